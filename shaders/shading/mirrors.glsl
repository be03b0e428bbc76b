// The light along a ray that mirrors reflect on, up to BOUNCES of them in a row (Whitted 1980).
// Provides radianceByMirrors(): linear RGB, for a ray `view` that meets the surface `mat` (0: none, and the background
// counts).
// Needs the generated mirrored(), the share that a material mirrors, and rayCSG(), the first surface along a ray.

#include "shading/lighting.glsl"

vec3 radianceByMirrors(int mat, Ray view, vec3 background) {
    vec3 c = vec3(0.0), share = vec3(1.0);
    for (int bounce = 0; bounce <= BOUNCES && share != vec3(0.0); bounce++) {
        if (mat == 0) {
            c += share * background;
            share = vec3(0.0);
        } else {
            c += share * radianceAt(mat, view);
            real3 P;
            Contact on;
            bool isFlat;
            pointAt(mat, view, P, on, isFlat);
            real3 N = mat > 0 ? on.n : -on.n;
            share *= mirrored(hitMaterial(mat), vec3(N), vec3(-view.rd));
            real3 rd = normalize(reflect(view.rd, N));
            view = Ray(P, rd, false, on, Contact(0, real3(0.0)), INF);
            if (share != vec3(0.0) && bounce < BOUNCES) {
                real3 at, normal;
                int met;
                rayCSG(view, at, normal, met);
                mat = met;
            }
        }
    }
    return c;
}
