// The intersection of a ray with a long chain: an object of many leaves under one operator, by a grid of cells.
// Provides meetGrid(): if the ray meets the object before `nearest`, it sets `nearest` to that surface.
//
// As in chain.glsl, the object is treated as a conjunction, and a leaf is False where the ray is not in it, or for a
// negated leaf, where the ray is in it. The few leaves of the core are tested for every ray. All others are negated: from a
// place where one of them is False, the ray goes on to where that leaf becomes True. It needs only the leaves around
// that place, the list of its cell (raytracer/compiler/chain_grids.py). All results have the bits of chain.glsl.
//
// If the host defines OWNERS, the result names the surface that the ray meets; otherwise its `mat` is 1 for any
// surface.

#include "csg/program.glsl"

// For each grid: the three rows of the map from view space to the grid (float bits); the number of cells along each
// axis, and where its cells begin in `gridLeaves`; where its core begins and ends there, and whether it is a union.
uniform isamplerBuffer grids;
// For each cell, where its leaves begin and end. For each leaf, its code (program.glsl) and its place in the tree.
uniform isamplerBuffer gridLeaves;

// The largest number of leaves in a core, CORE of raytracer/compiler/batches.py.
const int CORE = 4;
const int LAST_PLACE = 0x7fffffff;

// A ray in the coordinates of a grid, whose cells have the side 1.
struct GridRay {
    vec3 ro;
    vec3 rd;
    ivec4 shape;  // the number of cells along each axis, and where the cells begin
};

ivec2 leafAt(int i) {
    return texelFetch(gridLeaves, i).xy;
}

// Where the leaves of a cell begin and end; nothing outside the grid.
ivec2 leavesOf(GridRay ray, ivec3 cell) {
    if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, ray.shape.xyz))) return ivec2(0);
    return leafAt(ray.shape.w + (cell.z * ray.shape.y + cell.y) * ray.shape.x + cell.x);
}

ivec3 cellAt(GridRay ray, real t) {
    return ivec3(floor(clamp(ray.ro + t * ray.rd, -1.0, 2048.0)));  // the clamp keeps numbers in the range of int
}

// The roots of a leaf, where roots that round to one number are no surface.
real2 gridRoots(Ray ray, int code) {
    real2 span = leafRoots(ray, code >> 5);
    return span.x < span.y ? span : real2(INF, -INF);
}

// Where the ray first enters a listed leaf, from a place that is in none of them; at least INF if it enters none.
real firstEntry(Ray ray, GridRay by) {
    vec3 towards = sign(by.rd), inverse = towards / max(abs(by.rd), 1e-30);
    vec3 begins = (vec3(by.shape.xyz) * max(-towards, 0.0) - by.ro) * inverse;
    // Along an axis with the slope 0, inverse is 0, so begins is 0.
    real start = max(max(begins.x, max(begins.y, begins.z)), 0.0);
    real until = INF;
    ivec3 cell = clamp(cellAt(by, start), ivec3(0), by.shape.xyz - 1), way = ivec3(towards);
    for (;;) {
        ivec2 list = leavesOf(by, cell);
        if (list == ivec2(0)) break;
        for (int k = list.x; k < list.y; k++) {
            real2 span = gridRoots(ray, leafAt(k).x);
            until = span.x > 0.0 ? min(until, span.x) : until;
        }
        vec3 ends = (vec3(cell) + max(towards, 0.0) - by.ro) * inverse;
        ends = mix(ends, vec3(INF), equal(towards, vec3(0.0)));
        real end = min(ends.x, min(ends.y, ends.z));
        if (until <= end) break;
        if (end == ends.x) cell.x += way.x;
        else if (end == ends.y) cell.y += way.y;
        else cell.z += way.z;
    }
    return until;
}

// The leaf with a root at a distance, among leaves: its code and its place, if that is before the place of `first`.
ivec2 ownerAmong(Ray ray, ivec2 list, real at, ivec2 first) {
    for (int k = list.x; k < list.y; k++) {
        ivec2 leaf = leafAt(k);
        real2 span = gridRoots(ray, leaf.x);
        int mat = span.x == at ? (leaf.x >> 5) + 1 : -(leaf.x >> 5) - 1;
        if ((span.x == at || span.y == at) && leaf.y < first.y) first = ivec2(mat, leaf.y);
    }
    return first;
}

void meetGrid(Ray ray, int number, int object, inout Nearest nearest) {
    number *= 5;
    vec4 x = intBitsToFloat(texelFetch(grids, number)), y = intBitsToFloat(texelFetch(grids, number + 1));
    vec4 z = intBitsToFloat(texelFetch(grids, number + 2));
    ivec4 core = texelFetch(grids, number + 4);
    GridRay by = GridRay(
        vec3(dot(x.xyz, ray.ro) + x.w, dot(y.xyz, ray.ro) + y.w, dot(z.xyz, ray.ro) + z.w),
        vec3(dot(x.xyz, ray.rd), dot(y.xyz, ray.rd), dot(z.xyz, ray.rd)), texelFetch(grids, number + 3));
    int complement = core.z * 8;
    real at = 0.0;      // up to here a leaf among those tested is False
    real last = INF;    // from here on a leaf of the core is False for good
    real2 spans[CORE];  // where a negated leaf is False; for any other leaf, where it is True, with swapped ends
    int count = core.y - core.x;
    for (int j = 0; j < count; j++) {
        int code = leafAt(core.x + j).x ^ complement;
        real2 span = gridRoots(ray, code);
        bool within = (code & 8) == 0;
        at = within ? max(at, span.x) : at;
        last = within ? min(last, span.y) : last;
        spans[j] = within ? span.yx : span;
    }
    for (;;) {
        if (at >= last || !nearer(at, object, nearest)) return;
        real before = at;
        for (int j = 0; j < count; j++) at = isInside(spans[j], at) ? spans[j].y : at;
        ivec2 list = leavesOf(by, cellAt(by, at));
        for (int k = list.x; k < list.y; k++) {
            real2 span = gridRoots(ray, leafAt(k).x);
            at = isInside(span, at) ? span.y : at;
        }
        if (at == before) break;
    }
    real next = at;
    if (at == 0.0) {
        next = firstEntry(ray, by);
        for (int j = 0; j < count; j++) next = spans[j].x > 0.0 ? min(next, spans[j].x) : next;
        if (!nearer(next, object, nearest)) return;
    }
#ifdef OWNERS
    ivec2 owner = ownerAmong(ray, ivec2(core.x, core.y), next, ivec2(0, LAST_PLACE));
    owner = ownerAmong(ray, leavesOf(by, cellAt(by, next)), next, owner);
    nearest = Nearest(next, owner.x, object);
#else
    nearest = Nearest(next, 1, object);
#endif
}
