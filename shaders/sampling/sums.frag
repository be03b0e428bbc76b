// The sums of all samples so far, to be kept.

#include "sampling/sums.glsl"

out vec4 kept;

void main() {
    kept = vec4(sumOfAll(ivec2(gl_FragCoord.xy)), 0.0);
}
