// Blinn's model with a normalised highlight: f = kd / pi + ks c (N.H)^h.
// Provides blinn_normalized(): f cos(theta_i), per colour channel (Blinn 1977). With c the highlight's albedo at normal
// incidence is ks: c = (h + 2) (h + 4) / (8 pi (2^(-h/2) + h)) (Giesen 2009, "Derivation of Phong and Blinn-Phong BRDF
// normalization factors").
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. H is halfway between L and V.

#include "brdf/lobes.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 blinn_normalized(Material m, vec3 N, vec3 L, vec3 V) {
    float c = (m.h + 2.0) * (m.h + 4.0) / (8.0 * PI * (exp2(-0.5 * m.h) + m.h));
    return (m.kd / PI + m.ks * (c * halfwayLobe(N, L, V, m.h))) * dot(N, L);
}
