// Blinn's model with a normalised highlight: f = kd / pi + ks c (N.H)^h.
// Provides blinn_normalized(). c is such that the lobe's albedo at normal incidence is ks:
// (h + 2) (h + 4) / (8 pi (2^(-h/2) + h)) (Blinn 1977; the constant: Giesen 2009, "Phong normalization factor").

#include "brdf/lobes.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 blinn_normalized(Material m, vec3 N, vec3 L, vec3 V) {
    float c = (m.h + 2.0) * (m.h + 4.0) / (8.0 * PI * (exp2(-0.5 * m.h) + m.h));
    return (m.kd / PI + m.ks * (c * halfwayLobe(N, L, V, m.h))) * dot(N, L);
}
