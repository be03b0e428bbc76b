// Provides listAt(), itemAt(), struct Nearest, nearer(), meets(), cubeCell(): what the generated walk through
// the list of a cell is made of. raytracer/lists.py says what a list holds.
//
// A ray from the camera through a cell of the picture, or one to a light from a cell of the cube around it,
// can meet only what that cell lists.

#include "ray.glsl"
#include "surfaces.glsl"

uniform isampler2D lists;  // for each light where its cells' lists begin, and then the lists
uniform sampler2D items;   // 2 texels for each object of a kind: the ball around it; kind, first surface, number

int listAt(int i) {
    return texelFetch(lists, texel(i), 0).x;
}

vec4 itemAt(int i) {
    return texelFetch(items, texel(i), 0);
}

// The first surface so far; of several at the same distance that of the first object in the scene.
struct Nearest {
    real t;
    int mat;     // as in surfaces.glsl
    int object;  // its number; -1 for none
};

bool nearer(real t, int object, Nearest than) {
    return t < than.t || (t == than.t && object < than.object);
}

// Of a distance: many times what float32 rounding moves a ray by.
const real SLACK = 1e-5;

// Whether the ray may meet something in a ball before the distance `end`.
bool meets(Ray ray, vec4 ball, real end) {
    real3 toCenter = ball.xyz - ray.ro;
    real3 moment = cross(toCenter, ray.rd);
    real along = dot(toCenter, ray.rd);
    real radius = ball.w + SLACK * (abs(along) + ball.w);
    return dot(moment, moment) <= radius * radius && along >= -radius && along - radius <= end;
}

// The cell, of GRID x GRID on each face of a cube around a light, in direction D from it.
int cubeCell(vec3 D) {
    vec3 size = abs(D);
    bool x = size.x >= size.y && size.x >= size.z, y = !x && size.y >= size.z;
    float main = x ? D.x : y ? D.y : D.z;
    vec2 at = (x ? D.yz : y ? D.xz : D.xy) / abs(main);
    ivec2 cell = clamp(ivec2((at + 1.0) * (0.5 * float(GRID))), ivec2(0), ivec2(GRID - 1));
    int face = (x ? 0 : y ? 2 : 4) + (main < 0.0 ? 1 : 0);
    return (face * GRID + cell.y) * GRID + cell.x;
}
