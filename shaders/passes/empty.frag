// The background, for cells in which no surface is visible.

flat in vec3 background;

uniform float samples;  // the number of samples of a pixel that are drawn at once

out vec4 radiance;  // linear RGB; .a is its squared length, and the sums of both give the error (error.frag)

void main() {
    radiance = samples * vec4(background, dot(background, background));
}
