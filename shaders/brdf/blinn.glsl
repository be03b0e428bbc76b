// Provides blinn(): the specular factor max(N.H, 0)^h, H halfway between L and V (Blinn 1977).
// N, L, V are unit, N.L > 0, h >= 0. L = -V has no halfway vector; N.H is then taken as 0.

#include "brdf/cosine_lobe.glsl"

float blinn(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(N, L + V, h);
}
