// What each pixel's ray sees: distance, normal towards the viewer, and surface.

#include "camera.glsl"
#include "scene.glsl"

layout(location = 0) out vec4 normalDepth;  // unit normal, 0 for nothing; t, INF for nothing
layout(location = 1) out int surface;       // as in hit.glsl, 0 for nothing

void main() {
    Ray ray = cameraRay();
    real3 P, N;
    real t = rayCSG(ray, P, N, surface);
    normalDepth = vec4(dot(N, ray.rd) > 0.0 ? -N : N, t);
}
