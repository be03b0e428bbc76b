"""References: the pictures that others are compared with, and an estimate of how far off a reference is itself."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.tradeoffs.configurations import Target
from raytracer.compiler.compiled_scene import compile
from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.formats.estimate import LEAST, UNSEEN, rests_on_few
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.solids import leaves

ReferenceMethod = Literal["auto", "gpu", "float64"]
# The float64 reference meets every primitive with every ray, in NumPy: beyond it takes hours.
FEW_PRIMITIVES = 48
# Of each of the two pictures that the GPU makes.
GPU_SAMPLES = 4096
# The most samples of a pixel of a reference by float64, and the error from which a pixel gets more. One that is only
# compared with the GPU's has the defaults of converged.py.
SAMPLES, TOLERANCE = 4096, 1e-4
# Errors below so many times the reference's own are not resolved: at 3 times, its error adds 5 % to a measured one. An
# uncertain one may be three times as large as it says.
RESOLVED_FROM, _UNCERTAIN_FROM = 3.0, 10.0


class Reference(NamedTuple):
    """`radiance` (H, W, 3) float64; `error`: its own estimated root mean square error; `kind`: how it was made.

    `uncertain`: the error is that or more.
    """

    radiance: NDArray[np.float64]
    error: float
    kind: str
    uncertain: bool = False

    @property
    def in_words(self) -> str:
        """The error of the reference."""
        return f"{'at least ' if self.uncertain else ''}{self.error:.2g}"

    @property
    def resolved_from(self) -> float:
        """The error from which errors that are measured against the reference are not the reference's own."""
        return (_UNCERTAIN_FROM if self.uncertain else RESOLVED_FROM) * self.error


def make_reference(
    target: Target,
    size: tuple[int, int],
    renderer: Renderer,
    method: ReferenceMethod = "auto",
    *,
    gpu_samples: int = GPU_SAMPLES,
    progress: Progress | None = None,
) -> Reference:
    """Draw the reference of `target` at `size`: by the GPU, or by the float64 ray tracer.

    "auto" is the GPU's. For scenes of few primitives it also says how far the float64 one is from it: that one is off
    by more, with as many samples as it can have in the time.
    """
    if target.same_samples:
        image = renderer.render(target.scene, size, target.settings, geometry=False, estimates=False)
        return Reference(image.radiance.astype(np.float64), 0.0, "the exact form's picture, of the same samples")
    if method == "float64":
        return _by_float64(target, size, SAMPLES, TOLERANCE, progress)
    by_gpu = _by_gpu(target, size, renderer, gpu_samples, progress)
    if method == "gpu" or count_primitives(target.scene) > FEW_PRIMITIVES:
        return by_gpu
    from raytracer.ground_truth import job

    other = _by_float64(target, size, job.SAMPLES, job.TOLERANCE, progress)
    apart = math.sqrt(float(np.mean((by_gpu.radiance - other.radiance) ** 2)))
    return by_gpu._replace(
        kind=f"{by_gpu.kind}; {apart:.2g} from the float64 reference, which takes itself to be off by {other.in_words}"
    )


def _by_float64(
    target: Target, size: tuple[int, int], samples: int, tolerance: float, progress: Progress | None
) -> Reference:
    """The converged picture in float64, kept on the disk."""
    from raytracer.ground_truth.converged import trace_converged

    picture = trace_converged(
        target.scene, size, target.settings, samples=samples, tolerance=tolerance, progress=progress
    )
    estimate = picture.estimate
    assert estimate and estimate.rmse is not None
    kind = f"float64 reference, {estimate.samples:.0f} samples a pixel"
    return Reference(picture.radiance, estimate.rmse, kind, estimate.uncertain)


def count_primitives(scene: Scene) -> int:
    """Spheres and planes, those of instances one by one."""
    return sum(len(leaves(solid)) for solid in scene.solids())


def _by_gpu(
    target: Target, size: tuple[int, int], renderer: Renderer, samples: int, progress: Progress | None
) -> Reference:
    """The mean of a picture by Sobol's and one by Roberts' sequence: they are off independently, but for the lights.

    So half their difference is the error of their mean, and uncertain where few pixels hold most of it. Their points on
    lights are the same: of these the first picture's own estimate tells. A picture of n samples has n points in common
    with it, and differs from it by up to n / `samples` less than from the exact one.
    """
    settings = msgspec.structs.replace(target.settings, samples=samples, evaluator="cells", precision=64)
    try:
        renderer.device.limits.check(compile(target.scene, settings.compile_options))
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
    squares = np.sum((a - b) ** 2, axis=2)
    error = math.sqrt(float(squares.mean()) / 3.0) / 2.0
    if few := rests_on_few(squares):
        error *= LEAST
    estimate = first.estimate
    assert estimate
    if estimate.rmse is not None and target.settings.shadows == "soft":
        error = max(error, estimate.rmse)
    kind = f"GPU, {settings.precision} bits, 2 x {samples} samples a pixel"
    return Reference((a + b) / 2.0, error, kind, few or estimate.unknown == UNSEEN)


def _half(progress: Progress | None, part: int) -> Progress | None:
    """The first or second half of a progress."""
    return progress and (lambda done, total: progress(done + part * total, 2 * total))
