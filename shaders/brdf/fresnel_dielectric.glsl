// The Fresnel reflectance of a smooth surface between two transparent media.
// Provides dielectricFresnel(), a share in [0, 1] of unpolarised light (Fresnel 1823; form of Cook and Torrance 1982).
// VoH is the cosine of the angle between the direction and the facet's normal, clamped to [0, 1]. ior is the ratio of
// the refractive indices, the far medium's to the near one's. The share is 1 for total internal reflection.
//
// The amplitudes are (g - c) / (g + c) and (ior^2 c - g) / (ior^2 c + g), with g^2 = ior^2 - 1 + c^2 and c = VoH. Their
// differences are multiplied out, so that nothing cancels for an ior near 1.

#include "materials.glsl"

vec3 dielectricFresnel(Material m, float VoH) {
    float c = clamp(VoH, 0.0, 1.0);
    float n2 = m.ior * m.ior, change = (m.ior - 1.0) * (m.ior + 1.0);
    float g = sqrt(max(change + c * c, 0.0));
    float s = change / ((g + c) * (g + c));
    float p = change * ((n2 + 1.0) * c * c - 1.0) / ((n2 * c + g) * (n2 * c + g));
    return vec3(change == 0.0 ? 0.0 : g > 0.0 ? 0.5 * (s * s + p * p) : 1.0);
}
