// The GGX distribution of facet normals (Trowbridge and Reitz 1975), and Smith's masking for it.
// Provides ggxD(): the density D, in 1/sr, at the direction S = L + V, which need not be unit. Provides ggxSlope():
// mu (1 + Lambda) for a direction with the cosine mu to the normal, Lambda being Smith's auxiliary function (Walter et
// al. 2007). N is the unit normal.
// The denominator of D is |N x H|^2 + (alpha N.H)^2, which never cancels. The usual form (alpha^2 - 1) (N.H)^2 + 1 is
// equal to it (Lagrange's identity), but rounding destroys it for alpha below 0.01.

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
