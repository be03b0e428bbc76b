// Strauss's model (1990), from plastic to metal, whose highlight takes on the surface's colour.
// Provides strauss(): f cos(theta_i) is its Qd + Qs, neither reciprocal nor bounded by energy, as published.
//
// F and G take angles over pi/2, not cosines: F(0) = 0, F(1) = 1, G(0) = 1, G(1) = 0. Both are the literature's
// differences of reciprocals, multiplied out: near x = 1, where 1 / (x - kg)^2 is 1e4, the differences would have no
// digits left. So they take x and y = 1 - x, each exact where it is small.

#include "brdf/angle.glsl"
#include "brdf/lobes.glsl"
#include "materials.glsl"

// [1 / (x - kf)^2 - 1 / kf^2] / [1 / (1 - kf)^2 - 1 / kf^2]
float straussF(float x, float y, float kf) {
    float over = (kf - 1.0) / (kf - 1.0 + y);
    return x * (2.0 * kf - x) / (2.0 * kf - 1.0) * over * over;
}

// [1 / (1 - kg)^2 - 1 / (x - kg)^2] / [1 / (1 - kg)^2 - 1 / kg^2]
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

    // rd = (1 - s^3)(1 - t), rn = (1 - t) - rd, d = 1 - metalness s, color_s = 1 + metalness (1 - F)(color - 1), each
    // as a sum of what is not negative.
    float rd = (1.0 - s) * (1.0 + s + s * s) * (1.0 - m.transparency), rn = s * s * s * (1.0 - m.transparency);
    float d = 1.0 - m.metalness + m.metalness * (1.0 - s);
    float rj = min(1.0, rn + (rn + m.kj) * j);
    vec3 color_s = 1.0 - m.metalness + m.metalness * (F + (1.0 - F) * m.color);
    return NoL * d * rd * m.color + rj * mirrorLobe(N, L, V, 3.0 / (1.0 - s)) * color_s;
}
