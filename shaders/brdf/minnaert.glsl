// Minnaert's model of the Moon: f = rho (k + 1) / (2 pi) (N.L N.V)^(k - 1).
// Provides minnaert() (Minnaert 1941, "The reciprocity principle in lunar photometry"). k = 1 is Lambert. For a smaller
// k it grows without bound as N.V goes to 0, and reflects more light than it receives.

#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 minnaert(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    float k = m.darkening;
    // Powers one by one: their product underflows later.
    return m.rho * ((k + 1.0) / (2.0 * PI) * pow(NoL, k) * pow(NoV, k - 1.0));
}
