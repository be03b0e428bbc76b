// Strauss's model (1990), from plastic to metal, whose highlight takes on the surface's colour.
// Provides strauss(): f cos(theta_i), per colour channel, the paper's Qd + Qs. As published it is neither reciprocal
// nor bounded by energy.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0.
//
// The paper's functions F (Fresnel) and G (shadowing) take an angle x in units of pi/2, not a cosine: F(0) = 0,
// F(1) = 1, G(0) = 1, G(1) = 0. Both are differences of reciprocals, which have no correct digits near x = 1, where
// 1 / (x - kg)^2 is 1e4. So the differences are multiplied out, and take both x and y = 1 - x, each accurate where it
// is small.

#include "brdf/angle.glsl"
#include "brdf/lobes.glsl"
#include "materials.glsl"

// F: [1 / (x - kf)^2 - 1 / kf^2] / [1 / (1 - kf)^2 - 1 / kf^2]
float straussF(float x, float y, float kf) {
    float over = (kf - 1.0) / (kf - 1.0 + y);
    return x * (2.0 * kf - x) / (2.0 * kf - 1.0) * over * over;
}

// G: [1 / (1 - kg)^2 - 1 / (x - kg)^2] / [1 / (1 - kg)^2 - 1 / kg^2]
float straussG(float y, float kg) {
    float over = kg / (kg - 1.0 + y);
    return y * (2.0 * (kg - 1.0) + y) / (2.0 * kg - 1.0) * over * over;
}

vec3 strauss(Material m, vec3 N, vec3 L, vec3 V) {
    const float TWO_OVER_PI = 0.63661977;
    float NoL = dot(N, L), NoV = max(dot(N, V), 0.0), sinL = length(cross(N, L)), s = m.smoothness;
    float xL = TWO_OVER_PI * angle(sinL, NoL), yL = TWO_OVER_PI * angle(NoL, sinL);
    float yV = TWO_OVER_PI * angle(NoV, length(cross(N, V)));
    float F = straussF(xL, yL, m.kf), j = F * straussG(yL, m.kg) * straussG(yV, m.kg);

    // The paper's rd = (1 - s^3)(1 - t), rn = (1 - t) - rd, d = 1 - metalness s and
    // color_s = 1 + metalness (1 - F)(color - 1), t the transparency: each as a sum of terms >= 0, which do not cancel.
    float rd = (1.0 - s) * (1.0 + s + s * s) * (1.0 - m.transparency), rn = s * s * s * (1.0 - m.transparency);
    float d = 1.0 - m.metalness + m.metalness * (1.0 - s);
    float rj = min(1.0, rn + (rn + m.kj) * j);
    vec3 color_s = 1.0 - m.metalness + m.metalness * (F + (1.0 - F) * m.color);
    return NoL * d * rd * m.color + rj * mirrorLobe(N, L, V, 3.0 / (1.0 - s)) * color_s;
}
