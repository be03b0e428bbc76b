// Which surface each pixel sees; if the host defines GEOMETRY, its distance and normal too.

#include "scene.glsl"

layout(location = 0) out int surface;       // as in hit.glsl, 0 for nothing
#ifdef GEOMETRY
layout(location = 1) out vec4 normalDepth;  // unit normal towards the viewer, 0 for nothing; t, INF for nothing
#endif

void main() {
    Ray ray = cameraRay();
    real3 P, N;
    real t = rayCSG(ray, P, N, surface);
#ifdef GEOMETRY
    normalDepth = vec4(dot(N, ray.rd) > 0.0 ? -N : N, t);
#endif
}
