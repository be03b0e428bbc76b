// He's model: reflection by a rough surface in wave optics (He, Torrance, Sillion and Greenberg 1991).
// Provides he(), heMirrored(), with two corrections of the paper, as in Westin's implementation: shadowing with its
// e^(-q^2), and tau over the wavelength.
// N, L and V are unit vectors in view space: the normal on the viewer's side, and the directions to the light and to
// the viewer; N.L > 0. The lengths sigma0 (height), tau (correlation) and the wavelengths have one unit.
// Needs the generated fresnel(), which calls the Fresnel form that the material chooses.
//
// he() is f cos(theta_i): the diffuse part rho / pi plus the directional diffuse part, per colour channel with its own
// wavelength lambda, with v = L + V:
//     f = ks F G S D / (pi N.L N.V)
//     G = (v.v / v.N)^2
//     D = pi^2 tau^2 / (4 lambda^2) sum over m >= 1 of g^m e^-g / (m! m) exp(-vxy^2 pi^2 tau^2 / (lambda^2 m))
//     g = (2 pi sigma / lambda (N.L + N.V))^2
// sigma = sigma0 / sqrt(1 + W) is the height of the unshadowed parts, W Lambert's function of ((K_L + K_V)^2 / (8 pi)),
// K = tan(theta) erfc(q) and q = tau / (2 sigma0 tan(theta)).
// In the paper, G has products of the polarisations s and p; each is |L x V|^2, and they cancel.
// For large g this is the geometric optics of Beckmann's distribution with alpha = 2 sigma / tau.
//
// heMirrored() is the third part, the coherent one: the factor of the radiance from the mirror direction.
//
// Numerics: g^m e^-g / m! is Poisson's probability of m. It comes from Loader's deviance (2000), because powers lose
// all digits: m log g - g cancels for a large g. The sum runs over the terms within HALF standard deviations of the
// largest term. If these are more than `terms`, it takes terms at equal steps, and multiplies by the step: samples of a
// bell curve at steps up to its width add up to its integral. So the default of 64 terms serves any g, with a relative
// error of 6e-6; 32 terms reach 1e-3, 24 reach 1e-2, 16 reach 0.2. The paper sums the first terms, of which there must
// be more than g. The result is finite up to the horizon, as both divisions by cosines are done analytically.

#include "brdf/erfc.glsl"
#include "materials.glsl"

const float HE_PI = 3.14159265;
const float HE_TINY = 1e-30;

// q of a direction with the cosine mu and its sine. Limit: 20, where erfc(q) and exp(-q^2) are 0 in float32.
float heSteepness(Material m, float mu, float sine) {
    return min(m.tau * mu / max(2.0 * m.sigma0 * sine, HE_TINY), 20.0);
}

// S1 / mu, the shadowing of a direction over its cosine mu: (1 - erfc(q) / 2) / ((1 + Lambda) mu), Lambda = (exp(-q^2)
// / (sqrt(pi) q) - erfc(q)) / 2.
float heShadowing(Material m, float mu, float sine) {
    const float FLAT = 1e-12; // less than any N.V of unit float32 vectors; the product for L and V stays finite
    float q = heSteepness(m, mu, sine), inLight = 1.0 - 0.5 * erfc(q);
    return inLight / max(mu * inLight + 0.56418958 * m.sigma0 * sine / m.tau * exp(-q * q), FLAT);
}

// 1 + W, for the cosines and sines of L and V. Newton's method for log(w) + w = log(z) (Iacono and Boyd 2017) is exact
// to float32 after three steps.
float heShadowed(Material m, vec2 mu, vec2 sine) {
    const float LEAST = 1e-18; // the smallest divisor: the square of its reciprocal is finite
    float z = 0.0;
    for (int i = 0; i < 2; i++)
        z += sine[i] / max(mu[i], LEAST) * erfc(heSteepness(m, mu[i], sine[i]));
    z *= z / (8.0 * HE_PI);
    float w = log(1.0 + z);
    for (int i = 0; i < 4; i++)
        w *= (1.0 + log(max(z, HE_TINY) / max(w, HE_TINY))) / (1.0 + w);
    return 1.0 + w;
}

