// The highlights of the lecture: max(R.V, 0)^h and max(N.H, 0)^h.
// Provides mirrorLobe(), halfwayLobe().
// N, L, V are unit, N.L > 0, h >= 0. L = -V has no halfway vector; N.H is then taken as 0.

#include "brdf/cosine_lobe.glsl"

float mirrorLobe(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(reflect(-L, N), V, h);
}

float halfwayLobe(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(N, L + V, h);
}
