// Smith's masking for Beckmann's distribution, exactly.
// Provides exactSmith(): mu (1 + Lambda) for a direction with the cosine mu to the normal, Lambda being Smith's
// auxiliary function (Smith 1967). With a = 1 / (alpha tan(theta)), where cos(theta) = mu, it is
// mu (1 + erf a) / 2 + alpha sin(theta) exp(-a^2) / (2 sqrt(pi)), a sum in which nothing cancels.

#include "brdf/erfc.glsl"
#include "materials.glsl"

float exactSmith(Material m, float mu) {
    float width = m.alpha * sqrt(max((1.0 - mu) * (1.0 + mu), 0.0));
    float a = min(mu / max(width, 1e-20), 10.0);  // erf(10) is 1 in float32
    return mu * (1.0 - 0.5 * erfc(a)) + 0.28209479 * width * exp(-a * a);
}
