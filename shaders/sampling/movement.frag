// The movement of a block's means between two numbers of samples, and the variance of its samples.
// A fragment is a block of BLOCK x BLOCK pixels. raytracer/rendering/estimator.py estimates the picture's error from both.
// If the host defines LESSENED, light is multiplied by a power of two first, so that no square overflows.

#include "sampling/sums.glsl"

uniform sampler2D earlierSum;  // the sums of all samples there were before
uniform float earlier;         // how many samples they are of
uniform float summed;          // how many radianceSum is of
uniform float samples;         // how many there are now
uniform ivec2 drawn;           // width and height of what is drawn of radianceSum
#ifdef LESSENED
uniform float lessened;
#else
const float lessened = 1.0;
#endif

out vec4 found;  // of the block's pixels: sums of |movement|^2 and of the samples' variance, the largest variance, 0

void main() {
    ivec2 corner = BLOCK * ivec2(gl_FragCoord.xy);
    vec3 all = vec3(0.0);
    for (int y = 0; y < BLOCK; ++y) {
        for (int x = 0; x < BLOCK; ++x) {
            ivec2 pixel = corner + ivec2(x, y);
            if (any(greaterThanEqual(pixel, drawn))) continue;
            vec4 sum = texelFetch(radianceSum, pixel, 0);
            vec3 moved = lessened * (sumOfAll(pixel) / samples - texelFetch(earlierSum, pixel, 0).rgb / earlier);
            float variance = max(squaredDeviations(sum, summed, lessened), 0.0) / (summed - 1.0);
            all = vec3(all.xy + vec2(dot(moved, moved), variance), max(all.z, variance));
        }
    }
    found = vec4(all, 0.0);
}
