// Provides angle(): between two vectors of any length, at most a right angle, to some units in the last place.
//
// Not by acos, which has lost small angles; and by a series instead of GLSL's atan, for which drivers use a
// polynomial good to 1e-6 or so. Half angles until the tangent is small, then artan x = x - x^3 / 3 + ...

float angle(vec3 a, vec3 b) {
    float y = length(cross(a, b)), x = max(dot(a, b), 0.0);
    // tan(t / 2) = y / (x + sqrt(x^2 + y^2)), twice: below tan(pi / 8).
    float r = sqrt(x * x + y * y);
    float half_ = y / max(x + r, 1e-30);
    float z = half_ / (1.0 + sqrt(1.0 + half_ * half_));
    float z2 = z * z;
    float series = 1.0 + z2 * (-1.0 / 3.0 + z2 * (1.0 / 5.0 + z2 * (-1.0 / 7.0 + z2 * (1.0 / 9.0
        + z2 * (-1.0 / 11.0 + z2 * (1.0 / 13.0 - z2 / 15.0))))));
    return 4.0 * z * series;
}
