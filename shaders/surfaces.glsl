// Provides spheres[], planes[], surfaceAt(), rayFrom(): the primitives of the scene's trees, in
// view space. A surface's index counts the spheres first, then the planes. The host defines
// SPHERES and PLANES, how many there are of each.

#include "ray.glsl"

layout(std140) uniform Surfaces {
#if SPHERES > 0
    vec4 spheres[SPHERES];  // center, radius
#endif
#if PLANES > 0
    vec4 planes[PLANES];    // unit outward normal, offset: solid where dot(normal, x) <= offset
#endif
};

// A point that lies on surface `index` up to rounding, brought onto it where that is more precise,
// and the outward normal there.
void surfaceAt(int index, inout vec3 P, out vec3 n) {
#if SPHERES > 0
#if PLANES > 0
    if (index < SPHERES)
#endif
    {
        vec4 sphere = spheres[index];
        n = normalize(P - sphere.xyz);
        // P is rounded in units of its own size, a point made from the centre in units of the
        // radius: beside a huge sphere the former is the better one.
        if (sphere.w < length(P)) P = sphere.xyz + sphere.w * n;
        return;
    }
#endif
#if PLANES > 0
    vec4 plane = planes[index - SPHERES];
    n = plane.xyz;
    P -= (dot(n, P) - plane.w) * n;
#endif
}

// The ray from P, which lies on surface `index` with outward normal n, along the unit vector rd.
Ray rayFrom(int index, vec3 P, vec3 n, vec3 rd) {
#if SPHERES > 0
#if PLANES > 0
    if (index < SPHERES)
#endif
        return Ray(P, rd, true, spheres[index], true, n);
#endif
#if PLANES > 0
    return Ray(P, rd, true, planes[index - SPHERES], false, n);
#endif
}
