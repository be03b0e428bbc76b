"""`rt.reference`: the picture that a scene converges to, as a function of checked arguments."""

from __future__ import annotations

import warnings
from typing import Any

from raytracer.core.progress import Progress, check_progress
from raytracer.core.validation import check_flag, check_size, whole
from raytracer.formats.image import Image
from raytracer.ground_truth.converged import trace_converged
from raytracer.ground_truth.cost import check_cost, estimate_cost
from raytracer.ground_truth.job import SAMPLES, TOLERANCE, Job, check_accuracy
from raytracer.scene.materials.models import Shading
from raytracer.scene.options import Shadows
from raytracer.scene.scene import Scene, checked_scene
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch, checked_patch
from raytracer.scene.warnings import scene_warnings

# A sixteenth of the pixels that render makes: the processor traces them in float64, in seconds to minutes.
REFERENCE_SIZE = (320, 180)
# Seconds. Longer waits are announced.
WORTH_MENTION = 60.0
# Processes. More than any machine has processors are a mistake.
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
    cache: bool = True,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Image:
    """Trace in float64 the limit of the picture of `scene` at `size` (width, height) in pixels.

    `shading`, `shadows` and `bounces` are as `Settings` has them, and come before the fields of `settings`, whose other
    fields are of no effect. Each pixel gets 16 samples, and up to `samples` (range: 16 to 65536) while its error is
    estimated to be above `tolerance`, in linear radiance. The image is float64: `radiance`; `depth`, `normal` and
    `material` of the centre rays; `samples`, the samples of each pixel; `error`, the standard error of each pixel;
    `estimate`, the error of the picture, which is a lower bound if `uncertain`.

    A reference is kept on the disk and read from there the next time, unless `cache` is False: the folder is the
    variable RAYTRACER_CACHE, or the user's cache. `workers` processes trace (default: one for each processor). The
    result does not depend on their number. They are spawned, so a script needs `if __name__ == "__main__":`.
    `progress(done, expected)` is called with numbers of samples.

    Warns (UserWarning) as `render`, and of more than a minute and of much memory. Raises InputError for a wrong value,
    and for a scene or a size that needs more memory than this machine has.
    """
    scene = checked_scene(scene)
    chosen = SettingsPatch.without_none(shading=shading, shadows=shadows, bounces=bounces)
    used = (checked_patch(settings).without_sampling() | chosen).resolve()
    size = check_size(size)
    samples, tolerance = check_accuracy(samples, tolerance)
    cache = check_flag(cache, "cache")
    if workers is not None:
        workers = whole(workers, "workers", 1, _MOST_WORKERS)
    check_progress(progress)
    for warning in scene_warnings(scene, used.replace(precision=64)):
        warnings.warn(warning, stacklevel=2)
    check_cost(scene, size, workers)

    def announce(job: Job) -> None:
        if (takes := estimate_cost(job, workers)).seconds > WORTH_MENTION:
            warnings.warn(f"this takes {takes}", stacklevel=4)

    options: dict[str, Any] = {"samples": samples, "tolerance": tolerance, "cache": cache, "workers": workers}
    return trace_converged(scene, size, used, **options, progress=progress, before=announce)
