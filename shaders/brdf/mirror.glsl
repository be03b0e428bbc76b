// The ideal mirror: f = F delta(V - R) / N.L.
// Provides mirror(), which is 0: a mirror reflects a point light to a single direction. Provides mirrorMirrored(): F,
// the factor of the light from the mirror direction, per colour channel (Whitted 1980).
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer. Needs the generated fresnel(), which calls the Fresnel form that the material chooses.

#include "materials.glsl"

vec3 mirror(Material m, vec3 N, vec3 L, vec3 V) {
    return vec3(0.0);
}

vec3 mirrorMirrored(Material m, vec3 N, vec3 V) {
    return fresnel(m, dot(N, V));
}
