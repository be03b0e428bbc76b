"""Pictures of sweeps: they are those of the changed scenes, to the bit; and attributes of scenes, by path."""

import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.farm.frame_jobs import FrameJob
from raytracer.farm.frame_store import FrameStore
from raytracer.farm.scene_attributes import replace_attribute
from raytracer.farm.sweep_points import Point
from raytracer.farm.sweep_run import Reference, Sweep, SweepOutcome
from raytracer.farm.sweep_table import SweepRow, read_measurements, write_rows
from raytracer.farm.swept_scenes import SweepSource
from raytracer.farm.tasks import Done, Failed, run_here
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.scene_paths import parse_path
from raytracer.gpu.device import shared_device
from tests import scenes

SIZE = (32, 20)
SCENE = scenes.still_life()


@pytest.mark.gl
def test_a_sweep_of_a_file_has_the_pictures_of_the_changed_scene() -> None:
    values = {"lights.0.position": np.array([[4, 7, 4], [0, 7, 4]]), "settings.samples": (1, 4)}
    pictures = [*rt.sweep("assignment", values, SIZE, shadows="off")]
    scene = scenes.assignment()
    assert [[*point.values()] for point, _ in pictures] == [[(x, 7, 4), n] for x in (4, 0) for n in (1, 4)]
    for point, image in pictures:
        position, samples = point.values()
        light = scene.lights[0].replace(position=position)
        expected = rt.render(scene.replace(lights=[light]), SIZE, samples=samples, shadows="off")  # pyright: ignore
        assert np.array_equal(image.radiance, expected.radiance)


@pytest.mark.gl
def test_a_picture_is_rendered_when_it_is_asked_for() -> None:
    pictures = rt.sweep(SCENE, [{"camera.vertical_fov": 60}, {"camera.vertical_fov": 180}], SIZE)
    _, image = next(pictures)
    wide = SCENE.replace(camera=SCENE.camera.replace(vertical_fov=60))
    assert np.array_equal(image.radiance, rt.render(wide, SIZE).radiance)
    with pytest.raises(rt.InputError, match=r"camera\.vertical_fov: expected degrees"):
        next(pictures)


@pytest.mark.parametrize(
    ("path", "value", "changed"),
    [
        ("camera.position.1", 5, SCENE.replace(camera=SCENE.camera.replace(position=(0, 5, 6)))),
        ("lights.0.radius", 0.5, SCENE.replace(lights=[scenes.SUN.replace(radius=0.5)])),
        ("ambient", (0, 0, 0), SCENE.replace(ambient=(0, 0, 0))),
        ("background.2", 0, SCENE.replace(background=(0.5, 0.7, 0))),
        (
            "objects.1.material.kd",
            (1, 0, 0),
            SCENE.replace(objects=[scenes.BALL, scenes.FLOOR.replace(material=scenes.COLORS[3].replace(kd=(1, 0, 0)))]),
        ),
        (
            "objects.0.b.radius",
            0.5,
            SCENE.replace(objects=[scenes.BALL.a - scenes.BALL.b.replace(radius=0.5), scenes.FLOOR]),  # pyright: ignore
        ),
    ],
)
def test_an_attribute_of_a_scene_is_replaced_by_its_path(path: str, value: Any, changed: rt.Scene) -> None:
    assert replace_attribute(SCENE, parse_path(path), value) == changed


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        ({"lihgts.0.radius": [1]}, {}, 'begins with one of .*; did you mean "lights"?'),
        ({"lights.1.radius": [1]}, {}, "lights.1.radius: .*expected an index in [0, 0], got 1"),
        ({"lights.0.raidus": [1]}, {}, 'unknown attribute `raidus` of PointLight .*; did you mean "radius"?'),
        ({"camera": [1]}, {}, "camera: .*expected the path of a number"),
        ({"camera.position.x": [1]}, {}, "expected an index in [0, 2], got x"),
        ({"camera.vertical_fov.0": [1]}, {}, "expected the end of the path"),
        ({"settings.sampels": [1]}, {}, 'unknown key `sampels` .*; did you mean "samples"?'),
        ({"settings.samples.0": [1]}, {}, "expected a path such as settings.samples"),
        ({"settings.samples": [1, 2]}, {"samples": 4}, "settings.samples: expected no samples beside a sweep"),
        ({"settings.samples": [1, 2]}, {"quality": "high"}, "settings.samples: expected no quality beside"),
        ({"settings.time": [1, 2]}, {"adaptive": 0.1}, "settings.time: expected no adaptive beside"),
        ({"settings.size": [(32, 20)]}, {"size": SIZE}, "settings.size: expected no size beside"),
    ],
)
def test_a_wrong_sweep_is_refused_at_the_call(values: Any, options: Any, message: str) -> None:
    with pytest.raises(rt.InputError) as caught:
        rt.sweep(SCENE, values, **options)
    pattern = re.escape(message).replace(r"\.\*", ".*")
    assert re.search(pattern, str(caught.value)), caught.value


