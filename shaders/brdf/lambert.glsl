// Lambert's model: the same radiance in all directions, f = rho / pi.
// Provides lambert() (Lambert 1760).

#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 lambert(Material m, vec3 N, vec3 L, vec3 V) {
    return m.rho * (dot(N, L) / PI);
}
