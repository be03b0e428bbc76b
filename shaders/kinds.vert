// A rectangle of the picture for each object of a kind, the smallest that holds all pixels that may see it: vertices
// 4 i to 4 i + 3 are its corners.

#include "draw.glsl"
#include "surfaces.glsl"

uniform isamplerBuffer objects;  // 2 texels each: rectangles() of raytracer/lists.py

flat out int kind;
flat out int first;
flat out int object;

#include "constants.glsl"

ivec4 objectAt(int i) {
    return texelFetch(objects, i);
}

void main() {
    int i = gl_VertexID / 4, corner = gl_VertexID % 4;
    ivec4 bounds = objectAt(2 * i);
    gl_Position = placeOf(vec2(corner % 2 == 0 ? bounds.x : bounds.z, corner / 2 == 0 ? bounds.y : bounds.w));
    ivec4 numbers = objectAt(2 * i + 1);
    kind = numbers.x;
    first = numbers.y;
    object = numbers.z;
    handOn();
    setConstants();
}
