// The full form of Oren and Nayar's model, with one bounce of light between facets.
// Provides fullForm(): pi f cos(theta_i) / rho, per colour channel (Oren and Nayar 1994). It is N.L times the sum of
// direct light, C1 + cos(phi) C2 tan(beta) + (1 - |cos(phi)|) C3 tan((alpha + beta) / 2), and a second bounce in
// proportion to rho. alpha is the larger and beta the smaller of the two angles to the normal, phi the azimuth between
// L and V.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// The material has sigma, the standard deviation of the facets' slope angle, in degrees; the formula takes radians.
//
// The tangents are infinite if both directions graze. So they are computed from sines and cosines, and multiplied by
// N.L before any division. With s = sin(alpha) sin(beta) cos(phi), from the parts of L and V in the tangent plane:
//     tan((alpha + beta) / 2) = (sin(alpha) + sin(beta)) / (N.L + N.V)
//     cos(phi) tan(beta) (sin(alpha) - (2 beta / pi)^3) = s / cos(beta) (1 - (2 beta / pi)^3 / sin(alpha))
// The second equation is for cos(phi) < 0. Near the horizon its last bracket is a difference of two numbers near 1; the
// code computes it from their distances to 1.

#include "brdf/angle.glsl"
#include "materials.glsl"

vec3 fullForm(Material m, vec3 N, vec3 L, vec3 V) {
    const float TWO_OVER_PI = 0.63661977;
    const float TINY = 1e-30; // a divisor above 0: sin(alpha) is 0 only if beta is 0, and then the numerator is 0
    float NoL = dot(N, L), NoV = max(dot(N, V), 0.0), sigma = radians(m.sigma), s2 = sigma * sigma;
    float sinL = length(cross(N, L)), sinV = length(cross(N, V));
    float s = dot(L - NoL * N, V - NoV * N), cosPhi = clamp(s / max(sinL * sinV, TINY), -1.0, 1.0);

    float sinAlpha = max(sinL, sinV), cosAlpha = min(NoL, NoV), cosBeta = max(NoL, NoV);
    float a = TWO_OVER_PI * angle(sinAlpha, cosAlpha), b = TWO_OVER_PI * angle(min(sinL, sinV), cosBeta);
    float below = TWO_OVER_PI * angle(cosBeta, min(sinL, sinV)); // 1 - b
    float minus = below * (1.0 + b + b * b) - cosAlpha * cosAlpha / (1.0 + sinAlpha); // sin(alpha) - b^3

    float C1 = 1.0 - 0.5 * s2 / (s2 + 0.33), C2 = 0.45 * s2 / (s2 + 0.09), C3 = 0.125 * s2 / (s2 + 0.09) * a * a * b * b;
    float direct = NoL * C1
        + C2 * s * (NoL / cosBeta) * (s < 0.0 ? minus / max(sinAlpha, TINY) : 1.0)
        + C3 * (1.0 - abs(cosPhi)) * (sinL + sinV) * (NoL / (NoL + NoV));
    float second = NoL * 0.17 * s2 / (s2 + 0.13) * (1.0 - cosPhi * b * b);
    return max(direct + second * m.rho, 0.0);
}
