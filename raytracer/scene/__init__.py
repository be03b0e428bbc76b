"""The scene description (solids, materials, lights, camera) and the render settings.

All objects are immutable and check their values when they are created. The package imports only core. It does not
import OpenGL, and imports NumPy only for instances, measured materials and some warnings. Other packages may use:

    scene: Scene, check_scene, used_models
    scene_objects: SceneObjects
    canonical: canonical (a scene as plain data, for the keys of stored pictures)
    solids: a subpackage with its own list
    instances: Instances
    lights: PointLight, FALLOFFS
    camera: Camera
    tracks: Animation, Track, TrackValue, Interpolation, go_round (values that change from frame to frame)
    materials: a subpackage with its own list
    settings: Settings
    options: CompileOptions, SamplingOptions (the halves of Settings), Shadows, Evaluator, Precision,
        MAX_SAMPLES, MAX_BOUNCES, DEFAULT_SAMPLE_LIMIT, check_shading
    settings_patch: SettingsPatch, EMPTY_PATCH, Quality, quality, QUALITIES, minimal_patch, flags, changed_fields,
        patch_from_settings (partial settings and their precedence)
    sequences: SampleSequence, SEQUENCES, PROGRESSIVE, sample_place, sample_points, is_scattered, light_index,
        replicate_place
    warnings: scene_warnings, NO_RADIUS

To add a sample sequence, add a row in sequences.py.
To add a falloff, add a name in lights.py, a formula in irradiance.glsl, the formula in float64 in
ground_truth/light_rays.py, and its bounds in compiler/light_scale.py and compiler/bright_features.py.
To add a setting, add a field with its check in options.py (CompileOptions or SamplingOptions), a field with its
description in settings.py, a field in settings_patch.py, and a command line option in app/options.py.
"""
