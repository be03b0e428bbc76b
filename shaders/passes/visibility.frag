// Pass 1: the surface that each pixel sees; if the host defines GEOMETRY, its distance and normal too.
//
// Small objects of common shapes are drawn over all other objects, one by one. The host defines SHAPES for
// that draw, which uses shapes.vert. It defines OTHERS for the draw before, unless that is cheap to repeat. The depth
// test finds the nearest object; of several at one distance it takes the first that is drawn, in the scene's order.

#include "scene.glsl"
#ifdef MANY_ROUNDS
#include "passes/cut_short.glsl"
#endif

layout(location = 0) out int surface;       // as in surfaces.glsl, 0 for nothing
#ifdef OTHERS
layout(location = 1) out vec2 other;        // t, and the number of the object, -1 for nothing
#define NEXT 2
#else
#define NEXT 1
#endif
#ifdef GEOMETRY
layout(location = NEXT) out vec4 normalDepth;  // unit normal towards the viewer, 0 for nothing; t, INF for nothing
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
        other = vec2(0.0, -1.0);  // so that nothing is drawn over it
#endif
    }
#endif
#ifdef SHAPES
    // The scale is a power of two, so depths are in the order of t. 1 is not before what the depth is cleared to.
    gl_FragDepth = nearer(t, object, otherAt(ray)) ? t * depthScale : 1.0;
#endif
}
