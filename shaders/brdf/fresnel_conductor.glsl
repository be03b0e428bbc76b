// The Fresnel reflectance of a smooth metal of complex index n + i k, per channel.
// Provides conductorFresnel(), a share in [0, 1] of unpolarised light: Fresnel's equations with a complex index (Born
// and Wolf, Principles of Optics, 7th edition, section 14.2). VoH is the cosine of the angle between the direction and
// the facet's normal, clamped to [0, 1].
//
// Let a + i b be the square root of (n + i k)^2 - sin^2. Only one of a and b does not cancel: it is computed first, and
// the other one follows from a b = n k. Metals have k > n, for which the usual formula for a loses most of its bits.

#include "materials.glsl"

vec3 conductorFresnel(Material m, float VoH) {
    float c = clamp(VoH, 0.0, 1.0), s2 = (1.0 - c) * (1.0 + c);
    vec3 n = m.n, k = m.extinction;
    vec3 part = (n - k) * (n + k) - s2, product = n * k;
    // The larger of |a| and |b|. The lower bound stands for 0, which only a vacuum seen straight from above (sine 0)
    // has.
    vec3 large = sqrt(max(0.5 * (sqrt(part * part + 4.0 * product * product) + abs(part)), 1e-30));
    vec3 small = product / large;
    vec3 a = mix(small, large, greaterThanEqual(part, vec3(0.0))), b = mix(large, small, greaterThanEqual(part, vec3(0.0)));
    vec3 b2 = b * b;
    vec3 s = ((a - c) * (a - c) + b2) / ((a + c) * (a + c) + b2);
    vec3 less = a * c - s2, more = a * c + s2;
    vec3 p = s * (less * less + b2 * c * c) / max(more * more + b2 * c * c, 1e-30);
    return 0.5 * (s + p);
}
