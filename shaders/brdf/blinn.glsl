// Blinn's model in the lecture's form: kd N.L + ks max(N.H, 0)^h, H halfway between L and V.
// Provides blinn() (Blinn 1977).
// As a reflectance it is kd + ks (N.H)^h / N.L: neither reciprocal nor bounded.

#include "brdf/lobes.glsl"
#include "materials.glsl"

vec3 blinn(Material m, vec3 N, vec3 L, vec3 V) {
    return m.kd * dot(N, L) + m.ks * halfwayLobe(N, L, V, m.h);
}
