// The distance to the visible surface, as grey.
// The grey is 1 / (1 + t / focus): white at the camera, half as bright at the distance of the point that the camera
// looks at, black for nothing. So it needs no range of its own.

#include "window/srgb.glsl"

uniform sampler2D normalDepth;  // from visibility.frag
uniform float focus;            // distance from the camera to what it looks at

out vec4 radiance;

void main() {
    float t = texelFetch(normalDepth, ivec2(gl_FragCoord.xy), 0).w;
    radiance = vec4(linearFromSrgb(vec3(1.0 / (1.0 + t / focus))), 1.0);
}
