"""`rt.reference`: the ground truth picture of a scene, as a public function that checks its arguments."""

from __future__ import annotations

import warnings
from typing import Any

from raytracer.core.progress import Progress, check_progress
from raytracer.core.validation import check_flag, check_size, integer
from raytracer.formats.image import Image
from raytracer.ground_truth.converged import trace_converged
from raytracer.ground_truth.cost import check_cost, estimate_cost
from raytracer.ground_truth.job import SAMPLES, TOLERANCE, Job, check_accuracy
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import Shadows
from raytracer.scene.scene import Scene, check_scene
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, patch_from_settings
from raytracer.scene.warnings import scene_warnings

# The default (width, height): a sixteenth of the pixels of render()'s default, because tracing in float64 on the CPU
# takes seconds to minutes.
REFERENCE_SIZE = (320, 180)
# The estimated time in seconds from which the program warns.
WARN_SECONDS = 60.0
# The largest accepted number of processes: no machine has more processors.
_MOST_WORKERS = 4096


def reference(
    scene: Scene,
    size: tuple[int, int] = REFERENCE_SIZE,
    settings: Settings | None = None,
    *,
    samples: int = SAMPLES,
    tolerance: float = TOLERANCE,
    shading: Shading | None = None,
    shadows: Shadows | None = None,
    bounces: int | None = None,
    transparent: bool = False,
    cache: bool = True,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Image:
    """Compute the ground truth of a picture: the picture to which more and more samples converge.

    The reference is traced on the CPU in float64, by code that is independent of the shaders, with adaptive random
    sampling. Compare pictures with it by `raytracer.compare`.

    Args:
        scene: the scene.
        size: (width, height) in pixels. Range: 1 to 65536. Default: (320, 180).
        settings: settings, of which only shading, shadows and bounces count. Default: Settings().
        samples: the most samples per pixel. Range: 16 to 65536. Default: 1024. Each pixel gets 16 samples, and more
            while its estimated error exceeds `tolerance`.
        tolerance: the accepted standard error of a pixel, in linear radiance, at least 0. Default: 0.0005.
        shading: overrides `settings.shading`. None does not. Default: None.
        shadows: overrides `settings.shadows`. None does not. Default: None.
        bounces: overrides `settings.bounces`. None does not. Default: None.
        transparent: whether the picture has an alpha, as for `render`. Default: False.
        cache: whether to store the reference on the disk, and read it from there the next time. The folder is the
            environment variable RAYTRACER_CACHE, or the user's cache folder. Default: True.
        workers: the number of processes. The result does not depend on it. Default: one per processor. The processes
            are spawned, so that a script needs `if __name__ == "__main__":`.
        progress: a function that is called with (done, expected) numbers of samples. Default: None.

    Returns:
        An Image in float64. `depth`, `normal` and `material` belong to the rays through the pixels' centres [H, W].
        `samples` is the number of samples and `error` the standard error of each pixel [H, W]. `estimate` is the error
        of the whole picture; it is only a lower bound if `estimate.uncertain`.

    Raises:
        InputError: a wrong value, or a scene or size that needs more memory than the machine has.

    Warns (UserWarning) as `render`, and if the reference takes more than a minute or much memory.
    """
    scene = check_scene(scene)
    overrides = SettingsPatch.without_none(shading=shading, shadows=shadows, bounces=bounces)
    merged = (patch_from_settings(settings).without_sampling() | overrides).resolve()
    size = check_size(size)
    samples, tolerance = check_accuracy(samples, tolerance)
    cache, transparent = check_flag(cache, "cache"), check_flag(transparent, "transparent")
    if workers is not None:
        workers = integer(workers, "workers", 1, _MOST_WORKERS)
    check_progress(progress)
    for warning in scene_warnings(scene, merged.replace(precision=64)):
        warnings.warn(warning, stacklevel=2)
    check_cost(scene, size, workers)

    def announce(job: Job) -> None:
        if (cost := estimate_cost(job, workers)).seconds > WARN_SECONDS:
            warnings.warn(f"this takes {cost}", stacklevel=4)

    options: dict[str, Any] = {"samples": samples, "tolerance": tolerance, "cache": cache, "workers": workers}
    return trace_converged(scene, size, merged, **options, transparent=transparent, progress=progress, before=announce)
