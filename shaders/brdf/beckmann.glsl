// The Beckmann microfacet model: mirror facets in Beckmann's distribution (1963).
// Provides beckmann(): f cos(theta_i), per colour channel, with f = F D G / (4 N.L N.V): D is the distribution of facet
// normals, G Smith's masking (Walter et al. 2007), and F the Fresnel reflectance at the angle between V and H.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. H is halfway between L and V.
// Needs the generated fresnel() and masking(), which call the forms that the material chooses.

#include "brdf/distribution_beckmann.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 beckmann(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    vec3 S = L + V;
    float facets = beckmannD(m, N, S) * masking(m, beckmannSlope(m, NoL), beckmannSlope(m, NoV), NoL, NoV);
    return fresnel(m, 0.5 * length(S)) * (0.25 * facets * NoL);  // V.H of unit vectors is |L + V| / 2
}
