// Schlick's approximation of the Fresnel reflectance: f0 + (1 - f0) (1 - V.H)^5.
// Provides schlickFresnel() (Schlick 1994): a share in [0, 1], per colour channel. VoH is the cosine of the angle
// between the direction and the facet's normal; f0 is the reflectance at normal incidence.

#include "materials.glsl"

vec3 schlickFresnel(Material m, float VoH) {
    float c = clamp(1.0 - VoH, 0.0, 1.0), c2 = c * c;
    return m.f0 + (1.0 - m.f0) * (c2 * c2 * c);
}
