// The light that a surface sends back along a ray: Le + ka Ia + sum over lights of S Il f cos(theta_i).
// Provides radianceAt(): linear RGB. With f cos(theta_i) = kd N.L + ks spec it is the lecture's formula. S is the
// shadow factor: 0 for an occluded light, 1 for a visible one, or between.
// Needs the generated reflected(), which is f cos(theta_i), and shadow() if the host defines SHADOWS.

#include "shading/material.glsl"

flat in vec3 ambient;  // Ia

#ifdef SPHERE_LIGHTS
flat in int lightIndex;  // the index of the sample point on each light (sobol.glsl)
#endif

#if LIGHTS > 0
// The light of a light source, number i, that a point P sends back in the direction V. P is on the surface `mat`
// (surfaces.glsl), `start` is its face there, and V is unit; all in view space.
vec3 reflectedOf(Light light, int i, Material m, int mat, real3 P, Contact start, bool isFlat, vec3 V) {
    // N is exactly n or -n, so that the sign of N.L and the shadow ray's own root agree on the side of L.
    real3 N = mat > 0 ? start.n : -start.n;
    real3 toLight = light.position - P;
    real distance = length(toLight);
    real3 L = toLight * (1.0 / distance);
    Contact end = Contact(light.on, light.n);
#ifdef FALLOFF
    light.color = irradiance(light, distance);
#endif
#ifdef SPHERE_LIGHTS
    if (light.radius > 0.0) {
        LightRay ray = lightRay(light, P, start, sobolPoint(ivec2(gl_FragCoord.xy + tileOrigin), i, lightIndex));
        L = ray.L;
        distance = ray.distance;
        end = ray.end;
        light.color *= ray.weight;
    }
#endif
    // A light in the plane of the face itself grazes it: N.L counts as 0, whatever its rounded value is.
    bool grazes = isFlat && end.surface == start.surface;
    float NoL = float(dot(N, L));
#ifdef DOUBLES
    // The models compute in float32, where N.L of a grazing ray may have the other sign.
    NoL = min(NoL, dot(vec3(N), vec3(L)));
#endif
    // A light on P itself, at distance 0, has no direction.
    if (distance == 0.0 || grazes || NoL <= 0.0) return vec3(0.0);
    vec3 I = light.color * reflected(m, vec3(N), vec3(L), V);
#ifdef SHADOWS
    I *= shadow(Ray(P, L, false, start, end, distance), i);
#endif
    return I;
}
#endif

// The radiance that a ray `view` receives from the surface `mat` that it meets; mat is not 0 (surfaces.glsl).
vec3 radianceAt(int mat, Ray view) {
    Material m = hitMaterial(mat);
    vec3 I = vec3(0.0);
#ifdef AMBIENT
    I += m.ka * ambient;
#endif
#ifdef EMISSION
    I += m.le;
#endif
#if LIGHTS > 0
    real3 P;
    Contact on;
    bool isFlat;
    pointAt(mat, view, P, on, isFlat);
    vec3 V = vec3(-view.rd);
    // Two lights are written out, because a loop would take llvmpipe a third longer; but not with hit lists, because it
    // needs minutes to compile Roth's filters twice in a row.
#if LIGHTS == 1 || (LIGHTS == 2 && !defined(MAX_HITS))
    I += reflectedOf(light0, 0, m, mat, P, on, isFlat, V);
#if LIGHTS == 2
    I += reflectedOf(light1, 1, m, mat, P, on, isFlat, V);
#endif
#else
    for (int i = 0; i < LIGHTS; i++) I += reflectedOf(lights[i], i, m, mat, P, on, isFlat, V);
#endif
#endif
    return I;
}
