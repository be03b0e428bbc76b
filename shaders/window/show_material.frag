// The material of the visible surface, as a colour of its own; black if no surface is visible.

#include "shading/material.glsl"
#include "window/srgb.glsl"

uniform isampler2D surface;  // from visibility.frag

out vec4 radiance;

void main() {
    int mat = texelFetch(surface, ivec2(gl_FragCoord.xy), 0).x;
    if (mat == 0) {
        radiance = vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }
    // Hues are in steps of the golden section: each new hue falls into one of the widest gaps between earlier hues.
    float hue = fract(0.618034 * float(materialAt(indexOf(mat)).number));
    vec3 c = 0.5 + 0.45 * cos(6.2831853 * (hue - vec3(0.0, 1.0, 2.0) / 3.0));
    radiance = vec4(linearFromSrgb(c), 1.0);
}
