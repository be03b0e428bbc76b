// Provides sphereTerms(), planeSlope(), sphereRoots(), planeRoots(), sameAs(): the roots of a ray with
// the scene's surfaces, to as many bits as can be had. All camera rays start at one point, so the host
// knows in float64 what cancels. Needs sphere.glsl if there are spheres, plane.glsl if there are planes.
// Where the host knows that rays meet no sphere, it defines NO_SPHERES.

#include "surfaces.glsl"
#include "camera.glsl"

// A number that a surface has in common with all that coincide with it, their sides aside; at least 1.
int sameAs(int index) {
    return int(fineAt(index).w);
}

#if defined(HAS_SPHERES) && !defined(NO_SPHERES)
// For sphereSpan() and sphereNormal().
real2 sphereTerms(Ray ray, int index) {
    if (ray.ofCamera)
        return real2(cameraSlope(coarseAt(index).xyz, fineAt(index).xyz), coarseAt(index).w);
    real4 sphere = shapeAt(index);
    real2 terms = sphereTermsOf(ray, sphere);
    // From the camera's power if that is the nearer one to go out from: beside a huge sphere the
    // distance of its centre has no bits left for how near its surface is.
    real3 toCenter = sphere.xyz - ray.ro;
    if (dot(ray.ro, ray.ro) < dot(toCenter, toCenter))
        terms.y = coarseAt(index).w - dot(ray.ro, sphere.xyz + toCenter);
    return terms;
}

real2 sphereRoots(Ray ray, int index) {
    real2 span = sphereSpan(ray, shapeAt(index), sphereTerms(ray, index));
    return sphereEnds(ray, shapeAt(index).w, sameAs(index), span);
}
#endif

#ifdef HAS_PLANES
// dot(normal, rd), for planeSpan().
real planeSlope(Ray ray, int index) {
    if (ray.ofCamera) return cameraSlope(coarseAt(index).xyz, fineAt(index).xyz);
    return dot(shapeAt(index).xyz, ray.rd);
}

real2 planeRoots(Ray ray, int index) {
    real slope = planeSlope(ray, index);
    return planeEnds(ray, slope, sameAs(index), planeSpan(ray, shapeAt(index), slope));
}

// Where a ray that meets nothing but half-spaces crosses the plane; INF if it does not.
real planeRoot(Ray ray, int index) {
    if (!ray.ofCamera && sameAs(index) == ray.start.surface) return INF;
    if (!ray.ofCamera && sameAs(index) == ray.end.surface) return ray.distance;
    real slope = planeSlope(ray, index);
    real4 plane = shapeAt(index);
    return slope == 0.0 ? INF : (plane.w - dot(plane.xyz, ray.ro)) / slope;
}

// The mat (surfaces.glsl) of that crossing: ahead of it, a ray comes out of a half-space that it is in.
int planeMat(Ray ray, int index) {
    real4 plane = shapeAt(index);
    return plane.w > dot(plane.xyz, ray.ro) ? -index - 1 : index + 1;
}

// The number in the scene of an object that is this half-space.
int planeObject(int index) {
    return int(coarseAt(index).w);
}
#endif
