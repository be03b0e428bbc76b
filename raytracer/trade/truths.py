"""What pictures are compared with, and how far off that is itself."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.checks import InputError
from raytracer.progress import Progress
from raytracer.renderer import Renderer
from raytracer.scene import Scene
from raytracer.settings import Settings
from raytracer.solids import leaves
from raytracer.trade.configurations import Target

Source = Literal["auto", "float64", "gpu"]
# The float64 reference meets every primitive with every ray, in NumPy: beyond it takes hours.
FEW_PRIMITIVES = 48
# Its samples a pixel at most, and what a pixel may be off by before it gets them.
SAMPLES, TOLERANCE = 4096, 1e-4
# Of each of the two pictures that the GPU makes.
GPU_SAMPLES = 4096
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
    """What `target` is at `size`, by the float64 reference or by the GPU."""
    if target.same_samples:
        image = renderer.render(target.scene, size, target.settings, geometry=False, estimates=False)
        return Truth(image.radiance.astype(np.float64), 0.0, "the exact form's picture, of the same samples")
    if source == "float64" or (source == "auto" and count_primitives(target.scene) <= FEW_PRIMITIVES):
        from raytracer.truth import truth

        found = truth(
            target.scene, size, target.settings, samples=SAMPLES, tolerance=TOLERANCE, cache=True, progress=progress
        )
        error = math.sqrt(float(np.mean(found.error**2))) if found.error is not None else math.inf
        return Truth(found.radiance, error, f"float64 reference, {found.samples.mean():.0f} samples a pixel")  # pyright: ignore[reportOptionalMemberAccess]
    return _by_gpu(target, size, renderer, gpu_samples, progress)


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
    bits = 64
    try:
        renderer.limits.check(target.scene, msgspec.structs.replace(target.settings, precision=64))
    except InputError:
        bits = 32
    first, second = (
        renderer.render(
            target.scene,
            size,
            Settings(
                samples=samples,
                sequence=sequence,
                precision=bits,
                shadows=target.settings.shadows,
                shading=target.settings.shading,
            ),
            geometry=False,
            progress=_half(progress, part),
        )
        for part, sequence in enumerate(("sobol", "r2"))
    )
    a, b = (image.radiance.astype(np.float64) for image in (first, second))
    error = math.sqrt(float(np.mean((a - b) ** 2))) / 2.0
    if first.estimate and first.estimate.rmse is not None and target.settings.shadows == "soft":
        error = max(error, first.estimate.rmse)
    kind = f"GPU, {bits} bits, 2 x {samples} samples a pixel"
    return Truth((a + b) / 2.0, error, kind)


def _half(progress: Progress | None, part: int) -> Progress | None:
    """The first or second half of a progress."""
    return progress and (lambda done, total: progress(done + part * total, 2 * total))
