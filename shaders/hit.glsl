// Provides surfaceAt(): the point that a ray hits.
//
// Needs what terms.glsl needs.

#include "terms.glsl"

// The point where the ray crosses the surface of `mat`, and the primitive's outward unit normal there.
void surfaceAt(int mat, Ray ray, out real3 P, out real3 n) {
    int index = indexOf(mat);
#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
    if (index < firstPlane) {
        real4 sphere = shapeAt(index);
        real2 span = sphereRoots(ray, index);
        real t = mat > 0 ? span.x : span.y;
        n = sphereNormal(ray, sphere, sphereTerms(ray, index), mat > 0);
        // Projected onto the sphere, unless that is so huge that its radius has fewer bits than the distance.
        P = sphere.w < t ? sphere.xyz + sphere.w * n : ray.ro + t * ray.rd;
    }
#endif
#ifdef HAS_PLANES
    if (index >= firstPlane) {
        n = shapeAt(index).xyz;
        // On the plane to the rounding of its own coordinates: to project it would round as much again.
        P = ray.ro + planeRoot(ray, index) * ray.rd;
    }
#endif
}
