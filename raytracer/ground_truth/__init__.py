"""Ground truth: an independent ray tracer in float64 NumPy, written from the definitions.

It shares only the scene with the shaders, so that neither can hide an error of the other: the package imports core,
scene and formats, never compiler, gpu or rendering. The *float64 ray tracer* can use the same samples as the shaders.
A *converged picture* uses random samples of its own, until its estimated error is small. The command line and
`rt.reference` call a converged picture the reference.

Other packages may use:

    ray_tracer: trace, trace_rays, camera_rays, camera_origins, rays_through, origins_through, RayResults
    intersection: Tracer
    scene_surfaces: Ball, HalfSpace, Wall
    reflectance: reflected, mirrored
    microfacets: fresnel, dot; rough_surfaces: eon_albedo, eon_mean_albedo (terms of the reflectance models)
    converged: trace_converged
    job: Job, FIRST_SAMPLES, SAMPLES, TOLERANCE
    cost: check_cost, estimate_cost
    disk_cache: MOST_BYTES
    picture: reference, REFERENCE_SIZE, WARN_SECONDS
"""
