// Rays towards a sphere light, for soft shadows.
// Provides struct LightRay, lightRay(): a ray from a point P to a point of the light, in view space.
//
// The direction is uniformly distributed over the solid angle of the light as seen from P (Shirley, Wang and Zimmerman
// 1996, "Monte Carlo techniques for direct lighting calculations"): a cone, or all directions if P is inside. With the
// radius r and the distance d of the centre, the sine of half the cone's angle is r / d; c is its cosine. The light's
// radiance is I d^2 / (pi r^2), so an unoccluded surface that faces the light gets I. Inside, the radiance is I / pi,
// as on the sphere. A ray stands for this radiance times the solid angle 2 pi (1 - c), divided by pi as reflectances
// are. As a multiple of I that is the `weight` 2 (1 - c) d^2 / r^2, which equals 2 / (1 + c), or 4 inside. As the
// radius tends to 0, the weight tends to 1, and the ray to the one to the centre.
//
// 1 - c is computed without a subtraction, so it has all its bits however small the light looks. For r / d below 1e-15
// squares may underflow: rays then go to the centre, and end.n is shorter than 1. If P is on a sphere of the scene that
// is the light's own (light.on), the code uses this fact instead of computing the distance.

#include "geometry/ray.glsl"
#include "shading/light.glsl"

struct LightRay {
    real3 L;        // unit
    real distance;  // to the light's surface: its near side, or from inside its far side
    Contact end;    // the light's own sphere in the scene, if any: it must not block the light
    float weight;   // the light that the ray stands for, as a multiple of I
};

// `start` is the surface that P is on. `point` is uniformly distributed in [0, 1)^2, with 24 bits.
LightRay lightRay(Light light, real3 P, Contact start, vec2 point) {
    bool leaves = light.on == start.surface;
    real3 toCenter = light.position - P;
    real r = light.radius, d = leaves ? r : length(toCenter);
    bool around = !leaves && d <= r, inside = leaves || around;
    real3 W = leaves ? -start.n : d > 0.0 ? toCenter * (1.0 / d) : real3(0.0, 0.0, 1.0);

    real sine = inside ? real(1.0) : r / d, cosine = inside ? real(0.0) : sqrt((d - r) * (d + r)) / d;
    real opening = around ? real(2.0) : sine * sine / (1.0 + cosine);  // 1 - c
    real off = point.x * opening;         // 1 - the cosine of the angle between L and W
    real side = sqrt(off * (2.0 - off));  // its sine
    float angle = 6.283185307 * point.y;
    real2 turn = normalize(real2(cos(angle), sin(angle)));

    // Two axes across W (Duff et al. 2017, "Building an orthonormal basis, revisited").
    real s = W.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + W.z), b = W.x * W.y * a;
    real3 T = turn.x * real3(1.0 + s * W.x * W.x * a, s * b, -s * W.x) + turn.y * real3(b, s + W.y * W.y * a, -W.y);
    real3 L = (1.0 - off) * W + side * T;

    // The square of half the sphere's chord along L, r^2 - (d side)^2. For a cone, the form below does not cancel, so
    // the square is not negative.
    real square = around ? (r - d * side) * (r + d * side)
                         : d * d * opening * (1.0 - point.x) * (2.0 - opening * (1.0 + point.x));
    real ahead = sqrt(max(square, real(0.0))) * (inside ? 1.0 : -1.0);  // from the chord's middle
    real3 n = (ahead * L - d * side * (side * W - (1.0 - off) * T)) * (1.0 / r);
    return LightRay(L, d * (1.0 - off) + ahead, Contact(light.on, n), around ? 4.0 : float(2.0 / (1.0 + cosine)));
}
