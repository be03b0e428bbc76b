// The intersection of a ray with a long chain: an object of many leaves under one operator, by a grid of cells.
// Provides meetGrid(): if the ray meets the object before `nearest`, it sets `nearest` to that surface.
//
// As in chain.glsl, the object is treated as a conjunction, and a leaf is False where the ray is not in it, or for a
// negated leaf, where the ray is in it. The few leaves of the core are tested for every ray. All others are negated:
// from a place where one of them is False, the ray goes on to where that leaf becomes True. It needs only the leaves
// around that place, the list of its cell (raytracer/compiler/chain_grids.py). All results have the bits of chain.glsl.
//
// If the host defines OWNERS, the result names the surface that the ray meets; otherwise its `mat` is 1 for any
// surface. If all leaves of a grid are boxes with the same three normals, for all grids of the scene, it defines
// BOX_GRIDS. The code then computes a ray's terms with the normals once for each grid.

#include "csg/program.glsl"

// For each grid: the three rows of the map from view space to the grid (float bits); the number of cells along each
// axis, and where its cells begin in `gridLeaves`; where its core begins and ends there, whether it is a union, and the
// index of one of its leaves.
uniform isamplerBuffer grids;
// For each cell, where its leaves begin and end. For each leaf, its code (program.glsl) and its place in the tree.
uniform isamplerBuffer gridLeaves;

// The largest number of leaves in a core, CORE of raytracer/compiler/long_chains.py.
const int CORE = 4;
// An owner: the `mat` of a leaf, and its place in the tree.
const ivec2 NO_OWNER = ivec2(0, 0x7fffffff);

// A ray in the coordinates of a grid, whose cells have the side 1.
struct GridRay {
    vec3 ro;
    vec3 rd;
    ivec4 shape;   // the number of cells along each axis, and where the cells begin
#ifdef BOX_GRIDS
    vec3 slopes;   // of the normals of the boxes
    vec3 heights;  // of the ray's origin along the normals; 0 for a camera ray
    int texel;     // the first texel of a box in `bodies`, less BOX times its index
#endif
};

ivec2 leafAt(int i) {
    return texelFetch(gridLeaves, i).xy;
}

// Leaf k of a list that ends at `end`; at the end, the leaf of the index `other`. For an empty list, the loops below
// take one leaf, without its roots: llvmpipe computes one more round of a loop that tests for the end first.
ivec2 listed(int k, int end, int other) {
    return k < end ? leafAt(k) : ivec2(other << 5, 0);
}

// Where the leaves of a cell begin and end; nothing outside the grid.
ivec2 leavesOf(GridRay by, ivec3 cell) {
    if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, by.shape.xyz))) return ivec2(0);
    return leafAt(by.shape.w + (cell.z * by.shape.y + cell.y) * by.shape.x + cell.x);
}

ivec3 cellAt(GridRay by, real t) {
    return ivec3(floor(clamp(by.ro + t * by.rd, -1.0, 2048.0)));  // the clamp keeps numbers in the range of int
}

#ifdef BOX_GRIDS
const int BOX = 12;  // the texels of a box: four for each pair of faces (body.glsl)

// Set the terms of a ray with one of the normals. `texel` is the first texel of a pair of faces.
void setTerms(Ray ray, int texel, out real slope, out real height) {
    real3 normal = bodyAt(texel).xyz;
    slope = dot(normal, ray.rd);
    height = dot(normal, ray.ro);
#ifndef ORTHOGRAPHIC
    if (ray.ofCamera) {
        slope = cameraSlope(bodyAt(texel + 2).xyz, bodyAt(texel + 3).xyz);
        height = 0.0;
    }
#endif
}

// The span of a pair of faces, with the bits of slabAt() of body.glsl.
real2 boxSpan(Ray ray, int texel, real slope, real height) {
    vec4 faces = bodyAt(texel + 1);
    return slabSpan(ray, faces.w - height, faces.x + height, slope, ivec2(faces.yz));
}
#endif

// The roots of a leaf. Roots that round to one number are no surface.
real2 gridRoots(Ray ray, GridRay by, int code) {
#ifdef BOX_GRIDS
    int texel = by.texel + BOX * (code >> 5);
    real2 x = boxSpan(ray, texel, by.slopes.x, by.heights.x);
    real2 y = boxSpan(ray, texel + 4, by.slopes.y, by.heights.y);
    real2 z = boxSpan(ray, texel + 8, by.slopes.z, by.heights.z);
    real2 span = real2(max(max(x.x, y.x), z.x), min(min(x.y, y.y), z.y));
#else
    real2 span = leafRoots(ray, code >> 5);
#endif
    return span.x < span.y ? span : real2(INF, -INF);
}

// The ray in the grid with the first texel `header`. `leaf` is the index of one of its leaves.
GridRay gridRay(Ray ray, int header, int leaf) {
    vec4 x = intBitsToFloat(texelFetch(grids, header)), y = intBitsToFloat(texelFetch(grids, header + 1));
    vec4 z = intBitsToFloat(texelFetch(grids, header + 2));
    GridRay by;
    by.ro = vec3(dot(x.xyz, ray.ro) + x.w, dot(y.xyz, ray.ro) + y.w, dot(z.xyz, ray.ro) + z.w);
    by.rd = vec3(dot(x.xyz, ray.rd), dot(y.xyz, ray.rd), dot(z.xyz, ray.rd));
    by.shape = texelFetch(grids, header + 3);
#ifdef BOX_GRIDS
    int texel = int(surfaceOf(leaf).coarse.x);
    setTerms(ray, texel, by.slopes.x, by.heights.x);
    setTerms(ray, texel + 4, by.slopes.y, by.heights.y);
    setTerms(ray, texel + 8, by.slopes.z, by.heights.z);
    by.texel = texel - BOX * leaf;
#endif
    return by;
}

