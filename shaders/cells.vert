// A rectangle of the picture for each instance: `run` is the column and row of a cell, `side` pixels square,
// counted from the lower left, and how many cells it is wide. If the host defines PROGRAMS, `list` is
// where the cell's list begins and ends (lists.glsl).

#include "draw.glsl"
#include "constants.glsl"

in ivec3 run;

uniform int side;

#ifdef PROGRAMS
in ivec2 list;
flat out ivec2 listed;
#endif

void main() {
    gl_Position = placeOf(vec2(side * (run.xy + ivec2(gl_VertexID % 2 * run.z, gl_VertexID / 2))));
    handOn();
    setConstants();
#ifdef PROGRAMS
    listed = list;
#endif
}
