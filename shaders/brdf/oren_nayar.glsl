// Oren and Nayar's model of rough diffuse surfaces: long V-shaped cavities of Lambertian facets.
// Provides oren_nayar(): f cos(theta_i), per colour channel, in the full or the short form of Oren and Nayar (1994).
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// Needs the generated form(), which calls the form that the material chooses.
// For a small sigma the albedo of the full form exceeds 1 at grazing angles (1.027 at N.V = 0.1).

#include "materials.glsl"

vec3 oren_nayar(Material m, vec3 N, vec3 L, vec3 V) {
    return m.rho * (0.31830989 * form(m, N, L, V));
}
