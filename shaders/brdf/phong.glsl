// Phong's model in the lecture's form: kd N.L + ks max(R.V, 0)^h, R the mirror direction of L.
// Provides phong() (Phong 1975).
// As a reflectance it is kd + ks (R.V)^h / N.L: neither reciprocal nor bounded.

#include "brdf/lobes.glsl"
#include "materials.glsl"

vec3 phong(Material m, vec3 N, vec3 L, vec3 V) {
    return m.kd * dot(N, L) + m.ks * mirrorLobe(N, L, V, m.h);
}
