// The variance of a pixel's samples, summed over red, green and blue.
// If the host defines CHOSEN, some blocks of pixels got more samples than others.

#include "sampling/sums.glsl"

#ifdef CHOSEN
uniform isampler2D blockSamples;  // the number of samples of each block of BLOCK x BLOCK pixels
#else
uniform float samples;            // the number of samples of each pixel
#endif

out float variance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 sum = texelFetch(radianceSum, pixel, 0);
#ifdef CHOSEN
    float samples = float(texelFetch(blockSamples, pixel / BLOCK, 0).r);
#endif
    variance = squaredDeviations(sum, samples) / max(samples - 1.0, 1.0);
}
