"""The disk cache of converged pictures: cache keys, damaged files, and the deletion of least recently used files."""

from __future__ import annotations

import math
import os
import pickle
import shutil
import sys
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.ground_truth import converged as module
from raytracer.ground_truth import disk_cache
from raytracer.ground_truth.converged import trace_converged
from raytracer.ground_truth.job import TOLERANCE, Job, make_job
from raytracer.scene.materials.merl import SHAPE, Measured
from raytracer.scene.settings import Settings
from raytracer.scene.solids.box import Box
from tests import scenes
from tests.processes import run_for_output

SHINING = rt.Material("lambert", rho=0, le=1)
SIZE = (48, 32)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The cache folder during a test."""
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def edge(angle: float = 0.3, offset: float = 0.2) -> rt.Scene:
    """Return an emitting half of the plane z = 0 before a black background, seen from (0, 0, 5).

    The emitting half is cos(angle) x + sin(angle) y <= offset.
    """
    side = rt.Plane((math.cos(angle), math.sin(angle), 0), offset, SHINING)
    camera = rt.Camera((0, 0, 5), (0, 0, 0), vertical_fov=40)
    return rt.Scene([rt.Plane((0, 0, 1), 0, SHINING) & side], [], camera, background=(0, 0, 0))


def cache_name(scene: rt.Scene, **settings: Any) -> str:
    size, samples = settings.pop("size", SIZE), settings.pop("samples", 16)
    return disk_cache.cache_path(make_test_job(scene, size, samples, **settings)).name


def make_test_job(scene: rt.Scene, size: tuple[int, int] = SIZE, samples: int = 16, **settings: Any) -> Job:
    return make_job(scene, size, Settings(**settings), samples, TOLERANCE, transparent=False)


def test_a_cached_picture_is_not_traced_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = edge()
    first = trace_converged(scene, SIZE, samples=16)
    assert [file.name for file in folder.iterdir()] == [cache_name(scene)]
    with monkeypatch.context() as patch:
        patch.setattr(module, "_trace", None)
        renamed = msgspec.structs.replace(scene, name="another name")
        again = trace_converged(renamed, SIZE, Settings(samples=4, evaluator="walk", precision=64), samples=16)
        with pytest.raises(TypeError):  # a picture that is not cached would be traced
            trace_converged(scene, SIZE, samples=32)
    for name in ("radiance", "error", "samples", "depth", "normal", "material"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    assert (
        first.estimate and again.estimate and first.estimate.replace(seconds=again.estimate.seconds) == again.estimate
    )
    [file] = folder.iterdir()
    whole = file.read_bytes()
    broken = bytearray(whole)
    broken[len(whole) // 2] ^= 1
    for damaged in (b"", b"PK", whole[: len(whole) // 2], bytes(broken), pickle.dumps({})):
        file.write_bytes(damaged)
        np.testing.assert_array_equal(trace_converged(scene, SIZE, samples=16).radiance, first.radiance)
        assert file.read_bytes() == whole
    file.write_bytes(b"")
    trace_converged(scene, SIZE, samples=16, cache=False)
    assert file.read_bytes() == b"", "neither read nor written"


def test_the_least_recently_used_files_are_deleted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {}
    for k, samples in enumerate((16, 32, 64)):
        trace_converged(edge(), SIZE, samples=samples)
        names[samples] = cache_name(edge(), samples=samples)
        os.utime(folder / names[samples], (k, k))
    size = (folder / names[16]).stat().st_size
    trace_converged(edge(), SIZE, samples=16)  # a read, so that this file is no longer the least recently used
    monkeypatch.setattr(disk_cache, "MOST_BYTES", 2.5 * size)
    trace_converged(edge(), SIZE, samples=128)
    assert {file.name for file in folder.iterdir()} == {names[16], cache_name(edge(), samples=128)}


def test_a_file_with_impossible_arrays_is_replaced(folder: Path) -> None:
    scene = edge()
    first = trace_converged(scene, SIZE, samples=16)
    [file] = folder.iterdir()
    right = file.read_bytes()
    with np.load(file) as archive:
        arrays = dict(archive)

    def with_value(name: str, value: float) -> dict[str, Any]:
        array = arrays[name].copy()
        array.flat[array.size // 2] = value
        return arrays | {name: array}

    values = {
        "radiance": (math.nan, math.inf, -1.0, 1e300),
        "error": (math.nan, math.inf, -1.0),
        "depth": (math.nan, -1.0, math.inf),
        "normal": (math.nan, math.inf, 1.1),
        "material": (-2, 1, -1),
        "samples": (0, -16, 32),
    }
    damaged = [with_value(name, value) for name, some in values.items() for value in some]
    damaged += [arrays | {name: array.astype(array.dtype.newbyteorder())} for name, array in arrays.items()]
    damaged += [arrays | {name: array.astype(np.float32)} for name, array in arrays.items()]
    damaged += [arrays | {name: array[:-1]} for name, array in arrays.items()]
    damaged += [{key: array for key, array in arrays.items() if key != name} for name in arrays]
    for wrong in damaged:
        np.savez(file, **wrong)
        assert disk_cache.read(file, make_test_job(scene)) is None
    np.savez(file, **damaged[0])
    np.testing.assert_array_equal(trace_converged(scene, SIZE, samples=16).radiance, first.radiance)
    assert file.read_bytes() == right


def test_pipes_links_and_folders_in_the_cache_are_not_read(tmp_path: Path, folder: Path) -> None:
    scene = edge()
    first = trace_converged(scene, SIZE, samples=16)
    [file] = folder.iterdir()
    elsewhere = file.rename(tmp_path / "elsewhere.npz")
    before = elsewhere.stat().st_mtime_ns
    makers = (
        lambda: os.mkfifo(file),
        lambda: file.symlink_to("/dev/zero"),
        lambda: file.symlink_to("/proc/self/maps"),
        lambda: file.symlink_to(file),
        lambda: file.symlink_to(elsewhere),
    )
    for make in makers:
        make()
        assert disk_cache.read(file, make_test_job(scene)) is None
        np.testing.assert_array_equal(trace_converged(scene, SIZE, samples=16).radiance, first.radiance)
        assert not file.is_symlink() and file.is_file()
        file.unlink()
    assert elsewhere.stat().st_mtime_ns == before
    file.mkdir()
    with pytest.warns(UserWarning, match="the reference could not be stored"):
        trace_converged(scene, SIZE, samples=16)


def test_the_cache_key_covers_all_source_files_that_tracing_needs() -> None:
    script = (
        "import sys, raytracer as rt; from raytracer.ground_truth.converged import trace_converged\n"
        "settings = rt.Settings(shading='ggx', shadows='soft')\n"
        "trace_converged(rt.load('materials'), (4, 3), settings, samples=16, workers=1, cache=False)\n"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.partition('.')[0] == 'raytracer'), sep='\\n')"
    )
    output = run_for_output(sys.executable, "-c", script, cwd=scenes.CHECKOUT)
    needed = {Path(line) for line in output.splitlines()}
    package = Path(rt.__file__).parent
    assert len(needed) > 20 and needed <= {package / name for name, _ in disk_cache._hash_sources()}


@pytest.mark.parametrize(
    ("file", "is_kept"),
    [
        ("app/cli.py", True),
        ("analysis/image_difference.py", True),
        ("compiler/surfaces.py", True),
        ("gpu/context.py", True),
        ("rendering/renderer.py", True),
        ("__init__.py", False),
        ("core/vectors.py", False),
        ("scene/solids/solid.py", False),
        ("scene/materials/models.py", False),
        ("formats/image.py", False),
        ("ground_truth/ray_tracer.py", False),
    ],
)
def test_an_edit_invalidates_pictures_only_in_files_that_may_change_them(
    file: str, is_kept: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "raytracer"
    shutil.copytree(Path(rt.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(disk_cache, "_ROOT", package)
    before = cache_name(edge())
    (package / file).write_text((package / file).read_text() + "# edited\n")
    assert (cache_name(edge()) == before) is is_kept


def test_a_read_only_cache_folder_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYTRACER_CACHE", "/proc/nowhere")
    with pytest.warns(UserWarning, match=r"^/proc/nowhere: the reference could not be stored"):
        assert trace_converged(edge(), SIZE, samples=16).radiance.max() > 0.9


def test_everything_that_affects_the_result_is_in_the_file_name(monkeypatch: pytest.MonkeyPatch) -> None:
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
    names = [cache_name(other) for other in others]
    options = ({"size": (32, 48)}, {"samples": 32}, {"shading": "phong"}, {"shadows": "soft"}, {"bounces": 0})
    names += [cache_name(scene, **option) for option in options]
    monkeypatch.setattr(disk_cache, "_PACKAGES", ())
    names.append(cache_name(scene))
    assert len({*names}) == len(names)


LIGHTS = ({"position": (4, 7, 5)}, {"color": (1, 1, 0.5)}, {"radius": 0.5}, {"falloff": "inverse_square"})


def test_the_key_depends_on_all_numbers_of_a_moved_solid() -> None:
    box = Box((0, 0, 0), (1, 2, 3), SHINING)
    solids = [
        box,
        Box((0, 0, 0), (1, 2, 4), SHINING),
        box.translate((0, 0, 1)),
        box.translate((0, 1, 0)),
        box.rotate((0, 0, 1), 90),
        rt.Sphere((0, 0, 0), 1, SHINING).scale((1, 2, 1)),
        rt.Sphere((0, 0, 0), 1, SHINING).scale((1, 2, 3)),
    ]
    names = [cache_name(rt.Scene([solid], [], rt.Camera((0, 0, 9), (0, 0, 0)))) for solid in solids]
    assert len(set(names)) == len(solids)
