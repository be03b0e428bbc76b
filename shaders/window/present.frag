// The picture in the window: the mean of the samples, as sRGB.
// ENLARGED: each pixel is a square of `enlarged` pixels of the window.
// REFINED: there may be sums of earlier samples, and blocks that get no more samples.

#include "window/srgb.glsl"

uniform sampler2D radianceSum;    // sums of the samples since it was last read
uniform float lightScale;         // times which light the sums are of
uniform float samples;            // of all pixels whose block has no number of its own
#ifdef ENLARGED
uniform int enlarged;
#endif
#ifdef REFINED
uniform sampler2D summedBefore;   // of those before, if there are any
uniform isampler2D blockSamples;  // for each block of BLOCK x BLOCK pixels that gets no more samples: how many it got
uniform bool hasBefore;
uniform bool hasStopped;
#endif

out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef ENLARGED
    pixel /= enlarged;
#endif
    vec3 sum = texelFetch(radianceSum, pixel, 0).rgb;
    float count = samples;
#ifdef REFINED
    if (hasBefore) sum += texelFetch(summedBefore, pixel, 0).rgb;
    int stopped = hasStopped ? texelFetch(blockSamples, pixel / BLOCK, 0).r : 0;
    if (stopped > 0) count = float(stopped);
#endif
    vec3 radiance = sum / (count * lightScale);
    color = vec4(srgbFromLinear(radiance), 1.0);  // the window clamps what is above 1
}
