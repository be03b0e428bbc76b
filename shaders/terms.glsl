// Provides spherePower(), planeSlope(): the terms of a ray's roots that cancel, to as many bits as
// can be had. All camera rays start at one point, so the host knows theirs in float64; where
// CAMERA_RAYS is defined, only camera rays are traced. Needs sphere.glsl if there are spheres.

#include "surfaces.glsl"
#ifdef CAMERA_RAYS
#include "camera.glsl"

layout(std140) uniform CameraTerms {
#if SPHERES > 0
    vec4 powers[SPHERES];       // .x: the power of the camera's position, for sphereSpan()
#endif
#if PLANES > 0
    vec4 coarseSlopes[PLANES];  // .xyz: for cameraSlope()
    vec4 fineSlopes[PLANES];
#endif
};
#endif

#if SPHERES > 0
// |center - ro|^2 - radius^2 of a sphere
float spherePower(Ray ray, int sphere) {
#ifdef CAMERA_RAYS
    return powers[sphere].x;
#else
    return powerOf(ray.ro, spheres[sphere].xyz, spheres[sphere].w);
#endif
}
#endif

#if PLANES > 0
// dot(normal, rd) of a plane
float planeSlope(Ray ray, int plane) {
#ifdef CAMERA_RAYS
    return cameraSlope(coarseSlopes[plane].xyz, fineSlopes[plane].xyz);
#else
    return dot(planes[plane].xyz, ray.rd);
#endif
}
#endif
