// The material of the surface that a ray hits.
// Provides hitMaterial(mat), mat being the number of the hit in surfaces.glsl. struct Material and materialAt() are
// generated (raytracer/compiler/glsl/materials.py): they have the parameters that the models in use need, and no
// others.

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
