// Smith's masking for Beckmann's distribution, by a rational fit that is 0.35 % off.
// Provides rationalSmith(): mu / G1 for a direction with the cosine mu to the normal. G1, the share of facets visible
// from there, is the fit of Walter et al. (2007), which pbrt-v3 and Mitsuba use.

#include "materials.glsl"

float rationalSmith(Material m, float mu) {
    float width = m.alpha * sqrt(max((1.0 - mu) * (1.0 + mu), 0.0));
    float a = mu / max(width, 1e-20);
    return a < 1.6 ? width * (1.0 + a * (2.276 + a * 2.577)) / (3.535 + a * 2.181) : mu;
}
