// The picture in the window: the mean of the samples, as sRGB.
// Each pixel is enlarged to a square of `enlarged` pixels of the window.

#include "window/srgb.glsl"

uniform sampler2D radianceSum;    // sums of the samples since it was last read
uniform sampler2D summedBefore;   // of those before, if there are any
uniform isampler2D blockSamples;  // for each block of BLOCK x BLOCK pixels that gets no more samples: how many it got
uniform bool hasBefore;
uniform bool hasStopped;
uniform float samples;            // of all other pixels
uniform int enlarged;

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) / enlarged;
    vec3 sum = texelFetch(radianceSum, pixel, 0).rgb;
    if (hasBefore) sum += texelFetch(summedBefore, pixel, 0).rgb;
    int stopped = hasStopped ? texelFetch(blockSamples, pixel / BLOCK, 0).r : 0;
    vec3 radiance = sum / (stopped > 0 ? float(stopped) : samples);
    color = vec4(srgbFromLinear(radiance), 1.0);  // the window clamps what is above 1
}
