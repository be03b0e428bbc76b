"""The description of a picture: solids, lights, a camera, materials, and the settings of how the picture is made.

All are frozen values that check themselves when they are made. The package imports core alone: no OpenGL, and NumPy
only where arrays are: for instances, measured materials, and spheres that are warned of. Other packages may use:

    scene: Scene, checked_scene, used_models
    scene_objects: SceneObjects
    solids: Solid, Primitive, Sphere, Plane; Union, Intersection, Difference, Complement; leaves, postfix, simplified
        and with_leaves, for the parts of a tree; MAX_SURFACES, ROUNDING
    instances: Instances
    lights: PointLight, FALLOFFS
    camera: Camera
    materials: a package of its own
    settings: Settings
    options: CompileOptions, SamplingOptions (the halves of Settings), Shadows, Evaluator, Precision,
        MAX_SAMPLES
    settings_patch: SettingsPatch, EMPTY, Quality, quality, QUALITIES, ASKED_SAMPLES, fewest, flags, changes,
        checked_patch (settings from many places)
    sequences: SampleSequence, SEQUENCES, PROGRESSIVE, sample_place, sample_points, scatters, light_index,
        replicate_place
    warnings: scene_warnings, NO_RADIUS

A new sequence is a row in sequences.py. A new falloff is a name in lights.py, a formula in irradiance.glsl and one in
float64 in ground_truth/light_rays.py. A new setting is a field in options.py, in its half and with its check, in
settings.py with its meaning, and in settings_patch.py; and an option of the command line in app/options.py.
"""
