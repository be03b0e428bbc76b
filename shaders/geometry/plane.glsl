// The intersection of a ray with a half-space dot(normal, x) <= offset, and its error bound.
// Provides planeSpan(), planeEnds(), planeCrossing(). All vectors and lengths are in view space.
//
// `plane` is (normal, offset), with a unit normal. `slope` is dot(normal, ray.rd); the caller may know it to more bits
// than that sum gives (terms.glsl). A span (t0, t1) is the part of the ray's whole line within the half-space, with
// -INF or INF for an unbounded end, and (INF, -INF) if the line is outside altogether. A line in the plane itself
// counts as inside: it crosses nothing, as a line tangent to a sphere.
//
// The relative error of t = depth / slope is 3 u from these two lines, plus the error of the slope, plus the
// depth's error: u for camera rays, and u (|offset| + |ro|) / |depth| for others. u is 2^-24, or 2^-53 for doubles.

#include "geometry/ray.glsl"

real2 planeSpan(Ray ray, real4 plane, real slope) {
    real depth = plane.w - dot(plane.xyz, ray.ro);  // the depth of ro in the half-space
    if (slope == 0.0) return depth >= 0.0 ? real2(-INF, INF) : real2(INF, -INF);
    real t = clamp(depth / slope, -INF, INF);
    return slope > 0.0 ? real2(-INF, t) : real2(t, INF);
}

// The span of a ray whose start or end may be known to lie on the plane: the root there is exact. `surface` is the
// plane's coincidence number, `span` the result of planeSpan().
real2 planeEnds(Ray ray, real slope, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    if (slope == 0.0) return real2(-INF, INF);
    real t = ends ? ray.distance : real(0.0);
    return slope > 0.0 ? real2(-INF, t) : real2(t, INF);
}

// The root of a ray in a scene region with half-spaces only; INF if the ray does not cross the plane. The ray's start
// or end may be known to lie on the plane, as for planeEnds().
real planeCrossing(Ray ray, real4 plane, real slope, int surface) {
    if (!ray.ofCamera && surface == ray.start.surface) return INF;
    if (!ray.ofCamera && surface == ray.end.surface) return ray.distance;
    return slope == 0.0 ? INF : (plane.w - dot(plane.xyz, ray.ro)) / slope;
}
