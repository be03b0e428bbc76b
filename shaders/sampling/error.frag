// The largest standard error of the means of a block's pixels, for adaptive sampling.
// A fragment is a block of BLOCK x BLOCK pixels; errors are of light as it is in radianceSum. With an APRON of pixels
// around the block, the result is at least the error that an edge may cause if no sample hits it.
// raytracer/rendering/stopping_rule.py explains both.

#include "sampling/sums.glsl"

uniform float summed;   // how many samples radianceSum is of
uniform float samples;  // how many the mean is of: these, and what was summed before
uniform float white;    // light of 1, as it is in radianceSum
uniform ivec2 drawn;    // width and height of what is drawn of radianceSum

out float error;

void main() {
    ivec2 corner = BLOCK * ivec2(gl_FragCoord.xy);
    float most = 0.0;
    vec3 low = vec3(white * summed), high = vec3(0.0);
    for (int y = -APRON; y < BLOCK + APRON; ++y) {
        for (int x = -APRON; x < BLOCK + APRON; ++x) {
            vec4 sum = texelFetch(radianceSum, clamp(corner + ivec2(x, y), ivec2(0), drawn - 1), 0);
            // sum |c - mean|^2
            float squares = squaredDeviations(sum, summed);
            // No channel of any sample lies further than its root from the mean. All surely above 1: shown alike.
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
