// Lafortune's model: a diffuse part and any number of generalised cosine lobes.
// Provides lafortune(): f cos(theta_i), per colour channel, with f = rho / pi plus a sum of lobes
// scale max(cx Lx Vx + cy Ly Vy + cz Lz Vz, 0)^n (Lafortune et al. 1997). z is along N and x along the material's
// tangent.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// The host divides the coefficients cx, cy, cz of a channel by the largest one, and multiplies scale by its n-th power:
// 0.577^10200 would underflow.
//
// With w = (cx Lx, cy Ly, cz Lz) a lobe is (w.V)^n, the product of |w|^n and the n-th power of the cosine between w and
// V. So a lobe around the mirror direction, cx = cy = -1 and cz = 1, is exactly Phong's, for any n. |w|^n comes from
// 1 - |w|^2 = sum (1 - c^2) L^2, which is exact where |w| is near 1.

#include "brdf/cosine_lobe.glsl"
#include "materials.glsl"

#ifdef LOBES
// A lobe of one channel, max(w.V, 0)^n, from w and y = 1 - |w|^2. For y up to FEW, five terms of the series of log(1 -
// y) suffice: the sixth is below 2e-7 of the sum.
float lafortuneLobe(vec3 w, float y, vec3 V, float n) {
    const float FEW = 0.05;
    const float NOTHING = 1e-30; // a smaller |w|^2 counts as 0: intermediate results would underflow
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
    // The tangent's part in the tangent plane. A part shorter than PARALLEL is rounding error: the lobes are then
    // computed as if L were in the plane of x and z, and cx takes the place of cy.
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
