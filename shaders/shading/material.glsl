// Provides hitMaterial(): how the surface that a ray hits reflects. struct Material and materialAt() are generated
// (raytracer/reflectance.py), with just what the models in use need.

#include "geometry/surfaces.glsl"
#include "materials.glsl"

#ifdef ONLY_MATERIAL
flat in Material onlyMaterial;  // from the vertex shader (draw.glsl)
#endif

Material hitMaterial(int mat) {
#ifdef ONLY_MATERIAL
    return onlyMaterial;
#else
    return materialAt(indexOf(mat));
#endif
}
