// Correlated masking and shadowing of facets: low facets are hidden from both sides.
// Provides correlatedMasking(): G / (N.L N.V), G the share of facets that both the light and the viewer see
// (Smith 1967; Heitz 2014, equation 99): G = 1 / (1 + Lambda(L) + Lambda(V)).
// l and v are slope() of N.L and N.V, which is N.L (1 + Lambda(L)): so nothing is divided by a cosine.

#include "materials.glsl"

float correlatedMasking(Material m, float l, float v, float NoL, float NoV) {
    // l NoV + v NoL - NoL NoV; of the bracket nothing is left to cancel but what is small beside the rest.
    return 1.0 / (l * NoV + (v - NoV) * NoL);
}
