"""The converged reference, and what it says of its own error, against closed forms; its cache; its command."""

from __future__ import annotations

import contextlib
import functools
import math
import operator
import os
import pickle
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer import compare_cli, memory, processes, reference, truth_cache, truth_cost
from raytracer import truth as module
from raytracer.cli import main
from raytracer.film import Image
from raytracer.merl import SHAPE, Measured
from raytracer.settings import Settings
from raytracer.truth import truth

from . import scenes

SHINING = rt.Material("lambert", rho=0, le=1)
WHITE = rt.Material(ka=(0, 0, 0), kd=(1, 1, 1), ks=(0, 0, 0))
SIZE = (48, 32)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where truths are kept during a test."""
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def edge(angle: float = 0.3, offset: float = 0.2) -> rt.Scene:
    """The shining part cos(angle) x + sin(angle) y <= offset of the plane z = 0, before black, seen from (0, 0, 5)."""
    side = rt.Plane((math.cos(angle), math.sin(angle), 0), offset, SHINING)
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)
    return rt.Scene([rt.Plane((0, 0, 1), 0, SHINING) & side], [], camera, background=(0, 0, 0))


def coverage(size: tuple[int, int], angle: float = 0.3, offset: float = 0.2) -> np.ndarray:
    """How much of each pixel edge() covers, (H, W): the area of a square that a line cuts off."""
    width, height = size
    pixel = 2.0 * 5.0 * math.tan(math.radians(20)) / height  # on the plane z = 0
    x, y = np.meshgrid((np.arange(width) - width / 2) * pixel, (height / 2 - 1 - np.arange(height)) * pixel)
    a, b = math.cos(angle), math.sin(angle)
    c = (offset - a * x - b * y) / pixel  # from the pixel's corner at the lower left: a u + b v <= c
    squares = (sign * np.maximum(c - part, 0.0) ** 2 for part, sign in ((0, 1), (a, -1), (b, -1), (a + b, 1)))
    return np.round(np.sum([*squares], axis=0) / (2.0 * a * b), 9)  # 0 and 1 as they are: squares cancel


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def stated(image: Image) -> np.ndarray:
    assert image.error is not None
    return image.error


@pytest.mark.parametrize(("samples", "tolerance"), [(16, 0.0), (256, 0.0), (1024, 5e-3)])
def test_an_edge_is_where_it_should_be_to_the_error_that_is_stated(samples: int, tolerance: float) -> None:
    size = (240, 160)
    image = truth(edge(), size, samples=samples, tolerance=tolerance, cache=False)
    off = image.radiance[..., 0] - coverage(size)
    cut = (coverage(size) > 0) & (coverage(size) < 1)
    # Of so many pixels, each with 3 or more degrees of freedom, such a ratio is known to 10 %.
    assert cut.sum() > 150
    assert rms(off[cut]) == pytest.approx(rms(stated(image)[cut]), rel=0.25)
    assert not off[~cut].any() and not stated(image)[~cut].any()
    # One sample in each of n boxes would be off by sqrt(0.15) n^(-3/4); four sets, and rounds, cost a factor of 2.2.
    assert rms(off[cut]) < 1.2 * max(2.2 * math.sqrt(0.15) * samples**-0.75, tolerance)


def test_samples_go_where_the_error_is_above_the_tolerance_and_no_farther() -> None:
    image = truth(edge(), (48, 32), samples=1000, tolerance=5e-3, cache=False)
    assert image.samples is not None and {*np.unique(image.samples)} <= {16, 32, 64, 128, 256, 512}
    far = np.abs(np.arange(48) - 24) > 12
    assert (image.samples[:, far] == 16).all() and image.samples.max() == 512
    assert rms(stated(image)) < 5e-3
    # Pixels that are not cut got more, too, and only beside those that are.
    cut = (coverage((48, 32)) > 0) & (coverage((48, 32)) < 1)
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(cut, 1), (3, 3)).any(axis=(2, 3))
    assert (image.samples[~cut] == 512).sum() > 30 and (image.samples[~beside] == 16).all()


def test_all_around_a_pixel_that_is_off_have_all_samples_also_if_they_had_ended_before() -> None:
    image = truth(scenes.assignment(), (64, 36), samples=256, tolerance=2e-3, cache=False)
    assert image.samples is not None
    off = np.lib.stride_tricks.sliding_window_view(np.pad(stated(image) > 2e-3, 1), (3, 3)).any(axis=(2, 3))
    assert off.sum() > 100 and (image.samples[off] == 256).all() and (image.samples == 16).sum() > 1000


FLOOR = rt.Plane((0, 1, 0), 0, WHITE)
LIGHT = rt.PointLight((-2, 4, 0), (0.7, 0.7, 0.7), radius=0.8)


def penumbra() -> rt.Scene:
    """A floor under a wall x >= 0, y >= 1, whose edge (0, 1, z) hides a part of a sphere light."""
    wall = rt.Plane((-1, 0, 0), 0) & rt.Plane((0, -1, 0), -1)
    return rt.Scene([FLOOR, wall], [LIGHT], rt.Camera((0.7, 0.8, 0.2), (0.7, 0, 0), vertical_fov=50))


def in_penumbra(P: np.ndarray) -> np.ndarray:
    """The radiance of penumbra()'s floor at points (..., 3): Lambert's integral over the border of what is seen.

    That is a part of the cone to the light, between an arc of its border and the plane of the point and the edge.
    """
    to_light = np.array(LIGHT.position) - P
    d = np.linalg.norm(to_light, axis=-1, keepdims=True)
    W, sine = to_light / d, LIGHT.radius / d[..., 0]
    cosine = np.sqrt(1.0 - sine**2)
    m = np.stack([np.ones(P.shape[:-1]), P[..., 0], np.zeros(P.shape[:-1])], axis=-1)
    m /= np.linalg.norm(m, axis=-1, keepdims=True)  # what is seen has a negative scalar product with it
    s = np.sum(W * m, axis=-1)
    U = (m - s[..., None] * W) / np.sqrt(1.0 - s**2)[..., None]
    V = np.cross(W, U)
    begin = np.arccos(np.clip(-s * cosine / (np.sqrt(1.0 - s**2) * sine), -1.0, 1.0))
    end = 2.0 * np.pi - begin

    def border(angle: np.ndarray) -> np.ndarray:
        across = np.cos(angle)[..., None] * U + np.sin(angle)[..., None] * V
        return cosine[..., None] * W + sine[..., None] * across

    along = (np.sin(end) - np.sin(begin))[..., None] * U - (np.cos(end) - np.cos(begin))[..., None] * V
    flux = (sine**2 * (end - begin))[..., None] * W - (cosine * sine)[..., None] * along
    normal = np.cross(border(end), border(begin))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    between = 2.0 * np.arcsin(np.linalg.norm(border(end) - border(begin), axis=-1, keepdims=True) / 2.0)
    flux += between * normal / np.maximum(length, 1e-300)
    return LIGHT.color[0] / (np.pi * sine**2) * flux[..., 1] / 2.0


def test_a_penumbra_is_as_dark_as_it_should_be_to_the_error_that_is_stated() -> None:
    size, parts = (24, 16), 6
    image = truth(penumbra(), size, Settings(shadows="soft"), samples=64, tolerance=0.0, cache=False)
    rd = reference.camera_rays(penumbra().camera, (parts * size[0], parts * size[1]))
    eye = np.array(penumbra().camera.position)
    points = in_penumbra(eye - eye[1] / rd[..., 1:2] * rd)
    expected = points.reshape(size[1], parts, size[0], parts).mean(axis=(1, 3))
    assert expected.max() - expected.min() > 0.4, "light and shadow"
    off = image.radiance[..., 0] - expected
    assert rms(off) == pytest.approx(rms(stated(image)), rel=0.2)
    # Of a light half of which is hidden, stratified rays show 0.36 n^(-3/4) too much or little; of each sample 4.
    assert rms(off) < 2.2 * 0.36 * LIGHT.color[0] * (4 * 64) ** -0.75


def test_depth_normal_and_material_are_those_of_the_centre_rays() -> None:
    found, expected = truth(scenes.assignment(), (32, 18), samples=16), reference.render(scenes.assignment(), (32, 18))
    for name in ("depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_the_result_does_not_depend_on_how_many_processes_work_on_it(monkeypatch: pytest.MonkeyPatch) -> None:
    pools = []

    class Pool(processes.ProcessPoolExecutor):
        def __init__(self, *arguments: Any) -> None:
            pools.append(arguments[0])
            super().__init__(*arguments)

    monkeypatch.setattr(processes, "ProcessPoolExecutor", Pool)
    seen: list[tuple[int, int]] = []
    one = truth(penumbra(), (96, 64), Settings(shadows="soft"), samples=32, workers=1, cache=False)
    three = truth(
        penumbra(),
        (96, 64),
        Settings(shadows="soft"),
        samples=32,
        workers=3,
        cache=False,
        progress=lambda done, total: seen.append((done, total)),
    )
    assert pools == [3]
    for name in ("radiance", "error", "samples", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))
    assert three.samples is not None and seen[-1] == (three.samples.sum(), three.samples.sum())
    assert len(seen) > 10 and all(done < total for done, total in seen[:-1])


def name_of(scene: rt.Scene, **settings: Any) -> str:
    size, samples = settings.pop("size", SIZE), settings.pop("samples", 16)
    given = Settings(**settings)
    given = Settings(shading=given.shading, shadows=given.shadows, bounces=given.bounces)
    return truth_cache.path_of(module.Job(scene, size, given), samples, module.TOLERANCE).name


def test_what_was_made_once_is_not_traced_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = edge()
    first = truth(scene, SIZE, samples=16)
    assert [file.name for file in folder.iterdir()] == [name_of(scene)]
    with monkeypatch.context() as patch:
        patch.setattr(module, "_traced", None)
        renamed = msgspec.structs.replace(scene, name="another name")
        again = truth(renamed, SIZE, Settings(samples=4, evaluator="walk", precision=64), samples=16)
        with pytest.raises(TypeError):  # what is not kept would be traced
            truth(scene, SIZE, samples=32)
    for name in ("radiance", "error", "samples", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    [file] = folder.iterdir()
    whole = file.read_bytes()
    broken = bytearray(whole)
    broken[len(whole) // 2] ^= 1
    for damaged in (b"", b"PK", whole[: len(whole) // 2], bytes(broken), pickle.dumps({})):
        file.write_bytes(damaged)
        np.testing.assert_array_equal(truth(scene, SIZE, samples=16).radiance, first.radiance)
        assert file.read_bytes() == whole
    file.write_bytes(b"")
    truth(scene, SIZE, samples=16, cache=False)
    assert file.read_bytes() == b"", "neither read nor written"


def test_what_was_not_asked_for_for_the_longest_time_makes_room(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {}
    for k, samples in enumerate((16, 32, 64)):
        truth(edge(), SIZE, samples=samples)
        names[samples] = name_of(edge(), samples=samples)
        os.utime(folder / names[samples], (k, k))
    size = (folder / names[16]).stat().st_size
    truth(edge(), SIZE, samples=16)  # read, so no longer the oldest
    monkeypatch.setattr(truth_cache, "MOST_BYTES", 2.5 * size)
    truth(edge(), SIZE, samples=128)
    assert {file.name for file in folder.iterdir()} == {names[16], name_of(edge(), samples=128)}


def test_the_files_whose_change_makes_truths_worthless_are_all_that_a_truth_needs() -> None:
    script = (
        "import sys, raytracer as rt; from raytracer.truth import truth\n"
        "settings = rt.Settings(shading='ggx', shadows='soft')\n"
        "truth(rt.load('materials'), (4, 3), settings, samples=16, workers=1, cache=False)\n"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.partition('.')[0] == 'raytracer'), sep='\\n')"
    )
    found = subprocess.run([sys.executable, "-c", script], cwd=scenes.CHECKOUT, capture_output=True, check=True)
    needed = {Path(line) for line in found.stdout.decode().splitlines()}
    package = Path(truth_cache.__file__).parent
    assert len(needed) > 20 and needed <= {package / name for name, _ in truth_cache._sources()}


def test_a_folder_that_cannot_be_written_to_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYTRACER_CACHE", "/proc/nowhere")
    with pytest.warns(UserWarning, match=r"^/proc/nowhere: the reference was not kept"):
        assert truth(edge(), SIZE, samples=16).radiance.max() > 0.9


def test_whatever_decides_the_result_decides_the_files_name(monkeypatch: pytest.MonkeyPatch) -> None:
    def measured(value: float) -> rt.Material:
        return rt.Material("merl", file=Measured(np.full((*SHAPE, 3), value), path="a.binary"))

    red, green = (SHINING.replace(name=name) for name in ("red", "green"))
    balls = [rt.Sphere((0, 0, 0), 1, red), rt.Sphere((1, 0, 0), 1, green)]
    camera, light = rt.Camera((0, 0, 5), (0, 0, 0)), rt.PointLight((4, 7, 4))
    scene = rt.Scene(balls, [light], camera)
    a, b = balls
    others = [
        scene,
        rt.Scene(balls[::-1], [light], camera),
        rt.Scene(balls, [light], camera, materials=[green, red]),
        rt.Scene([a], [light], camera),
        rt.Scene([a | b], [light], camera),
        rt.Scene([a & b], [light], camera),
        rt.Scene([a - b], [light], camera),
        rt.Scene([~a], [light], camera),
        rt.Scene([rt.Instances(a, [(0, 0, 0)])], [light], camera),
        rt.Scene([rt.Instances(a, [(0, 0, 1)])], [light], camera),
        rt.Scene([rt.Instances(a, [(0, 0, 1)], 0.5)], [light], camera),
        rt.Scene(balls, [], camera),
        *(rt.Scene(balls, [msgspec.structs.replace(light, **change)], camera) for change in LIGHTS),
        rt.Scene(balls, [light], rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=math.nextafter(53.13, 54))),
        rt.Scene(balls, [light], camera, ambient=(0, 0, 0)),
        rt.Scene(balls, [light], camera, background=(0, 0, 0)),
        rt.Scene([rt.Sphere((0, 0, 0), 1, measured(0.1))], [light], camera),
        rt.Scene([rt.Sphere((0, 0, 0), 1, measured(0.2))], [light], camera),
    ]
    names = [name_of(other) for other in others]
    options = ({"size": (32, 48)}, {"samples": 32}, {"shading": "phong"}, {"shadows": "soft"}, {"bounces": 0})
    names += [name_of(scene, **option) for option in options]
    monkeypatch.setattr(truth_cache, "_SOURCES", ("truth.py",))
    names.append(name_of(scene))
    assert len({*names}) == len(names)


LIGHTS = ({"position": (4, 7, 5)}, {"color": (1, 1, 0.5)}, {"radius": 0.5}, {"falloff": "inverse_square"})


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"samples": 15}, "samples: expected a whole number in [16, 65536], got 15"),
        ({"samples": 2**17}, "samples"),
        ({"samples": 16.0}, "samples"),
        ({"tolerance": -1.0}, "tolerance: expected a finite number of at least 0"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"size": (0, 1)}, "size"),
    ],
)
def test_what_cannot_be_asked_for_is_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(rt.InputError, match=re.escape(says)):
        truth(edge(), **{"size": SIZE, **arguments})


def test_the_command_writes_the_arrays_and_says_what_they_are(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "ref.npz"
    command = ["reference", "assignment", "-o", str(out), "--size", "32x18", "--samples", "32", "--tolerance", "0.01"]
    assert main([*command, "--no-cache"]) == 0
    assert not folder.exists() and "from the cache" not in capsys.readouterr().out
    assert main(command) == 0
    said = capsys.readouterr().out
    assert re.fullmatch(r"wrote .*: 32x18, 16 to 32 samples a pixel, .* RMSE about \d\.\de-0\d, \d+\.\d s\n", said)
    assert main(command) == 0
    assert capsys.readouterr().out.endswith("from the cache\n")
    with np.load(out) as arrays:
        assert arrays["radiance"].shape == (18, 32, 3) and arrays["radiance"].dtype == np.float64
        assert {*arrays} == {"radiance", "depth", "normal", "material", "samples", "error", "metadata"}
    for arguments, says in (
        (["-o", str(tmp_path / "a.png")], "ends in .npz"),
        (["-o", str(out), "--samples", "3"], "samples"),
        (["-o", str(out), "--tolerance", "-1"], "tolerance"),
        (["-o", str(out), "--size", "0x1"], "size"),
    ):
        assert main(["reference", "assignment", *arguments]) == 2
        errors = capsys.readouterr().err
        assert says in errors and errors.count("\n") == 1


def test_the_command_takes_from_the_files_settings_what_it_has_no_flags_for(tmp_path: Path, folder: Path) -> None:
    file, out = tmp_path / "scene.toml", str(tmp_path / "ref.npz")
    of_file = 'samples = 4\nsize = [640, 360]\nshading = "blinn"\nshadows = "diluted"\nbounces = 1\n'
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n[settings]\n{of_file}")
    command = ["reference", str(file), "-o", out, "--size", "16x9", "--samples", "16"]
    assert main(command) == 0 and main([*command, "--shading", "none", "--shadows", "off"]) == 0
    given = ({"shading": "blinn", "shadows": "diluted", "bounces": 1}, {"shadows": "off", "bounces": 1})
    expected = {name_of(rt.load(file), size=(16, 9), **settings) for settings in given}
    assert {kept.name for kept in folder.iterdir()} == expected


def test_what_does_not_fit_into_memory_is_refused_before_it_is_begun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["reference", "assignment", "-o", str(tmp_path / "ref.npz")]
    monkeypatch.setattr(memory, "physical_memory", lambda: 2**34)
    assert main([*command, "--size", "65536x65536"]) == 2
    assert re.search(r"--size: expected a picture that fits .* got 65536x65536, which needs", capsys.readouterr().err)
    monkeypatch.setattr(truth_cost, "physical_memory", lambda: 20)
    with pytest.raises(rt.InputError, match=r"expected at most 4 primitives for the .* memory, got 5"):
        truth_cost.check_cost(scenes.assignment(), SIZE, workers=1)


def test_what_it_takes_is_told_before_it_is_begun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    job = module.Job(scenes.assignment(), (320, 180), Settings())
    tried = truth_cost.cost(job, 1024, workers=1)
    assert tried.tried and 1.0 < tried.seconds < 600.0
    assert truth_cost.cost(job, 4096, workers=1).seconds > 1.5 * tried.seconds
    row = functools.reduce(operator.or_, [rt.Sphere((x, 0, 0), 1) for x in range(2000)])
    many = rt.Scene([row], [], rt.Camera((0, 0, 5), (0, 0, 0)))
    guessed = truth_cost.cost(module.Job(many, (320, 180), Settings()), 1024, workers=1)
    assert re.fullmatch("at least [0-9]+ (hours|days): each ray meets each of 2000 primitives", str(guessed))
    monkeypatch.setattr(compare_cli, "_WORTH_MENTION", 0.0)
    command = ["reference", "assignment", "-o", str(tmp_path / "a.npz"), "--size", "16x9", "--samples", "16"]
    for says in (1, 0):  # not of what is read from the disk
        assert main(command) == 0
        assert capsys.readouterr().err.count("raytracer: this takes about 0 seconds: each ray meets") == says


def test_ctrl_c_ends_all_its_processes_and_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "ref.npz"
    command = [sys.executable, "-m", "raytracer", "reference", "materials", "--shadows", "soft", "-o", str(out)]
    process = subprocess.Popen(command, cwd=scenes.CHECKOUT, stderr=subprocess.PIPE, start_new_session=True)
    deadline = time.monotonic() + 60
    while len(in_group(process.pid)) < 3 and time.monotonic() < deadline:  # it, the one that counts resources, a worker
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1 and errors.endswith(b"raytracer: interrupted, nothing written\n")
    assert b"Traceback" not in errors
    assert not out.exists() and not (tmp_path / "cache").exists()
    deadline = time.monotonic() + 10
    while (left := in_group(process.pid)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not left


def in_group(group: int) -> list[str]:
    """The processes of a group that still run, as Linux shows them."""
    stats = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            stats.append(file.read_text())
    fields = [(stat, stat.rpartition(")")[2].split()) for stat in stats]
    return [stat for stat, (state, _, own, *_) in fields if int(own) == group and state != "Z"]
