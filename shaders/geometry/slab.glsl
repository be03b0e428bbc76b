// The intersection of a ray with a slab: the points between two parallel planes, or on one side of a plane.
// Provides slabSpan(). All vectors and lengths are in view space.
//
// The high side is the half-space with the outward unit normal n, and the low side is the half-space with -n. `high`
// and `low` are the depths of the ray's origin in the two, INF for a side without a face. `slope` is dot(n, ray.rd).
// `surfaces` are the coincidence numbers of the high and the low face, 0 for none.
//
// Each side has at most one root, and the sign of the slope tells which one is the entry. So the span needs no minimum
// of the two roots, and each root has the bits of planeSpan() and planeEnds() for the same depth: a slab and a plane
// at the same place have equal roots. The error bound is that of plane.glsl.

#include "geometry/ray.glsl"

// Whether the ray's start or end is known to lie on a face.
bool isKnownFace(Ray ray, int surface) {
    return !ray.ofCamera && surface != 0 && (surface == ray.start.surface || surface == ray.end.surface);
}

// The root with one face, whose outward normal has `slope`, not 0.
real faceRoot(Ray ray, real depth, real slope, int surface) {
    if (isKnownFace(ray, surface)) return surface == ray.end.surface ? ray.distance : real(0.0);
    if (depth >= INF) return slope > 0.0 ? INF : -INF;
    return clamp(depth / slope, -INF, INF);
}

// The span (t0, t1), as that of planeSpan(); t0 >= t1 if the line is outside.
real2 slabSpan(Ray ray, real high, real low, real slope, ivec2 surfaces) {
    if (slope == 0.0) {
        bool below = high >= 0.0 || isKnownFace(ray, surfaces.x), above = low >= 0.0 || isKnownFace(ray, surfaces.y);
        return below && above ? real2(-INF, INF) : real2(INF, -INF);
    }
    real top = faceRoot(ray, high, slope, surfaces.x), bottom = faceRoot(ray, low, -slope, surfaces.y);
    return slope > 0.0 ? real2(bottom, top) : real2(top, bottom);
}
