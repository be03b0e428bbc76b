// Provides mirror(), mirrorMirrored(): an ideal mirror, f = F delta(V - R) / N.L. Of a light that is a point it
// reflects nothing but to one direction: so f is 0, and F is what is left of the ray to the mirror direction (Whitted
// 1980). Needs fresnel().

#include "materials.glsl"

vec3 mirror(Material m, vec3 N, vec3 L, vec3 V) {
    return vec3(0.0);
}

vec3 mirrorMirrored(Material m, vec3 N, vec3 V) {
    return fresnel(m, dot(N, V));
}
