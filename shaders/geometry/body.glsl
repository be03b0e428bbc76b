// The intersection of a ray with a body: slabs, and at most one curved wall, of which it is the common part.
// Provides bodyRoots(), bodyFace(). All vectors and lengths are in view space. A part of a torus is a body, too.
//
// A body's header is in .coarse of its Surface: its first texel in `bodies`, its number of slabs, its kind of wall, and
// its part of a torus. The host defines HAS_ROUND_WALLS, HAS_CONE_WALLS and HAS_TORI for the kinds in use, and includes
// their files before this one.
// raytracer/compiler/body_texels.py packs the texels:
//     a slab:  the unit normal and the depth of the camera below the high face; the depth above the low face, and the
//              coincidence numbers of the high and the low face, and again the first depth (grid.glsl); for camera rays
//              the coarse slopes of the normal (camera.glsl) and the first depth; the fine slopes and the second depth
//     a wall:  l0 if it is constant, the power of the camera (wall.glsl; 0 if the camera is on the wall, 1 for another
//              camera of a torus), the coincidence number, 0; then for each form its gradient and its value at the
//              camera; for camera rays the coarse slopes and again the value; the fine slopes
// So any ray reads two texels of a slab.

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
#ifdef HANDED_TEXELS
    // The vertex shader hands on the texels before the first one (shapes.vert).
    if (texel < 0) return handedAt(texel + HANDED_TEXELS);
#endif
    return texelFetch(bodies, texel);
}
#endif

// A slab along a ray.
struct SlabRoots {
    real2 span;
    real slope;  // of the high face's normal
};

SlabRoots slabAt(Ray ray, int texel) {
#ifndef ORTHOGRAPHIC
    if (ray.ofCamera) {
        real4 coarse = bodyAt(texel + 2), fine = bodyAt(texel + 3);
        real slope = cameraSlope(coarse.xyz, fine.xyz);
        return SlabRoots(slabSpan(ray, coarse.w, fine.w, slope, ivec2(0)), slope);
    }
#endif
    real4 high = bodyAt(texel), low = bodyAt(texel + 1);
    real slope = dot(high.xyz, ray.rd), height = dot(high.xyz, ray.ro);
    return SlabRoots(slabSpan(ray, high.w - height, low.x + height, slope, ivec2(low.yz)), slope);
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
    gradient = bodyAt(texel).xyz;
#ifndef ORTHOGRAPHIC
    if (ray.ofCamera) {
        real4 coarse = bodyAt(texel + 1);
        value = coarse.w;
        slope = cameraSlope(coarse.xyz, bodyAt(texel + 2).xyz);
        return;
    }
#endif
    value = dot(gradient, ray.ro) + bodyAt(texel).w;
    slope = dot(gradient, ray.rd);
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

#ifdef HAS_TORI
// Whether the ray starts on the torus.
bool startsOnTorus(Ray ray, Wall wall) {
    return ray.ofCamera ? wall.power == 0.0 : wall.surface == ray.start.surface;
}

// The slope of the torus's outward normal at the start of a ray that starts on it.
real torusSlope(Ray ray, Wall wall) {
    return ray.ofCamera ? dot(torusGradient(wall.p.yzw), wall.d.yzw) : dot(ray.start.n, ray.rd);
}
#endif

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
    bool starts = startsOnTorus(ray, wall), ends = !ray.ofCamera && wall.surface == ray.end.surface;
    bool isKnown = starts || ends;
    real4 spans = torusRoots(wall.p, wall.d, isKnown ? 0 : 2 * part, isKnown ? 4 : 2 * part + 2);
    real2 span = part == 0 ? spans.xy : spans.zw, other = part == 0 ? spans.zw : spans.xy;
    return torusEnds(ray, part, starts, ends, torusSlope(ray, wall), span, other);
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

// The roots of the ray's whole line with the body of a header; (INF, -INF) for a miss.
real2 rootsOf(Ray ray, ivec4 header) {
    int wall = header.x + 4 * header.y, texel = header.x, kind = header.z;
    real2 span = real2(-INF, INF);
    // llvmpipe computes one more round of a loop that tests for the end first.
    do {
        if (texel < wall) {
            real2 own = slabAt(ray, texel).span;
            span = real2(max(span.x, own.x), min(span.y, own.y));
        }
        texel += 4;
    } while (texel < wall);
#ifdef HAS_WALLS
    if (kind != 0) {
        real2 own = wallRoots(ray, wallAt(ray, wall, kind), kind, header.w);
        span = real2(max(span.x, own.x), min(span.y, own.y));
    }
#endif
    return span.x < span.y ? span : real2(INF, -INF);
}

real2 bodyRoots(Ray ray, Surface s) {
    return rootsOf(ray, ivec4(s.coarse));
}

#ifdef HAS_TORI
// The roots of both parts of a torus, .xy and .zw, with the bits of bodyRoots(). `header` belongs to part 0.
real4 rootsOfParts(Ray ray, ivec4 header) {
    const real4 NONE = real4(INF, -INF, INF, -INF);
    Wall wall = wallAt(ray, header.x, TORUS_WALL);
    bool starts = startsOnTorus(ray, wall), ends = !ray.ofCamera && wall.surface == ray.end.surface;
    real slope = torusSlope(ray, wall);
    real4 both = torusRoots(wall.p, wall.d, 0, 4);
    both = real4(
        torusEnds(ray, 0, starts, ends, slope, both.xy, both.zw),
        torusEnds(ray, 1, starts, ends, slope, both.zw, both.xy)
    );
    return real4(both.x < both.y ? both.xy : NONE.xy, both.z < both.w ? both.zw : NONE.zw);
}
#endif

// A face of a body at a hit.
struct Face {
    Contact on;   // its coincidence number and outward unit normal
    bool isFlat;
    real t;       // the distance along the ray
};

// The face where the ray enters the body (`enters`), or where it leaves it: the first face with that root.
Face bodyFace(Ray ray, Surface s, bool enters) {
    ivec4 header = ivec4(s.coarse);
    int wall = header.x + 4 * header.y, texel = header.x, slab = header.x;
    real t = enters ? -INF : INF, slope = 0.0;
    do {
        SlabRoots roots = slabAt(ray, texel);
        real root = enters ? roots.span.x : roots.span.y;
        if (texel < wall && (enters ? root > t : root < t)) {
            t = root;
            slope = roots.slope;
            slab = texel;
        }
        texel += 4;
    } while (texel < wall);
    bool isHigh = (slope > 0.0) != enters;
    real3 normal = bodyAt(slab).xyz;
    real4 low = bodyAt(slab + 1);
    Face face = Face(Contact(int(isHigh ? low.y : low.z), isHigh ? normal : -normal), true, t);
#ifdef HAS_WALLS
    if (header.z != 0) {
        Wall curved = wallAt(ray, wall, header.z);
        real2 roots = wallRoots(ray, curved, header.z, header.w);
        real root = enters ? roots.x : roots.y;
        if (enters ? root > t : root < t)
            face = Face(Contact(curved.surface, wallNormal(curved, header.z, root, enters)), false, root);
    }
#endif
    return face;
}
