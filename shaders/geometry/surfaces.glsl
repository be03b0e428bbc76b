// The scene's primitives, spheres and planes, in view space.
// Provides struct Surface, surfaceOf(), firstPlane, indexOf().
//
// A surface's index counts the spheres first, then the planes; firstPlane is the number of spheres. The host defines
// HAS_SPHERES and HAS_PLANES if there are any, SPHERES as the number of spheres, and SURFACES as the number of all
// surfaces. For large scenes it defines LISTS instead of the numbers, so that the text does not depend on them. The
// vertex shader (draw.glsl) hands on the few surfaces that a text names.
//
// A hit names its surface by one number, `mat`: the surface's index + 1, negative where the ray leaves the primitive; 0
// for no surface. So the code knows the root of a hit without comparing distances.

#include "geometry/real.glsl"

struct Surface {
    // A sphere: center, radius. A plane: unit outward normal, offset: solid where dot(normal, x) <= offset.
    real4 shape;
    // .xyz: for cameraSlope(). .w: for a sphere, the power of the camera's position; for a plane, its object's number.
    real4 coarse;
    real4 fine;    // .xyz: for cameraSlope(); .w: the coincidence number, sameAs() of terms.glsl
};

#ifdef DOUBLES
layout(std140) uniform Surfaces {
    real4 shapes[SURFACES];
};

layout(std140) uniform CameraTerms {
    real4 coarse[SURFACES];
    real4 fine[SURFACES];
};

Surface surfaceOf(int index) {
    return Surface(shapes[index], coarse[index], fine[index]);
}
#else
uniform samplerBuffer numbers;  // 4 texels for each surface: shape, coarse, fine, and its object's number in .x

vec4 shapeOf(int index) {
    return texelFetch(numbers, 4 * index);
}

Surface surfaceOf(int index) {
    return Surface(shapeOf(index), texelFetch(numbers, 4 * index + 1), texelFetch(numbers, 4 * index + 2));
}

float objectOf(int index) {
    return texelFetch(numbers, 4 * index + 3).x;
}
#endif

#ifndef LISTS
const int firstPlane = SPHERES;
#elif !defined(VERTEX)
flat in int firstPlane;
#endif

#ifndef VERTEX
// The index of the surface `mat`, which must not be 0.
int indexOf(int mat) {
    return abs(mat) - 1;
}
#endif
