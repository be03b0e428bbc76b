"""The rows of the table: a measurement against a peer, and the ratio that it should reach."""

import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from PIL import Image as Pillow

import raytracer as rt
from benchmarks import scenes
from benchmarks.bench import OTHER_RAYS, Agreement, Bench, in_turns
from benchmarks.literal import Literal
from benchmarks.povray import UnavailableError
from raytracer.ground_truth import ray_tracer
from tests.processes import finished

_CHECKOUT = Path(__file__).parent.parent
# How far the light moves from frame to frame, in the scene's unit: never back, so that nothing kept of it helps.
_STEP = 0.01
# Largest first: the first whose error is small enough is the fastest.
_THRESHOLDS = (0.1, 0.09, 0.08, 0.07, 0.06, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
_MORE_ERROR = 1.1
_MANY_SAMPLES = 1024
# A process's bare cost: what the command line cannot do without.
BARE_PROCESS = """
import numpy, moderngl
context = moderngl.create_context(standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
frame = context.simple_framebuffer((1280, 720))
frame.clear()
numpy.frombuffer(frame.read(), numpy.uint8)
"""
# What the script `raytracer` does that pip installs.
SCRIPT = "import sys; from raytracer.app.cli import main; sys.exit(main())"


@dataclass(frozen=True)
class Timing:
    """Seconds of ours and of theirs, and how the pictures agree. `note` stands with the row."""

    ours: float
    theirs: float
    agreement: Agreement
    note: str = ""


@dataclass(frozen=True)
class SpeedRow:
    """`wanted`: how many times faster than `against` the work should be; or, if `at_most`, how long it may take."""

    group: str
    work: str
    against: str
    wanted: float
    measure: Callable[[Bench], Timing]
    at_most: bool = False

    def ratio(self, timing: Timing) -> float:
        """The ratio that is compared with `wanted`."""
        return timing.ours / timing.theirs if self.at_most else timing.theirs / timing.ours

    def reached(self, timing: Timing) -> bool:
        """Whether it is as fast as it should be."""
        return self.ratio(timing) <= self.wanted if self.at_most else self.ratio(timing) >= self.wanted


def _assignment() -> rt.Scene:
    return rt.load("assignment")


def _against_povray(scene: Callable[[], rt.Scene], bench: Bench, samples: int = 1, once: bool = False) -> Timing:
    """`once`: POV-Ray takes so long that one run is enough."""
    made, settings = scene(), rt.Settings(samples=samples)
    ours, theirs = in_turns(
        bench.rounds,
        lambda: bench.frame(made, settings),
        lambda: bench.traced(made, samples, again=not once)[1],
        each=1,
    )
    return Timing(ours, theirs, bench.agreement(made, samples))


def _against_literal(bench: Bench) -> Timing:
    scene = _assignment()
    with Literal(bench.context, scene, bench.size) as literal:
        literal.frame()  # compiles
        ours, theirs = in_turns(bench.rounds, lambda: bench.frame(scene, rt.Settings()), literal.frame)
        agreement = bench.agreement(scene)
        truth = ray_tracer.trace(scene, bench.size).srgb8()
        # Its shadow rays' bias and its roots' cancellation show at outlines.
        agreement.compare(literal.picture(), truth, "float64's by the literal shader", OTHER_RAYS)
    return Timing(ours, theirs, agreement)


def _against_fewer(bench: Bench) -> Timing:
    few, more, settings = scenes.many(1_000), scenes.many(10_000), rt.Settings()
    bench.frame(few, settings)
    ours, theirs = in_turns(bench.rounds, lambda: bench.frame(more, settings), lambda: bench.frame(few, settings))
    return Timing(ours, theirs, bench.agreement(more))


def _light_moved(bench: Bench) -> Timing:
    scene, settings, steps = scenes.many(10_000), rt.Settings(), itertools.count(1)

    def moved() -> rt.Scene:
        x, y, z = scene.lights[0].position
        return msgspec.structs.replace(scene, lights=[rt.PointLight((x + _STEP * next(steps), y, z))])

    ours, theirs = in_turns(
        bench.rounds,
        lambda: bench.first_frame(moved, settings),
        lambda: bench.frame(scene, settings),
    )
    return Timing(ours, theirs, bench.agreement(moved()), "with what it takes to make the scene anew")


def _adaptive(bench: Bench) -> Timing:
    scene, full = _assignment(), rt.Settings(samples=16)
    candidates = [msgspec.structs.replace(full, adaptive=threshold) for threshold in _THRESHOLDS]
    truth = bench.radiance(scene, rt.Settings(samples=_MANY_SAMPLES))

    def error(settings: rt.Settings) -> float:
        return float(np.sqrt(np.mean((bench.rendered(scene, settings).radiance - truth) ** 2)))

    of_full = error(full)
    errors = ((settings, error(settings)) for settings in candidates)
    best = next(((s, e) for s, e in errors if e <= _MORE_ERROR * of_full), None)
    if best is None:
        raise UnavailableError(f"no threshold down to {_THRESHOLDS[-1]} has an error within 10 % of {of_full:.2e}")
    settings, of_adaptive = best
    ours, theirs = in_turns(bench.rounds, lambda: bench.summed(scene, settings), lambda: bench.summed(scene, full))
    agreement = bench.agreement(scene, full.samples)
    agreement.findings.append(f"error {of_adaptive:.2e}, of full {of_full:.2e}")
    return Timing(ours, theirs, agreement, f"T = {settings.adaptive}, both with the read-back")


def _unread_geometry(bench: Bench) -> Timing:
    scene = _assignment()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "picture.png")
        ours, theirs = in_turns(
            bench.rounds,
            lambda: bench.saved(scene, path, geometry=True),
            lambda: bench.saved(scene, path, geometry=False),
        )
    return Timing(ours, theirs, bench.agreement(scene))


