// The brightest channel of a part of a tile, of the sums of some of its pixels.
// A fragment is a square of SIDE x SIDE pixels that are `stride` pixels apart. raytracer/compiler/light_scale.py
// derives the scale of all light from the brightest channel.

#include "sampling/sums.glsl"

uniform int stride;
uniform ivec2 drawn;  // width and height of the part of radianceSum that holds the tile

out float brightest;

void main() {
    ivec2 first = SIDE * ivec2(gl_FragCoord.xy);
    brightest = 0.0;
    for (int y = 0; y < SIDE; ++y) {
        for (int x = 0; x < SIDE; ++x) {
            ivec2 place = first + ivec2(x, y);
            // The pixels are not aligned in rows or columns, so that they hit a thin line.
            vec3 sum = sumOfAll(min(stride * place + place.yx % stride, drawn - 1));
            brightest = max(brightest, max(max(sum.r, sum.g), sum.b));
        }
    }
}
