// The movement of a block's means between two numbers of samples, and the largest variance of a pixel's samples.
// A fragment is a block of BLOCK x BLOCK pixels. raytracer/rendering/estimator.py estimates the picture's error from
// both numbers. They are in the squared units of radianceSum.

#include "sampling/sums.glsl"

uniform sampler2D earlierSum;  // the sums of the earlier number of samples
uniform float earlier;         // the number of samples in earlierSum
uniform float summed;          // the number of samples in radianceSum
uniform float samples;         // the number of all samples now
uniform ivec2 drawn;           // width and height of the part of radianceSum that holds the tile

out vec2 found;  // over the block's pixels: the sum of |movement|^2, and the largest variance of the samples

void main() {
    ivec2 corner = BLOCK * ivec2(gl_FragCoord.xy);
    vec2 all = vec2(0.0);
    for (int y = 0; y < BLOCK; ++y) {
        for (int x = 0; x < BLOCK; ++x) {
            ivec2 pixel = corner + ivec2(x, y);
            if (any(greaterThanEqual(pixel, drawn))) continue;
            vec4 sum = texelFetch(radianceSum, pixel, 0);
            vec3 moved = sumOfAll(pixel) / samples - texelFetch(earlierSum, pixel, 0).rgb / earlier;
            float variance = squaredDeviations(sum, summed) / (summed - 1.0);
            all = vec2(all.x + dot(moved, moved), max(all.y, variance));
        }
    }
    found = all;
}