def _command_line(bench: Bench, new: bool) -> Timing:
    """`new`: also to Mesa, which otherwise has the compiled programs on disk."""
    size = 1280, 720
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "picture.png")
        command = ("-c", SCRIPT, "render", "assignment", "-o", str(output), "--size", f"{size[0]}x{size[1]}")
        runs = itertools.count()

        def cache() -> Mapping[str, str]:
            return {"MESA_SHADER_CACHE_DIR": f"{folder}/{next(runs) if new else 'cache'}"}

        ours, theirs = in_turns(
            bench.rounds,
            lambda: process_seconds(*command, variables=cache()),
            lambda: process_seconds("-c", BARE_PROCESS, variables=cache()),
        )
        with Pillow.open(output) as image:
            picture = np.asarray(image.convert("RGB"))
    agreement = Agreement()
    agreement.compare(picture, ray_tracer.trace(_assignment(), size).srgb8(), f"float64's, {size[0]}x{size[1]}")
    return Timing(ours, theirs, agreement)


def process_seconds(*arguments: str, variables: Mapping[str, str]) -> float:
    """The seconds that a new Python takes. Raises UnavailableError if it fails."""
    # With bytecode, which pip compiles when it installs, NumPy's and ours; what keeps Python from it is ours alone.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    begin = time.perf_counter()
    done = finished(sys.executable, *arguments, cwd=_CHECKOUT, env={**environment, **variables})
    if done.returncode:
        raise UnavailableError(done.stderr.strip().rpartition("\n")[2])
    return time.perf_counter() - begin


_POVRAY, _ITSELF = "POV-Ray", "itself"
ROWS = [
    SpeedRow("assignment", "assignment, 1 sample", _POVRAY, 15, partial(_against_povray, _assignment)),
    SpeedRow("assignment", "assignment, 4 samples", _POVRAY, 12, partial(_against_povray, _assignment, samples=4)),
    SpeedRow("assignment", "assignment, 16 samples", _POVRAY, 12, partial(_against_povray, _assignment, samples=16)),
    SpeedRow("literal", "assignment, 1 sample", "the literal shader", 15, _against_literal),
    SpeedRow("many", "1,000 objects", _POVRAY, 15, partial(_against_povray, partial(scenes.many, 1_000))),
    SpeedRow("many", "10,000 objects", _POVRAY, 20, partial(_against_povray, partial(scenes.many, 10_000))),
    SpeedRow("many", "10,000 objects", "1,000 objects", 2.5, _against_fewer, at_most=True),
    SpeedRow("light", "10,000 objects, light moved", "the same, light still", 2, _light_moved, at_most=True),
    *(
        SpeedRow("holes", work, _POVRAY, 150, partial(_against_povray, partial(scenes.holes, chain), once=True))
        for work, chain in (("sphere minus a union of 999", False), ("sphere minus 999, one by one", True))
    ),
    SpeedRow("adaptive", "assignment, 16 samples, adaptive", "full 16 samples", 0.35, _adaptive, at_most=True),
    SpeedRow(
        "geometry", "assignment, saved as .png", "the same with geometry=False", 1.1, _unread_geometry, at_most=True
    ),
    SpeedRow("cold", "command line, again", "a bare process", 1.5, partial(_command_line, new=False), at_most=True),
    SpeedRow("cold", "command line, first ever", "a bare process", 1.5, partial(_command_line, new=True), at_most=True),
]
# Frames a second are counted of these, and of so many samples.
SCENES: dict[str, tuple[Callable[[], rt.Scene], int]] = {
    "assignment, 1 sample": (_assignment, 1),
    "assignment, 16 samples": (_assignment, 16),
    "1,000 objects": (partial(scenes.many, 1_000), 1),
    "10,000 objects": (partial(scenes.many, 10_000), 1),
    "sphere minus a union of 999": (partial(scenes.holes, False), 1),
}
