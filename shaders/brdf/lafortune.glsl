// Lafortune's model: a diffuse part and any number of generalised cosine lobes.
// Provides lafortune(): rho / pi and lobes scale max(cx Lx Vx + cy Ly Vy + cz Lz Vz, 0)^n, each channel with its
// own (Lafortune et al. 1997); z is along N, x along the material's tangent. The host has divided the
// coefficients by the largest of a channel, and put its power into the scale: 0.577^10200 underflows.
//
// With w = (cx Lx, cy Ly, cz Lz) a lobe is (w.V)^n = |w|^n cos^n of the angle between w and V: so a lobe around the
// mirror direction, cx = cy = -1, cz = 1, is exactly phong's, for any n. And |w|^n is made of
// 1 - |w|^2 = sum (1 - c^2) L^2, which is exact where |w| is near 1.

#include "brdf/cosine_lobe.glsl"
#include "materials.glsl"

#ifdef LOBES
// A lobe of one channel, max(w.V, 0)^n, of w and 1 - |w|^2. Up to FEW, five terms of the series of log(1 - y) suffice:
// the sixth is below 2e-7 of it.
float lafortuneLobe(vec3 w, float y, vec3 V, float n) {
    const float FEW = 0.05;
    const float NOTHING = 1e-30; // of |w|^2; below, it underflows on the way
    float ww = dot(w, w);
    if (n == 0.0 || ww < NOTHING) return n == 0.0 ? 1.0 : 0.0;
    float series = -y * (1.0 + y * (0.5 + y * (1.0 / 3.0 + y * (0.25 + y * 0.2))));
    float length_n = y > 0.0 ? exp(0.5 * n * (y < FEW ? series : log(ww))) : 1.0;
    return length_n * cosineLobe(w, V, n);
}
#endif

vec3 lafortune(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L);
    vec3 sum = 0.31830989 * m.rho;
#ifdef LOBES
    vec3 normal = NoL * N;
#ifdef ANISOTROPIC
    // The tangent's part in the surface; less of it than PARALLEL is rounding, and then the lobes are as if L were in
    // the plane of x and z: cx stands for cy.
    const float PARALLEL = 1e-6;
    vec3 T = normalize(m.tangent);
    T -= dot(N, T) * N;
    vec3 along = L - normal, across = vec3(0.0);
    if (length(T) > PARALLEL) {
        T = normalize(T);
        vec3 B = cross(N, T);
        along = dot(L, T) * T;
        across = dot(L, B) * B;
    }
    vec3 squares = vec3(dot(along, along), dot(across, across), NoL * NoL);
#else
    vec3 l = cross(N, L);
    vec2 squares = vec2(dot(l, l), NoL * NoL);
#endif
    for (int i = 0; i < LOBES; i++) {
        Lobe lobe = m.lobes[i];
        vec3 value;
        for (int k = 0; k < 3; k++) {
            float cx = lobe.cx[k], cz = lobe.cz[k];
#ifdef ANISOTROPIC
            float cy = lobe.cy[k];
            vec3 w = cx * along + cy * across + cz * normal;
            float y = dot(vec3((1.0 - cx) * (1.0 + cx), (1.0 - cy) * (1.0 + cy), (1.0 - cz) * (1.0 + cz)), squares);
#else
            vec3 w = cx * L + (cz - cx) * normal;
            float y = dot(vec2((1.0 - cx) * (1.0 + cx), (1.0 - cz) * (1.0 + cz)), squares);
#endif
            value[k] = lafortuneLobe(w, y, V, lobe.n[k]);
        }
        sum += lobe.scale * value;
    }
#endif
    return NoL * sum;
}
