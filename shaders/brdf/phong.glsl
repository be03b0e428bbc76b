// Provides phong(): the specular factor max(R.V, 0)^h, R the mirror direction of L (Phong 1975).
// N, L, V are unit, N.L > 0, h >= 0.

#include "brdf/cosine_lobe.glsl"

float phong(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(reflect(-L, N), V, h);
}
