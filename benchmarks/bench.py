"""The bench: times of users' calls, ours and others' in turns, and whether pictures agree."""

import time
from collections.abc import Callable
from statistics import median

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from benchmarks import povray
from raytracer.gpu.device import Device
from raytracer.ground_truth import ray_tracer
from raytracer.scene.solids import leaves

Size = tuple[int, int]
Picture = NDArray[np.uint8]

# Of 255: by how much a value may differ. Rounding to 8 bits alone makes 1.
TOLERANCE = 3
# The share of pixels that may differ by more where the same rays are shot: rounding decides on which side of an
# outline some of them fall.
SAME_RAYS = 1e-4
# POV-Ray's rays through a pixel are not ours where there are several, so all outlines differ somewhat.
OTHER_RAYS = 0.01
# Calls of ours a round, so that one slow moment does not decide.
CALLS = 3
# The reference tests every ray against every leaf, in NumPy: some seconds for a few of them, and for
# 3,000 still where the picture is small. It is no help beyond.
_FEW, _MANY, _SMALL = 16, 4000, (64, 36)


class Agreement:
    """Agreement of pictures, in words; whether they are right."""

    def __init__(self) -> None:
        self.findings: list[str] = []
        self.right = True

    def compare(self, picture: Picture, truth: Picture, against: str, share: float = SAME_RAYS) -> None:
        """At most that `share` of the pixels may differ by more than the tolerance."""
        share_off = float(np.mean(np.abs(picture.astype(int) - truth).max(axis=2) > TOLERANCE))
        self.right &= share_off <= share
        self.findings.append(f"{100.0 * share_off:.2g} % off {against} (at most {100.0 * share:g} %)")

    def add(self, *, is_right: bool, finding: str) -> None:
        """Take a finding in words."""
        self.right &= is_right
        self.findings.append(finding)


def seconds(act: Callable[[], object]) -> float:
    """The seconds that an action takes."""
    begin = time.perf_counter()
    act()
    return time.perf_counter() - begin


def in_turns(
    rounds: int, ours: Callable[[], float], theirs: Callable[[], float], each: int = CALLS
) -> tuple[float, float]:
    """The medians of the seconds that two functions return, measured in turns: the machine is not ours alone.

    `each`: calls of `theirs` a round.
    """
    ours()  # compiles
    times: tuple[list[float], list[float]] = [], []
    for _ in range(rounds):
        times[0].extend(ours() for _ in range(CALLS))
        times[1].extend(theirs() for _ in range(each))
    return median(times[0]), median(times[1])


class Bench:
    """One device, one size of the pictures, and the number of rounds. `rt.render()` must use the same device."""

    def __init__(self, device: Device, size: Size, rounds: int) -> None:
        self.device, self.size, self.rounds = device, size, rounds
        self.software = any(name in device.limits.driver for name in ("llvmpipe", "softpipe"))
        self._traced: dict[tuple[str, int], tuple[Picture, float]] = {}

    def call(self, scene: rt.Scene, settings: rt.Settings, size: Size | None = None) -> float:
        """The seconds of a user's call `rt.render()`, which returns a picture in the processor's memory."""
        return seconds(lambda: rt.render(scene, size or self.size, settings))

    def traced(self, scene: rt.Scene, samples: int = 1, *, again: bool = False) -> tuple[Picture, float]:
        """POV-Ray's picture and seconds; of a run before, if there was one and it is not to run `again`."""
        text = povray.source(scene, self.size, rt.Settings())
        if again or (text, samples) not in self._traced:
            self._traced[text, samples] = povray.run(text, self.size, samples)
        return self._traced[text, samples]

    def agreement(self, scene: rt.Scene, samples: int = 1) -> Agreement:
        """How our picture compares with POV-Ray's where that is installed, and the reference's where that is quick."""
        agreement, settings = Agreement(), rt.Settings(samples=samples)
        if povray.version():
            share = SAME_RAYS if samples == 1 else OTHER_RAYS
            picture = rt.render(scene, self.size, settings).srgb8()
            agreement.compare(picture, self.traced(scene, samples)[0], "POV-Ray's", share)
        count = sum(len(leaves(solid)) for solid in scene.solids())
        if count <= _FEW or (not povray.version() and count <= _MANY):
            width, height = self.size
            size = _SMALL if count > _FEW else self.size if samples == 1 else (width // 4, height // 4)
            truth = ray_tracer.trace(scene, size, settings).srgb8()
            picture = rt.render(scene, size, settings).srgb8()
            agreement.compare(picture, truth, f"float64's, {size[0]}x{size[1]}")
        if not agreement.findings:
            agreement.findings.append("not compared: that takes povray")
        return agreement
