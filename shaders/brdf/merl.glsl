// Measured reflectance: an isotropic table, such as the tables of the MERL database (Matusik et al. 2003).
// Provides merl(): f cos(theta_i), per colour channel, f interpolated linearly between the centres of the table's
// cells.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
// A table has 90 x 90 x 180 cells over the half and difference angles of Rusinkiewicz (1998): theta_h in the square
// root of the angle up to 90 degrees, theta_d in steps of 1 degree, phi_d in steps of 1 degree up to 180 degrees.
// raytracer/scene/materials/merl.py describes the files.
//
// The angles come from S = L + V, without the paper's rotations: phi_d = atan(L . (N x H), (N.V - N.L) |S| / 2) cancels
// nowhere.

#include "brdf/angle.glsl"
#include "brdf/numbers.glsl"
#include "materials.glsl"

uniform sampler3D measured;  // axes phi_d, theta_d, theta_h; the tables follow each other along theta_h

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
    // The place in the table, in cells from the centre of the first cell.
    vec3 at = vec3(90.0 * sqrt(thetaH / (0.5 * PI)), thetaD * (180.0 / PI), phiD * (180.0 / PI)) - 0.5;
    vec3 low = floor(at), part = at - low;
    ivec2 h = clamp(ivec2(low.x, low.x + 1.0), 0, 89), d = clamp(ivec2(low.y, low.y + 1.0), 0, 89);
    ivec2 phi = ivec2(mod(vec2(low.z, low.z + 1.0), 180.0));
    int table = int(m.file);
    vec3 near = mix(merlRow(table, h, d, phi, part, 0), merlRow(table, h, d, phi, part, 1), part.y);
    vec3 far = mix(merlRow(table, h, d, phi, part, 2), merlRow(table, h, d, phi, part, 3), part.y);
    return mix(near, far, part.x) * NoL;
}
