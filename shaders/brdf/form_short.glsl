// The short form of Oren and Nayar's model, without light between facets.
// Provides shortForm(): pi f cos(theta_i) / rho (Oren and Nayar 1994), which is
// N.L (A + B max(0, cos phi) sin(alpha) tan(beta)). alpha is the larger and beta the smaller of the two angles to the
// normal, phi the azimuth between L and V.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// The material has sigma, the standard deviation of the facets' slope angle, in degrees; the formula takes radians. The
// product cos(phi) sin(alpha) tan(beta) is s / max(N.L, N.V) with s = L.V - N.L N.V. This difference cancels, so s is
// computed from the parts of L and V in the tangent plane.

#include "materials.glsl"

vec3 shortForm(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), 0.0), sigma = radians(m.sigma), s2 = sigma * sigma;
    float s = dot(L - NoL * N, V - NoV * N);
    float A = 1.0 - 0.5 * s2 / (s2 + 0.33), B = 0.45 * s2 / (s2 + 0.09);
    return vec3(NoL * A + B * max(s, 0.0) * (NoL / max(NoL, NoV)));
}
