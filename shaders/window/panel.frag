// A panel of text over the window's picture.
// The host draws the text into `panel`. Its alpha is not premultiplied.

uniform sampler2D panel;
uniform ivec2 corner;  // the window's pixel at the panel's lower left corner

out vec4 color;

void main() {
    color = texelFetch(panel, ivec2(gl_FragCoord.xy) - corner, 0);
}
