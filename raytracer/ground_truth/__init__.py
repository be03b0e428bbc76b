"""The same picture in float64 NumPy, from the definitions: the ground truth of all that is measured.

Nothing is shared with the shaders but the scene, so that neither hides an error of the other: the package imports core,
scene and formats, never compiler, gpu or rendering. The *float64 ray tracer* draws one sample as the shaders do, or
several. A *converged picture* is traced by it with random samples of its own, until its estimated error is small; on
the command line, and as `rt.reference`, a converged picture is called the reference.

Other packages may use:

    ray_tracer: trace, trace_rays, camera_rays, rays_through, RayResults
    intersection: Tracer
    reflectance: reflected, mirrored
    microfacets: fresnel, dot; rough_surfaces: eon_albedo, eon_mean_albedo (terms of the reflectance models)
    converged: trace_converged
    job: Job, FIRST_SAMPLES, SAMPLES, TOLERANCE
    cost: check_cost, estimate_cost
    disk_cache: MOST_BYTES
    picture: reference, REFERENCE_SIZE, WORTH_MENTION
"""
