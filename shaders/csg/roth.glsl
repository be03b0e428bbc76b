// Constructive solid geometry by hit lists (Roth diagrams), in the words of the course assignment.
// Provides struct Hit, struct Roth, raySphere(), rayPlane(), rayBody(), unionCSG(), intersectionCSG(), complementCSG(),
// differenceCSG(), firstHit(). (Roth, "Ray casting for modeling solids", 1982.) All lengths are in view space.
//
// A Roth diagram is the list of a ray's crossings with a solid, in strictly increasing order of the distance t. It
// covers the whole line, also behind the ray's origin ro. The ray is inside the solid from hit 0 to hit 1, from hit 2
// to hit 3, and so on, so the number n of hits is even. A solid that is unbounded along the line begins at -INF or ends
// at INF. An empty solid has n = 0, and all of space is [-INF, INF]; each of the two is the complement of the other:
//
//     A             ------[=======]--------[===]------
//     complement    ======]-------[========]---[======
//
// So the filters are right also with the camera inside a solid, with an empty operand, and with complements of
// complements. The lists are for reading rather than for speed; walk.glsl describes the faster way.

#include "geometry/ray.glsl"
#include "geometry/sphere.glsl"
#include "geometry/plane.glsl"

// The host computes the bound from the scene's trees, so a list never overflows. Default: 8.
#ifndef MAX_HITS
#define MAX_HITS 8
#endif

struct Hit {
    real t;        // distance along the ray
    real3 normal;  // unit, outward from the solid; 0 at +-INF
    int mat;       // the surface's index + 1, negative where the ray leaves the primitive; 0 at +-INF
};

struct Roth {
    int n;
    Hit hit[MAX_HITS];
};

// The crossings of a ball. sphere: centre and radius. terms: the two numbers of sphereSpan(). surface: the coincidence
// number of sphereEnds(). mat: the surface's index + 1.
Roth raySphere(Ray ray, real4 sphere, real2 terms, int surface, int mat) {
    Roth r;
    r.n = 0;
    real2 span = sphereEnds(ray, sphere.w, surface, sphereSpan(ray, sphere, terms));
    if (span.x < span.y) {
        r.n = 2;
        r.hit[0] = Hit(span.x, sphereNormal(ray, sphere, terms, true), mat);
        r.hit[1] = Hit(span.y, sphereNormal(ray, sphere, terms, false), -mat);
    }
    return r;
}

// The crossings of a half-space: one root, and an end at infinity. plane: normal and offset. slope: dot(normal,
// ray.rd). surface: the coincidence number of planeEnds(). mat: the surface's index + 1.
Roth rayPlane(Ray ray, real4 plane, real slope, int surface, int mat) {
    Roth r;
    r.n = 0;
    real2 span = planeEnds(ray, slope, surface, planeSpan(ray, plane, slope));
    if (span.x < span.y) {
        r.n = 2;
        r.hit[0] = Hit(span.x, span.x == -INF ? real3(0.0) : plane.xyz, mat);
        r.hit[1] = Hit(span.y, span.y == INF ? real3(0.0) : plane.xyz, -mat);
    }
    return r;
}

#ifdef HAS_BODIES
// The crossings of a body with the roots `span`. mat: the surface's index + 1. The hits have no normals: the code of
// faces is long, so only the nearest hit gets one.
Roth rayBody(real2 span, int mat) {
    Roth r;
    r.n = 0;
    if (span.x < span.y) {
        r.n = 2;
        r.hit[0] = Hit(span.x, real3(0.0), mat);
        r.hit[1] = Hit(span.y, real3(0.0), -mat);
    }
    return r;
}
#endif

// The parts of the line that are inside at least `depth` of a and b: 1 is the union, 2 the intersection. Hits of a and
// b at the same t count as one step, so coincident faces become one face or none; the hit is then the one of a.
Roth atLeast(int depth, Roth a, Roth b) {
    Roth r;
    r.n = 0;
    int i = 0, j = 0, inside = 0;
    while (i < a.n || j < b.n) {
        bool crossA = j >= b.n || (i < a.n && a.hit[i].t <= b.hit[j].t);
        bool crossB = i >= a.n || (j < b.n && b.hit[j].t <= a.hit[i].t);
        int before = inside;
        Hit hit;
        if (crossB) {
            hit = b.hit[j];
            inside += j % 2 == 0 ? 1 : -1;
            j++;
        }
        if (crossA) {
            hit = a.hit[i];
            inside += i % 2 == 0 ? 1 : -1;
            i++;
        }
        if ((before >= depth) != (inside >= depth)) {
            r.hit[r.n] = hit;
            r.n++;
        }
    }
    return r;
}

Roth unionCSG(Roth a, Roth b) {
    return atLeast(1, a, b);
}

Roth intersectionCSG(Roth a, Roth b) {
    return atLeast(2, a, b);
}

// The complement: the same crossings with inside and outside exchanged. An end at infinity disappears, and an end that
// was finite becomes one at infinity.
Roth complementCSG(Roth a) {
    Roth r;
    r.n = 0;
    int from = 0, to = a.n;
    if (a.n > 0 && a.hit[0].t == -INF) {
        from = 1;
    } else {
        r.hit[r.n] = Hit(-INF, real3(0.0), 0);
        r.n++;
    }
    bool endless = a.n > 0 && a.hit[a.n - 1].t == INF;
    if (endless) to = a.n - 1;
    for (int i = from; i < to; i++) {
        r.hit[r.n] = Hit(a.hit[i].t, -a.hit[i].normal, a.hit[i].mat);
        r.n++;
    }
    if (!endless) {
        r.hit[r.n] = Hit(INF, real3(0.0), 0);
        r.n++;
    }
    return r;
}

// The difference A - B, which is A and not B.
Roth differenceCSG(Roth a, Roth b) {
    return intersectionCSG(a, complementCSG(b));
}

// Set `nearest` to the first crossing ahead of the ray's origin if that is nearer than `nearest.t`.
void firstHit(Roth r, inout Hit nearest) {
    for (int i = 0; i < r.n; i++) {
        if (r.hit[i].t > 0.0) {
            if (r.hit[i].t < nearest.t) nearest = r.hit[i];
            return;
        }
    }
}
