"""The library as Python users see it: settings, files, arrays, comparisons, references."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import raytracer as rt
from raytracer.formats import scene_file
from raytracer.scene.settings_patch import SettingsPatch, patch_from_settings
from tests import scenes

SIZE = (16, 9)
wrong: Any = rt  # for calls with wrong types


@pytest.mark.gl
def test_keywords_of_render_override_the_fields_of_settings() -> None:
    scene = scenes.assignment()
    settings = rt.Settings(samples=4, shadows="diluted", shading="blinn", bounces=1)
    by_keywords = rt.render(scene, SIZE, samples=4, shadows="diluted", shading="blinn", bounces=1)
    for image in (rt.render(scene, SIZE, settings), rt.render(scene, SIZE, settings=settings)):
        np.testing.assert_array_equal(image.radiance, by_keywords.radiance)
        assert f"{settings}" in image.metadata["Description"]
    cases: list[dict[str, Any]] = [
        {"samples": 9},
        {"shadows": "off", "shading": None},
        {"quality": "draft"},
        {"quality": "high", "samples": 2},
        {"max_error": 0.5},
        {"adaptive": 0.1, "samples": 16},
    ]
    for keywords in cases:
        image = rt.render(scene, SIZE, settings, **keywords)
        used = (patch_from_settings(settings) | SettingsPatch.without_none(**keywords)).resolve()
        assert f"{SIZE[0]}x{SIZE[1]}, {used}" == image.metadata["Description"]
    # These settings exclude each other: the keyword replaces the field.
    assert "adaptive=0.1, " in rt.render(scene, SIZE, rt.quality("normal"), adaptive=0.1).metadata["Description"]
    description = rt.render(scene, SIZE, rt.Settings(samples=16, adaptive=0.1), max_error=0.5).metadata["Description"]
    assert "adaptive=None" in description and "max_error=0.5" in description and "samples=4096" in description


@pytest.mark.parametrize("settings", ["high", {"samples": 4}, 4, rt.Settings, True], ids=repr)
def test_a_value_that_is_not_settings_is_refused(settings: Any) -> None:
    for function in (rt.render, rt.reference):
        with pytest.raises(rt.InputError, match=r"^settings: expected Settings"):
            function(scenes.assignment(), SIZE, settings)


@pytest.mark.gl
def test_load_all_reads_the_scene_the_size_and_the_settings_in_one_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(
        f'{scenes.ASSIGNMENT.read_text()}\n[settings]\nsize = [16, 9]\nquality = "draft"\nshadows = "off"\n'
    )
    readings = []
    real = scene_file.read_bounded

    def counted(path: Path, most: int, **options: Any) -> bytes:
        readings.append(path)
        return real(path, most, **options)

    monkeypatch.setattr(scene_file, "read_bounded", counted)
    scene, size, settings = loaded = rt.load_all(file)
    assert readings == [file]
    assert (loaded.scene, loaded.size, loaded.settings) == (scene, size, settings)
    assert scene == rt.load(file) and size == (16, 9) and settings == rt.load_settings(file)
    image = rt.render(*rt.load_all(str(file)))
    np.testing.assert_array_equal(image.radiance, rt.render(scene, SIZE, shadows="off").radiance)
    assert rt.load_all("assignment") == (scenes.assignment(), (1280, 720), rt.Settings())
    file.write_text(f"{scenes.ASSIGNMENT.read_text()}\n[settings]\nsize = [0, 9]\n")
    with pytest.raises(rt.InputError, match=r"scene.toml:\d+: settings.size: expected"):
        rt.load_all(file)


def test_a_warning_about_a_file_names_the_line_of_python_that_loads_it(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    spare = '\n[shapes.spare]\nsphere = { center = [0, 0, 0], radius = 1 }\nmaterial = "red"\n'
    file.write_text(scenes.ASSIGNMENT.read_text() + spare)
    for load in (rt.load, rt.load_all):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            load(file)
        [warning] = caught
        assert "spare" in str(warning.message) and warning.filename == __file__


@pytest.mark.gl
def test_an_image_converts_to_the_array_of_its_radiance() -> None:
    image = rt.render(scenes.assignment(), SIZE)
    assert np.asarray(image) is image.radiance and image.radiance.dtype == np.float32
    assert np.asarray(image).shape == (SIZE[1], SIZE[0], 3)
    doubled = np.asarray(image, np.float64)
    assert doubled.dtype == np.float64
    np.testing.assert_array_equal(doubled, image.radiance)
    copied = np.array(image)
    assert not np.shares_memory(copied, image.radiance)
    np.testing.assert_array_equal(copied, image.radiance)
    assert image.__array__() is image.radiance and image.__array__(copy=False) is image.radiance
    assert not np.shares_memory(image.__array__(copy=True), image.radiance)
    with pytest.raises(ValueError, match="copy"):
        image.__array__(np.dtype(np.float64), copy=False)
    assert np.max(image) == image.radiance.max() and (image.radiance - np.asarray(image) == 0).all()


@pytest.mark.gl
def test_png_returns_the_bytes_that_save_writes(tmp_path: Path) -> None:
    image = rt.render(scenes.assignment(), SIZE)
    image.save(tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes() == image.png() == image._repr_png_()


@pytest.mark.parametrize("radiance", [None, "x", [[[0, 0, 0]]], np.zeros((2, 2)), np.zeros((0, 1, 3)), np.zeros(3)])
def test_an_image_without_pixels_is_refused(radiance: Any) -> None:
    with pytest.raises(rt.InputError, match=r"^radiance: expected an array \(H, W, 3\)"):
        rt.Image(radiance)


@pytest.mark.gl
def test_compare_takes_images_and_arrays() -> None:
    a, b = (rt.render(scenes.assignment(), SIZE, samples=n) for n in (1, 16))
    comparison = rt.compare(a, b)
    assert comparison.rmse == pytest.approx(np.sqrt(np.mean((a.radiance.astype(float) - b.radiance) ** 2)), rel=1e-12)
    assert comparison.rmse > 0.0
    assert (
        comparison == rt.compare(a.radiance, b) == rt.compare(a, b.radiance.tolist()) and rt.compare(a, a).rmse == 0.0
    )
    other = rt.render(scenes.assignment(), (8, 9))
    with pytest.raises(rt.InputError, match=r"^expected pictures of one size, got 16x9 and 8x9"):
        rt.compare(a, other)
    for value in (
        None,
        [[1, 2], [3]],
        a.radiance[..., 0],
        a.radiance > 0,
        scenes.assignment(),
        np.array(["x"]),
    ):
        for name, pair in (("a", (value, a)), ("b", (a, value))):
            with pytest.raises(rt.InputError, match=rf"^{name}: expected an Image, an array \(H, W, 3\) of numbers"):
                wrong.compare(*pair)
    for flip in (True, "LDR", 1):
        with pytest.raises(rt.InputError, match=r"^flip: expected"):
            wrong.compare(a, b, flip=flip)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the cached references during a test."""
    monkeypatch.setenv("RAYTRACER_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_a_reference_equals_the_picture_of_the_command(cache: Path, tmp_path: Path) -> None:
    from raytracer.app.cli import main

    arguments = ["--size", "16x9", "--samples", "16", "--shadows", "diluted", "--no-cache"]
    assert main(["reference", "assignment", "-o", str(tmp_path / "a.npz"), *arguments]) == 0
    settings = rt.Settings(samples=3, shadows="diluted", shading="blinn", sequence="r2")
    image = rt.reference(scenes.assignment(), SIZE, settings.replace(shading=None), samples=16, cache=False)
    assert image.radiance.dtype == np.float64 and isinstance(image, rt.Image) and not cache.exists()
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_array_equal(image.radiance, arrays["radiance"])
    # Keywords override the fields of settings. A reference that exists already is read from the cache.
    blinn = [
        rt.reference(scenes.assignment(), SIZE, settings, samples=16),
        rt.reference(scenes.assignment(), np.array(SIZE), shading="blinn", shadows="diluted", samples=np.int64(16)),  # pyright: ignore[reportArgumentType]
        rt.reference(scenes.assignment(), SIZE, settings.replace(shading="ggx"), shading="blinn", samples=16),
    ]
    assert len(list(cache.iterdir())) == 1 and rt.compare(blinn[0], image).rmse > 1e-4
    assert all(rt.compare(other, blinn[0]).rmse == 0.0 for other in blinn)


@pytest.mark.gl
def test_the_estimate_of_a_picture_agrees_with_its_error_against_the_reference(cache: Path) -> None:
    scene = scenes.assignment()
    image = rt.render(scene, (64, 36), samples=16)
    comparison = rt.compare(image, rt.reference(scene, (64, 36), samples=256, workers=1))
    assert image.estimate and comparison.rmse == pytest.approx(image.estimate.rmse, rel=0.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scene": "assignment"}, "scene: expected a Scene"),
        ({"size": (0, 9)}, "size: expected"),
        ({"size": 9}, "size: expected"),
        ({"samples": 15}, "samples: expected a whole number in [16, 65536]"),
        ({"tolerance": -1}, "tolerance: expected"),
        ({"shadows": "dark"}, "shadows: expected one of"),
        ({"bounces": 65}, "bounces: expected"),
        ({"workers": 0}, "workers: expected"),
        ({"workers": 1.5}, "workers: expected"),
        ({"workers": True}, "workers: expected"),
    ],
)
def test_a_reference_with_a_wrong_argument_is_refused(cache: Path, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(rt.InputError, match=f"^{re.escape(message)}"):
        rt.reference(**{"scene": scenes.assignment(), "size": SIZE, **arguments})


def test_a_reference_too_large_for_the_memory_is_refused_and_a_long_one_is_announced(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from raytracer.core import memory
    from raytracer.ground_truth import picture

    with monkeypatch.context() as patch:
        patch.setattr(memory, "physical_memory", lambda: 2**34)
        with pytest.raises(rt.InputError, match="size: expected a picture that fits"):
            rt.reference(scenes.assignment(), (65536, 65536))
    monkeypatch.setattr(picture, "WARN_SECONDS", 0.0)
    with pytest.warns(UserWarning, match="this takes about 0 seconds") as warned:
        rt.reference(scenes.assignment(), SIZE, samples=16)
    assert warned[0].filename == __file__
