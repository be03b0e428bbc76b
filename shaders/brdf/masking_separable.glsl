// Separable masking and shadowing of facets, as if the two were independent: G = G1(L) G1(V).
// Provides separableMasking(): G / (N.L N.V), where G is the share of facets that both the light and the viewer see
// (Walter et al. 2007). l is N.L / G1(L) and v is N.V / G1(V), the results of slope(): so nothing is divided by a small
// cosine.

#include "materials.glsl"

float separableMasking(Material m, float l, float v, float NoL, float NoV) {
    return 1.0 / (l * v);
}
