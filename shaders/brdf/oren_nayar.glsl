// Oren and Nayar's model of rough diffuse surfaces: long V-shaped cavities of Lambertian facets.
// Provides oren_nayar() (Oren and Nayar 1994), in the paper's full form or in its short one. The full form's albedo
// exceeds 1 at grazing angles for a small sigma (1.027 at N.V = 0.1).

#include "materials.glsl"

vec3 oren_nayar(Material m, vec3 N, vec3 L, vec3 V) {
    return m.rho * (0.31830989 * form(m, N, L, V));
}
