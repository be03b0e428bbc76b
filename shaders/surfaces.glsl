// Provides struct Surface, surfaceOf(), texel(), firstPlane, indexOf(): the scene's primitives, in view space.
//
// A surface's index counts the spheres first, then the planes; firstPlane is how many spheres there are.
// The host defines HAS_SPHERES and HAS_PLANES if there are any, and SPHERES and SURFACES, how many there are
// of one and both; or LISTED if they are so many that they are held in a texture. Those few that a text names
// itself it has from the vertex shader (draw.glsl).
//
// A hit says which surface it is on in one number, `mat`: the surface's index + 1, negative where the ray
// comes out of the primitive; 0 for no surface. So the hit's root is known again without comparing distances.

#include "real.glsl"

struct Surface {
    real4 shape;   // a sphere: center, radius; a plane: unit outward normal, offset: solid where dot(normal, x) <= offset
    real4 coarse;  // .xyz for cameraSlope(); .w of a sphere: the power of the camera's position; of a plane: its object's number
    real4 fine;    // .xyz for cameraSlope(); .w: sameAs()
};

#ifdef LISTED
uniform sampler2D numbers;  // 4 texels for each surface: shape, coarse, fine, and its material's number

// Where a texture of so many has the one numbered i: bits, which llvmpipe divides twice as fast as / and %.
ivec2 texel(int i) {
    return ivec2(i & ((1 << ROW_BITS) - 1), i >> ROW_BITS);
}

vec4 numberAt(int i) {
    return texelFetch(numbers, texel(i), 0);
}

Surface surfaceOf(int index) {
    return Surface(numberAt(4 * index), numberAt(4 * index + 1), numberAt(4 * index + 2));
}

#ifndef VERTEX
flat in int firstPlane;
#endif
#else
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

const int firstPlane = SPHERES;
#endif

#ifndef VERTEX
// mat is not 0.
int indexOf(int mat) {
    return abs(mat) - 1;
}
#endif
