// The candidate lists of cells: for each cell, the objects that its rays may meet.
// Provides endsAt(), listAt(), ballAt(), struct Item, itemAt(), surfaceOf(), struct Nearest, nearer(), meets(),
// hemisphereCell(), for the generated loop over a list. raytracer/compiler/candidate_lists.py describes the entries.
//
// A ray from the camera through a cell of the picture, or one to a light from a cell around it,
// can meet only what that cell lists.

#include "geometry/ray.glsl"
#include "geometry/surfaces.glsl"

uniform isamplerBuffer lists;  // the entries of all cells' lists
uniform isamplerBuffer ends;   // of each light the longest ray and where its lists begin; then, from there on, where the
                               // list of each cell of each light begins and ends
uniform samplerBuffer items;   // 4 texels for each object of a common shape: see ballAt() and itemAt()

flat in int grid;              // cells of a side of each hemisphere around a light

ivec2 endsAt(int cell) {
    return texelFetch(ends, cell).xy;
}

int listAt(int i) {
    return texelFetch(lists, i).x;
}

vec4 itemsAt(int i) {
    return texelFetch(items, i);
}

// The ball around an object of a common shape.
vec4 ballAt(int item) {
    return itemsAt(4 * item);
}

struct Item {
    int shape;
    int first;   // index of its first surface
    int object;  // its number in the scene
    vec4 power;  // of its surfaces: coarse.w, and sameAs()
    vec4 same;
};

Item itemAt(int item) {
    vec4 numbers = itemsAt(4 * item + 1);
    return Item(int(numbers.x), int(numbers.y), int(numbers.z), itemsAt(4 * item + 2), itemsAt(4 * item + 3));
}

// A surface of it, with what rays other than the camera's need: fewer texels than surfaceOf() of its index.
Surface surfaceOf(Item i, int leaf) {
    return Surface(shapeOf(i.first + leaf), vec4(i.power[leaf]), vec4(i.same[leaf]));
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

// Of a distance: ten times, for lenses (raytracer/compiler/batches.py), what float32 rounding moves a ray or a root by, 32 u.
const real SLACK = 2e-5;

// Whether the ray may meet something in a ball before the distance `end`.
bool meets(Ray ray, vec4 ball, real end) {
    real3 toCenter = ball.xyz - ray.ro;
    real3 moment = cross(toCenter, ray.rd);
    real along = dot(toCenter, ray.rd);
    real radius = ball.w + SLACK * (abs(along) + ball.w);
    return dot(moment, moment) <= radius * radius && along >= -radius && along - radius <= end;
}

// The cell, of grid x grid on each of two hemispheres around a light, in direction D from it. `size` is the length of D.
int hemisphereCell(vec3 D, float size) {
    vec2 at = D.xy / (abs(D.z) + size);
    ivec2 cell = clamp(ivec2((at + 1.0) * (0.5 * float(grid))), ivec2(0), ivec2(grid - 1));
    return ((D.z < 0.0 ? grid : 0) + cell.y) * grid + cell.x;
}
