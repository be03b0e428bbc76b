"""The bench: times users' calls in turns with their peers, and checks that the pictures agree."""

import time
from collections.abc import Callable
from statistics import median

import numpy as np
from numpy.typing import NDArray

import raytracer as rt
from benchmarks import povray
from raytracer.gpu.device import Device
from raytracer.ground_truth import ray_tracer
from raytracer.scene.solids.flattening import leaves

Size = tuple[int, int]
Picture = NDArray[np.uint8]

# The largest difference of 8-bit values that counts as equal. Rounding to 8 bits alone causes a difference of 1.
TOLERANCE = 3
# The largest share of pixels with a larger difference, if both pictures use the same rays: rounding decides on which
# side of an outline a ray falls.
SAME_RAYS = 1e-4
# The same limit with several samples a pixel: POV-Ray uses other rays through the pixel, so all outlines differ
# somewhat.
OTHER_RAYS = 0.01
# Our calls in each round. More than one, so that a single slow moment does not decide the result.
CALLS = 3
# The reference tests every ray against every leaf, in NumPy. This takes some seconds for up to _FEW leaves, and for up
# to _MANY leaves (about 3,000 in practice) at the size _SMALL. Larger scenes are not compared with the reference.
_FEW, _MANY, _SMALL = 16, 4000, (64, 36)


class Agreement:
    """The agreement of a row's pictures with others: all `findings` in words, and whether all of them are `right`."""

    def __init__(self) -> None:
        self.findings: list[str] = []
        self.right = True

    def compare(self, picture: Picture, truth: Picture, against: str, share: float = SAME_RAYS) -> None:
        """Add a comparison: at most the `share` of the pixels may differ by more than TOLERANCE."""
        share_off = float(np.mean(np.abs(picture.astype(int) - truth).max(axis=2) > TOLERANCE))
        self.right &= share_off <= share
        self.findings.append(f"{100.0 * share_off:.2g} % off {against} (at most {100.0 * share:g} %)")

    def add(self, *, is_right: bool, finding: str) -> None:
        """Add a finding in words."""
        self.right &= is_right
        self.findings.append(finding)


def seconds(act: Callable[[], object]) -> float:
    """Return the seconds that an action takes."""
    begin = time.perf_counter()
    act()
    return time.perf_counter() - begin


def in_turns(
    rounds: int, ours: Callable[[], float], theirs: Callable[[], float], peer_calls: int = CALLS
) -> tuple[float, float]:
    """Return the medians of the seconds that two functions return.

    The functions take turns, because other work on the machine then slows down both.

    Args:
        rounds: The number of rounds.
        ours: Returns the seconds of our call. Called CALLS times in each round.
        theirs: Returns the seconds of the peer's call.
        peer_calls: Calls of `theirs` in each round.
    """
    ours()  # compiles
    times: tuple[list[float], list[float]] = [], []
    for _ in range(rounds):
        times[0].extend(ours() for _ in range(CALLS))
        times[1].extend(theirs() for _ in range(peer_calls))
    return median(times[0]), median(times[1])


class Bench:
    """The conditions of a benchmark: the device, the picture size, and the rounds.

    `rt.render()` must use the same device.
    """

    def __init__(self, device: Device, size: Size, rounds: int) -> None:
        self.device, self.size, self.rounds = device, size, rounds
        self.software = any(name in device.limits.driver for name in ("llvmpipe", "softpipe"))
        self._traced: dict[tuple[str, int], tuple[Picture, float]] = {}

    def call(self, scene: rt.Scene, settings: rt.Settings, size: Size | None = None) -> float:
        """Return the seconds of a user's call `rt.render()`, which returns a picture in the processor's memory."""
        return seconds(lambda: rt.render(scene, size or self.size, settings))

    def traced(self, scene: rt.Scene, samples: int = 1, *, again: bool = False) -> tuple[Picture, float]:
        """Return POV-Ray's picture and trace time. An earlier run is reused unless `again` is set."""
        text = povray.source(scene, self.size, rt.Settings())
        if again or (text, samples) not in self._traced:
            self._traced[text, samples] = povray.run(text, self.size, samples)
        return self._traced[text, samples]

    def agreement(self, scene: rt.Scene, samples: int = 1) -> Agreement:
        """Compare our picture with POV-Ray's if POV-Ray is installed, and with the reference if tracing it is quick."""
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
