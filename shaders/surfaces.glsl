// Provides shapeAt(), coarseAt(), fineAt(), firstPlane, indexOf(): the scene's primitives, in view space.
//
// A surface's index counts the spheres first, then the planes; firstPlane is how many spheres there are.
// The host defines HAS_SPHERES and HAS_PLANES if there are any, and SPHERES and SURFACES, how many there are
// of one and both; or LISTED if they are so many that they are held in a texture.
//
// A hit says which surface it is on in one number, `mat`: the surface's index + 1, negative where the ray
// comes out of the primitive; 0 for no surface. So the hit's root is known again without comparing distances.
// Where the host knows that rays meet only one surface, it defines ONLY as its index.

#include "real.glsl"

#ifdef LISTED
uniform int firstPlane;
uniform sampler2D numbers;  // 4 texels for each surface: shape, coarse, fine, and its material's number

vec4 numberAt(int i) {
    return texelFetch(numbers, ivec2(i % ROW, i / ROW), 0);
}

vec4 shapeAt(int index) {
    return numberAt(4 * index);
}

vec4 coarseAt(int index) {
    return numberAt(4 * index + 1);
}

vec4 fineAt(int index) {
    return numberAt(4 * index + 2);
}
#else
const int firstPlane = SPHERES;

layout(std140) uniform Surfaces {
    real4 shapes[SURFACES];
};

layout(std140) uniform CameraTerms {
    real4 coarse[SURFACES];
    real4 fine[SURFACES];
};

// A sphere: center, radius. A plane: unit outward normal, offset: solid where dot(normal, x) <= offset.
real4 shapeAt(int index) {
    return shapes[index];
}

// .xyz for cameraSlope(); .w of a sphere: the power of the camera's position; of a plane: its object's number.
real4 coarseAt(int index) {
    return coarse[index];
}

// .xyz for cameraSlope(); .w: sameAs().
real4 fineAt(int index) {
    return fine[index];
}
#endif

// mat is not 0.
int indexOf(int mat) {
#ifdef ONLY
    return ONLY;
#else
    return abs(mat) - 1;
#endif
}
