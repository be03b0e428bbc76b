// The full form of Oren and Nayar's model, with one bounce of light between facets.
// Provides fullForm(): pi f cos(theta_i) / rho, which is
// C1 + cos(phi) C2 tan(beta) + (1 - |cos(phi)|) C3 tan((alpha + beta) / 2), and the second bounce, with rho; alpha is
// the larger and beta the smaller of the two angles. sigma comes in degrees, the formula has radians.
//
// Tangents are made of sines and cosines, and N.L is in them before anything is divided, because they are infinite
// where both directions graze. With s = sin(alpha) sin(beta) cos(phi), from the parts in the surface:
// tan((alpha + beta) / 2) = (sin(alpha) + sin(beta)) / (N.L + N.V), and where cos(phi) < 0,
// cos(phi) tan(beta) (sin(alpha) - (2 beta / pi)^3) = s / cos(beta) (1 - (2 beta / pi)^3 / sin(alpha)), whose
// difference, near the horizon one of two numbers near 1, is made of their distances from 1.

#include "brdf/angle.glsl"
#include "materials.glsl"

vec3 fullForm(Material m, vec3 N, vec3 L, vec3 V) {
    const float TWO_OVER_PI = 0.63661977;
    const float TINY = 1e-30; // sin(alpha) is 0 only if beta is, and then what is divided by it
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
