// The marker of a light in the window: a disk of the light's colour in a ring.
// If the light is out of view, only the ring is drawn. A white band between black ones is visible on every background.

#include "window/srgb.glsl"

uniform vec2 center;    // pixels of the window
uniform float radius;   // pixels
uniform vec3 fill;      // linear, in [0, 1]
uniform bool inView;

out vec4 color;

const vec3 BLACK = vec3(0.0), WHITE = vec3(1.0);
// The inner edges of the bands, from the outermost inwards, as shares of the radius.
const float RIM = 0.84, RING = 0.56, INNER_RIM = 0.42;

void main() {
    float r = length(gl_FragCoord.xy - center) / radius;
    if (r > 1.0 || (!inView && r < INNER_RIM)) discard;
    color = vec4(r > RIM ? BLACK : r > RING ? WHITE : r > INNER_RIM ? BLACK : srgbFromLinear(fill), 1.0);
}
