// The light that reaches the camera from what each pixel sees: the lecture's
// I = ka Ia + sum over lights of S (kd Il max(N.L, 0) + ks Il spec), spec = 0 where N.L <= 0.

#include "camera.glsl"
#include "material.glsl"
#include "scene.glsl"

uniform sampler2D normalDepth;  // from visibility.frag
uniform isampler2D surface;
uniform vec3 ambient;           // Ia
uniform vec3 background;

out vec4 radiance;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    int index = texelFetch(surface, pixel, 0).x;
    if (index < 0) {
        radiance = vec4(background, 1.0);
        return;
    }
    Material m = materials[index];
    vec3 I = m.ka * ambient;

#if LIGHTS > 0
    vec4 seen = texelFetch(normalDepth, pixel, 0);
    Ray view = cameraRay();
    vec3 P = view.ro + seen.w * view.rd;
    vec3 n;
    surfaceAt(index, P, n);
    // Exactly n or -n, so that N.L > 0 and the shadow ray's own root agree on which side L is.
    vec3 N = dot(n, seen.xyz) < 0.0 ? -n : n;
    for (int i = 0; i < LIGHTS; i++) {
        vec3 toLight = lights[i].position - P;
        float distance = length(toLight);
        if (distance == 0.0) continue;  // on the surface itself, a light has no direction
        vec3 L = toLight / distance;
        float NoL = dot(N, L);
        if (NoL <= 0.0) continue;
        vec3 reflected = m.kd * NoL + m.ks * specular(m, N, L, -view.rd);
#ifdef SHADOWS
        reflected *= shadow(rayFrom(index, P, n, L), distance);
#endif
        I += lights[i].color * reflected;
    }
#endif
    radiance = vec4(I, 1.0);
}
