// The distance to the visible surface, as grey.
// The grey is 1 / (1 + t / focus), in sRGB: 1 (white) at the camera, 1/2 at the distance of the point that the camera
// looks at, 0 (black) if no surface is visible. So it needs no range of its own.

#include "window/srgb.glsl"

uniform sampler2D normalDepth;  // from visibility.frag
uniform float advance;          // the distance from the camera to the origin of view space, 0 in perspective
uniform float focus;            // the distance from the camera to the point that it looks at

out vec4 radiance;

void main() {
    float t = texelFetch(normalDepth, ivec2(gl_FragCoord.xy), 0).w + advance;
    radiance = vec4(linearFromSrgb(vec3(1.0 / (1.0 + t / focus))), 1.0);
}
