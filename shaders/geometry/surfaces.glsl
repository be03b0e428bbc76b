// The scene's primitives, spheres and planes, in view space.
// Provides struct Surface, surfaceOf(), firstPlane, indexOf().
//
// A surface's index counts the spheres first, then the planes; firstPlane is the number of spheres.
// The host defines HAS_SPHERES and HAS_PLANES if there are any, and SPHERES and SURFACES, how many there are
// of one and both. For large scenes it defines LISTS instead: the text then does not depend on their number. The few
// surfaces that a text names itself come from the vertex shader (draw.glsl).
//
// A hit says which surface it is on in one number, `mat`: the surface's index + 1, negative where the ray
// comes out of the primitive; 0 for no surface. So the hit's root is known again without comparing distances.

#include "geometry/real.glsl"

struct Surface {
    // A sphere: center, radius. A plane: unit outward normal, offset: solid where dot(normal, x) <= offset.
    real4 shape;
    // .xyz for cameraSlope(); .w of a sphere: the power of the camera's position; of a plane: its object's number.
    real4 coarse;
    real4 fine;    // .xyz for cameraSlope(); .w: sameAs()
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
uniform samplerBuffer numbers;  // 4 texels for each surface: shape, coarse, fine, and the number of its object

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
// mat is not 0.
int indexOf(int mat) {
    return abs(mat) - 1;
}
#endif
