"""Measured reflectance in MERL's format."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler.draws import sample_at
from raytracer.compiler.frame import make_frame
from raytracer.formats.scene_file import companion_paths, load
from raytracer.rendering.programs import find_programs
from raytracer.rendering.renderer import Renderer
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.scene.materials import merl
from raytracer.scene.settings import Settings
from tests import scenes
from tests.compiled import compiled
from tests.directions import direction_pairs

pytestmark = pytest.mark.gl
ROUGH = rt.Material("ggx", alpha=0.3, f0=(0.9, 0.6, 0.3))


@pytest.fixture(scope="module")
def baked() -> merl.Measured:
    return rt.brdf.bake(ROUGH)


@pytest.fixture(scope="module")
def file(baked: merl.Measured, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("merl") / "rough.binary"
    with path.open("wb") as file:
        merl.write(baked, file)
    return path


def test_a_file_has_the_layout_of_the_database(file: Path, baked: merl.Measured) -> None:
    # Readers of the database use the index phi_d + 180 (theta_d + 90 theta_h), one plane for each channel, scaled.
    data = file.read_bytes()
    assert len(data) == 34_992_012 and np.frombuffer(data, "<i4", 3).tolist() == [90, 90, 180]
    values = np.frombuffer(data, "<f8", offset=12)
    for (h, d, phi), (channel, scale) in [((3, 20, 100), (0, 1 / 1500)), ((60, 7, 5), (2, 1.66 / 1500))]:
        index = phi + 180 * (d + 90 * h) + channel * 90 * 90 * 180
        assert values[index] * scale == pytest.approx(float(baked.values[h, d, phi, channel]), rel=1e-12)
    assert merl.read(file) == baked


def test_cells_have_rusinkiewiczs_angles() -> None:
    wi, wo = merl.directions()
    np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(wo, axis=-1), 1, rtol=1e-12)
    half = wi + wo
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    h, d, phi = 40, 30, 120
    assert np.degrees(np.arccos(half[h, d, phi, 2])) == pytest.approx(90 * (40.5 / 90) ** 2)
    assert np.degrees(np.arccos(half[h, d, phi] @ wi[h, d, phi])) == pytest.approx(30.5)
    # For phi_d = 0, wi is in the plane of N and H and beyond H. For phi_d = 90 degrees it is beside this plane.
    assert wi[h, d, 0] @ (0, 1, 0) == pytest.approx(np.sin(np.radians(30.5)) * np.sin(np.radians(0.5)))
    assert wi[h, d, 0, 2] < wo[h, d, 0, 2]


def test_a_baked_model_equals_the_model_at_cell_centres(renderer: Renderer, baked: merl.Measured) -> None:
    wi, wo = (part.reshape(-1, 3)[::101] for part in merl.directions())
    above = (wi[:, 2] > 0.02) & (wo[:, 2] > 0.02)
    values = rt.brdf.evaluate(rt.Material("merl", file=baked), wi[above], wo[above], device=renderer.device)
    expected = rt.brdf.evaluate(ROUGH, wi[above], wo[above], device=renderer.device)
    np.testing.assert_allclose(values, expected, rtol=1e-4)


def test_a_baked_lambert_equals_lambert_everywhere(renderer: Renderer) -> None:
    table = rt.brdf.bake(rt.Material("lambert"), device=renderer.device)
    wi, wo = direction_pairs(2000)
    a, b = (
        rt.brdf.evaluate(m, wi, wo, device=renderer.device)
        for m in (rt.Material("lambert"), rt.Material("merl", file=table))
    )
    np.testing.assert_allclose(b, a, rtol=1e-6)


def test_a_value_between_cells_is_between_the_values_of_the_cells(renderer: Renderer, baked: merl.Measured) -> None:
    # The values are between the smallest and the largest value of the surrounding cells.
    wi, wo = direction_pairs(3000, least=0.05)
    values = rt.brdf.evaluate(rt.Material("merl", file=baked), wi, wo, device=renderer.device)[:, 0] / wi[:, 2]
    half = wi.astype(float) + wo
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    h = 90 * np.sqrt(np.arccos(half[:, 2]) / (np.pi / 2)) - 0.5
    d = np.degrees(np.arccos(np.clip(np.sum(half * wi, axis=1), -1, 1))) - 0.5
    rows = [np.clip(np.floor(at)[:, None].astype(int) + np.arange(-1, 3), 0, 89) for at in (h, d)]
    near = baked.values[rows[0][:, :, None], rows[1][:, None, :], :, 0]  # of all phi_d
    low, high = near.min(axis=(1, 2, 3)), near.max(axis=(1, 2, 3))
    assert ((values >= low * (1 - 1e-5)) & (values <= high * (1 + 1e-5))).all()


def test_a_picture_with_a_table_equals_the_models_within_its_resolution(
    renderer: Renderer, baked: merl.Measured
) -> None:
    def picture(material: rt.Material) -> np.ndarray:
        ball = rt.Sphere((0, 0, 0), 1, material)
        lights = [rt.PointLight((3, 4, 5), (3, 3, 3)), rt.PointLight((-5, 0, 1))]
        scene = rt.Scene([ball], lights, rt.Camera((0, 0, 4), (0, 0, 0), vertical_fov=40), background=(0, 0, 0))
        return renderer.render(scene, (96, 96), Settings(samples=4)).radiance

    expected, baked_picture = picture(ROUGH), picture(rt.Material("merl", file=baked))
    difference = np.abs(baked_picture - expected)
    # The steps of theta_h are uniform in its square root: 0.7 degrees at the flank of the highlight, and f falls by 5 %
    # in a step.
    assert difference.max() < 0.01 * expected.max() and np.median(difference[expected > 0]) < 2e-3 * np.median(
        expected[expected > 0]
    )


def test_materials_in_one_scene_use_their_own_tables(renderer: Renderer, baked: merl.Measured) -> None:
    white = rt.brdf.bake(rt.Material("lambert", rho=1), device=renderer.device)
    materials = [
        rt.Material("merl", file=table, name=name) for table, name in ((baked, "a"), (white, "b"), (baked, "c"))
    ]
    balls = [rt.Sphere((2 * i - 2, 0, 0), 0.9, m) for i, m in enumerate(materials)]

    def with_only(*shown: rt.Sphere) -> rt.Scene:
        return rt.Scene(shown, [rt.PointLight((0, 0, 9))], rt.Camera((0, 0, 9), (0, 0, 0), vertical_fov=12.68))

    image = renderer.render(with_only(*balls), (90, 30), Settings())
    single = [renderer.render(with_only(ball), (90, 30), Settings()).radiance for ball in balls]
    for i, picture in enumerate(single):
        np.testing.assert_array_equal(image.radiance[:, 30 * i : 30 * i + 30], picture[:, 30 * i : 30 * i + 30])


def test_a_scene_file_refers_to_a_table_in_its_folder(file: Path, baked: merl.Measured) -> None:
    text = scenes.ASSIGNMENT.read_text()
    start, end = text.index("[materials.red]"), text.index("[materials.blue]")
    scene = file.parent / "scene.toml"
    scene.write_text(f'{text[:start]}[materials.red]\nmodel = "merl"\nfile = "rough.binary"\n{text[end:]}')
    assert load(scene).materials[0].file == baked
    assert companion_paths(scene, scene.read_text()) == [file]


def test_a_shared_table_is_read_once_and_a_scene_has_at_most_sixteen_tables(file: Path, tmp_path: Path) -> None:
    head, tail = scenes.ASSIGNMENT.read_text().split("[materials.red]")

    def scene(names: list[str]) -> rt.Scene:
        tables = (f'[materials.m{i}]\nmodel = "merl"\nfile = "{name}"' for i, name in enumerate(names))
        path = tmp_path / "scene.toml"
        path.write_text("\n".join([head, *tables, "[materials.red]" + tail]))
        return load(path)

    (tmp_path / "a.binary").hardlink_to(file)
    materials = {m.name: m for m in scene(["a.binary"] * 50).materials}
    assert materials["m0"].file is materials["m49"].file
    for i in range(17):
        (tmp_path / f"{i}.binary").hardlink_to(file)
    with pytest.raises(rt.InputError, match=r"materials.m16.file: expected at most 16 .binary files"):
        scene([f"{i}.binary" for i in range(17)])


def test_tables_that_do_not_fit_leave_the_tables_of_the_last_scene(renderer: Renderer, baked: merl.Measured) -> None:
    ball = rt.Sphere((0, 0, 0), 1, rt.Material("merl", file=baked))
    good = rt.Scene([ball], [rt.PointLight((0, 0, 9))], rt.Camera((0, 0, 4), (0, 0, 0)))
    white = rt.Material("merl", file=rt.brdf.bake(rt.Material("lambert"), device=renderer.device))
    two = rt.Scene([ball, rt.Sphere((2, 0, 0), 1, white)], good.lights, good.camera)
    size, settings = (32, 32), Settings()
    with renderer.device.context:
        limits = renderer.device.limits
        frame = make_frame(compiled(good), size, limits)
        # A driver with room for one table only.
        with pytest.raises(rt.InputError, match="materials: expected at most 1 measured"):
            make_frame(compiled(two), size, msgspec.structs.replace(limits, volume_layers=179), frame)
        tiles = TileRenderer(renderer.device, size)
        tiles.load(find_programs(renderer.device, frame.compiled), frame)
        tiles.draw((0, 0, *size), [sample_at(0, settings.sampling)])
        picture = tiles.read_sums((0, 0, *size))
        tiles.close()
    np.testing.assert_array_equal(picture, renderer.render(good, size, settings).radiance)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "expected a MERL file"),
        (np.array([90, 90, 180], "<i4").tobytes(), "expected a MERL file"),
        (np.array([90, 90, 360], "<i4").tobytes() + bytes(34_992_000), "expected a MERL file"),
        (np.array([90, 90, 180], "<i4").tobytes() + b"\xff" * 34_992_000, "expected values of at most"),
    ],
)
def test_a_file_without_a_table_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "a.binary"
    path.write_bytes(data)
    with pytest.raises(rt.InputError, match=f"a.binary: {message}"):
        merl.read(path)
    with pytest.raises(rt.InputError, match=r"readable \.binary file"):
        merl.read(tmp_path)


def test_anisotropic_materials_have_no_table() -> None:
    with pytest.raises(rt.InputError, match="isotropic"):
        rt.brdf.bake(rt.Material("lafortune", lobes=[rt.Lobe(-1, 1, 10, cy=-0.9)]))
