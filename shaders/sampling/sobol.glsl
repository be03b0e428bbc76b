// Sample points on sphere lights: scrambled Sobol' points, different ones for each pixel and light.
// Provides sobolPoint(): a point in [0, 1)^2 for each index.
//
// They are Sobol' points (1967, the first two dimensions, a (0, 2)-sequence in base 2) with Owen's nested scrambling,
// by hashing as in Burley 2020, "Practical hash-based Owen scrambling". The host orders the indices (light_index() in
// raytracer/scene/sequences.py). So of a pixel's first 2^n points each of the 2^n boxes of any shape 2^-i x 2^(i-n)
// holds exactly one, and pairs of a place in the pixel and a point of the light are spread evenly in four dimensions.
// Any two pixels or lights have independent points: the rest of the error is noise, not bands.
//
// Bits are numbered from the lowest. A digit of a point may be scrambled by those before it, so the hash, in
// which a bit depends only on lower ones, is of numbers whose bit i is digit i, and these are reversed at the end.

uint reversed(uint x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// A permutation in which each bit is changed or not by what is below it: the one of Laine and Karras 2011, with the
// steps that Vegdahl found to do it better (2021, "Building a better LK hash").
uint scrambled(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The digits of Sobol's second dimension from the index: digit j is the sum, modulo 2, of the bits k with
// binomial(k, j) odd, that is of those k that have all the bits of j. So bit after bit of k may be left out.
uint pascal(uint x) {
    x ^= (x >> 1) & 0x55555555u;
    x ^= (x >> 2) & 0x33333333u;
    x ^= (x >> 4) & 0x0f0f0f0fu;
    x ^= (x >> 8) & 0x00ff00ffu;
    return x ^ (x >> 16);
}

// Three numbers that have nothing to do with each other, or with those of another v: pcg3d of Jarzynski and Olano 2020,
// "Hash functions for GPU rendering".
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

// `pixel` is that of the whole picture, so that it does not matter in which tile it is drawn. The upper 8 bits of
// `index` are the number of the scrambling. The index proper has 24 bits, as many as a point has digits.
vec2 sobolPoint(ivec2 pixel, int light, int index) {
    uvec3 seeds = hashed(uvec3(uvec2(pixel), uint(light) | uint(index) & 0xff000000u));
    // A point's first digits depend on the lowest bits of the seeds. Those of near pixels are alike until higher bits
    // are mixed in: without, points of neighbours are correlated by up to 0.3.
    seeds ^= seeds >> 16;
    uint k = uint(index) & 0xffffffu;
    uvec2 digits = uvec2(scrambled(k, seeds.y), scrambled(pascal(k), seeds.z));
    // 24 bits, which float has, so that none is rounded to 1. OpenGL promises no exact exp2().
    return vec2(reversed(digits.x) >> 8, reversed(digits.y) >> 8) * (1.0 / 16777216.0);
}