// The cell in which the ray enters the grid, or starts.
ivec3 firstCell(GridRay by) {
    // Along an axis with the slope 0, begins is 0.
    vec3 towards = sign(by.rd);
    vec3 begins = (vec3(by.shape.xyz) * max(-towards, 0.0) - by.ro) * towards / max(abs(by.rd), 1e-30);
    return clamp(cellAt(by, max(max(begins.x, max(begins.y, begins.z)), 0.0)), ivec3(0), by.shape.xyz - 1);
}

// Go on to the next cell along the ray. Return where the ray leaves the present one.
real leaveCell(GridRay by, inout ivec3 cell) {
    vec3 towards = sign(by.rd);
    vec3 ends = (vec3(cell) + max(towards, 0.0) - by.ro) * towards / max(abs(by.rd), 1e-30);
    ends = mix(ends, vec3(INF), equal(towards, vec3(0.0)));
    real end = min(ends.x, min(ends.y, ends.z));
    ivec3 way = ivec3(towards);
    cell += end == ends.x ? ivec3(way.x, 0, 0) : end == ends.y ? ivec3(0, way.y, 0) : ivec3(0, 0, way.z);
    return end;
}

// The first in the tree of two owners of a surface: `first`, and a leaf if it has a root at that distance.
ivec2 firstOwner(ivec2 leaf, real2 span, real at, ivec2 first) {
    int mat = span.x == at ? (leaf.x >> 5) + 1 : -(leaf.x >> 5) - 1;
    return (span.x == at || span.y == at) && leaf.y < first.y ? ivec2(mat, leaf.y) : first;
}

void meetGrid(Ray ray, int number, int object, inout Nearest nearest) {
    ivec4 core = texelFetch(grids, 5 * number + 4);
    GridRay by = gridRay(ray, 5 * number, core.w);
    real last = INF;  // from here on a leaf of the core is False for good
    // For the core: where a negated leaf is False; for any other leaf, where it is True, with swapped ends. The loops
    // over `spans` have constant bounds: then llvmpipe keeps the array in registers, and a ray takes a fifth less time.
    real2 spans[CORE];
    for (int j = 0; j < CORE; j++) spans[j] = real2(INF, -INF);
    // Up to here a leaf among those tested is False. If the ray walks: from here on.
    real at = 0.0;
    int k = core.x;
    do {
        int code = listed(k, core.y, core.w).x ^ core.z * 8;
        real2 span = k < core.y ? gridRoots(ray, by, code) : real2(INF, -INF);
        bool within = k < core.y && (code & 8) == 0;
        at = within ? max(at, span.x) : at;
        last = within ? min(last, span.y) : last;
        for (int j = 0; j < CORE; j++) spans[j] = k - core.x == j ? (within ? span.yx : span) : spans[j];
        k++;
    } while (k < core.y);
    // A ray that starts in the conjunction walks from cell to cell, to where the first leaf becomes False. Both ways
    // are one loop, because llvmpipe computes at least one round of each loop.
    bool walks = false;
    ivec3 cell = ivec3(0);
    ivec2 owner = NO_OWNER;
    for (;;) {
        if (!walks && (at >= last || !nearer(at, object, nearest))) return;
        real before = at;
        for (int j = 0; j < CORE; j++) at = !walks && isInside(spans[j], at) ? spans[j].y : at;
        if (!walks) cell = cellAt(by, at);
        if (at != before) owner = NO_OWNER;
        ivec2 list = leavesOf(by, cell);
        k = list.x;
        do {
            ivec2 leaf = listed(k, list.y, core.w);
            real2 span = k < list.y ? gridRoots(ray, by, leaf.x) : real2(INF, -INF);
            bool moves = walks ? span.x > 0.0 && span.x < at : isInside(span, at);
            if (moves) {
                at = walks ? span.x : span.y;
                owner = NO_OWNER;
            }
            owner = firstOwner(leaf, span, at, owner);
            k++;
        } while (k < list.y);
        if (walks) {
            if (list == ivec2(0) || leaveCell(by, cell) >= min(at, nearest.t)) break;
        } else if (at == before) {
            if (at > 0.0) break;
            walks = true;
            cell = firstCell(by);
            owner = NO_OWNER;
            at = INF;
            for (int j = 0; j < CORE; j++) at = spans[j].x > 0.0 ? min(at, spans[j].x) : at;
        }
    }
    if (!nearer(at, object, nearest)) return;
#ifdef OWNERS
    for (int j = 0; j < CORE; j++) {
        // Beyond the core are other leaves, but their spans here have no roots.
        ivec2 leaf = leafAt(core.x + j);
        owner = firstOwner(leaf, real2(min(spans[j].x, spans[j].y), max(spans[j].x, spans[j].y)), at, owner);
    }
    nearest = Nearest(at, owner.x, object);
#else
    nearest = Nearest(at, 1, object);
#endif
}