// log(m!) - log(sqrt(2 pi m) (m / e)^m), m >= 1: a minimax fit of this project in 1 / m, with an error of 7e-8.
float heStirling(float m) {
    float x = 1.0 / m;
    float p = -0.00282896713 + x * (0.000187374939 + x * (0.00058458614 - x * 0.000219535557));
    return x * (0.0833332655 + x * (4.67525307e-06 + x * p));
}

// Poisson's probability of m = g + d for the mean g.
float hePoisson(float g, float d, float m) {
    const float CLOSE = 0.2; // below this |v|, the next term of the series is v^9 / 11, less than 1e-7 of the sum
    float v = d / (g + m), v2 = v * v;
    float series = d * v + 2.0 * m * v * v2 * (1.0 / 3.0 + v2 * (1.0 / 5.0 + v2 * (1.0 / 7.0 + v2 / 9.0)));
    float deviance = abs(v) < CLOSE ? series : m * log(m / g) - d;
    return exp(-deviance - heStirling(m)) / sqrt(2.0 * HE_PI * m);
}

// The sum of g^m e^-g / (m! m) exp(-b / m) over m >= 1, divided by g.
float heSum(float g, float b, float terms) {
    const float HALF = 6.0;
    if (g < 1e-6) {
        // The first two terms suffice: the third, g^2 / 18 e^(-b / 3), is below float32's resolution.
        return exp(-b) + 0.25 * g * exp(-0.5 * b);
    }
    // The largest term is at m = y g with y^2 log(y) = b / g^2. Newton's method starts with a y that is too large, and
    // approaches the solution from above.
    float c = b / (g * g), y = 1.0 + min(c, sqrt(c));
    for (int i = 0; i < 5; i++)
        y -= (y * y * log(y) - c) / (2.0 * y * log(y) + y);
    float top = max(floor(g * y + 0.5), 1.0), deviation = sqrt(top);
    // The ranges on both sides of it. The upper one is larger: for a small mean, Poisson's distribution is skewed.
    float below = min(HALF * deviation, top - 1.0), above = HALF * deviation + 10.0;
    float apart = max((below + above) / terms, 1.0), first = top - g - (apart > 1.0 ? below : floor(below));
    float sum = 0.0;
    for (float d = first; d <= top - g + above; d += apart) {
        float m = g + d;
        sum += hePoisson(g, d, m) / m * exp(-b / m);
    }
    return sum * apart / g;
}

vec3 he(Material m, vec3 N, vec3 L, vec3 V) {
    vec3 v = L + V, vxy = cross(N, v);
    vec2 mu = vec2(dot(N, L), max(dot(N, V), 0.0)), sine = vec2(length(cross(N, L)), length(cross(N, V)));
    float vz = mu.x + mu.y, vv = dot(v, v), correlation = HE_PI * HE_PI * m.tau * m.tau;
    vec3 lambda2 = m.wavelength * m.wavelength;
    vec3 height = 4.0 * HE_PI * HE_PI * m.sigma0 * m.sigma0 / (heShadowed(m, mu, sine) * lambda2);
    vec3 g = height * vz * vz, b = correlation * dot(vxy, vxy) / lambda2;
    vec3 sum = vec3(heSum(g.x, b.x, m.terms), heSum(g.y, b.y, m.terms), heSum(g.z, b.z, m.terms));
    vec3 GD = vv * vv * 0.25 * correlation / lambda2 * height * sum;
    float S = heShadowing(m, mu.x, sine.x) * heShadowing(m, mu.y, sine.y);
    vec3 F = fresnel(m, min(0.5 * sqrt(vv), 1.0));
    return mu.x * (0.31830989 * m.rho + m.ks * F * GD * (S / HE_PI));
}

vec3 heMirrored(Material m, vec3 N, vec3 V) {
    float mu = clamp(dot(N, V), 0.0, 1.0), sine = length(cross(N, V)), S1 = mu * heShadowing(m, mu, sine);
    vec3 rough = 4.0 * HE_PI * m.sigma0 * mu / m.wavelength;
    return m.ks * fresnel(m, mu) * exp(-rough * rough / heShadowed(m, vec2(mu), vec2(sine))) * S1 * S1;
}
