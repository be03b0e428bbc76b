// Provides planeSpan(): where a ray is inside a solid half-space dot(normal, x) <= offset.
//
// normal is unit; slope is dot(normal, ray.rd), which the caller may know to more bits than that sum
// gives (camera.glsl). Returns (t0, t1) along the ray's whole line, with -INF or INF for an end
// that does not end; (INF, -INF) if the line is outside altogether.

#include "ray.glsl"

vec2 planeSpan(Ray ray, vec3 normal, float offset, float slope) {
    // How deep ro is inside. Exactly 0 on the plane itself.
    float depth = leavesPlane(ray, vec4(normal, offset)) ? 0.0 : offset - dot(normal, ray.ro);
    if (slope == 0.0) return depth >= 0.0 ? vec2(-INF, INF) : vec2(INF, -INF);
    float t = clamp(depth / slope, -INF, INF);
    return slope > 0.0 ? vec2(-INF, t) : vec2(t, INF);
}
