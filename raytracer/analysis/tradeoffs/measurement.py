"""Measurement of time and error of all configurations, in rounds in which they take turns."""

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
from raytracer.analysis.tradeoffs.pareto import find_dominating
from raytracer.analysis.tradeoffs.targets import GPU_SAMPLES, Reference, ReferenceMethod, make_reference
from raytracer.compiler.glsl.preprocessor import ShaderError
from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.formats.image import Image
from raytracer.rendering.renderer import Renderer
from raytracer.scene.scene import Scene

# A function that opens a progress bar with a title.
Bar = Callable[[str], AbstractContextManager[Progress | None]]


class Result(msgspec.Struct):
    """The measurements of one configuration. Means are over the pixels of the picture at its full size."""

    configuration: Configuration
    seconds: list[float]  # the time in each round
    samples: float = 0.0  # mean number of samples per pixel
    rays: float = 0.0  # mean number of rays per pixel: camera rays, and at most one ray from each to every light
    error: Comparison | None = None
    resolved: bool = True  # whether the error is large enough to be distinguished from the reference's own
    beaten_by: str | None = None  # the fastest configuration that dominates this one; None on the Pareto front
    refused: str = ""  # the reason if there is no picture

    @property
    def median(self) -> float:
        """The median time in seconds."""
        return median(self.seconds)

    @property
    def measured(self) -> bool:
        """Whether the configuration has a time and an error."""
        return bool(self.seconds) and self.error is not None


class Tradeoffs(msgspec.Struct):
    """All measurements of a scene, and the machine that made them. `complete`: whether no Ctrl-C ended them early."""

    scene: str
    size: tuple[int, int]
    rounds: int  # the number of times that each configuration is measured
    machine: dict[str, str]
    plan: Plan
    references: dict[str, Reference]
    results: list[Result]
    complete: bool = False

    def results_for(self, target: str) -> list[Result]:
        """Return the results that were measured against a target."""
        return [result for result in self.results if result.configuration.target == target and result.measured]

    def results_for_knob(self, knob: str, target: str | None = None) -> list[Result]:
        """Return the series of a knob, optionally for one target only."""
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
    """Measure all configurations of `plan`. After Ctrl-C, return the measurements until then.

    The time covers Renderer.render() and resizing to the picture's size, but not compilation. Each configuration is
    rendered once for its compilation and its error, then `rounds` times, in turns with all others.

    Args:
        scene, plan, renderer: the scene, its configurations, and the renderer
        size: width and height of the pictures in pixels
        rounds: number of timed pictures of each configuration
        bar: opens a progress bar
        method: the reference of errors. Default: "auto" (see make_reference()).
        gpu_samples: samples per pixel of a GPU reference

    Raises KeyboardInterrupt if there is no measurement yet.
    """
    trade = Tradeoffs(scene.name, size, rounds, describe_machine(renderer), plan, {}, [])
    total = len(plan.configurations) * rounds
    try:
        for number, target in enumerate(plan.targets.values(), 1):
            place = f"({number} of {len(plan.targets)})"
            with bar(f"rendering the reference of {target.name} {place}") as progress:
                trade.references[target.name] = make_reference(
                    target, size, renderer, method, gpu_samples=gpu_samples, progress=progress
                )
            with bar(f"measuring {target.name} {place}") as progress:
                for configuration in plan.configurations:
                    if configuration.target == target.name:
                        trade.results.append(_measure_first(configuration, trade, renderer))
                        if progress:
                            progress(len(trade.results), total)
        with bar(f"timing all {len(trade.results)} configurations in turns, {rounds} times") as progress:
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


def _measure_first(configuration: Configuration, trade: Tradeoffs, renderer: Renderer) -> Result:
    """Compile the programs, and measure a configuration's error and its time in the first round."""
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
    """Draw a configuration's picture at `size`, and return the picture and the duration in seconds."""
    scene = configuration.scene or target.scene
    begin = time.perf_counter()
    scaled = size[0] * configuration.scale, size[1] * configuration.scale
    image = renderer.render(
        scene,
        (max(1, round(scaled[0])), max(1, round(scaled[1]))),
        configuration.settings,
        geometry=False,
        estimates=configuration.estimates,
    )
    if configuration.scale != 1.0:
        image = msgspec.structs.replace(image, radiance=resize_picture(image.radiance, size))
    return image, time.perf_counter() - begin


def resize_picture(radiance: NDArray[Any], size: tuple[int, int]) -> NDArray[np.float32]:
    """Resize a picture (H, W, 3): by averages over boxes if it becomes smaller, else bilinearly."""
    from PIL import Image as Pillow

    method = Pillow.Resampling.BOX if size[0] < radiance.shape[1] else Pillow.Resampling.BILINEAR
    channels = [Pillow.fromarray(np.ascontiguousarray(radiance[..., k], np.float32)) for k in range(3)]
    return np.stack([np.asarray(channel.resize(size, method)) for channel in channels], axis=-1)


def _judge(trade: Tradeoffs) -> None:
    """Find each target's Pareto front. Errors that the reference does not resolve count as the smallest it resolves."""
    for name, reference in trade.references.items():
        results = trade.results_for(name)
        floor = reference.resolved_from
        points = [(result.median, max(result.error.rmse, floor) if result.error else floor) for result in results]
        for result, other in zip(results, find_dominating(points), strict=True):
            result.beaten_by = None if other is None else results[other].configuration.label
