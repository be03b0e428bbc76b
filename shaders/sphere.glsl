// Provides sphereSpan(), sphereNormal(), sphereTermsOf(): where a ray is inside a ball, and the
// normals there.
//
// A sphere is (center, radius). `terms` are the two numbers that may cancel:
//   .x  along, dot(center - ro, rd): how far along the ray its point nearest to the centre is;
//   .y  power, |center - ro|^2 - radius^2, of the ray's origin: the product of the two roots.
// The host knows both in float64 for camera rays (terms.glsl); sphereTermsOf() is for any ray.
//
// The roots are along -+ h, h half the chord, and h^2 is the discriminant. With p, the line's
// distance from the centre (the length of its moment about it), h^2 = (r - p) (r + p). That squares
// neither the distance nor anything that it is subtracted from (Hearn and Baker 2004; Haines et al.,
// Ray Tracing Gems 2019, ch. 7; the moment instead of the perpendicular, because on a narrow
// field of view its products are small). Where the middle of the chord is nearer than the radius,
// as beside a huge sphere, h^2 = along^2 - power has the smaller terms to subtract. The root with the
// smaller magnitude comes from the product, without cancellation (Press et al., Numerical Recipes, 5.6).
//
// The error: with u = 2^-24 (2^-53 for doubles) half a unit in the last place of 1, and |c x rd|
// standing for the sums of the absolute products that make up the moment of c = center - ro,
//   |dp| <= 8 u |c x rd| + 8 u p, beside the rounding of what is given, included here:
//           centre, radius and direction; for a sphere in the middle of the view that is u p,
//           at its border u |c|: 1e-4 of a pixel or less, at any distance and field of view;
//   |dh| <= p |dp| / h + 4 u h, so near a tangent the depth is what the square root makes of p's bits;
//   |dt| <= |d along| + |dh| + u |t|.
// raytracer/resolution.py evaluates these bounds for a pixel, and the tests hold every pixel to them.
//
// A tangent ray, h = 0, misses.

#include "ray.glsl"

real2 sphereTermsOf(Ray ray, real4 sphere) {
    real3 toCenter = sphere.xyz - ray.ro;
    return real2(dot(toCenter, ray.rd), dot(toCenter, toCenter) - sphere.w * sphere.w);
}

real discriminant(Ray ray, real4 sphere, real2 terms) {
    if (abs(terms.x) < sphere.w) return terms.x * terms.x - terms.y;
    real p = length(cross(sphere.xyz - ray.ro, ray.rd));
    return (sphere.w - p) * (sphere.w + p);
}

// (t0, t1), the ray's two roots along its whole line, t0 < t1, also behind the origin; (INF, -INF)
// for a miss.
real2 sphereSpan(Ray ray, real4 sphere, real2 terms) {
    if (leavesSphere(ray, sphere)) {
        real chord = -2.0 * sphere.w * dot(ray.n, ray.rd);
        return real2(min(chord, 0.0), max(chord, 0.0));
    }
    real square = discriminant(ray, sphere, terms);
    if (square <= 0.0) return real2(INF, -INF);
    real along = terms.x;
    real outer = along + (along < 0.0 ? -sqrt(square) : sqrt(square));
    real inner = terms.y / outer;
    return real2(min(inner, outer), max(inner, outer));
}

// The outward unit normal where the ray enters the ball, or where it comes out: made of the chord
// and not of the point, which is rounded in units of its distance.
real3 sphereNormal(Ray ray, real4 sphere, real2 terms, bool enters) {
    real halfChord = sqrt(max(discriminant(ray, sphere, terms), 0.0));
    real3 perp = cross(ray.rd, cross(sphere.xyz - ray.ro, ray.rd));  // from the chord's middle to the centre
    return normalize((enters ? -halfChord : halfChord) * ray.rd - perp);
}
