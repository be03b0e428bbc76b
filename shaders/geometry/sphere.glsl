// The intersection of a ray with a sphere: both roots, their error bounds, and the normals there.
// Provides sphereSpan(), sphereEnds(), sphereNormal(), sphereTermsOf(). All vectors and lengths are in view space.
//
// `sphere` is (center, radius). `terms` are the two numbers that may cancel:
//     .x  along, dot(center - ro, rd): the distance along the ray of its point nearest to the centre;
//     .y  power, |center - ro|^2 - radius^2, the power of the ray's origin: the product of the two roots.
// For camera rays the host computes both in float64 (terms.glsl); sphereTermsOf() is for any ray.
//
// The roots are along -+ h. h is half the chord, and h^2 is the discriminant. With p, the line's distance from the
// centre (the length of its moment about the centre), h^2 = r^2 - p^2. This form squares neither the distance nor
// anything larger than the radius (Hearn and Baker 2004; Haines et al., Ray Tracing Gems 2019, ch. 7; but with the
// moment instead of the perpendicular, because the moment's products are small in a narrow field of view). If the
// middle of the chord is nearer than the radius, as beside a huge sphere, the form h^2 = along^2 - power has the
// smaller terms. The root with the smaller magnitude comes from the product of the roots, without cancellation (Press
// et al., Numerical Recipes, 5.6).
//
// Error bounds. u = 2^-24 (2^-53 for doubles) is half a unit in the last place of 1. |c x rd| stands for the sums of
// the absolute products that make up the moment of c = center - ro.
//     |dp| <= 8 u |c x rd| + 8 u p, including the rounding of the inputs (centre, radius, direction). That is some u p
//     for
//             a sphere in the middle of the view, some u |c| at the border: 1e-4 of a pixel or less, at any distance
//             and
//             field of view.
//     2 h |dh| <= 2 r (|dp| + 5 u r) by the first form of h^2: near a tangent the square root of p's bits decides the
//     depth;
//             <= 2 |along| |d along| + |d power| + 2 u (along^2 + |power|) by the second.
//     |dt| <= |d along| + |dh| + u |t| for the root with the larger magnitude, `outer`;
//             <= (|d power| + |t| |d outer|) / |outer| + 2 u |t| for the other root.
// For camera rays, |d along| and |d power| are 8 u and u, relative. For other rays they are 8 u |c| and 8 u |c|^2;
// beside a huge sphere terms.glsl makes |d power| smaller. raytracer/analysis/pixel_doubt.py evaluates these bounds for
// a pixel, and the tests check every pixel against them.
//
// A tangent ray, h = 0, misses.

#include "geometry/ray.glsl"

// `terms` of any ray, rounded as the sums that define them.
real2 sphereTermsOf(Ray ray, real4 sphere) {
    real3 toCenter = sphere.xyz - ray.ro;
    return real2(dot(toCenter, ray.rd), dot(toCenter, toCenter) - sphere.w * sphere.w);
}

// h^2, the square of half the chord; at most 0 for a miss.
real discriminant(Ray ray, real4 sphere, real2 terms) {
    if (abs(terms.x) < sphere.w) return terms.x * terms.x - terms.y;
    real3 moment = cross(sphere.xyz - ray.ro, ray.rd);
    return sphere.w * sphere.w - dot(moment, moment);
}

// The span (t0, t1): the two roots along the ray's whole line, also behind its origin, t0 < t1; (INF, -INF) for a miss.
real2 sphereSpan(Ray ray, real4 sphere, real2 terms) {
    real square = discriminant(ray, sphere, terms);
    if (square <= 0.0) return real2(INF, -INF);
    real along = terms.x;
    real outer = along + (along < 0.0 ? -sqrt(square) : sqrt(square));
    real inner = terms.y / outer;
    return real2(min(inner, outer), max(inner, outer));
}

// The span of a ray whose start or end may be known to lie on the sphere: the root there is exact, and the normal gives
// the other root. `surface` is the sphere's coincidence number, `span` the result of sphereSpan().
real2 sphereEnds(Ray ray, real radius, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    real slope = starts ? dot(ray.start.n, ray.rd) : dot(ray.end.n, ray.rd);
    real chord = starts && ends ? ray.distance : -2.0 * radius * slope;
    return (starts ? real(0.0) : ray.distance) + real2(min(chord, 0.0), max(chord, 0.0));
}

// The outward unit normal where the ray enters the ball (`enters`), or where it leaves it. It comes from the chord, not
// from the point, whose rounding is in proportion to its distance.
real3 sphereNormal(Ray ray, real4 sphere, real2 terms, bool enters) {
    real halfChord = sqrt(max(discriminant(ray, sphere, terms), 0.0));
    real3 perp = cross(ray.rd, cross(sphere.xyz - ray.ro, ray.rd));  // from the chord's middle to the centre
    return normalize((enters ? -halfChord : halfChord) * ray.rd - perp);
}
