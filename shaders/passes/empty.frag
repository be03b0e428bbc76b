// The background, for cells in which no surface is visible.
// If the host defines TRANSPARENT, the background does not count.

flat in vec3 background;

uniform float samples;  // the number of samples of a pixel that are drawn at once

#ifdef TRANSPARENT
layout(location = 0) out vec4 radiance;
layout(location = 1) out float coverage;  // 1 where a surface is visible, 0 where only the background is
#else
out vec4 radiance;  // linear RGB; .a is its squared length, and the sums of both give the error (error.frag)
#endif

void main() {
#ifdef TRANSPARENT
    radiance = vec4(0.0);
    coverage = 0.0;
#else
    radiance = samples * vec4(background, dot(background, background));
#endif
}
