// Phong's model as a reflectance that conserves energy: f = kd / pi + ks (h + 2) / (2 pi) max(R.V, 0)^h.
// Provides phong_normalized(): f cos(theta_i), per colour channel (Lafortune and Willems 1994, "Using the modified
// Phong reflectance model for physically based rendering"). R is the mirror direction of L. The model is reciprocal,
// and its albedo is at most kd + ks.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.

#include "brdf/lobes.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 phong_normalized(Material m, vec3 N, vec3 L, vec3 V) {
    float lobe = (m.h + 2.0) / (2.0 * PI) * mirrorLobe(N, L, V, m.h);
    return (m.kd / PI + m.ks * lobe) * dot(N, L);
}
