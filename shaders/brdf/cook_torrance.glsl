// Cook and Torrance's microfacet model (1982), with V-shaped cavities.
// Provides cook_torrance(): f = rho / pi + ks constant F D G / (N.L N.V), with Beckmann's D, where the integral of
// D cos is 1. Needs fresnel().
//
// The constant is 1/4 (Walter 2007). Cook and Torrance print 1/pi before a D without its 1/pi: that is 1 here, four
// times what facets can reflect. Others have 1/pi.

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
