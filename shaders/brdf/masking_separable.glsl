// Provides separableMasking(): G / (N.L N.V), G the share of facets that both the light and the viewer see, as if one
// had nothing to do with the other: G1(L) G1(V) (Walter 2007). l and v are as in masking_correlated.glsl.

#include "materials.glsl"

float separableMasking(Material m, float l, float v, float NoL, float NoV) {
    return 1.0 / (l * v);
}
