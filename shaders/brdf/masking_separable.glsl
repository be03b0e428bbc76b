// Separable masking and shadowing of facets, as if the two were independent: G = G1(L) G1(V).
// Provides separableMasking(): G / (N.L N.V), G the share of facets that both the light and the viewer see (Walter
// 2007). l and v are as in masking_correlated.glsl.

#include "materials.glsl"

float separableMasking(Material m, float l, float v, float NoL, float NoV) {
    return 1.0 / (l * v);
}