def test_an_unknown_keyword_is_refused_at_the_call() -> None:
    with pytest.raises(TypeError, match="sampels"):
        rt.sweep(SCENE, {"lights.0.radius": [1]}, sampels=1)


def test_none_cancels_a_setting_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scenes.GOOD + '[settings]\nshading = "blinn"\n')
    source = SweepSource(read_document(path))
    models = [source.scene_at({"settings.shading": name}).settings.shading for name in ("none", "phong")]
    assert models == [None, "phong"]


class Runner:
    """Runs jobs here, and records their numbers. The job `fatal` fails."""

    def __init__(self, fatal: int | None = None) -> None:
        self.fatal = fatal
        self.jobs: list[int] = []

    def __call__(self, function: Callable[[Any], Any], jobs: Iterable[tuple[int, Any]]) -> Iterator[Done | Failed]:
        for index, job in jobs:
            self.jobs.append(index)
            if index == self.fatal:
                yield Failed(index, "three workers died")
            else:
                yield from run_here(function, [(index, job)])


POINTS: list[Point] = [{"lights.0.radius": radius} for radius in (0, 0.5, -1, 0.75)]


def draw(folder: Path, runner: Runner, points: list[Point] = POINTS, suffix: str = ".png") -> list[SweepOutcome]:
    """Draw a sweep of the assignment into a folder, write its table, and return the outcomes in order."""
    source = SweepSource(read_document(find_scene("assignment")), SIZE)

    def make_job(point: Point) -> FrameJob:
        return FrameJob(*source.scene_at(point), suffix)

    table = folder / "sweep.csv"
    known, driver = read_measurements(table), shared_device().limits.driver
    sweep = Sweep(points, make_job, FrameStore(folder, f"%04d{suffix}"), Reference(0, None, "0"), known, [driver])
    outcomes: list[SweepOutcome] = []
    sweep.draw(runner, outcomes.append)
    outcomes.sort(key=lambda outcome: outcome.row.number)
    with table.open("wb") as file:
        write_rows(file, ["lights.0.radius"], [outcome.row for outcome in outcomes])
    return outcomes


def without_times(row: SweepRow) -> SweepRow:
    return row._replace(measurements=row.measurements and row.measurements._replace(seconds=""))


@pytest.mark.gl
def test_refused_and_failed_pictures_leave_all_others_alone(tmp_path: Path) -> None:
    outcomes = draw(tmp_path, Runner(fatal=1))
    assert [outcome.row.file for outcome in outcomes] == ["0000.png", "", "", "0003.png"]
    assert outcomes[1].row.problem == "three workers died" and "got -1" in outcomes[2].row.problem
    assert {path.name for path in tmp_path.iterdir()} == {"0000.png", "0003.png", "sweep.csv"}


@pytest.mark.gl
@pytest.mark.parametrize(("suffix", "again"), [(".png", [0, 3]), (".npz", [3])])
def test_a_second_run_draws_what_is_missing_and_a_reference_that_its_file_has_lost(
    suffix: str, again: list[int], tmp_path: Path
) -> None:
    first = [outcome.row for outcome in draw(tmp_path, Runner(), suffix=suffix)]
    (tmp_path / f"0003{suffix}").write_bytes(b"half")
    runner = Runner()
    second = [outcome.row for outcome in draw(tmp_path, runner, suffix=suffix)]
    assert runner.jobs == again
    assert [without_times(row) for row in first] == [without_times(row) for row in second]
    runner = Runner()
    draw(tmp_path, runner, suffix=suffix)
    assert runner.jobs == []


@pytest.mark.gl
def test_another_reference_or_other_values_draw_the_pictures_again(tmp_path: Path) -> None:
    draw(tmp_path, Runner())
    runner = Runner()
    draw(tmp_path, runner, [{"lights.0.radius": 0.25}, *POINTS[1:]])
    assert sorted(runner.jobs) == [0, 1, 3]


@pytest.mark.gl
def test_the_rmse_is_that_of_the_linear_radiance(tmp_path: Path) -> None:
    points: list[Point] = [{"lights.0.position": (x, 7.0, 4.0)} for x in (4.0, 0.0)]
    source = SweepSource(read_document(find_scene("assignment")), SIZE)
    driver = shared_device().limits.driver

    def make_job(point: Point) -> FrameJob:
        return FrameJob(*source.scene_at(point), ".png")

    sweep = Sweep(points, make_job, FrameStore(tmp_path, "%04d.png"), Reference(0, None, "0"), {}, [driver])
    outcomes: list[SweepOutcome] = []
    sweep.draw(run_here, outcomes.append)
    a, b = (image for _, image in rt.sweep("assignment", points, SIZE))
    measured = [outcome.row.measurements for outcome in outcomes]
    assert [texts and texts.rmse for texts in measured] == ["0.0", repr(rt.compare(b, a).rmse)]
