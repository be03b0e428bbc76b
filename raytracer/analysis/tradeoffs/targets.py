"""Reference pictures of the targets, with an estimate of a reference's own error."""

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
from raytracer.formats.estimate import LOWER_BOUND_FACTOR, UNSEEN, is_dominated_by_few
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene
from raytracer.scene.solids.flattening import leaves

ReferenceMethod = Literal["auto", "gpu", "float64"]
# The most primitives of a scene with a float64 reference in "auto". It intersects every ray with every primitive, in
# NumPy: larger scenes take hours.
FEW_PRIMITIVES = 48
# The number of samples of each of the two pictures of a GPU reference.
GPU_SAMPLES = 4096
# The limit of samples of a float64 reference, and the error from which a pixel gets more samples. A float64 picture
# that is only compared with the GPU reference has the defaults of converged.py instead.
SAMPLES, TOLERANCE = 4096, 1e-4
# An error is resolved from this multiple of the reference's own error on: at 3 times, the reference adds 5 % to a
# measured error. An uncertain reference may have three times its stated error.
RESOLVED_FROM, _UNCERTAIN_FROM = 3.0, 10.0


class Reference(NamedTuple):
    """A reference picture."""

    radiance: NDArray[np.float64]  # (H, W, 3)
    error: float  # the estimate of its own root mean square error
    kind: str  # a description of the method
    is_uncertain: bool = False  # whether the error is only a lower bound

    @property
    def in_words(self) -> str:
        """The error of the reference, in words."""
        return f"{'at least ' if self.is_uncertain else ''}{self.error:.2g}"

    @property
    def resolved_from(self) -> float:
        """The smallest measured error that can be distinguished from the reference's own error."""
        return (_UNCERTAIN_FROM if self.is_uncertain else RESOLVED_FROM) * self.error


def make_reference(
    target: Target,
    size: tuple[int, int],
    renderer: Renderer,
    method: ReferenceMethod = "auto",
    *,
    gpu_samples: int = GPU_SAMPLES,
    progress: Progress | None = None,
) -> Reference:
    """Draw the reference of `target` at `size`, on the GPU or by the float64 ray tracer.

    "auto" draws on the GPU, and for scenes of few primitives also states the distance from a float64 picture. The
    float64 picture has a larger error, because it gets fewer samples in acceptable time.
    """
    if target.same_samples:
        image = renderer.render(target.scene, size, target.settings, geometry=False, estimates=False)
        return Reference(image.radiance.astype(np.float64), 0.0, "the exact form, with the same samples")
    if method == "float64":
        return _trace_reference(target, size, SAMPLES, TOLERANCE, progress)
    by_gpu = _draw_reference(target, size, renderer, gpu_samples, progress)
    if method == "gpu" or count_primitives(target.scene) > FEW_PRIMITIVES:
        return by_gpu
    from raytracer.ground_truth import job

    other = _trace_reference(target, size, job.SAMPLES, job.TOLERANCE, progress)
    apart = math.sqrt(float(np.mean((by_gpu.radiance - other.radiance) ** 2)))
    return by_gpu._replace(
        kind=f"{by_gpu.kind}; differs by {apart:.2g} from float64, whose own error is {other.in_words}"
    )


def _trace_reference(
    target: Target, size: tuple[int, int], samples: int, tolerance: float, progress: Progress | None
) -> Reference:
    """Trace the converged picture in float64, or load it from the disk cache."""
    from raytracer.ground_truth.converged import trace_converged

    picture = trace_converged(
        target.scene, size, target.settings, samples=samples, tolerance=tolerance, progress=progress
    )
    estimate = picture.estimate
    assert estimate and estimate.rmse is not None
    kind = f"float64 reference, {estimate.samples:.0f} samples per pixel"
    return Reference(picture.radiance, estimate.rmse, kind, estimate.uncertain)


def count_primitives(scene: Scene) -> int:
    """Count the spheres and planes of a scene, including each instance."""
    return sum(len(leaves(solid)) for solid in scene.solids())


def _draw_reference(
    target: Target, size: tuple[int, int], renderer: Renderer, samples: int, progress: Progress | None
) -> Reference:
    """Draw a picture with Sobol' points and one with Roberts' sequence, and return their mean as the reference.

    The errors of the two pictures are independent, except for points on lights. So half their difference is the error
    of their mean; it is uncertain if few pixels hold most of it. Points on lights are the same in both pictures, and
    the estimate of the first picture covers their error. A picture of n samples shares n of these points with the
    reference, and so differs from it by up to n / `samples` less than from the exact picture.
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
            progress=_half_progress(progress, part),
        )
        for part, sequence in enumerate(("sobol", "r2"))
    )
    a, b = (image.radiance.astype(np.float64) for image in (first, second))
    squares = np.sum((a - b) ** 2, axis=2)
    error = math.sqrt(float(squares.mean()) / 3.0) / 2.0
    if few := is_dominated_by_few(squares):
        error *= LOWER_BOUND_FACTOR
    estimate = first.estimate
    assert estimate
    if estimate.rmse is not None and target.settings.shadows == "soft":
        error = max(error, estimate.rmse)
    kind = f"GPU, {settings.precision} bits, 2 x {samples} samples per pixel"
    return Reference((a + b) / 2.0, error, kind, few or estimate.unknown == UNSEEN)


def _half_progress(progress: Progress | None, part: int) -> Progress | None:
    """Return a progress callback for the first half (`part` 0) or the second half (`part` 1) of the work."""
    return progress and (lambda done, total: progress(done + part * total, 2 * total))
