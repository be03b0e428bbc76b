// The largest standard error of the means of a block's pixels, for adaptive sampling.
// A fragment is a block of BLOCK x BLOCK pixels. Errors are in the units of radianceSum: radiance times the scale of
// all light. If the host defines APRON > 0, the block includes APRON pixels around it, and the result is at least the
// error that an edge may cause if no sample hits it. raytracer/rendering/stopping_rule.py explains both.

#include "sampling/sums.glsl"

uniform float summed;   // the number of samples in radianceSum
uniform float samples;  // the number of samples in the mean: these and the earlier ones
uniform float white;    // a radiance of 1 in the units of radianceSum
uniform ivec2 drawn;    // width and height of the part of radianceSum that holds the tile

out float error;

void main() {
    ivec2 corner = BLOCK * ivec2(gl_FragCoord.xy);
    float most = 0.0;
    vec3 low = vec3(white * summed), high = vec3(0.0);
    for (int y = -APRON; y < BLOCK + APRON; ++y) {
        for (int x = -APRON; x < BLOCK + APRON; ++x) {
            vec4 sum = texelFetch(radianceSum, clamp(corner + ivec2(x, y), ivec2(0), drawn - 1), 0);
            // The sum of |c - mean|^2 over the samples c.
            float squares = squaredDeviations(sum, summed);
            // No channel of a sample deviates from the mean by more than the root of that sum. If all samples are
            // surely above 1 in all channels, the screen shows them alike, and the pixel has no visible error.
            float above = min(min(sum.r, sum.g), sum.b) / summed - white;
            most = max(most, above < 0.0 || above * above < squares ? squares : 0.0);
            vec3 shown = min(sum.rgb, white * summed);
            low = min(low, shown);
            high = max(high, shown);
        }
    }
    error = sqrt(most / ((summed - 1.0) * samples));
#if APRON > 0
    error = max(error, distance(low, high) / summed / (2.0 * samples));
#endif
}
