// Cook and Torrance's microfacet model (1982), with V-shaped cavities.
// Provides cook_torrance(): f cos(theta_i), per colour channel, with f = rho / pi + ks constant F D G / (N.L N.V). D is
// Beckmann's distribution of facet normals, whose integral over D cos is 1.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. F is taken at the angle between V and the halfway vector.
// Needs the generated fresnel(), which calls the Fresnel form that the material chooses.
//
// The constant is 1/4 (Walter et al. 2007). Cook and Torrance print 1/pi before a D that lacks its own 1/pi; for the D
// used here, that is a constant of 1, four times what facets can reflect. Other authors use 1/pi.

#include "brdf/gaussian_slopes.glsl"
#include "brdf/numbers.glsl"
#include "brdf/v_cavity.glsl"
#include "materials.glsl"

vec3 cook_torrance(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    vec3 S = L + V;
    float facets = m.constant * gaussianSlopes(m.m, N, S) * vCavity(N, S, NoL, NoV);
    return m.rho * (NoL / PI) + m.ks * fresnel(m, 0.5 * length(S)) * facets;
}
