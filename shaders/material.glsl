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

#ifdef LISTED
uniform sampler2D materials;  // 3 texels each

Material materialAt(int index) {
    int number = int(numberAt(4 * index + 3).x), i = 3 * number;
    vec4 a = texelFetch(materials, texel(i), 0);
    vec4 d = texelFetch(materials, texel(i + 1), 0);
    vec4 s = texelFetch(materials, texel(i + 2), 0);
    return Material(a.rgb, a.w, d.rgb, int(d.w), s.rgb, number);
}
#else
layout(std140) uniform Materials {
    Material materials[SURFACES];  // one entry a surface
};

Material materialAt(int index) {
    return materials[index];
}
#endif

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
