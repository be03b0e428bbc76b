// The picture in the window: the mean of the samples, as sRGB.
// If the host defines ENLARGED, each pixel of the picture is a square of `enlarged` pixels of the window. If it defines
// REFINED, there may be sums of earlier samples, and blocks that get no more samples.

#include "window/srgb.glsl"

uniform sampler2D radianceSum;    // the sums of the samples since the host last read it, times lightScale
uniform float lightScale;         // the scale of all light in the sums
uniform float samples;            // the number of samples of each pixel, unless its block has stopped
#ifdef ENLARGED
uniform int enlarged;
#endif
#ifdef REFINED
uniform sampler2D summedBefore;   // the sums of the samples before those, if hasBefore
uniform isampler2D blockSamples;  // the number of samples of each stopped block of BLOCK x BLOCK pixels; 0 for others
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
    color = vec4(srgbFromLinear(radiance), 1.0);  // the window clamps values above 1
}
