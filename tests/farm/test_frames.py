"""Frames: each file has the picture of its frame's scene, and a second run draws only what is missing or different."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import raytracer as rt
from raytracer.farm.frame_jobs import FrameJob, draw_frame
from raytracer.farm.frame_store import FrameStore
from raytracer.farm.frames import FrameResult, make_frames
from raytracer.farm.tasks import run_here
from raytracer.formats.animated_scene import AnimatedScene, open_animation
from raytracer.formats.scene_file import parse_document
from raytracer.gpu.device import shared_device
from tests.scenes import GOOD

SIZE = (48, 32)
TABLE = """
[animation]
frames = 4
turntable = 90
[[animation.tracks]]
path = "shapes.a.sphere.radius"
keys = { 0 = 1.0, 3 = 1.6 }
"""
# The radius of frame 2 is negative.
WRONG = TABLE.replace("3 = 1.6", "1 = 0.5, 2 = -1, 3 = 1.6")


def animated(table: str = TABLE) -> AnimatedScene:
    return open_animation(parse_document(Path("good.toml"), GOOD + table))


def make(
    folder: Path, animation: AnimatedScene, settings: rt.Settings, suffix: str = ".npz", driver: str = ""
) -> dict[int, FrameResult]:
    """Make all frames, and return the results by frame."""
    results: dict[int, FrameResult] = {}
    drivers = [driver or shared_device().limits.driver]

    def job(frame: int) -> FrameJob:
        return FrameJob(animation.scene(frame), SIZE, settings, suffix)

    def report(result: FrameResult) -> None:
        results[result.frame] = result

    make_frames(range(animation.frames), job, FrameStore(folder, f"%02d{suffix}"), run_here, drivers, report)
    assert sorted(results) == [*range(animation.frames)]
    return results


def drawn(results: dict[int, FrameResult]) -> list[int]:
    return [frame for frame, result in sorted(results.items()) if result.estimate]


@pytest.mark.gl
def test_a_frame_has_the_bits_of_its_scene_rendered_alone(tmp_path: Path) -> None:
    animation, settings = animated(), rt.Settings(samples=4)
    assert drawn(make(tmp_path, animation, settings)) == [0, 1, 2, 3]
    for k, scene in enumerate(animation):
        image = rt.render(scene, SIZE, settings)
        with np.load(tmp_path / f"{k:02}.npz") as file:
            for name in ("radiance", "depth", "normal", "material", "error"):
                assert np.array_equal(file[name], getattr(image, name), equal_nan=True), (k, name)


@pytest.mark.gl
@pytest.mark.parametrize("suffix", [".npz", ".png"])
def test_a_second_run_draws_only_frames_that_are_missing_damaged_or_different(suffix: str, tmp_path: Path) -> None:
    animation, settings = animated(), rt.Settings(samples=2)
    make(tmp_path, animation, settings, suffix)
    files = [tmp_path / f"{k:02}{suffix}" for k in range(4)]
    before = [file.read_bytes() for file in files]
    times = [file.stat().st_mtime_ns for file in files]
    assert drawn(make(tmp_path, animation, settings, suffix)) == []
    assert [file.stat().st_mtime_ns for file in files] == times
    files[0].unlink()
    files[1].write_bytes(before[1][:-100])  # cut off
    rt.render(animation.scene(2), SIZE, settings).save(files[2])  # the same picture, but from elsewhere
    assert drawn(make(tmp_path, animation, settings, suffix)) == [0, 1, 2]
    os.replace(files[3], files[0])  # the picture of another frame
    assert drawn(make(tmp_path, animation, settings, suffix)) == [0, 3]
    assert drawn(make(tmp_path, animation, rt.Settings(samples=3), suffix)) == [0, 1, 2, 3]
    assert drawn(make(tmp_path, animation, rt.Settings(samples=3), suffix, "another driver")) == [0, 1, 2, 3]


@pytest.mark.gl
def test_a_frame_without_a_scene_leaves_all_others_alone(tmp_path: Path) -> None:
    results = make(tmp_path, animated(WRONG), rt.Settings())
    assert drawn(results) == [0, 1, 3] and "(in frame 2)" in results[2].failure
    assert sorted(file.name for file in tmp_path.iterdir()) == ["00.npz", "01.npz", "03.npz"]


@pytest.mark.gl
def test_a_stored_frame_remembers_that_it_missed_the_error(tmp_path: Path) -> None:
    settings = rt.Settings(samples=3, max_error=1e-6)
    for _ in range(2):
        assert not any(result.has_reached for result in make(tmp_path, animated(), settings).values())


def test_the_key_of_a_job_depends_on_all_that_the_picture_depends_on() -> None:
    scene, settings = animated().scene(1), rt.Settings()
    job = FrameJob(scene, SIZE, settings, ".png")
    others = [
        job.replace(scene=animated().scene(2)),
        job.replace(scene=scene.replace(name="other")),
        job.replace(scene=scene.replace(camera=scene.camera.replace(vertical_fov=30))),
        job.replace(size=(32, 48)),
        job.replace(settings=rt.Settings(bounces=7)),
        job.replace(suffix=".npz"),
    ]
    assert len({job.key(), *(other.key() for other in others)}) == 7
    assert job.key() == FrameJob(animated().scene(1), SIZE, rt.Settings(), ".png").key()


@pytest.mark.gl
def test_a_drawn_frame_states_its_driver_and_its_error() -> None:
    frame = draw_frame(FrameJob(animated().scene(0), SIZE, rt.Settings(samples=9), ".png"))
    assert frame.driver == shared_device().limits.driver and frame.samples == 9
    assert frame.estimate.rmse and frame.data.startswith(b"\x89PNG")
