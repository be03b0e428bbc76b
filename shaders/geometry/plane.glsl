// The intersection of a ray with a half-space dot(normal, x) <= offset, and its error bound.
// Provides planeSpan(), planeEnds(), planeCrossing().
//
// A plane is (normal, offset), the normal unit; slope is dot(normal, ray.rd), which the caller may
// know to more bits than that sum gives (terms.glsl). Returns (t0, t1) along the ray's whole line,
// with -INF or INF for an end that does not end; (INF, -INF) if the line is outside altogether.
// A line in the plane itself is inside: it crosses nothing, as a line tangent to a sphere.
//
// The error of t = depth / slope, relative: 3 u from these two lines, the error of the slope, and
// that of the depth, which is u for camera rays and u (|offset| + |ro|) / |depth| for others.

#include "geometry/ray.glsl"

real2 planeSpan(Ray ray, real4 plane, real slope) {
    real depth = plane.w - dot(plane.xyz, ray.ro);  // how deep ro is inside
    if (slope == 0.0) return depth >= 0.0 ? real2(-INF, INF) : real2(INF, -INF);
    real t = clamp(depth / slope, -INF, INF);
    return slope > 0.0 ? real2(-INF, t) : real2(t, INF);
}

// That span for a ray an end of which may be known to lie on the plane, which is numbered `surface`:
// there the root is exact.
real2 planeEnds(Ray ray, real slope, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    if (slope == 0.0) return real2(-INF, INF);
    real t = ends ? ray.distance : real(0.0);
    return slope > 0.0 ? real2(-INF, t) : real2(t, INF);
}

// The root of a ray that meets nothing but half-spaces; INF if the ray does not cross the plane. An end of the ray may
// be known to lie on the plane, as for planeEnds().
real planeCrossing(Ray ray, real4 plane, real slope, int surface) {
    if (!ray.ofCamera && surface == ray.start.surface) return INF;
    if (!ray.ofCamera && surface == ray.end.surface) return ray.distance;
    return slope == 0.0 ? INF : (plane.w - dot(plane.xyz, ray.ro)) / slope;
}
