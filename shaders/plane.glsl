// Provides planeSpan(): where a ray is inside a solid half-space dot(normal, x) <= offset.
//
// A plane is (normal, offset), the normal unit; slope is dot(normal, ray.rd), which the caller may
// know to more bits than that sum gives (terms.glsl). Returns (t0, t1) along the ray's whole line,
// with -INF or INF for an end that does not end; (INF, -INF) if the line is outside altogether.
// A line in the plane itself is inside: it crosses nothing, as a line tangent to a sphere.
//
// The error of t = depth / slope, relative: 3 u from these two lines, the error of the slope, and
// that of the depth, which is u for camera rays and u (|offset| + |ro|) / |depth| for others.

#include "ray.glsl"

real2 planeSpan(Ray ray, real4 plane, real slope) {
    // How deep ro is inside. Exactly 0 on the plane itself.
    real depth = isPlane(ray.start, plane) ? real(0.0) : plane.w - dot(plane.xyz, ray.ro);
    if (slope == 0.0) return depth >= 0.0 ? real2(-INF, INF) : real2(INF, -INF);
    real t = isPlane(ray.end, plane) ? ray.distance : clamp(depth / slope, -INF, INF);
    return slope > 0.0 ? real2(-INF, t) : real2(t, INF);
}
