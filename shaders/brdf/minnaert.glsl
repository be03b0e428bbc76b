// Minnaert's model of the Moon: f = rho (k + 1) / (2 pi) (N.L N.V)^(k - 1).
// Provides minnaert(): f cos(theta_i), per colour channel (Minnaert 1941, "The reciprocity principle in lunar
// photometry"). k = 1 is Lambert's model.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// For k < 1, f grows without bound as N.V goes to 0, and the surface reflects more light than it receives.

#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 minnaert(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    float k = m.darkening;
    // Two powers, because N.L N.V would underflow where the powers do not.
    return m.rho * ((k + 1.0) / (2.0 * PI) * pow(NoL, k) * pow(NoV, k - 1.0));
}
