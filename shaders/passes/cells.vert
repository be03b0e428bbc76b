// The cells of the picture that one program draws, squares of `side` pixels.
// The mesh has an instance for each `block` of squares: the column and row of its first square, counted from the lower
// left of the picture, and its numbers of columns and rows. A block is drawn as a rectangle, or if `points`, as a point
// that is one square. (llvmpipe shades the pixels along a rectangle's diagonal twice, once for each triangle.) If the
// host defines PROGRAMS, `list` holds where the candidate list of that cell begins and ends (lists.glsl).

#include "passes/draw.glsl"
#include "constants.glsl"

in ivec4 block;

uniform int side;
uniform bool points;

#ifdef PROGRAMS
in ivec2 list;
flat out ivec2 cellList;
#endif

void main() {
    vec2 within = points ? vec2(0.5) : vec2(ivec2(gl_VertexID % 2, gl_VertexID / 2) * block.zw);
    gl_Position = placeOf(float(side) * (vec2(block.xy) + within));
    gl_PointSize = float(side);
    handOn();
    setConstants();
#ifdef PROGRAMS
    cellList = list;
#endif
}
