// The split model: mirror facets reflect the share F of the light, and the rest is diffuse.
// Provides split(): f cos(theta_i), per colour channel, with f = (1 - F) (1 - metalness) rho / pi + F D G / (4 N.L N.V)
// and Schlick's F = f0 + (1 - f0) (1 - V.H)^5. f0 changes to rho as metalness goes to 1 (Karis 2013).
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// Needs the generated D(), slope() and masking(), which call the distribution and masking that the material chooses.
//
// The "Physical based rendering cheat sheet" has kd f_lambert + ks f_cook-torrance, ks = F and kd = 1 - F. Cook and
// Torrance's f contains F already, so here F occurs once. 1 - F is Schlick's at V.H. It is not the share that passes
// into the material and out again.

#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 split(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = max(dot(N, V), GRAZING);
    vec3 S = L + V;
    float c = max(1.0 - 0.5 * length(S), 0.0), c2 = c * c;
    vec3 f0 = mix(m.f0, m.rho, m.metalness);
    vec3 F = f0 + (1.0 - f0) * (c2 * c2 * c);
    float facets = D(m, N, S) * masking(m, slope(m, NoL), slope(m, NoV), NoL, NoV);
    return ((1.0 - F) * (1.0 - m.metalness) * m.rho / PI + F * (0.25 * facets)) * NoL;
}
