// Lambert's model: the same radiance in all directions, f = rho / pi.
// Provides lambert() (Lambert 1760): f cos(theta_i), per colour channel.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.

#include "brdf/numbers.glsl"
#include "materials.glsl"

vec3 lambert(Material m, vec3 N, vec3 L, vec3 V) {
    return m.rho * (dot(N, L) / PI);
}
