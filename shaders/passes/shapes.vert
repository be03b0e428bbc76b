// The rectangles of the picture in which small objects of common shapes may be seen.
// There is one rectangle for each object: the smallest that holds all pixels that may see the object. Vertices 4 i to 4
// i + 3 are the corners of rectangle i. If `points`, vertex i is a point: a square around rectangle i (see cells.vert).

#include "passes/draw.glsl"
#include "geometry/surfaces.glsl"

// 2 texels for each object: first column and row of pixels, and one past the last; shape, index of the first sphere,
// number in the scene, and index of the first body.
uniform isamplerBuffer objects;

flat out int shape;
flat out ivec2 first;
flat out int object;

#include "constants.glsl"

ivec4 objectAt(int i) {
    return texelFetch(objects, i);
}

uniform bool points;

void main() {
    int i = points ? gl_VertexID : gl_VertexID / 4, corner = gl_VertexID % 4;
    ivec4 bounds = objectAt(2 * i);
    vec2 at = vec2(corner % 2 == 0 ? bounds.x : bounds.z, corner / 2 == 0 ? bounds.y : bounds.w);
    gl_Position = placeOf(points ? 0.5 * vec2(bounds.xy + bounds.zw) : at);
    gl_PointSize = float(max(bounds.z - bounds.x, bounds.w - bounds.y));
    ivec4 numbers = objectAt(2 * i + 1);
    shape = numbers.x;
    first = numbers.yw;
    object = numbers.z;
    handOn();
    setConstants();
}
