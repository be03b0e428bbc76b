// Correlated masking and shadowing of facets: low facets are hidden from both sides.
// Provides correlatedMasking(): G / (N.L N.V), where G = 1 / (1 + Lambda(L) + Lambda(V)) is the share of facets that
// both the light and the viewer see (Heitz 2014, equation 99). Lambda is Smith's auxiliary function (1967).
// NoL and NoV are N.L and N.V. l is N.L (1 + Lambda(L)) and v is N.V (1 + Lambda(V)), the results of slope(): so
// nothing is divided by a small cosine.

#include "materials.glsl"

float correlatedMasking(Material m, float l, float v, float NoL, float NoV) {
    // This is l NoV + v NoL - NoL NoV. If v - NoV cancels, the difference and its error are small beside l NoV.
    return 1.0 / (l * NoV + (v - NoV) * NoL);
}
