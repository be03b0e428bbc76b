// Torrance and Sparrow's microfacet model (1967), with V-shaped cavities.
// Provides torrance_sparrow(): f cos(theta_i), per colour channel, with f = rho / pi + ks constant F D G / (N.L N.V)
// and D = c exp(-(angle / m)^2), of the angle between N and the halfway vector H.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. F is taken at the angle between V and H.
// Needs the generated fresnel(), which calls the Fresnel form that the material chooses.
// D is written as by Cook and Torrance (1982), where c is an arbitrary constant. Here c = 0 stands for 1 / (pi m^2),
// which makes the integral over D cos equal to 1 for a small m.

#include "brdf/angle.glsl"
#include "brdf/numbers.glsl"
#include "brdf/v_cavity.glsl"
#include "materials.glsl"

vec3 torrance_sparrow(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    vec3 S = L + V;
    float x = angle(length(cross(N, S)), dot(N, S)) / m.m;
    float D = (m.c > 0.0 ? m.c : 1.0 / (PI * m.m * m.m)) * exp(-x * x);
    return m.rho * (NoL / PI) + m.ks * fresnel(m, 0.5 * length(S)) * (m.constant * D * vCavity(N, S, NoL, NoV));
}
