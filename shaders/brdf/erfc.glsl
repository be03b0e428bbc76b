// The complementary error function, to the last bits of float32.
// Provides erfc(x), for x >= 0. Relative error: 1e-7, plus 2 x^2 2^-24 from exp(-x^2).
// Method: (1 + 2 x) exp(x^2) erfc(x) as a polynomial in (x - 3) / (x + 3), after Shepherd and Laframboise (1981). The
// coefficients are a minimax fit of this project on [0, 20], with an error of 1.2e-8.

float erfc(float x) {
    float t = (x - 3.0) / (x + 3.0);
    float p = -0.0238456724 + t * (0.00246260844 + t * (0.00203299152 + t * (-0.000633179624 + t * -0.000200377037)));
    p = 1.25300807 + t * (-0.135621069 + t * (-0.0475635 + t * (0.129643954 + t * (-0.119257614 + t * (0.0683215757 + t * p)))));
    return p / (1.0 + 2.0 * x) * exp(-x * x);
}
