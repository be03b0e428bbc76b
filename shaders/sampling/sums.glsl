// The sums of a pixel's samples.
// Provides sumOfAll(), squaredDeviations(). If the host defines SUMMED_BEFORE, radianceSum holds the samples since it was
// last read, and summedBefore those before.

uniform sampler2D radianceSum;  // sums of samples times the scale of all light, and in a of their squared lengths
#ifdef SUMMED_BEFORE
uniform sampler2D summedBefore;
#endif

// Larger sums of squares are not used: they, or 256 times as much, may have overflowed.
const float MOST_SQUARES = 3.3e35;  // 2^118

vec3 sumOfAll(ivec2 pixel) {
    vec3 sum = texelFetch(radianceSum, pixel, 0).rgb;
#ifdef SUMMED_BEFORE
    sum += texelFetch(summedBefore, pixel, 0).rgb;
#endif
    return sum;
}

// The sum of |c - mean|^2 over the light c of so many samples. Where squares overflowed it is the most that it can be:
// no light is negative, and so the squares of all samples add up to at most the square of their sum.
float squaredDeviations(vec4 sum, float samples) {
    float square = dot(sum.rgb, sum.rgb);
    return max(0.0, sum.a > MOST_SQUARES ? square * (1.0 - 1.0 / samples) : sum.a - square / samples);
}
