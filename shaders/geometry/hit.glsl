// The surface, the point and the normal of a hit.
// Provides hitSurface(), isPlane(), pointAt(). They take the hit's `mat` (surfaces.glsl), which must not be 0.
//
// Needs what terms.glsl needs. Where the host knows that rays meet only one surface, it defines ONLY as what that
// is called, and where it knows that they meet no sphere, NO_SPHERES.

#include "geometry/terms.glsl"

Surface hitSurface(int mat) {
#ifdef ONLY
    return ONLY;
#else
    return surfaceOf(indexOf(mat));
#endif
}

bool isPlane(int mat) {
#if defined(NO_SPHERES) || !defined(HAS_SPHERES)
    return true;
#elif defined(HAS_PLANES)
    return indexOf(mat) >= firstPlane;
#else
    return false;
#endif
}

// The point where the ray crosses the surface of `mat`, and the primitive's outward unit normal there.
void pointAt(int mat, Ray ray, out real3 P, out real3 n) {
    Surface s = hitSurface(mat);
#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
    if (!isPlane(mat)) {
        real2 span = sphereRoots(ray, s);
        real t = mat > 0 ? span.x : span.y;
        n = sphereNormal(ray, s.shape, sphereTerms(ray, s), mat > 0);
        // Projected onto the sphere, unless that is so huge that its radius has fewer bits than the distance.
        P = s.shape.w < t ? s.shape.xyz + s.shape.w * n : ray.ro + t * ray.rd;
    }
#endif
#ifdef HAS_PLANES
    if (isPlane(mat)) {
        n = s.shape.xyz;
        // On the plane to the rounding of its own coordinates: to project it would round as much again.
        P = ray.ro + planeRoot(ray, s) * ray.rd;
    }
#endif
}
