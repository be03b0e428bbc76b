// The short form of Oren and Nayar's model, without light between facets.
// Provides shortForm(): pi f cos(theta_i) / rho, which is
// A + B max(0, cos phi) sin(alpha) tan(beta), alpha the larger and beta the smaller of the two angles. The product is
// s / max(N.L, N.V) with s = L.V - N.L N.V, which is made of the parts in the surface, because it cancels.
// sigma comes in degrees, the formula has radians.

#include "materials.glsl"

vec3 shortForm(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), 0.0), sigma = radians(m.sigma), s2 = sigma * sigma;
    float s = dot(L - NoL * N, V - NoV * N);
    float A = 1.0 - 0.5 * s2 / (s2 + 0.33), B = 0.45 * s2 / (s2 + 0.09);
    return vec3(NoL * A + B * max(s, 0.0) * (NoL / max(NoL, NoV)));
}
