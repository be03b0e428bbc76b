"""Cost and error of each configuration, measured in turns."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from statistics import median
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.analysis.image_difference import Comparison, compare
from raytracer.analysis.machine import describe_machine
from raytracer.analysis.tradeoffs.configurations import Configuration, Plan, Target
from raytracer.analysis.tradeoffs.pareto import beaten_by
from raytracer.analysis.tradeoffs.targets import GPU_SAMPLES, Reference, ReferenceMethod, make_reference
from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene

# Makes a progress bar with a title.
Bar = Callable[[str], AbstractContextManager[Progress | None]]


class Result(msgspec.Struct):
    """The measurements of one configuration.

    `seconds`: one for each round. `samples` and `rays` are means over the pixels of the picture at its full size; rays
    are those from the camera and at most one from each to every light. `refused`: why there is no picture.
    `beaten_by`: the fastest configuration that is neither slower nor more wrong; None on the front.
    """

    configuration: Configuration
    seconds: list[float]
    samples: float = 0.0
    rays: float = 0.0
    error: Comparison | None = None
    resolved: bool = True
    beaten_by: str | None = None
    refused: str = ""

    @property
    def median(self) -> float:
        """Seconds."""
        return median(self.seconds)

    @property
    def measured(self) -> bool:
        """Whether there are a time and an error."""
        return bool(self.seconds) and self.error is not None


class Tradeoffs(msgspec.Struct):
    """All measurements of a scene, and the machine; `complete` unless Ctrl-C ended them."""

    scene: str
    size: tuple[int, int]
    rounds: int
    machine: dict[str, str]
    plan: Plan
    references: dict[str, Reference]
    results: list[Result]
    complete: bool = False

    def of(self, target: str) -> list[Result]:
        """The results that were measured against that target."""
        return [result for result in self.results if result.configuration.target == target and result.measured]

    def of_knob(self, knob: str, target: str | None = None) -> list[Result]:
        """The series of a knob."""
        return [
            result
            for result in self.results
            if knob in result.configuration.knobs and result.measured and target in (None, result.configuration.target)
        ]


def measure_tradeoffs(
    scene: Scene,
    plan: Plan,
    renderer: Renderer,
    size: tuple[int, int],
    rounds: int,
    bar: Bar,
    *,
    method: ReferenceMethod = "auto",
    gpu_samples: int = GPU_SAMPLES,
) -> Tradeoffs:
    """Measure everything of `plan`, as far as it gets: Ctrl-C ends it, and what was measured by then is there.

    Time is that of the whole of Renderer.render() and of bringing the picture to its size, once programs are compiled.
    Each is rendered once for that, and its error; then `rounds` times, in turns with all others.
    Raises KeyboardInterrupt if there is nothing yet.
    """
    trade = Tradeoffs(scene.name, size, rounds, describe_machine(renderer), plan, {}, [])
    total = len(plan.configurations) * rounds
    try:
        for target in plan.targets.values():
            with bar(f"the reference of {target.name}") as progress:
                trade.references[target.name] = make_reference(
                    target, size, renderer, method, gpu_samples=gpu_samples, progress=progress
                )
            with bar(f"measuring {target.name}") as progress:
                for configuration in plan.configurations:
                    if configuration.target == target.name:
                        trade.results.append(_first(configuration, trade, renderer))
                        if progress:
                            progress(len(trade.results), total)
        with bar("measuring in turns") as progress:
            for k in range(len(trade.results), total):
                result = trade.results[k % len(trade.results)]
                if not result.refused:
                    target = plan.targets[result.configuration.target]
                    result.seconds.append(time_picture(result.configuration, target, renderer, size)[1])
                if progress:
                    progress(k + 1, total)
        trade.complete = True
    except KeyboardInterrupt:
        if not any(result.measured for result in trade.results):
            raise
    _judge(trade)
    return trade


def _first(configuration: Configuration, trade: Tradeoffs, renderer: Renderer) -> Result:
    """Measure the error of a configuration's picture, which compiles the programs; then the time of the first round."""
    target, reference = trade.plan.targets[configuration.target], trade.references[configuration.target]
    result = Result(configuration, [])
    try:
        image, _ = time_picture(configuration, target, renderer, trade.size)
        result.error = compare(image.radiance, reference.radiance)
    except (InputError, ShaderError) as error:
        result.refused = str(error).partition("\n")[0]
        return result
    result.resolved = result.error.rmse > reference.resolved_from or target.same_samples
    if image.estimate:
        result.samples = image.estimate.samples * configuration.scale**2
    lights = 0 if configuration.settings.shadows == "off" else len(target.scene.lights)
    result.rays = result.samples * (1 + lights)
    result.seconds.append(time_picture(configuration, target, renderer, trade.size)[1])
    return result


def time_picture(
    configuration: Configuration, target: Target, renderer: Renderer, size: tuple[int, int]
) -> tuple[Image, float]:
    """Draw a configuration's picture at `size`; return it with the seconds that it took."""
    scene = configuration.scene or target.scene
    begin = time.perf_counter()
    made = size[0] * configuration.scale, size[1] * configuration.scale
    image = renderer.render(
        scene,
        (max(1, round(made[0])), max(1, round(made[1]))),
        configuration.settings,
        geometry=False,
        estimates=configuration.estimates,
    )
    if configuration.scale != 1.0:
        image = msgspec.structs.replace(image, radiance=resized(image.radiance, size))
    return image, time.perf_counter() - begin


def resized(radiance: NDArray[Any], size: tuple[int, int]) -> NDArray[np.float32]:
    """A picture (H, W, 3) at another size: averaged over boxes if it gets smaller, bilinear if larger."""
    from PIL import Image as Pillow

    how = Pillow.Resampling.BOX if size[0] < radiance.shape[1] else Pillow.Resampling.BILINEAR
    channels = [Pillow.fromarray(np.ascontiguousarray(radiance[..., k], np.float32)) for k in range(3)]
    return np.stack([np.asarray(channel.resize(size, how)) for channel in channels], axis=-1)


def _judge(trade: Tradeoffs) -> None:
    """Find each target's front. Errors below what its reference resolves count as that."""
    for name, reference in trade.references.items():
        results = trade.of(name)
        floor = reference.resolved_from
        points = [(result.median, max(result.error.rmse, floor) if result.error else floor) for result in results]
        for result, other in zip(results, beaten_by(points), strict=True):
            result.beaten_by = None if other is None else results[other].configuration.label
