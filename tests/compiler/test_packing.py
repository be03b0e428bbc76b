"""Coincidence numbers, which all surfaces at one place share."""

import numpy as np
import pytest

import raytracer as rt
from raytracer.compiler import packing
from raytracer.compiler.surfaces import make_surfaces
from raytracer.compiler.view_space import make_view
from raytracer.scene.options import Precision
from tests import scenes

# Factors of the hash by which coincident surfaces are sorted: the usual odd one, and 0, with which most hashes collide.
MIXING = packing._MIXING, np.uint64(0)


@pytest.mark.parametrize("mixing", MIXING)
@pytest.mark.parametrize("precision", [32, 64])
def test_surfaces_share_a_number_exactly_if_they_are_equal_in_the_shaders(
    precision: Precision, mixing: np.uint64, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "_MIXING", mixing)
    rng = np.random.default_rng(3)
    # There are few values, so many surfaces coincide, or differ in one number, or in the sign of a zero or a normal.
    balls = [rt.Sphere(tuple(rng.choice([-1.0, -0.0, 0.0, 1.0], 3).tolist()), r) for r in (0.5, 1.0) for _ in range(60)]
    normals = [(0, 1, 0), (0, -1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)]
    planes = [rt.Plane(normal, offset) for normal in normals for offset in (-1, 0, 1) for _ in range(2)]
    scene = scenes.lit_scene(*balls, *planes, eye=(0, 0, 0), at=(0, 0, -1))
    view = make_view(make_surfaces(scene), scene.camera, (64, 48))
    numbers = packing.coincidences(view, precision)
    assert numbers.min() >= 1 and numbers.max() <= len(numbers)

    def face(row: np.ndarray, is_plane: bool) -> tuple[object, ...]:
        sign = next(np.sign(part) for part in row if part) if is_plane else 1.0
        return is_plane, *(sign * row).tolist()  # 0.0 and -0.0 compare as equal

    rows = packing.surface_rows(view).astype({32: np.float32, 64: np.float64}[precision])
    faces = [face(row, i >= len(balls)) for i, row in enumerate(rows)]
    for number, one in zip(numbers, faces, strict=True):
        assert (numbers == number).tolist() == [one == other for other in faces]
    assert len({*faces}) < len(faces) / 2


def test_surfaces_that_do_not_coincide_have_different_numbers() -> None:
    scene = scenes.lit_scene(*(rt.Sphere((i, 0, 0), 0.4) for i in range(50)))
    numbers = packing.coincidences(make_view(make_surfaces(scene), scene.camera, (64, 48)), 32)
    assert len({*numbers.tolist()}) == 50
