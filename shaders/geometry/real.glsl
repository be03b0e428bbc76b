// The number types of all geometry: float, or double for 64 bits.
// Provides real, real2, real3, real4. They are double and its vectors if the host defines DOUBLES (--precision 64, GLSL
// 400). No other file names a double; colours and reflectance are always float.

#ifdef DOUBLES
#define real double
#define real2 dvec2
#define real3 dvec3
#define real4 dvec4
#else
#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
#endif
