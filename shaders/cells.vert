// A rectangle of the picture for each instance: `run` is the column and row of a cell, CELL pixels square,
// counted from the lower left, and how many cells it is wide. If the host defines LISTED, `list` is where
// the cell's list begins and ends (lists.glsl).

in ivec3 run;

uniform vec2 tileOrigin;  // the lower left pixel of the tile being drawn
uniform vec2 tileSize;    // in pixels

#ifdef LISTED
in ivec2 list;
flat out ivec2 listed;
#endif

void main() {
    ivec2 corner = run.xy + ivec2(gl_VertexID % 2 * run.z, gl_VertexID / 2);
    gl_Position = vec4(2.0 * (vec2(CELL * corner) - tileOrigin) / tileSize - 1.0, 0.0, 1.0);
#ifdef LISTED
    listed = list;
#endif
}
