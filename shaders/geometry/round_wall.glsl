// The intersection of a ray with a round wall, that of an ellipsoid or a cylinder.
// Provides roundSpan(), roundEnds(), roundNormal(). All vectors and lengths are in view space.
//
// The wall bounds the points with |(l1, l2, l3)| <= l0 for a constant l0. `p` and `d` are the forms of wall.glsl along
// the ray, so d.x is 0. `power` is wallPower(p); for camera rays the host computes it in float64. w1 to w3 are the
// gradients of l1 to l3. A cylinder has l3 = 0.
//
// In the space of (l1, l2, l3) the wall is a sphere around the origin with the radius l0. So the roots are those of
// sphere.glsl for the unit direction e = (d1, d2, d3) / |d|, divided by |d|, in the same two forms of h^2, the square
// of half the chord.
//
// Error bounds. u is 2^-24 (2^-53 for doubles). dp and dd are the errors of p and d:
//     |dp| <= u |p| and |dd| <= 8 u |d| for camera rays, by component, and (W + H) 2^-46 more for dd;
//     |dp| <= u (4 |w| |ro| + 2 |c|) and |dd| <= 4 u |w| |rd| for others, by component, with absolute sums.
// |p x e| stands for the moment with the absolute products, and s for the root t |d|.
//     |de| <= |dd| / |d| + 4 u |e|, by component
//     |dB| <= |p| |de| + |dp| |e| + 3 u |p x e|, the error of the moment B = p x e
//     2 h |dh| <= 2 |B| |dB| + 8 u l0^2, or 2 |along| |d along| + |d power| + 2 u (along^2 + |power|);
//     |ds| as |dt| in sphere.glsl, and |dt| <= |ds| / |d| + |t| (|dd| / |d| + 4 u).
// raytracer/analysis/rounding_bounds.py evaluates these bounds, and the tests check the roots against them.
//
// A tangent ray, h = 0, misses. A ray along a cylinder's axis, d = 0, is inside for ever, or never.

#include "geometry/wall.glsl"

// h^2 for the unit direction e.
real roundSquare(real4 p, real3 e, real along, real power) {
    if (abs(along) < p.x) return along * along + power;
    real3 moment = cross(p.yzw, e);
    return p.x * p.x - dot(moment, moment);
}

// The span (t0, t1) of the ray's whole line, t0 < t1; (INF, -INF) for a miss.
real2 roundSpan(real4 p, real4 d, real power) {
    real speed = wallSpeed(d);
    if (speed == 0.0) return power > 0.0 ? real2(-INF, INF) : real2(INF, -INF);
    real3 e = d.yzw / speed;
    real along = -dot(p.yzw, e);
    real square = roundSquare(p, e, along, power);
    if (square <= 0.0) return real2(INF, -INF);
    real outer = along + (along < 0.0 ? -sqrt(square) : sqrt(square));
    real inner = -power / outer;
    return clamp(real2(min(inner, outer), max(inner, outer)) / speed, -INF, INF);
}

// The span of a ray whose start or end may be known to lie on the wall: the root there is exact, and the normal gives
// the other root without cancellation. `surface` is the wall's coincidence number, `span` the result of roundSpan().
real2 roundEnds(Ray ray, real4 p, real4 d, real3 w1, real3 w2, real3 w3, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    real slope = starts ? dot(ray.start.n, ray.rd) : dot(ray.end.n, ray.rd);
    real3 l = starts ? p.yzw : p.yzw + ray.distance * d.yzw;
    // The known point is on the wall, where |l| = l0; so only the direction of l counts.
    real gradient = length(wallGradient(real4(0.0, l), real3(0.0), w1, w2, w3)) * p.x / length(l);
    real square = dot(d.yzw, d.yzw);
    // Along a cylinder, only the sign of the slope counts.
    real far = slope == 0.0 ? real(0.0) : slope > 0.0 ? -INF : INF;
    if (square > 0.0) far = clamp(-2.0 * gradient * slope / square, -INF, INF);
    real chord = starts && ends ? ray.distance : far;
    return (starts ? real(0.0) : ray.distance) + real2(min(chord, 0.0), max(chord, 0.0));
}

// The outward unit normal where the ray enters the wall (`enters`), or where it leaves it. It comes from the chord, as
// that of a sphere.
real3 roundNormal(real4 p, real4 d, real power, real3 w1, real3 w2, real3 w3, bool enters) {
    real3 e = d.yzw / wallSpeed(d);
    real halfChord = sqrt(max(roundSquare(p, e, -dot(p.yzw, e), power), 0.0));
    real3 middle = cross(e, cross(p.yzw, e));  // of the chord
    real3 l = middle + (enters ? -halfChord : halfChord) * e;
    return normalize(wallGradient(real4(0.0, l), real3(0.0), w1, w2, w3));
}
