// Provides radianceAt(): the light that a surface sends back along a ray, the lecture's
// I = ka Ia + sum over lights of S (kd Il max(N.L, 0) + ks Il spec), spec = 0 where N.L <= 0.
// Needs what the generated scene.glsl provides: specular(), and shadow() if the host defines SHADOWS.

#include "material.glsl"

uniform vec3 ambient;  // Ia

// The ray meets the surface `mat`, which is not 0 (hit.glsl).
vec3 radianceAt(int mat, Ray view) {
    int index = indexOf(mat);
    Material m = materials[index];
    vec3 I = m.ka * ambient;
#if LIGHTS > 0
    real3 P, n;
    surfaceAt(mat, view, P, n);
    // Exactly n or -n, so that N.L > 0 and the shadow ray's own root agree on which side L is.
    real3 N = mat > 0 ? n : -n;
    Contact start = Contact(sameAs(index), n);
    for (int i = 0; i < LIGHTS; i++) {
        real3 toLight = lights[i].position - P;
        real distance = length(toLight);
        if (distance == 0.0) continue;  // on the surface itself, a light has no direction
        real3 L = toLight / distance;
        Contact end = contactOf(lights[i].on, lights[i].position);
        // A light in the plane itself grazes it: N.L is 0, whatever rounding makes of it.
        bool grazes = index >= SPHERES && end.surface == start.surface;
        float NoL = float(dot(N, L));
        if (grazes || NoL <= 0.0) continue;
        vec3 reflected = m.kd * NoL + m.ks * specular(m, vec3(N), vec3(L), vec3(-view.rd));
#ifdef SHADOWS
        reflected *= shadow(Ray(P, L, false, start, end, distance));
#endif
        I += lights[i].color * reflected;
    }
#endif
    return I;
}
