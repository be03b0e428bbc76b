// The sum of all samples of a pixel.
// Provides sumOfAll(). If the host defines SUMMED_BEFORE, radianceSum holds the samples since it was last read, and
// summedBefore those before.

uniform sampler2D radianceSum;  // sums of samples, and in a of their squared lengths
#ifdef SUMMED_BEFORE
uniform sampler2D summedBefore;
#endif

vec3 sumOfAll(ivec2 pixel) {
    vec3 sum = texelFetch(radianceSum, pixel, 0).rgb;
#ifdef SUMMED_BEFORE
    sum += texelFetch(summedBefore, pixel, 0).rgb;
#endif
    return sum;
}
