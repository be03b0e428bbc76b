"""The rows of the speed benchmark: users' calls, their peers, and the ratios to be reached."""

import csv
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from PIL import Image as Pillow

import raytracer as rt
from benchmarks import light_frames, scenes, solid_scenes
from benchmarks.bare import BareDraws
from benchmarks.bench import OTHER_RAYS, Agreement, Bench, in_turns, seconds
from benchmarks.literal import Literal
from benchmarks.povray import UnavailableError
from raytracer.ground_truth import ray_tracer
from tests.processes import run_to_end

_CHECKOUT = Path(__file__).parent.parent
# The movement of the light from call to call, in the scene's unit. It never returns, so that no kept list fits again.
_STEP = 0.01
# Thresholds of `adaptive`. The largest come first, because the first that is accurate enough is the fastest.
_THRESHOLDS = (0.1, 0.09, 0.08, 0.07, 0.06, 0.05, 0.03, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005)
_MORE_ERROR = 1.1
_MANY_SAMPLES = 1024
# Two numbers of samples that take about the same time, so that calls with either can take turns.
_NUMBERS = 15, 16
# The primitives of light_frames.crowd(), 20,000 spheres and a floor, and the lights on the floor.
_CROWD, _FEW_LIGHTS, _MANY_LIGHTS = 20_001, 1, 20
# The bare process: the part of the command line's work that it cannot avoid.
BARE_PROCESS = """
import numpy, moderngl
context = moderngl.create_context(standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
frame = context.simple_framebuffer((1280, 720))
frame.clear()
numpy.frombuffer(frame.read(), numpy.uint8)
"""
# The content of the script `raytracer` that pip installs.
SCRIPT = "import sys; from raytracer.app.cli import main; sys.exit(main())"


@dataclass(frozen=True)
class Timing:
    """Seconds of our call and of the peer, and the agreement of their pictures. `note` is added to the row's name."""

    ours: float
    theirs: float
    agreement: Agreement | None = None
    note: str = ""


@dataclass(frozen=True)
class SpeedRow:
    """A row: a user's call, the peer `against`, and the goal.

    The call should be `goal` times faster than the peer, or with `at_most` take at most `goal` times as long.
    """

    group: str
    call: str
    against: str
    goal: float
    measure: Callable[[Bench], Timing]
    at_most: bool = False

    @property
    def is_in_docs(self) -> bool:
        """Whether docs/performance.md repeats the row: a user's call, or a frame of the window."""
        return self.group in ("assignment", "many", "holes", "solids", "first", "samples", "geometry", "window")

    def ratio(self, timing: Timing) -> float:
        """Return the ratio to compare with the goal."""
        return timing.ours / timing.theirs if self.at_most else timing.theirs / timing.ours

    def is_reached(self, timing: Timing) -> bool:
        """Return whether the call reaches the goal."""
        return self.ratio(timing) <= self.goal if self.at_most else self.ratio(timing) >= self.goal


def _assignment() -> rt.Scene:
    return rt.load("assignment")


def _against_povray(make: Callable[[], rt.Scene], bench: Bench, samples: int = 1, once: bool = False) -> Timing:
    """Time calls for one scene object. With `once` POV-Ray runs only once, because it takes minutes."""
    scene, settings = make(), rt.Settings(samples=samples)
    ours, theirs = in_turns(
        bench.rounds,
        lambda: bench.call(scene, settings),
        lambda: bench.traced(scene, samples, again=not once)[1],
        peer_calls=1,
    )
    return Timing(ours, theirs, bench.agreement(scene, samples))


def _first_against_povray(make: Callable[[], rt.Scene], bench: Bench) -> Timing:
    """Time calls for a new scene, without the time to make it. Programs are compiled already."""
    other = rt.Scene([rt.Sphere((0, 0, 0), 1, scenes.GREY)], [], rt.Camera((0, 0, 5), (0, 0, 0)))

    def call() -> float:
        # A picture of another scene first: the renderer keeps the last scene, also for a new scene of equal solids.
        bench.call(other, rt.Settings())
        return bench.call(make(), rt.Settings())

    ours, theirs = in_turns(
        bench.rounds,
        call,
        lambda: bench.traced(make(), again=True)[1],
        peer_calls=1,
    )
    return Timing(ours, theirs, bench.agreement(make()))


def _against_literal(bench: Bench) -> Timing:
    scene = _assignment()
    with Literal(bench.device, scene, bench.size) as literal:
        with closing(BareDraws(bench.device, scene, rt.Settings(), bench.size)) as bare:
            seconds(literal.draw)  # compiles
            ours, theirs = in_turns(bench.rounds, lambda: seconds(bare.draw), lambda: seconds(literal.draw))
        agreement = bench.agreement(scene)
        truth = ray_tracer.trace(scene, bench.size).srgb8()
        # The bias of its shadow rays and the cancellation in its roots show at outlines.
        agreement.compare(literal.picture(), truth, "float64's by the literal shader", OTHER_RAYS)
    return Timing(ours, theirs, agreement)


