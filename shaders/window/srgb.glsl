// The sRGB transfer function (IEC 61966-2-1:1999), both ways.
// Provides srgbFromLinear(), linearFromSrgb(), for values >= 0. Values above 1 stay above 1. The driver's own
// conversion is not used, because drivers differ.

vec3 srgbFromLinear(vec3 c) {
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
}

vec3 linearFromSrgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}
