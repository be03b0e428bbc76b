// The roots of a ray with the scene's surfaces, with the terms that would cancel taken from the host.
// Provides sphereTerms(), planeSlope(), sphereRoots(), planeRoots(), sameAs().
// All camera rays start at one point, so the host computes those terms in float64. Needs sphere.glsl if there are
// spheres, plane.glsl if there are planes.

#include "geometry/surfaces.glsl"
#include "geometry/camera.glsl"

// A number that a surface has in common with all that coincide with it, their sides aside; at least 1.
int sameAs(Surface s) {
    return int(s.fine.w);
}

#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
// For sphereSpan() and sphereNormal().
real2 sphereTerms(Ray ray, Surface s) {
    if (ray.ofCamera) return real2(cameraSlope(s.coarse.xyz, s.fine.xyz), s.coarse.w);
    real2 terms = sphereTermsOf(ray, s.shape);
    // From the camera's power if that is the nearer one to go out from: beside a huge sphere the
    // distance of its centre has no bits left for how near its surface is.
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
// dot(normal, rd), for planeSpan().
real planeSlope(Ray ray, Surface s) {
    if (ray.ofCamera) return cameraSlope(s.coarse.xyz, s.fine.xyz);
    return dot(s.shape.xyz, ray.rd);
}

real2 planeRoots(Ray ray, Surface s) {
    real slope = planeSlope(ray, s);
    return planeEnds(ray, slope, sameAs(s), planeSpan(ray, s.shape, slope));
}

// Where a ray that meets nothing but half-spaces crosses the plane; INF if it does not.
real planeRoot(Ray ray, Surface s) {
    return planeCrossing(ray, s.shape, planeSlope(ray, s), sameAs(s));
}

// The mat (surfaces.glsl) of that crossing: ahead of it, a ray comes out of a half-space that it is in.
int planeMat(Ray ray, Surface s, int index) {
    return s.shape.w > dot(s.shape.xyz, ray.ro) ? -index - 1 : index + 1;
}

// The number in the scene of an object that is this half-space.
int planeObject(Surface s) {
    return int(s.coarse.w);
}
#endif
