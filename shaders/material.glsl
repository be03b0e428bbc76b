// Provides struct Material, materialAt(), hitMaterial(): how each surface reflects.
// ka, kd, ks are linear RGB >= 0; h is the exponent of the highlight, >= 0.

#include "surfaces.glsl"

struct Material {
    vec3 ka;
    float h;
    vec3 kd;
    int model;  // which specular model, where a scene has several: see the generated specular()
    vec3 ks;
    int number;  // in the scene's list of materials
};

uniform samplerBuffer materials;  // 3 texels for each surface

Material materialAt(int index) {
    vec4 a = texelFetch(materials, 3 * index);
    vec4 d = texelFetch(materials, 3 * index + 1);
    vec4 s = texelFetch(materials, 3 * index + 2);
    return Material(a.rgb, a.w, d.rgb, int(d.w), s.rgb, int(s.w));
}

#ifndef VERTEX
#ifdef ONLY
flat in Material onlyMaterial;  // from the vertex shader (draw.glsl)
#endif

Material hitMaterial(int mat) {
#ifdef ONLY
    return onlyMaterial;
#else
    return materialAt(indexOf(mat));
#endif
}
#endif
