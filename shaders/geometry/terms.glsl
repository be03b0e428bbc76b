// The roots of a ray with the scene's surfaces; for camera rays the host computes the terms that would cancel.
// Provides sphereTerms(), planeSlope(), sphereRoots(), planeRoots(), sameAs(), all in view space. Roots are distances
// along the ray. Because all camera rays in perspective start at one point, the host can compute their terms in
// float64, once for each surface.
// Needs sphere.glsl if there are spheres, and plane.glsl if there are planes.

#include "geometry/surfaces.glsl"
#include "geometry/camera.glsl"

// The coincidence number of a surface, at least 1: equal for all surfaces at one place, whichever side is inside.
int sameAs(Surface s) {
    return int(s.fine.w);
}

#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
// The `terms` for sphereSpan() and sphereNormal().
real2 sphereTerms(Ray ray, Surface s) {
#ifndef ORTHOGRAPHIC
    if (ray.ofCamera) return real2(cameraSlope(s.coarse.xyz, s.fine.xyz), s.coarse.w);
#endif
    real2 terms = sphereTermsOf(ray, s.shape);
    // If the camera is nearer to ro than the sphere's centre is, start from the camera's power: beside a huge sphere,
    // the distance of the centre is too coarse to resolve the distance of the surface.
    real3 toCenter = s.shape.xyz - ray.ro;
    if (dot(ray.ro, ray.ro) < dot(toCenter, toCenter))
        terms.y = s.coarse.w - dot(ray.ro, s.shape.xyz + toCenter);
    return terms;
}

real2 sphereRoots(Ray ray, Surface s) {
    return sphereEnds(ray, s.shape.w, sameAs(s), sphereSpan(ray, s.shape, sphereTerms(ray, s)));
}
#endif

#ifdef HAS_PLANES
// The slope dot(normal, rd), for planeSpan().
real planeSlope(Ray ray, Surface s) {
#ifndef ORTHOGRAPHIC
    if (ray.ofCamera) return cameraSlope(s.coarse.xyz, s.fine.xyz);
#endif
    return dot(s.shape.xyz, ray.rd);
}

real2 planeRoots(Ray ray, Surface s) {
    real slope = planeSlope(ray, s);
    return planeEnds(ray, slope, sameAs(s), planeSpan(ray, s.shape, slope));
}

// The distance at which a ray that meets nothing but half-spaces crosses the plane; INF if it does not.
real planeRoot(Ray ray, Surface s) {
    return planeCrossing(ray, s.shape, planeSlope(ray, s), sameAs(s));
}

// The `mat` (surfaces.glsl) of the crossing at planeRoot(): negative if the ray's origin is in the half-space, so that
// the ray leaves it there. `index` is the plane's index.
int planeMat(Ray ray, Surface s, int index) {
    return s.shape.w > dot(s.shape.xyz, ray.ro) ? -index - 1 : index + 1;
}

// The number in the scene of the object that consists of this half-space.
int planeObject(Surface s) {
    return int(s.coarse.w);
}
#endif
