// The scene's primitives, in view space: spheres, bodies and planes.
// Provides struct Surface, surfaceOf(), headerOf(), isBody(), firstPlane, indexOf(). Bodies are all other primitives
// (body.glsl).
//
// A surface's index counts the spheres first, then the bodies, then the planes. The host defines HAS_SPHERES,
// HAS_BODIES and HAS_PLANES if there are any, FIRST_PLANE as the index of the first plane, and SURFACES as the number
// of all surfaces. For large scenes it defines LISTS instead of the numbers, so that the text does not depend on them. The
// vertex shader (draw.glsl) hands on the few surfaces that a text names.
//
// A hit names its surface by one number, `mat`: the surface's index + 1, negative where the ray leaves the primitive; 0
// for no surface. So the code knows the root of a hit without comparing distances.

#include "geometry/real.glsl"

struct Surface {
    // A sphere: center, radius; a body: the same of a ball around it. A plane: unit outward normal, offset: solid where
    // dot(normal, x) <= offset.
    real4 shape;
    // .xyz: for cameraSlope(). .w: for a sphere, the power of the camera's position; for a plane, its object's number.
    // For a body, the header of body.glsl.
    real4 coarse;
    real4 fine;    // .xyz: for cameraSlope(); .w: the coincidence number, sameAs() of terms.glsl; 0 for a body
};

// Whether a sphere or a body is a body. The coincidence numbers are those of its faces.
bool isBody(Surface s) {
#ifdef HAS_BODIES
    return s.fine.w == 0.0;
#else
    return false;
#endif
}

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

// The header of a body (body.glsl).
ivec4 headerOf(int index) {
    return ivec4(texelFetch(numbers, 4 * index + 1));
}

Surface surfaceOf(int index) {
    return Surface(shapeOf(index), texelFetch(numbers, 4 * index + 1), texelFetch(numbers, 4 * index + 2));
}

float objectOf(int index) {
    return texelFetch(numbers, 4 * index + 3).x;
}
#endif

#ifndef LISTS
const int firstPlane = FIRST_PLANE;
#elif !defined(VERTEX)
flat in int firstPlane;
#endif

#ifndef VERTEX
// The index of the surface `mat`, which must not be 0.
int indexOf(int mat) {
    return abs(mat) - 1;
}
#endif
