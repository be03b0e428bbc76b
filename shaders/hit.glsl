// Provides surfaceAt(), contactOf(): the point that a ray hits, and what is known where a ray ends.
//
// A hit says which surface in one number, `mat`: its index + 1, negative where the ray comes out of
// the primitive; 0 for no surface. So the hit's root is known again without comparing distances.
// Needs what terms.glsl needs.

#include "terms.glsl"

// The point where the ray crosses the surface of `mat`, and the primitive's outward unit normal there.
void surfaceAt(int mat, Ray ray, out real3 P, out real3 n) {
    int index = abs(mat) - 1;
#if SPHERES > 0
    if (index < SPHERES) {
        real4 sphere = spheres[index];
        real2 terms = sphereTerms(ray, index);
        real2 span = sphereSpan(ray, sphere, terms);
        real t = mat > 0 ? span.x : span.y;
        n = sphereNormal(ray, sphere, terms, mat > 0);
        // Projected onto the sphere, unless that is so huge that its radius has fewer bits than the distance.
        P = sphere.w < t ? sphere.xyz + sphere.w * n : ray.ro + t * ray.rd;
    }
#endif
#if PLANES > 0
    if (index >= SPHERES) {
        real4 plane = planes[index - SPHERES];
        n = plane.xyz;
        real2 span = planeSpan(ray, plane, planeSlope(ray, index - SPHERES));
        // On the plane to the rounding of its own coordinates: to project it would round as much again.
        P = ray.ro + (mat > 0 ? span.x : span.y) * ray.rd;
    }
#endif
}

// The contact of a point P that lies on the surface of `mat`; none for 0.
Contact contactOf(int mat, real3 P) {
    int index = abs(mat) - 1;
#if SPHERES > 0
    if (mat != 0 && index < SPHERES)
        return Contact(SPHERE, spheres[index], normalize(P - spheres[index].xyz));
#endif
#if PLANES > 0
    if (index >= SPHERES) return Contact(PLANE, planes[index - SPHERES], planes[index - SPHERES].xyz);
#endif
    return Contact(NONE, real4(0.0), real3(0.0));
}
