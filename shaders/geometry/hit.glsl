// The surface, the point and the face of a hit.
// Provides hitSurface(), pointAt(), in view space. They take the hit's number `mat`: the surface's index + 1, negative
// where the ray leaves the primitive (surfaces.glsl). mat must not be 0.
//
// Needs sphere.glsl if there are spheres, body.glsl if there are bodies, and plane.glsl if there are planes. If the host
// knows that rays meet only one surface, it defines ONLY as the expression for that surface. If it knows that rays meet
// only planes, it defines NO_SPHERES.

#include "geometry/terms.glsl"

Surface hitSurface(int mat) {
#ifdef ONLY
    return ONLY;
#else
    return surfaceOf(indexOf(mat));
#endif
}

bool isPlane(int mat) {
#if defined(NO_SPHERES) || (!defined(HAS_SPHERES) && !defined(HAS_BODIES))
    return true;
#elif defined(HAS_PLANES)
    return indexOf(mat) >= firstPlane;
#else
    return false;
#endif
}

// The point where the ray crosses the surface of `mat`, its face and the face's outward unit normal there, and whether
// the face is flat.
void pointAt(int mat, Ray ray, out real3 P, out Contact on, out bool isFlat) {
    Surface s = hitSurface(mat);
    on.surface = sameAs(s);
    isFlat = isPlane(mat);
#if defined(HAS_BODIES) && !defined(NO_SPHERES)
    if (isBody(s)) {
        Face face = bodyFace(ray, s, mat > 0);
        on = face.on;
        isFlat = face.isFlat;
        P = ray.ro + face.t * ray.rd;
    }
#endif
#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
    if (!isPlane(mat) && !isBody(s)) {
        real2 span = sphereRoots(ray, s);
        real t = mat > 0 ? span.x : span.y;
        on.n = sphereNormal(ray, s.shape, sphereTerms(ray, s), mat > 0);
        // P is projected onto the sphere, unless the radius is larger than t: it then resolves less than the distance
        // does.
        P = s.shape.w < t ? s.shape.xyz + s.shape.w * on.n : ray.ro + t * ray.rd;
    }
#endif
#ifdef HAS_PLANES
    if (isPlane(mat)) {
        on.n = s.shape.xyz;
        // P is on the plane up to the rounding of its own coordinates. A projection would add as much rounding again.
        P = ray.ro + planeRoot(ray, s) * ray.rd;
    }
#endif
}
