// The background, for cells in which no surface is visible.

flat in vec3 background;

uniform float samples;  // how many samples of a pixel are drawn at once

out vec4 radiance;  // and, in a, its squared length: the sums of both tell their error (error.frag)

void main() {
    radiance = samples * vec4(background, dot(background, background));
}
