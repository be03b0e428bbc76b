"""What pictures are compared with, and how far off that is itself."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.tradeoffs.configurations import Target
from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.solids import leaves

Source = Literal["auto", "gpu", "float64"]
# The float64 reference meets every primitive with every ray, in NumPy: beyond it takes hours.
FEW_PRIMITIVES = 48
# Of each of the two pictures that the GPU makes.
GPU_SAMPLES = 4096
# Samples a pixel at most of a reference that is the truth, and what a pixel may be off by before it gets them. One that
# is only to be compared with has what converged.py has by default.
SAMPLES, TOLERANCE = 4096, 1e-4
# What differs from a truth by less than so many times its own error is not resolved: at 3 times, that error adds
# 5 % to what is measured.
RESOLVED = 3.0


class Truth(NamedTuple):
    """`radiance` (H, W, 3) float64; `error`: its own estimated root mean square error; `kind`: how it was made."""

    radiance: NDArray[np.float64]
    error: float
    kind: str


def make_truth(
    target: Target,
    size: tuple[int, int],
    renderer: Renderer,
    source: Source = "auto",
    *,
    gpu_samples: int = GPU_SAMPLES,
    progress: Progress | None = None,
) -> Truth:
    """What `target` is at `size`: by the GPU, or by the float64 reference.

    "auto" is the GPU's, and says how far the reference is from it, of scenes of few primitives: with as many samples as
    it can have in the time, the reference is off by more.
    """
    if target.same_samples:
        image = renderer.render(target.scene, size, target.settings, geometry=False, estimates=False)
        return Truth(image.radiance.astype(np.float64), 0.0, "the exact form's picture, of the same samples")
    if source == "float64":
        radiance, error, samples = _by_reference(target, size, SAMPLES, TOLERANCE, progress)
        return Truth(radiance, error, f"float64 reference, {samples:.0f} samples a pixel")
    found = _by_gpu(target, size, renderer, gpu_samples, progress)
    if source == "gpu" or count_primitives(target.scene) > FEW_PRIMITIVES:
        return found
    from raytracer.ground_truth import job

    radiance, error, _ = _by_reference(target, size, job.SAMPLES, job.TOLERANCE, progress)
    apart = math.sqrt(float(np.mean((found.radiance - radiance) ** 2)))
    return found._replace(
        kind=f"{found.kind}; {apart:.2g} from the float64 reference, which takes itself to be off by {error:.2g}"
    )


def _by_reference(
    target: Target, size: tuple[int, int], samples: int, tolerance: float, progress: Progress | None
) -> tuple[NDArray[np.float64], float, float]:
    """The float64 reference, kept on the disk; its own error, and its samples a pixel."""
    from raytracer.ground_truth.converged import trace_converged

    picture = trace_converged(
        target.scene, size, target.settings, samples=samples, tolerance=tolerance, progress=progress
    )
    assert picture.error is not None and picture.samples is not None
    return picture.radiance, math.sqrt(float(np.mean(picture.error**2))), float(picture.samples.mean())


def count_primitives(scene: Scene) -> int:
    """Spheres and planes, those of instances one by one."""
    return sum(len(leaves(solid)) for solid in scene.solids())


def _by_gpu(
    target: Target, size: tuple[int, int], renderer: Renderer, samples: int, progress: Progress | None
) -> Truth:
    """The mean of a picture by Sobol's and one by Roberts' sequence: they are off independently, but for the lights.

    So half their difference is the error of their mean. Their points on lights are the same: of these the first
    picture's own estimate tells. A picture of n samples has n points in common with it, and differs from it by up to
    n / `samples` less than from the truth.
    """
    settings = msgspec.structs.replace(target.settings, samples=samples, evaluator="cells", precision=64)
    try:
        renderer.limits.check(target.scene, settings)
    except InputError:
        settings = msgspec.structs.replace(settings, precision=32)
    first, second = (
        renderer.render(
            target.scene,
            size,
            msgspec.structs.replace(settings, sequence=sequence),
            geometry=False,
            progress=_half(progress, part),
        )
        for part, sequence in enumerate(("sobol", "r2"))
    )
    a, b = (image.radiance.astype(np.float64) for image in (first, second))
    error = math.sqrt(float(np.mean((a - b) ** 2))) / 2.0
    if first.estimate and first.estimate.rmse is not None and target.settings.shadows == "soft":
        error = max(error, first.estimate.rmse)
    kind = f"GPU, {settings.precision} bits, 2 x {samples} samples a pixel"
    return Truth((a + b) / 2.0, error, kind)


def _half(progress: Progress | None, part: int) -> Progress | None:
    """The first or second half of a progress."""
    return progress and (lambda done, total: progress(done + part * total, 2 * total))
