// The intersection of a ray with a body: slabs, and at most one curved wall, of which it is the common part.
// Provides bodyRoots(), bodyFace(). All vectors and lengths are in view space. A part of a torus is a body, too.
//
// A body's header is in .coarse of its Surface: its first texel in `bodies`, its number of slabs, its kind of wall, and
// its part of a torus. The host defines HAS_ROUND_WALLS, HAS_CONE_WALLS and HAS_TORI for the kinds in use, and includes
// their files before this one.
// raytracer/compiler/body_texels.py packs the texels:
//     a slab:  the unit normal and the depth of the camera below the high face; the coarse slopes of the normal
//              (camera.glsl) and the depth above the low face; the fine slopes; the coincidence numbers of both faces
//     a wall:  l0 if it is constant, the power of the camera (wall.glsl; 0 if the camera is on the wall, 1 for another
//              camera of a torus), the coincidence number, 0; then for each form its gradient and its value at the
//              camera, the coarse slopes, and the fine slopes

#include "geometry/terms.glsl"
#include "geometry/slab.glsl"

// The kinds of walls, as WALLS in raytracer/compiler/bodies.py.
const int ROUND_WALL = 1, CONE_WALL = 2, TORUS_WALL = 3;

#ifdef DOUBLES
layout(std140) uniform Bodies {
    real4 bodies[BODY_TEXELS];
};

real4 bodyAt(int texel) {
    return bodies[texel];
}
#else
uniform samplerBuffer bodies;

vec4 bodyAt(int texel) {
    return texelFetch(bodies, texel);
}
#endif

// A slab along a ray.
struct SlabRoots {
    real2 span;
    real slope;  // of the high face's normal
};

SlabRoots slabAt(Ray ray, int texel) {
    real4 high = bodyAt(texel), low = bodyAt(texel + 1);
    real slope, height = 0.0;
    ivec2 surfaces = ivec2(0);
    if (ray.ofCamera) {
        slope = cameraSlope(low.xyz, bodyAt(texel + 2).xyz);
    } else {
        slope = dot(high.xyz, ray.rd);
        height = dot(high.xyz, ray.ro);
        surfaces = ivec2(bodyAt(texel + 3).xy);
    }
    return SlabRoots(slabSpan(ray, high.w - height, low.w + height, slope, surfaces), slope);
}

#if defined(HAS_ROUND_WALLS) || defined(HAS_CONE_WALLS) || defined(HAS_TORI)
#define HAS_WALLS

// A wall along a ray: the forms at the ray's origin, their slopes, and their gradients (wall.glsl).
struct Wall {
    real4 p;
    real4 d;
    real power;
    int surface;
    real3 w0;
    real3 w1;
    real3 w2;
    real3 w3;
};

// Set the value, the slope and the gradient of the form at `texel`.
void readForm(Ray ray, int texel, out real value, out real slope, out real3 gradient) {
    real4 form = bodyAt(texel);
    gradient = form.xyz;
    value = ray.ofCamera ? form.w : dot(gradient, ray.ro) + form.w;
    slope = ray.ofCamera ? cameraSlope(bodyAt(texel + 1).xyz, bodyAt(texel + 2).xyz) : dot(gradient, ray.rd);
}

Wall wallAt(Ray ray, int texel, int kind) {
    real4 header = bodyAt(texel);
    Wall wall;
    wall.p.x = header.x;
    wall.d.x = 0.0;
    wall.w0 = real3(0.0);
    texel++;
#ifdef HAS_CONE_WALLS
    if (kind == CONE_WALL) {
        readForm(ray, texel, wall.p.x, wall.d.x, wall.w0);
        texel += 3;
    }
#endif
    readForm(ray, texel, wall.p.y, wall.d.y, wall.w1);
    readForm(ray, texel + 3, wall.p.z, wall.d.z, wall.w2);
    readForm(ray, texel + 6, wall.p.w, wall.d.w, wall.w3);
    wall.power = ray.ofCamera ? header.y : wallPower(wall.p);
    wall.surface = int(header.z);
    return wall;
}

