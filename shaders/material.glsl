// Provides struct Material, materials[]: how each surface reflects, one entry a surface.
// ka, kd, ks are linear RGB >= 0; h is the exponent of the highlight, >= 0.

#include "mat.glsl"

struct Material {
    vec3 ka;
    float h;
    vec3 kd;
    int model;  // which specular model, where a scene has several: see the generated specular()
    vec3 ks;
    int number;  // in the scene's list of materials
};

layout(std140) uniform Materials {
    Material materials[SURFACES];
};