def _against_fewer(bench: Bench) -> Timing:
    few, more, settings = scenes.many(1_000), scenes.many(10_000), rt.Settings()
    bench.call(few, settings)
    ours, theirs = in_turns(bench.rounds, lambda: bench.call(more, settings), lambda: bench.call(few, settings))
    return Timing(ours, theirs, bench.agreement(more))


def _light_moved(bench: Bench) -> Timing:
    scene, settings, steps = scenes.many(10_000), rt.Settings(), itertools.count(1)

    def move_light() -> rt.Scene:
        x, y, z = scene.lights[0].position
        return scene.replace(lights=[rt.PointLight((x + _STEP * next(steps), y, z))])

    ours, theirs = in_turns(
        bench.rounds, lambda: bench.call(move_light(), settings), lambda: bench.call(scene, settings)
    )
    return Timing(ours, theirs, bench.agreement(move_light()))


def _other_samples(make: Callable[[], rt.Scene], bench: Bench, estimates: bool = True) -> Timing:
    scene = make()
    few, more = (rt.Settings(samples=n) for n in _NUMBERS)
    bare = partial(BareDraws, bench.device, scene, size=bench.size, estimates=estimates)
    with closing(bare(few)) as few_draws, closing(bare(more)) as more_draws:
        ours, theirs = in_turns(
            bench.rounds,
            lambda: bench.call(scene, few) + bench.call(scene, more),
            lambda: seconds(few_draws.draw_and_read) + seconds(more_draws.draw_and_read),
        )
        agreement = Agreement()
        agreement.add(is_right=more_draws.is_same(), finding="the bare draws give the same sums")
        is_same = np.array_equal(rt.render(scene, bench.size, more).radiance, more_draws.image.radiance)
        agreement.add(is_right=is_same, finding="a call in turns gives the same bits")
    return Timing(ours / 2.0, theirs / 2.0, agreement)


def _adaptive(bench: Bench) -> Timing:
    scene, full = _assignment(), rt.Settings(samples=16)
    candidates = [msgspec.structs.replace(full, adaptive=threshold) for threshold in _THRESHOLDS]
    truth = rt.render(scene, bench.size, samples=_MANY_SAMPLES).radiance

    def error(settings: rt.Settings) -> float:
        return float(np.sqrt(np.mean((rt.render(scene, bench.size, settings).radiance - truth) ** 2)))

    full_error = error(full)
    errors = ((settings, error(settings)) for settings in candidates)
    best = next(((s, e) for s, e in errors if e <= _MORE_ERROR * full_error), None)
    if best is None:
        raise UnavailableError(f"no threshold down to {_THRESHOLDS[-1]} has an error within 10 % of {full_error:.2e}")
    settings, adaptive_error = best
    ours, theirs = in_turns(bench.rounds, lambda: bench.call(scene, settings), lambda: bench.call(scene, full))
    agreement = bench.agreement(scene, full.samples)
    agreement.add(is_right=True, finding=f"error {adaptive_error:.2e}, of full {full_error:.2e}")
    return Timing(ours, theirs, agreement, f"T = {settings.adaptive}")


def _unread_geometry(bench: Bench) -> Timing:
    scene = _assignment()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x.png")
        ours, theirs = in_turns(
            bench.rounds,
            lambda: seconds(lambda: rt.render(scene, bench.size).save(path)),
            lambda: seconds(lambda: rt.render(scene, bench.size, geometry=False).save(path)),
        )
    return Timing(ours, theirs, bench.agreement(scene))


def _frame(bench: Bench, floor: str) -> Timing:
    """Time a frame of the window in a new process, because this process has no display.

    `floor`: a field of FrameTimes.
    """
    done = run_to_end(sys.executable, "-m", "benchmarks.frames", "assignment", "--csv", cwd=_CHECKOUT)
    if done.returncode:
        raise UnavailableError(done.stderr.strip().rpartition("\n")[2])
    times = next(row for row in csv.DictReader(done.stdout.splitlines()) if row["movement"] == "light")
    return Timing(float(times["whole"]), float(times[floor]))


def _more_lights(bench: Bench, change: str) -> Timing:
    """Time the preparation of a frame with many and with few lights. `change`: a change of light_frames."""
    numbers = itertools.count(1)
    few, more = (light_frames.Frames(_CROWD, lights, rt.Settings()) for lights in (_FEW_LIGHTS, _MANY_LIGHTS))
    for frames in (few, more):
        frames.milliseconds("all", 0)
    ours, theirs = in_turns(
        bench.rounds,
        lambda: more.milliseconds(change, next(numbers)) / 1000.0,
        lambda: few.milliseconds(change, next(numbers)) / 1000.0,
    )
    return Timing(ours, theirs)


def _command_line(bench: Bench, new: bool) -> Timing:
    """Time the command line. With `new` Mesa has to compile the programs, which it otherwise has on disk."""
    width, height = bench.size
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "picture.png")
        command = ("-c", SCRIPT, "render", "assignment", "-o", str(output), "--size", f"{width}x{height}")
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
    agreement.compare(picture, ray_tracer.trace(_assignment(), bench.size).srgb8(), f"float64's, {width}x{height}")
    return Timing(ours, theirs, agreement)


