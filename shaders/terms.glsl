// Provides sphereTerms(), planeSlope(): the terms of a ray's roots that cancel, to as many bits as
// can be had. All camera rays start at one point, so the host knows theirs in float64. Needs
// sphere.glsl if there are spheres, plane.glsl if there are planes.

#include "surfaces.glsl"
#include "camera.glsl"

layout(std140) uniform CameraTerms {
    real4 coarse[SURFACES];  // .xyz for cameraSlope(); .w of a sphere: the power of the camera's position
    real4 fine[SURFACES];    // .xyz for cameraSlope()
};

#if SPHERES > 0
// For sphereSpan() and sphereNormal().
real2 sphereTerms(Ray ray, int index) {
    if (ray.ofCamera)
        return real2(cameraSlope(coarse[index].xyz, fine[index].xyz), coarse[index].w);
    real4 sphere = spheres[index];
    real2 terms = sphereTermsOf(ray, sphere);
    // From the camera's power if that is the nearer one to go out from: beside a huge sphere the
    // distance of its centre has no bits left for how near its surface is.
    real3 toCenter = sphere.xyz - ray.ro;
    if (dot(ray.ro, ray.ro) < dot(toCenter, toCenter))
        terms.y = coarse[index].w - dot(ray.ro, sphere.xyz + toCenter);
    return terms;
}
#endif

#if PLANES > 0
// dot(normal, rd), for planeSpan(). plane counts from 0, after the spheres.
real planeSlope(Ray ray, int plane) {
    if (ray.ofCamera)
        return cameraSlope(coarse[SPHERES + plane].xyz, fine[SPHERES + plane].xyz);
    return dot(planes[plane].xyz, ray.rd);
}
#endif
