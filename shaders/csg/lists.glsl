// The candidate lists of cells: for each cell, the objects that its rays may meet.
// Provides endsAt(), listAt(), ballAt(), struct Item, itemAt(), surfaceOf(), struct Nearest, nearer(), meets(),
// hemisphereCell(), for the generated loop over a list. raytracer/compiler/candidate_lists.py describes the entries.
//
// A cell is a square of the picture, for rays from the camera, or a cell of a hemisphere around a light, for rays to
// that light. A ray through a cell can meet only the objects in the cell's list. All lengths are in view space.

#include "geometry/ray.glsl"
#include "geometry/surfaces.glsl"

uniform isamplerBuffer lists;  // the entries of all cells' lists
// First a texel for each light: the length of ray up to which its lists are complete (float bits), and where its lists
// begin in `lists`. Then a texel for each cell of each light: where its list begins and ends, counted from there.
uniform isamplerBuffer ends;
uniform samplerBuffer items;   // 4 texels for each object of a common shape: see ballAt() and itemAt()

flat in int grid;              // the number of cells along each side of a hemisphere around a light

ivec2 endsAt(int cell) {
    return texelFetch(ends, cell).xy;
}

int listAt(int i) {
    return texelFetch(lists, i).x;
}

vec4 itemsAt(int i) {
    return texelFetch(items, i);
}

// The bounding sphere of an object of a common shape: centre, radius.
vec4 ballAt(int item) {
    return itemsAt(4 * item);
}

struct Item {
    int shape;
    ivec2 first; // index of its first sphere and of its first body
    int object;  // its number in the scene
    vec4 power;  // coarse.w of each of its spheres (surfaces.glsl)
    vec4 same;   // the coincidence number of each, sameAs()
};

Item itemAt(int item) {
    vec4 numbers = itemsAt(4 * item + 1);
    return Item(int(numbers.x), ivec2(numbers.yw), int(numbers.z), itemsAt(4 * item + 2), itemsAt(4 * item + 3));
}

// The item's sphere number `leaf`, with the members that rays to a light need. It reads fewer texels than surfaceOf()
// of the surface's index.
Surface surfaceOf(Item i, int leaf) {
    return Surface(shapeOf(i.first.x + leaf), vec4(i.power[leaf]), vec4(i.same[leaf]));
}

// The nearest surface so far; among several at one distance, the surface of the object that comes first in the scene.
struct Nearest {
    real t;
    int mat;     // the surface's index + 1, negative where the ray leaves the primitive; 0 for none
    int object;  // the object's number in the scene; -1 for none
};

bool nearer(real t, int object, Nearest than) {
    return t < than.t || (t == than.t && object < than.object);
}

// The tolerance of meets(), as a share of a distance. Float32 rounding moves a ray or a root by up to 32 u, u = 2^-24.
// The factor of ten is for bounding spheres of lenses, which grow by more (raytracer/compiler/batches.py).
const real SLACK = 2e-5;

// Whether the ray may meet a surface within a ball (centre, radius) before the distance `end`.
bool meets(Ray ray, vec4 ball, real end) {
    real3 toCenter = ball.xyz - ray.ro;
    real3 moment = cross(toCenter, ray.rd);
    real along = dot(toCenter, ray.rd);
    real radius = ball.w + SLACK * (abs(along) + ball.w);
    return dot(moment, moment) <= radius * radius && along >= -radius && along - radius <= end;
}

// The cell in the direction D from a light, among grid x grid cells on each of two hemispheres. `size` is the length of
// D.
int hemisphereCell(vec3 D, float size) {
    vec2 at = D.xy / (abs(D.z) + size);
    ivec2 cell = clamp(ivec2((at + 1.0) * (0.5 * float(grid))), ivec2(0), ivec2(grid - 1));
    return ((D.z < 0.0 ? grid : 0) + cell.y) * grid + cell.x;
}
