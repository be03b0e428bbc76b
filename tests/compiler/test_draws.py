"""The list of draws of a sample: values only, which a player without OpenGL can play, too."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.draws import MARGIN, SAMPLES_PER_SUM, Clear, Draw, Step, sample_at, sample_draws
from raytracer.compiler.frame import make_frame
from raytracer.compiler.meshes import (
    EMPTY,
    PICTURE,
    PLANE_ONLY,
    SEE,
    SEVERAL,
    SHADE,
    SHAPES,
    Cells,
    Coverage,
    tile_meshes,
)
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.rendering.programs import find_programs
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.options import SamplingOptions
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled

SIZE = 48, 32
TILE = 0, 0, *SIZE
FOUR_SAMPLES = SamplingOptions(samples=4)


def coverage(**cells: list[str]) -> Coverage:
    """Return the coverage of a picture of 2 x 3 cells, the lowest row first. A program draws the cells marked "#"."""
    masks = {name: np.array([[c == "#" for c in row] for row in rows]) for name, rows in cells.items()}
    return Coverage((0, 0, *SIZE), masks, None, None)


GROUND = coverage(see=["#..", ".#."], shade=["#..", ".#."], plane_only=[".##", "..."], empty=["...", "#.#"])


def step_lines(steps: list[Step]) -> list[str]:
    """Return one line per step, as a player would that only takes notes."""
    lines = []
    for step in steps:
        if isinstance(step, Clear):
            lines.append(f"clear {step.texture} to {step.value[0]:g}")
        else:
            lines.append(f"{step.program} into {'+'.join(step.target)}: {step.blending}")
    return lines


def make_draws(picture: Coverage, *numbers: int, mask: np.ndarray | None = None, shades: bool = True) -> list[Step]:
    meshes = tile_meshes(picture, TILE, mask, ())
    samples = [sample_at(number, FOUR_SAMPLES) for number in numbers]
    return sample_draws(meshes, TILE, samples, ["surface"], shades=shades, constants={})


def test_the_first_sample_replaces_and_later_samples_are_added() -> None:
    see = "see into surface: replace"
    lights = ("shade", "plane_only", "empty")
    assert step_lines(make_draws(GROUND, 0)) == [see, *(f"{name} into radiance: replace" for name in lights)]
    assert step_lines(make_draws(GROUND, 1)) == [see, *(f"{name} into radiance: add" for name in lights)]
    assert step_lines(make_draws(GROUND, SAMPLES_PER_SUM)) == step_lines(make_draws(GROUND, 0))


def test_samples_drawn_together_share_the_draws_of_empty_and_plane_only_cells() -> None:
    see, shade = "see into surface: replace", "shade into radiance: add"
    several = msgspec.structs.replace(GROUND, cells={**GROUND.cells, SEVERAL: GROUND.cells[PLANE_ONLY]})
    start = [f"{name} into radiance: replace" for name in ("several", "empty", "shade")]
    assert step_lines(make_draws(several, 0, 1, 2, 3)) == [see, *start, *(3 * [see, shade])]
    steps = make_draws(several, 4, 5, 6, 7)
    assert step_lines(steps)[1:4] == [line.replace("replace", "add") for line in start]
    for step in steps:
        if isinstance(step, Draw) and step.program in (SEVERAL, EMPTY):
            assert step.uniforms["samples"] == 4
            assert step.uniforms["samplePlaces"] == [sample_at(number, FOUR_SAMPLES).place for number in range(4, 8)]
    assert step_lines(make_draws(GROUND, 4, 5, 6, 7)).count("plane_only into radiance: add") == 4


def test_only_cells_in_the_mask_are_drawn_and_their_sum_starts_at_zero() -> None:
    mask = np.zeros((8, 12), bool)
    mask[1, 2] = mask[5, 9] = True  # a block of the first cell and a block of the last cell
    for number, clear in ((1, []), (SAMPLES_PER_SUM, ["clear radiance to 0"])):
        steps = make_draws(GROUND, number, mask=mask)
        assert step_lines(steps) == [
            *clear, "see into surface: replace", "shade into radiance: add", "empty into radiance: add"
        ]  # fmt: skip
        cells = {step.program: step.mesh for step in steps if isinstance(step, Draw)}
        for name, row in ((SEE, [2, 1, 1, 1]), (SHADE, [2, 1, 1, 1]), (EMPTY, [9, 5, 1, 1])):
            mesh = cells[name]
            assert isinstance(mesh, Cells) and mesh.rows.tolist() == [row] and mesh.side == 4 and mesh.as_points


def test_neighbouring_cells_are_one_run_but_each_cell_with_a_list_is_a_point() -> None:
    rows = tile_meshes(GROUND, TILE, None, ()).cells[PLANE_ONLY].rows
    assert rows.tolist() == [[1, 0, 2, 1]]
    listed = msgspec.structs.replace(GROUND, lists=np.arange(12, dtype=np.int32).reshape(6, 2))
    meshes = tile_meshes(listed, TILE, None, [SHADE]).cells
    assert meshes[SHADE].rows.tolist() == [[0, 0, 1, 1, 0, 1], [1, 1, 1, 1, 8, 9]] and meshes[SHADE].as_points
    assert meshes[PLANE_ONLY].rows.tolist() == [[1, 0, 2, 1]] and not meshes[PLANE_ONLY].as_points
    assert tile_meshes(GROUND, (16, 16, 32, 16), None, ()).cells[SHADE].rows.tolist() == [[1, 1, 1, 1]]


def test_rectangles_are_drawn_after_cells_and_only_inside_the_tile() -> None:
    rectangles = np.array([[0, 0, 10, 10], [20, 20, 26, 21], [40, 2, 48, 32]], np.int32)
    picture = msgspec.structs.replace(GROUND, rectangles=rectangles)
    shapes = "shapes into surface: replace"
    assert step_lines(make_draws(picture, 0, shades=False)) == ["see into surface: replace", "clear depth to 1", shapes]
    alone = msgspec.structs.replace(picture, cells={SHADE: GROUND.cells[SHADE]})
    assert step_lines(make_draws(alone, 0, shades=False)) == ["clear surface to 0", "clear depth to 1", shapes]
    mesh = tile_meshes(picture, (0, 0, 32, 32), None, ()).rectangles
    assert mesh and mesh.numbers.tolist() == [0, 1] and mesh.largest == 10


def test_every_draw_has_the_uniforms_of_its_sample() -> None:
    tile = 16, 0, 32, 32
    sample = sample_at(3, FOUR_SAMPLES)
    constants = {"focus": 1.0}
    meshes = tile_meshes(GROUND, tile, None, ())
    for step in sample_draws(meshes, tile, [sample], ["surface"], shades=True, constants=constants):
        assert isinstance(step, Draw) and step.constants is constants
        assert isinstance(step, Draw) and step.is_long and step.area == (0, 0, 32, 32)
        assert step.uniforms["draw.samplePlace"] == sample.place and step.uniforms["draw.lightIndex"] == 3
        assert step.uniforms["draw.tileOrigin"] == (16, 0) and step.uniforms["draw.scatter"] == -1
        assert step.viewport == (-MARGIN, -MARGIN, 32 + 2 * MARGIN, 32 + 2 * MARGIN)


def is_plain(value: object) -> bool:
    """Return whether a value consists of numbers, names and arrays."""
    if isinstance(value, dict):
        return all(is_plain(item) for item in value.items())
    if isinstance(value, tuple):
        return all(is_plain(item) for item in value)
    if isinstance(value, msgspec.Struct):
        return all(is_plain(item) for item in msgspec.structs.astuple(value))
    return value is None or isinstance(value, (bool, int, float, str, np.ndarray))


MANY = [rt.Sphere((0.3 * i, 0, 0), 0.1, scenes.COLORS[i % 4]) for i in range(40)]


@pytest.mark.gl
@pytest.mark.parametrize("scene", [scenes.assignment(), scenes.lit_scene(*MANY, rt.Plane((0, 1, 0), -2.5))])
def test_a_player_receives_only_plain_values(
    renderer: Renderer, scene: rt.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded: list[Step] = []
    original = DrawPlayer.play

    def play(self: DrawPlayer, steps: list[Step], **keywords: object) -> None:
        recorded.extend(steps)
        original(self, steps, **keywords)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(DrawPlayer, "play", play)
    settings = Settings(samples=2)
    with renderer.device.turn():
        tiles = TileRenderer(renderer.device, SIZE)
        drawn = make_frame(compiled(scene, settings), SIZE, renderer.device.limits)
        tiles.load(find_programs(renderer.device, drawn.compiled), drawn)
        for number in range(2):
            tiles.draw(TILE, [sample_at(number, settings.sampling)])
        tiles.close()
    names = {step.program for step in recorded if isinstance(step, Draw)}
    is_large = len(scene.objects) > 20
    assert (PICTURE in names, SHADE in names, SHAPES in names) == (not is_large, is_large, is_large)
    assert all(is_plain(step) for step in recorded)
