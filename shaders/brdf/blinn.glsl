// Blinn's model in the lecture's form: kd N.L + ks max(N.H, 0)^h, H halfway between L and V.
// Provides blinn() (Blinn 1977): the factor of the light's colour, per colour channel.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// As a reflectance the highlight is ks (N.H)^h / N.L, which is neither reciprocal nor bounded.

#include "brdf/lobes.glsl"
#include "materials.glsl"

vec3 blinn(Material m, vec3 N, vec3 L, vec3 V) {
    return m.kd * dot(N, L) + m.ks * halfwayLobe(N, L, V, m.h);
}
