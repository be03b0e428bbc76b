// The parts of the stack machine for programs: CSG trees reduced to the leaves that one cell may meet.
// Provides leafRoots(), mayMeet(), leafHolds(), leafOwner(), joinedHolds(), joinedOwner(), for the generated machine
// and for chain.glsl. A code is leaf << 5 | swapped << 4 | negated << 3 | operation; leaf is a surface's index
// (raytracer/compiler/csg_pruning.py).
//
// The host defines PROGRAM_PLANES if any program has a half-space.
//
// The generated text has two machines. One computes the distance up to which the tree's value at a distance holds
// (walk.glsl). The other finds the owner of the surface at a distance. The owner machine's values are before | after <<
// 1 | mat << 2: whether the ray is inside just before and just after, and the surface as in surfaces.glsl.

#include "geometry/terms.glsl"
#include "csg/walk.glsl"

const int PUSH = 0, AND_LEAF = 1, OR_LEAF = 2, AND = 3, OR = 4, GRID = 6;

real2 leafRoots(Ray ray, int index) {
    Surface s = surfaceOf(index);
#ifdef PROGRAM_PLANES
#if defined(HAS_SPHERES) || defined(HAS_BODIES)
    if (index >= firstPlane) return planeRoots(ray, s);
#else
    return planeRoots(ray, s);
#endif
#endif
#ifdef HAS_SPHERES
#ifdef HAS_BODIES
    if (!isBody(s)) return sphereRoots(ray, s);
#else
    return sphereRoots(ray, s);
#endif
#endif
#ifdef HAS_BODIES
    return bodyRoots(ray, s);
#endif
}

// Whether the ray may meet the leaf before the distance `end`. A ball's radius grows by `blur`. Planes always count.
bool mayMeet(Ray ray, int index, real blur, real end) {
#if defined(HAS_SPHERES) || defined(HAS_BODIES)
    vec4 shape = shapeOf(index);
    bool met = meets(ray, vec4(shape.xyz, shape.w + blur), end);
#else
    bool met = true;
#endif
#ifdef PROGRAM_PLANES
    return met || index >= firstPlane;
#else
    return met;
#endif
}

real leafHolds(Ray ray, int code, real at) {
    real held = holds(leafRoots(ray, code >> 5), at);
    return (code & 8) != 0 ? -held : held;
}

real joinedHolds(int code, real a, real b) {
    int operation = code & 7;
    return operation == AND || operation == AND_LEAF ? min(a, b) : max(a, b);
}

int leafOwner(Ray ray, int code, real at) {
    int surface = code >> 5;
    real2 span = leafRoots(ray, surface);
    bool before = isBefore(span, at), after = isInside(span, at);
    int mat = after ? surface + 1 : -surface - 1;
    if ((code & 8) != 0) {
        before = !before;
        after = !after;
    }
    return mat * 4 + (after ? 2 : 0) + (before ? 1 : 0);
}

bool changes(int owner) {
    return (owner & 1) != ((owner >> 1) & 1);
}

int joinedOwner(int code, int a, int b) {
    int operation = code & 7;
    int values = operation == AND || operation == AND_LEAF ? a & b & 3 : (a | b) & 3;
    int first = (code & 16) != 0 ? b : a, second = (code & 16) != 0 ? a : b;
    return ((changes(first) ? first : second) >> 2) * 4 + values;
}
