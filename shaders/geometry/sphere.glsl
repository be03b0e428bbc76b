// The intersection of a ray with a sphere: both roots, their error bounds, and the normals there.
// Provides sphereSpan(), sphereEnds(), sphereNormal(), sphereTermsOf().
//
// A sphere is (center, radius). `terms` are the two numbers that may cancel:
//   .x  along, dot(center - ro, rd): how far along the ray its point nearest to the centre is;
//   .y  power, |center - ro|^2 - radius^2, of the ray's origin: the product of the two roots.
// The host knows both in float64 for camera rays (terms.glsl); sphereTermsOf() is for any ray.
//
// The roots are along -+ h, h half the chord, and h^2 is the discriminant. With p, the line's
// distance from the centre (the length of its moment about it), h^2 = r^2 - p^2. That squares
// neither the distance nor anything larger than the radius (Hearn and Baker 2004; Haines et al.,
// Ray Tracing Gems 2019, ch. 7; the moment instead of the perpendicular, because on a narrow
// field of view its products are small). Where the middle of the chord is nearer than the radius,
// as beside a huge sphere, h^2 = along^2 - power has the smaller terms to subtract. The root with the
// smaller magnitude comes from the product, without cancellation (Press et al., Numerical Recipes, 5.6).
//
// The error: with u = 2^-24 (2^-53 for doubles) half a unit in the last place of 1, and |c x rd|
// standing for the sums of the absolute products that make up the moment of c = center - ro,
//   |dp| <= 8 u |c x rd| + 8 u p, the rounding of what is given (centre, radius, direction) included:
//           for a sphere in the middle of the view that is some u p, at its border some u |c|,
//           1e-4 of a pixel or less, at any distance and field of view;
//   2 h |dh| <= 2 r (|dp| + 5 u r) by the first form of h^2, so near a tangent the depth is what the
//           square root makes of p's bits;
//           <= 2 |along| |d along| + |d power| + 2 u (along^2 + |power|) by the second;
//   |dt| <= |d along| + |dh| + u |t| of the root with the larger magnitude, `outer`;
//           <= (|d power| + |t| |d outer|) / |outer| + 2 u |t| of the other.
// |d along| and |d power| are 8 u and u of their own for camera rays; for others 8 u |c|, and 8 u |c|^2 or,
// beside a huge sphere, what terms.glsl leaves of that. raytracer/analysis/pixel_doubt.py evaluates these bounds for
// a pixel, and the tests hold every pixel to them.
//
// A tangent ray, h = 0, misses.

#include "geometry/ray.glsl"

real2 sphereTermsOf(Ray ray, real4 sphere) {
    real3 toCenter = sphere.xyz - ray.ro;
    return real2(dot(toCenter, ray.rd), dot(toCenter, toCenter) - sphere.w * sphere.w);
}

real discriminant(Ray ray, real4 sphere, real2 terms) {
    if (abs(terms.x) < sphere.w) return terms.x * terms.x - terms.y;
    real3 moment = cross(sphere.xyz - ray.ro, ray.rd);
    return sphere.w * sphere.w - dot(moment, moment);
}

// (t0, t1), the ray's two roots along its whole line, t0 < t1, also behind the origin; (INF, -INF)
// for a miss.
real2 sphereSpan(Ray ray, real4 sphere, real2 terms) {
    real square = discriminant(ray, sphere, terms);
    if (square <= 0.0) return real2(INF, -INF);
    real along = terms.x;
    real outer = along + (along < 0.0 ? -sqrt(square) : sqrt(square));
    real inner = terms.y / outer;
    return real2(min(inner, outer), max(inner, outer));
}

// That span for a ray an end of which may be known to lie on the sphere, which is numbered `surface`:
// there the root is exact, and the normal gives the other one.
real2 sphereEnds(Ray ray, real radius, int surface, real2 span) {
    bool starts = surface == ray.start.surface, ends = surface == ray.end.surface;
    if (ray.ofCamera || !(starts || ends)) return span;
    real slope = starts ? dot(ray.start.n, ray.rd) : dot(ray.end.n, ray.rd);
    real chord = starts && ends ? ray.distance : -2.0 * radius * slope;
    return (starts ? real(0.0) : ray.distance) + real2(min(chord, 0.0), max(chord, 0.0));
}

// The outward unit normal where the ray enters the ball, or where it comes out: made of the chord
// and not of the point, which is rounded in units of its distance.
real3 sphereNormal(Ray ray, real4 sphere, real2 terms, bool enters) {
    real halfChord = sqrt(max(discriminant(ray, sphere, terms), 0.0));
    real3 perp = cross(ray.rd, cross(sphere.xyz - ray.ro, ray.rd));  // from the chord's middle to the centre
    return normalize((enters ? -halfChord : halfChord) * ray.rd - perp);
}
