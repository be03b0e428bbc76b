// The squares of the picture, `side` pixels each, that are drawn: rectangles, an instance for each `run`, which is
// the column and row of its first square, counted from the lower left, and how many it has in a row; or points of
// one square each, because llvmpipe shades what lies along a rectangle's diagonal twice, once for each triangle.
// If the host defines PROGRAMS, `list` is where the list of that cell begins and ends (lists.glsl).

#include "passes/draw.glsl"
#include "constants.glsl"

in ivec3 run;

uniform int side;
uniform bool points;

#ifdef PROGRAMS
in ivec2 list;
flat out ivec2 listed;
#endif

void main() {
    vec2 within = points ? vec2(0.5) : vec2(gl_VertexID % 2 * run.z, gl_VertexID / 2);
    gl_Position = placeOf(float(side) * (vec2(run.xy) + within));
    gl_PointSize = float(side);
    handOn();
    setConstants();
#ifdef PROGRAMS
    listed = list;
#endif
}
