// Provides spheres[], planes[]: the primitives of the scene's trees, in view space. A surface's
// index counts the spheres first, then the planes. The host defines SPHERES and PLANES, how many
// there are of each, and SURFACES, their sum.

#include "real.glsl"

layout(std140) uniform Surfaces {
#if SPHERES > 0
    real4 spheres[SPHERES];  // center, radius
#endif
#if PLANES > 0
    real4 planes[PLANES];    // unit outward normal, offset: solid where dot(normal, x) <= offset
#endif
};