real2 wallRoots(Ray ray, Wall wall, int kind, int part) {
#ifdef HAS_ROUND_WALLS
    if (kind == ROUND_WALL) {
        real2 span = roundSpan(wall.p, wall.d, wall.power);
        return roundEnds(ray, wall.p, wall.d, wall.w1, wall.w2, wall.w3, wall.surface, span);
    }
#endif
#ifdef HAS_CONE_WALLS
    if (kind == CONE_WALL) {
        real2 span = coneSpan(wall.p, wall.d, wall.power);
        return coneEnds(ray, wall.p, wall.d, wall.w0, wall.w1, wall.w2, wall.w3, wall.surface, span);
    }
#endif
#ifdef HAS_TORI
    real2 span = torusSpan(wall.p, wall.d, part);
    bool starts = ray.ofCamera ? wall.power == 0.0 : wall.surface == ray.start.surface;
    bool ends = !ray.ofCamera && wall.surface == ray.end.surface;
    if (!(starts || ends)) return span;
    real slope = dot(ray.start.n, ray.rd);
    if (ray.ofCamera) slope = dot(torusGradient(wall.p.yzw), wall.d.yzw);
    return torusEnds(ray, part, starts, ends, slope, span, torusSpan(wall.p, wall.d, 1 - part));
#else
    return real2(INF, -INF);
#endif
}

real3 wallNormal(Wall wall, int kind, real t, bool enters) {
#ifdef HAS_ROUND_WALLS
    if (kind == ROUND_WALL) return roundNormal(wall.p, wall.d, wall.power, wall.w1, wall.w2, wall.w3, enters);
#endif
#ifdef HAS_CONE_WALLS
    if (kind == CONE_WALL)
        return coneNormal(wall.p, wall.d, wall.power, wall.w0, wall.w1, wall.w2, wall.w3, enters);
#endif
#ifdef HAS_TORI
    return torusNormal(wall.p, wall.d, t, wall.w1, wall.w2, wall.w3);
#else
    return real3(0.0);
#endif
}
#endif

// The roots of the ray's whole line with the body; (INF, -INF) for a miss.
real2 bodyRoots(Ray ray, Surface s) {
    ivec4 header = ivec4(s.coarse);
    int texel = header.x, kind = header.z;
    real2 span = real2(-INF, INF);
    for (int i = 0; i < header.y; i++) {
        real2 own = slabAt(ray, texel).span;
        span = real2(max(span.x, own.x), min(span.y, own.y));
        texel += 4;
    }
#ifdef HAS_WALLS
    if (kind != 0) {
        real2 own = wallRoots(ray, wallAt(ray, texel, kind), kind, header.w);
        span = real2(max(span.x, own.x), min(span.y, own.y));
    }
#endif
    return span.x < span.y ? span : real2(INF, -INF);
}

// A face of a body at a hit.
struct Face {
    Contact on;   // its coincidence number and outward unit normal
    bool isFlat;
    real t;       // the distance along the ray
};

// The face where the ray enters the body (`enters`), or where it leaves it: the first face with that root.
Face bodyFace(Ray ray, Surface s, bool enters) {
    ivec4 header = ivec4(s.coarse);
    real2 roots = bodyRoots(ray, s);
    real t = enters ? roots.x : roots.y;
    int texel = header.x;
    for (int i = 0; i < header.y; i++) {
        SlabRoots slab = slabAt(ray, texel);
        if ((enters ? slab.span.x : slab.span.y) == t) {
            bool isHigh = (slab.slope > 0.0) != enters;
            real4 surfaces = bodyAt(texel + 3);
            real3 normal = bodyAt(texel).xyz;
            return Face(Contact(int(isHigh ? surfaces.x : surfaces.y), isHigh ? normal : -normal), true, t);
        }
        texel += 4;
    }
#ifdef HAS_WALLS
    Wall wall = wallAt(ray, texel, header.z);
    return Face(Contact(wall.surface, wallNormal(wall, header.z, t, enters)), false, t);
#else
    return Face(Contact(0, real3(0.0)), false, t);
#endif
}
