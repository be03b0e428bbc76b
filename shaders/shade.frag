// The light that reaches the camera from what each pixel sees: the lecture's
// I = ka Ia + sum over lights of S (kd Il max(N.L, 0) + ks Il spec), spec = 0 where N.L <= 0.

#include "material.glsl"
#include "scene.glsl"

uniform isampler2D surface;  // from visibility.frag
uniform vec3 ambient;        // Ia
uniform vec3 background;

out vec4 radiance;

void main() {
    int mat = texelFetch(surface, ivec2(gl_FragCoord.xy), 0).x;
    if (mat == 0) {
        radiance = vec4(background, 1.0);
        return;
    }
    Material m = materials[abs(mat) - 1];
    vec3 I = m.ka * ambient;

#if LIGHTS > 0
    Ray view = cameraRay();
    real3 P, n;
    surfaceAt(mat, view, P, n);
    // Exactly n or -n, so that N.L > 0 and the shadow ray's own root agree on which side L is.
    real3 N = mat > 0 ? n : -n;
    Contact start = contactOf(mat, P);
    start.n = n;
    for (int i = 0; i < LIGHTS; i++) {
        real3 toLight = lights[i].position - P;
        real distance = length(toLight);
        if (distance == 0.0) continue;  // on the surface itself, a light has no direction
        real3 L = toLight / distance;
        Contact end = contactOf(lights[i].on, lights[i].position);
        // A light in the plane itself grazes it: N.L is 0, whatever rounding makes of it.
        bool grazes = start.kind == PLANE && isPlane(end, start.surface);
        float NoL = float(dot(N, L));
        if (grazes || NoL <= 0.0) continue;
        vec3 reflected = m.kd * NoL + m.ks * specular(m, vec3(N), vec3(L), vec3(-view.rd));
#ifdef SHADOWS
        reflected *= shadow(Ray(P, L, false, start, end, distance));
#endif
        I += lights[i].color * reflected;
    }
#endif
    radiance = vec4(I, 1.0);
}