def process_seconds(*arguments: str, variables: Mapping[str, str]) -> float:
    """Return the seconds that a new Python process takes. Raises UnavailableError if the process fails."""
    # Python may write bytecode, as pip does when it installs packages. The variable that forbids it is set only here.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    begin = time.perf_counter()
    done = run_to_end(sys.executable, *arguments, cwd=_CHECKOUT, env={**environment, **variables})
    if done.returncode:
        raise UnavailableError(done.stderr.strip().rpartition("\n")[2])
    return time.perf_counter() - begin


_POVRAY = "POV-Ray's trace time"
_BARE = "its bare draws and read-back"
_MANY, _VERY_MANY = partial(scenes.many, 1_000), partial(scenes.many, 10_000)
ROWS = [
    SpeedRow("assignment", "assignment, 1 sample", _POVRAY, 13, partial(_against_povray, _assignment)),
    SpeedRow("assignment", "assignment, 4 samples", _POVRAY, 12, partial(_against_povray, _assignment, samples=4)),
    SpeedRow("assignment", "assignment, 16 samples", _POVRAY, 20, partial(_against_povray, _assignment, samples=16)),
    SpeedRow("many", "1,000 objects", _POVRAY, 10, partial(_against_povray, _MANY)),
    SpeedRow("many", "10,000 objects", _POVRAY, 10, partial(_against_povray, _VERY_MANY)),
    SpeedRow("many", "10,000 objects", "1,000 objects", 2.5, _against_fewer, at_most=True),
    *(
        SpeedRow("holes", work, _POVRAY, 100, partial(_against_povray, partial(scenes.holes, chain), once=True))
        for work, chain in (("sphere minus a union of 999", False), ("sphere minus 999, one by one", True))
    ),
    *(
        SpeedRow("solids", work, _POVRAY, goal, partial(_against_povray, make))
        for work, make, goal in (
            ("two dice", solid_scenes.dice, 8),
            ("plate with 100 holes", solid_scenes.plate, 8),
            ("1,000 boxes less cylinders", solid_scenes.boxes, 8),
            ("20 tori", solid_scenes.tori, 4),
        )
    ),
    SpeedRow("first", "assignment, scene made anew", _POVRAY, 10, partial(_first_against_povray, _assignment)),
    SpeedRow("first", "1,000 objects, scene made anew", _POVRAY, 5, partial(_first_against_povray, _MANY)),
    SpeedRow("first", "10,000 objects, scene made anew", _POVRAY, 5, partial(_first_against_povray, _VERY_MANY)),
    *(
        SpeedRow(
            "samples", f"{work}, 15 and 16 samples in turns", _BARE, 1.1, partial(_other_samples, make), at_most=True
        )
        for work, make in (("assignment", _assignment), ("1,000 objects", _MANY))
    ),
    SpeedRow(
        "samples",
        "assignment, 15 and 16 samples in turns",
        "the samples' draws and one read-back alone",
        1.1,
        partial(_other_samples, _assignment, estimates=False),
        at_most=True,
    ),
    SpeedRow(
        "geometry", 'assignment, .save("x.png")', "the same with geometry=False", 1.1, _unread_geometry, at_most=True
    ),
    SpeedRow("adaptive", "assignment, 16 samples, adaptive", "16 samples", 0.35, _adaptive, at_most=True),
    SpeedRow("light", "10,000 objects, light moved", "the same, light still", 2, _light_moved, at_most=True),
    *(
        SpeedRow("window", "frame while the light moves", against, 1.5, partial(_frame, floor=floor), at_most=True)
        for floor, against in (("draws", "its draws again and the swap"), ("passes", "the bare passes and the swap"))
    ),
    *(
        SpeedRow("lights", f"inner: numbers of a frame, 20 lights, {call}", "1 light", 2, measure, at_most=True)
        for call, measure in (
            ("the first", partial(_more_lights, change="all")),
            ("one light moves", partial(_more_lights, change="a light's place")),
            ("the camera moves", partial(_more_lights, change="the camera's place")),
        )
    ),
    SpeedRow("literal", "inner: draws of the assignment", "the literal shader", 15, _against_literal),
    SpeedRow("cold", "command line, again", "a bare process", 1.5, partial(_command_line, new=False), at_most=True),
    SpeedRow("cold", "command line, first ever", "a bare process", 1.5, partial(_command_line, new=True), at_most=True),
]
# Scenes and numbers of samples for the table of pictures a second.
SCENES: dict[str, tuple[Callable[[], rt.Scene], int]] = {
    "assignment, 1 sample": (_assignment, 1),
    "assignment, 16 samples": (_assignment, 16),
    "1,000 objects": (_MANY, 1),
    "10,000 objects": (_VERY_MANY, 1),
    "sphere minus a union of 999": (partial(scenes.holes, False), 1),
}
