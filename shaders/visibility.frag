// What each pixel's ray sees: distance, normal towards the viewer, and surface.

#define CAMERA_RAYS
#include "camera.glsl"
#include "scene.glsl"

layout(location = 0) out vec4 normalDepth;  // unit normal, 0 for nothing; t, INF for nothing
layout(location = 1) out int surface;       // index, -1 for nothing

void main() {
    Ray ray = cameraRay();
    vec3 P, N;
    float t = rayCSG(ray, INF, P, N, surface);
    normalDepth = vec4(dot(N, ray.rd) > 0.0 ? -N : N, t);
}
