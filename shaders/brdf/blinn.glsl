// Provides blinn(): the specular factor max(N.H, 0)^h, H halfway between L and V (Blinn 1977).
// N, L, V are unit, N.L > 0, h >= 0. L = -V has no halfway vector; N.H is then taken as 0.

#include "brdf/power.glsl"

float blinn(vec3 N, vec3 L, vec3 V, float h) {
    vec3 H = L + V;
    float length2 = dot(H, H);
    return power(length2 > 0.0 ? max(dot(N, H) * inversesqrt(length2), 0.0) : 0.0, h);
}
