// The highlights of the lecture: max(R.V, 0)^h and max(N.H, 0)^h.
// Provides mirrorLobe() for Phong's highlight and halfwayLobe() for Blinn's, each a number in [0, 1]. R is the mirror
// direction of L, and H is halfway between L and V.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. The exponent h is >= 0. For L = -V there is no halfway vector, and N.H counts as 0.

#include "brdf/cosine_lobe.glsl"

float mirrorLobe(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(reflect(-L, N), V, h);
}

float halfwayLobe(vec3 N, vec3 L, vec3 V, float h) {
    return cosineLobe(N, L + V, h);
}
