// The sum of all samples of each pixel, as a copy that the next error estimate compares with.

#include "sampling/sums.glsl"

out vec4 kept;

void main() {
    kept = vec4(sumOfAll(ivec2(gl_FragCoord.xy)), 0.0);
}
