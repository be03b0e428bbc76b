// Pass 1: the surface that each pixel sees; if the host defines GEOMETRY, its distance and normal too.
//
// Small objects of common shapes are drawn over all other objects, one by one. The host defines SHAPES for that draw,
// which uses shapes.vert. It defines OTHERS for the draw before it, unless that draw is cheap to repeat. The depth test
// keeps the nearest object; among several at one distance it keeps the one drawn first, which is the first in the
// scene.

#include "scene.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

layout(location = 0) out int surface;       // `mat`, the signed number of surfaces.glsl; 0 for none
#ifdef OTHERS
layout(location = 1) out vec2 other;        // t, and the object's number; -1 for none
#define NEXT 2
#else
#define NEXT 1
#endif
#ifdef GEOMETRY
layout(location = NEXT) out vec4 normalDepth;  // unit normal towards the viewer, 0 for none; distance t, INF for none
#endif
#ifdef SHAPES
flat in int object;
flat in float depthScale;
#endif

void main() {
    Ray ray = cameraRay();
    real3 P, N;
    real t = rayCSG(ray, P, N, surface);
#ifdef GEOMETRY
    normalDepth = vec4(dot(N, ray.rd) > 0.0 ? -N : N, t);
#endif
#ifdef OTHERS
    other = vec2(t, surface == 0 ? -1.0 : objectOf(indexOf(surface)));
#endif
#if defined(MANY_ROUNDS) && !defined(SHAPES)
    if (isCutShort()) {
        surface = CUT_SHORT;
#ifdef OTHERS
        other = vec2(0.0, -1.0);  // a distance of 0, so that no object is drawn over this pixel
#endif
    }
#endif
#ifdef SHAPES
    // The scale is a power of two, so depths are in the order of t. A depth of 1 fails the test: the buffer is cleared
    // to 1.
    gl_FragDepth = nearer(t, object, otherAt(ray)) ? t * depthScale : 1.0;
#endif
}
