// Provides phong(): the specular factor max(R.V, 0)^h, R the mirror direction of L (Phong 1975).
// N, L, V are unit, N.L > 0, h >= 0.

#include "brdf/power.glsl"

float phong(vec3 N, vec3 L, vec3 V, float h) {
    return power(max(dot(reflect(-L, N), V), 0.0), h);
}
