// The sums of a pixel's samples.
// Provides sumOfAll(), squaredDeviations(). If the host defines SUMMED_BEFORE, radianceSum holds the samples since the
// host last read it, and summedBefore holds the samples before.

uniform sampler2D radianceSum;  // .rgb: the sums of radiance times the scale of all light; .a: of its squared length
#ifdef SUMMED_BEFORE
uniform sampler2D summedBefore;
#endif

// The largest sum of squares that squaredDeviations() trusts: a larger one, or 256 times as much, may have overflowed.
const float MOST_SQUARES = 3.3e35;  // 2^118

// The sum of all samples of a pixel, in the units of radianceSum.
vec3 sumOfAll(ivec2 pixel) {
    vec3 sum = texelFetch(radianceSum, pixel, 0).rgb;
#ifdef SUMMED_BEFORE
    sum += texelFetch(summedBefore, pixel, 0).rgb;
#endif
    return sum;
}

// The sum of |c - mean|^2 over the light c of a pixel's samples. `sum` is a texel of radianceSum, `samples` the number
// of samples in it. If squares overflowed, the result is an upper bound: no light is negative, so the squares of all
// samples add up to at most the square of their sum.
float squaredDeviations(vec4 sum, float samples) {
    float square = dot(sum.rgb, sum.rgb);
    return max(0.0, sum.a > MOST_SQUARES ? square * (1.0 - 1.0 / samples) : sum.a - square / samples);
}
