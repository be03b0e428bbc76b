// The GGX microfacet model: mirror facets in the distribution of Trowbridge and Reitz (1975).
// Provides ggx(): f = F D G / (4 N.L N.V), with Smith's masking (Walter 2007). Needs fresnel(), masking().

#include "brdf/distribution_ggx.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 ggx(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    vec3 S = L + V;
    float facets = ggxD(m, N, S) * masking(m, ggxSlope(m, NoL), ggxSlope(m, NoV), NoL, NoV);
    return fresnel(m, 0.5 * length(S)) * (0.25 * facets * NoL);  // V.H of unit vectors is |L + V| / 2
}
