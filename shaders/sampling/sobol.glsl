// Sample points on sphere lights: scrambled Sobol' points, different ones for each pixel and light.
// Provides sobolPoint(): a point in [0, 1)^2 for each index.
//
// The points are Sobol' points (1967; the first two dimensions, a (0, 2)-sequence in base 2) with Owen's nested
// scrambling, by hashing as in Burley 2020, "Practical hash-based Owen scrambling". The host orders the indices
// (light_index() in raytracer/scene/sequences.py). So among a pixel's first 2^n points, each of the 2^n boxes of any
// shape 2^-i x 2^(i-n) holds exactly one point, and pairs of a sample place in the pixel and a point on the light are
// spread evenly in four dimensions. Any two pixels or lights have independent points, so the remaining error is noise,
// not bands.
//
// Bits are numbered from the lowest. Scrambling may change a digit of a point by the digits before it. In a hash, a bit
// depends only on lower bits. So the hash applies to numbers whose bit i is digit i, and the bits are reversed at the
// end.

// The 32 bits in reverse order.
uint reversed(uint x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// A permutation in which the lower bits decide whether each bit is flipped: by Laine and Karras (2011), with Vegdahl's
// better steps (2021, "Building a better LK hash").
uint scrambled(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The digits of Sobol's second dimension from the index: digit j is the sum, modulo 2, of the index's bits k for which
// binomial(k, j) is odd, which means that k has all the bits of j. So the sum can be done for one bit of k after
// another.
uint pascal(uint x) {
    x ^= (x >> 1) & 0x55555555u;
    x ^= (x >> 2) & 0x33333333u;
    x ^= (x >> 4) & 0x0f0f0f0fu;
    x ^= (x >> 8) & 0x00ff00ffu;
    return x ^ (x >> 16);
}

// Three pseudorandom numbers, independent of each other and of the numbers of any other v: pcg3d of Jarzynski and Olano
// 2020, "Hash functions for GPU rendering".
uvec3 hashed(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// The point number `index` on the light number `light` for a pixel. `pixel` counts from the lower left of the whole
// picture, so that tiles do not matter. The upper 8 bits of `index` are the number of the scrambling. The index proper
// has 24 bits, as many as a point has digits.
vec2 sobolPoint(ivec2 pixel, int light, int index) {
    uvec3 seeds = hashed(uvec3(uvec2(pixel), uint(light) | uint(index) & 0xff000000u));
    // A point's first digits depend on the lowest bits of the seeds, which are alike for neighbouring pixels. Mix in
    // higher bits: otherwise the points of neighbours have a correlation of up to 0.3.
    seeds ^= seeds >> 16;
    uint k = uint(index) & 0xffffffu;
    uvec2 digits = uvec2(scrambled(k, seeds.y), scrambled(pascal(k), seeds.z));
    // A float has 24 bits, so no number is rounded to 1. The factor is a constant: OpenGL does not promise exact
    // exp2().
    return vec2(reversed(digits.x) >> 8, reversed(digits.y) >> 8) * (1.0 / 16777216.0);
}
