// The light that reaches the camera where there is nothing to be seen.

uniform vec3 background;

out vec4 radiance;

void main() {
    radiance = vec4(background, 1.0);
}
