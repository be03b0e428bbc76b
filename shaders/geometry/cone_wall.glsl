// The intersection of a ray with a cone wall, that of a cone, a frustum or a paraboloid.
// Provides coneSpan(), coneEnds(), coneNormal(). All vectors and lengths are in view space.
//
// The wall bounds the points with |(l1, l2, l3)| <= l0. `p` and `d` are the forms of wall.glsl along the ray. `power`
// is wallPower(p); for camera rays the host computes it in float64. w0 to w3 are the gradients of the forms. The set
// is convex: the second nappe of the cone, with l0 < 0, does not belong to it.
//
// With the product <x, y> = x0 y0 - x1 y1 - x2 y2 - x3 y3, e = d / |d| and s = t |d|, the power along the ray is
//     <p + s e, p + s e> = A s^2 + 2 b s + power,  A = <e, e>,  b = <p, e>,
// and b^2 - A power = |E|^2 - |B|^2 with E = p0 (e1, e2, e3) - e0 (p1, p2, p3) and B = (p1, p2, p3) x (e1, e2, e3).
// This is the r^2 - moment^2 of sphere.glsl. As there, b^2 - A power is better if b^2 < |E|^2.
//
// Along a generator of the cone A is nearly 0, and the error u of A moves a root by u s^2. If the origin of s is far
// from the apex and the root is not, then s is large. So there is a second pair of roots, whose origin m is the point
// of the ray nearest to the apex in the space of the forms. The moments E and B give m without cancellation. A root is
// taken from there if it is nearer to m than half the distance of the ray's origin from m.
//
// Error bounds. u is 2^-24 (2^-53 for doubles); |de| is as in round_wall.glsl, for all four forms, and r is the square
// root of |E|^2 - |B|^2. The errors of A, b, E, B and the power follow from |dp|, |de| and 5 u of each product.
//     2 r |dr| <= 2 |E| |dE| + 2 |B| |dB| + 5 u (|E|^2 + |B|^2), or by the second form
//     |ds| <= (|d power| + 2 |s| |db| + s^2 |dA|) / (2 r) to first order, about the origin
//          <= (2 |l| (|dE| + |dB|) + 8 u |l|^2) / (2 r) to first order, about m, with l the forms at the root
//     |dt| <= |ds| / |d| + |t| (|dd| / |d| + 4 u)
// raytracer/analysis/rounding_bounds.py evaluates these bounds, and the tests check the roots against them.
//
// A tangent ray, r = 0, misses.

#include "geometry/wall.glsl"

// A ray in the space of the forms.
struct ConeRay {
    real speed;
    real4 e;      // unit direction
    real4 m;      // the point nearest to the apex
    real along;   // its place on the ray, in units of the forms
    real A;       // <e, e>
    real square;  // r^2
};

ConeRay coneRay(real4 p, real4 d, real power) {
    real speed = wallSpeed(d);
    real4 e = d / speed;
    real3 E = p.x * e.yzw - e.x * p.yzw, B = cross(p.yzw, e.yzw);
    real A = e.x * e.x - dot(e.yzw, e.yzw), b = p.x * e.x - dot(p.yzw, e.yzw);
    real square = b * b < dot(E, E) ? b * b - A * power : dot(E, E) - dot(B, B);
    return ConeRay(speed, e, real4(dot(E, e.yzw), cross(e.yzw, B) - e.x * E), -dot(p, e), A, square);
}

// The roots of A s^2 + 2 b s + c where it grows (.x) and where it falls (.y), r^2 = b^2 - A c; +-FAR for A = 0. FAR is
// beyond INF even after the division by |d|, which is at most 2.
const real FAR = 1e6 * INF;

real2 coneRoots(real A, real b, real c, real r) {
    real q = b < 0.0 ? r - b : -r - b;
    real inner = q == 0.0 ? real(0.0) : c / q;
    real outer = A == 0.0 ? (q < 0.0 ? -FAR : FAR) : clamp(q / A, -FAR, FAR);
    return b < 0.0 ? real2(outer, inner) : real2(inner, outer);
}

// The same roots about m.
real2 nearRoots(ConeRay ray) {
    // <m, e> is 2 m0 e0, because m and e are perpendicular.
    return coneRoots(ray.A, 2.0 * ray.m.x * ray.e.x, wallPower(ray.m), sqrt(max(ray.square, 0.0)));
}

// The span (t0, t1) of the ray's whole line, -INF or INF for an unbounded end; t0 >= t1 for a miss.
real2 coneSpan(real4 p, real4 d, real power) {
    const real2 NONE = real2(INF, -INF);
    if (d == real4(0.0)) return power > 0.0 && p.x > 0.0 ? real2(-INF, INF) : NONE;
    ConeRay ray = coneRay(p, d, power);
    // Where A < 0, both roots are on one nappe, and l0 has the sign of m0 in the middle between them.
    if (ray.A < 0.0 && (ray.square <= 0.0 || ray.m.x <= 0.0)) return NONE;
    real b = p.x * ray.e.x - dot(p.yzw, ray.e.yzw);
    real2 s = coneRoots(ray.A, b, power, sqrt(max(ray.square, 0.0)));
    real2 near = nearRoots(ray);
    // From a point on the wall, one root is exactly 0.
    real nearer = power == 0.0 ? real(0.0) : 0.5 * abs(ray.along);
    if (abs(near.x) < nearer) s.x = near.x + ray.along;
    if (abs(near.y) < nearer) s.y = near.y + ray.along;
    s = clamp(s / ray.speed, -INF, INF);
    if (ray.A < 0.0) return s;
    // Along the axis or so: the ray stays inside from one root on.
    if (ray.square <= 0.0 && ray.A == 0.0) return NONE;
    return d.x > 0.0 ? real2(s.x, INF) : real2(-INF, s.y);
}

// The span of a ray whose start or end may be known to lie on the wall: the root there is exact, and the normal gives
// the other root without cancellation. `surface` is the wall's coincidence number, `span` the result of coneSpan().
real2 coneEnds(Ray ray, real4 p, real4 d, real3 w0, real3 w1, real3 w2, real3 w3, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    if (starts && ends) return real2(0.0, ray.distance);
    real slope = starts ? dot(ray.start.n, ray.rd) : dot(ray.end.n, ray.rd);
    real known = starts ? real(0.0) : ray.distance;
    real a = wallPower(d);
    // Where a >= 0, the ray stays inside from one root on, in the direction in which l0 grows.
    real chord = slope < 0.0 && d.x > 0.0 ? INF : slope > 0.0 && d.x < 0.0 ? -INF : real(0.0);
    if (a < 0.0) chord = clamp(2.0 * length(wallGradient(p + known * d, w0, w1, w2, w3)) * slope / a, -INF, INF);
    return known + real2(min(chord, 0.0), max(chord, 0.0));
}

// The outward unit normal where the ray enters the wall (`enters`), or where it leaves it. It comes from m, not from
// the point, whose rounding is in proportion to its distance.
real3 coneNormal(real4 p, real4 d, real power, real3 w0, real3 w1, real3 w2, real3 w3, bool enters) {
    ConeRay ray = coneRay(p, d, power);
    real2 s = nearRoots(ray);
    return normalize(wallGradient(ray.m + (enters ? s.x : s.y) * ray.e, w0, w1, w2, w3));
}
