// Phong's model as a reflectance that conserves energy: f = kd / pi + ks (h + 2) / (2 pi) max(R.V, 0)^h.
// Provides phong_normalized() (Lafortune and Willems 1994, "Using the modified Phong reflectance model"). It is
// reciprocal, and its albedo is kd + ks at most.

#include "brdf/lobes.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 phong_normalized(Material m, vec3 N, vec3 L, vec3 V) {
    float lobe = (m.h + 2.0) / (2.0 * PI) * mirrorLobe(N, L, V, m.h);
    return (m.kd / PI + m.ks * lobe) * dot(N, L);
}
