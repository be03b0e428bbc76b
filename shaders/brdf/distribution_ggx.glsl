// The GGX distribution of facet normals (Trowbridge and Reitz 1975), and Smith's masking for it.
// Provides ggxD(), ggxSlope() (Walter 2007).
//
// ggxD() is D of the direction S = L + V, which need not be unit. Not (alpha^2 - 1) (N.H)^2 + 1, which is lost to
// rounding for alpha below 0.01: |N x H|^2 + (alpha N.H)^2 is the same, and never cancels (Lagrange).
// ggxSlope() is mu (1 + Lambda) for a direction with the cosine mu.

#include "brdf/extent.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

float ggxD(Material m, vec3 N, vec3 S) {
    vec3 x = cross(N, S);
    float c = m.alpha * dot(N, S);
    float k = m.alpha * dot(S, S) / max(dot(x, x) + c * c, 1e-30);
    return k * k / PI;
}

float ggxSlope(Material m, float mu) {
    return 0.5 * (mu + sqrt(mu * mu + m.alpha * m.alpha * (1.0 - mu) * (1.0 + mu)));
}
