// The picture in the window: the mean of the samples, as sRGB.
// Each pixel is enlarged to a square of `enlarged` pixels of the window.

#include "window/srgb.glsl"

uniform sampler2D radianceSum;
uniform float samples;
uniform int enlarged;

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) / enlarged;
    vec3 radiance = texelFetch(radianceSum, pixel, 0).rgb / samples;
    color = vec4(srgbFromLinear(radiance), 1.0);  // the window clamps what is above 1
}
