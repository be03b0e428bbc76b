// Measured reflectance: an isotropic table, such as those of the MERL database (Matusik et al. 2003).
// Provides merl(): the table's value, linear between the middles of its cells. raytracer/scene/materials/merl.py says how the table is
// stored.
//
// The half and difference angles (Rusinkiewicz 1998) by what is left of his rotations for S = L + V:
// phi_d = atan(L . (N x H), (N.V - N.L) |S| / 2), which cancels nowhere.

#include "brdf/angle.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

uniform sampler3D measured;  // phi_d, theta_d, theta_h, one table after another

vec3 merlRow(int table, ivec2 h, ivec2 d, ivec2 phi, vec3 part, int i) {
    int z = 90 * table + (i < 2 ? h.x : h.y), y = (i & 1) == 0 ? d.x : d.y;
    vec3 a = texelFetch(measured, ivec3(phi.x, y, z), 0).rgb, b = texelFetch(measured, ivec3(phi.y, y, z), 0).rgb;
    return mix(a, b, part.z);
}

vec3 merl(Material m, vec3 N, vec3 L, vec3 V) {
    float NoL = dot(N, L), NoV = dot(N, V);
    vec3 S = L + V;
    float thetaH = angle(length(cross(N, S)), dot(N, S)), thetaD = angle(length(cross(L, S)), dot(L, S));
    float y = 2.0 * dot(L, cross(N, V)), x = length(S) * (NoV - NoL);
    float phiD = x == 0.0 && y == 0.0 ? 0.0 : atan(y, x);
    if (phiD < 0.0) phiD += PI;
    // In cells, from the middle of the first.
    vec3 at = vec3(90.0 * sqrt(thetaH / (0.5 * PI)), thetaD * (180.0 / PI), phiD * (180.0 / PI)) - 0.5;
    vec3 low = floor(at), part = at - low;
    ivec2 h = clamp(ivec2(low.x, low.x + 1.0), 0, 89), d = clamp(ivec2(low.y, low.y + 1.0), 0, 89);
    ivec2 phi = ivec2(mod(vec2(low.z, low.z + 1.0), 180.0));
    int table = int(m.file);
    vec3 near = mix(merlRow(table, h, d, phi, part, 0), merlRow(table, h, d, phi, part, 1), part.y);
    vec3 far = mix(merlRow(table, h, d, phi, part, 2), merlRow(table, h, d, phi, part, 3), part.y);
    return mix(near, far, part.x) * NoL;
}
