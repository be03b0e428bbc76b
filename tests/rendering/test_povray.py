"""Translation of scenes into POV-Ray's language, which the benchmarks use: POV-Ray renders the same picture."""

import shutil

import numpy as np
import pytest

import raytracer as rt
from benchmarks import povray
from benchmarks.bench import SAME_RAYS, TOLERANCE
from raytracer.rendering.renderer import Renderer
from tests import scenes

SIZE = (160, 90)
RED = rt.Material(ka=(0.1, 0.0, 0.2), kd=(0.5, 0.0, 0.25))


def export_text(*objects: rt.Solid, settings: rt.Settings | None = None) -> str:
    return povray.source(scenes.lit_scene(*objects), SIZE, settings or rt.Settings())


def test_space_is_mirrored_and_ambient_light_is_a_share_of_the_pigment() -> None:
    text = export_text(rt.Sphere((1, 2, 3), 0.5, RED), rt.Plane((0, 0, 2), -4, RED))
    assert "\nsphere { <1, 2, -3>, 0.5 texture { T0 } }\n" in text
    assert "\nplane { <0, 0, -1>, -2 texture { T0 } }\n" in text
    assert "location <0, 0, -5>" in text
    assert text.count("light_source {") == 2 and "shadowless" not in text
    assert "pigment { rgb <0.5, 0, 0.25> } finish { ambient rgb <0.20000000000000001, 0, 0.80000000000000004>" in text


def test_the_horizontal_angle_matches_the_picture() -> None:
    tangent = np.tan(np.radians(float(export_text(rt.Sphere((0, 0, 0), 1)).split("angle ")[1].split()[0]) / 2))
    assert tangent == pytest.approx(np.tan(np.radians(30)) * 16 / 9)  # for a vertical angle of 60 degrees


def test_chains_of_one_operator_become_one_list() -> None:
    a, b, c, d = (rt.Sphere((x, 0, 0), 1) for x in range(4))
    difference = export_text(a - b - c - d)
    assert "difference { sphere { <0, 0, -0>" in difference and difference.count("{ sphere") == 1
    assert export_text(a - (b | c) - d) == export_text(a - (b | (c | d))) == difference
    assert export_text((a | b) | (c | d)).count("union {") == 1
    assert export_text((a & b) - (c & d)).count("intersection {") == 2
    assert export_text(a - (b - c)).count("difference {") == 2
    assert " inverse }" in export_text(a & ~(b | c))


def test_a_body_is_its_shape_under_the_mirrored_matrix_and_a_torus_is_one_solid() -> None:
    box = rt.Box((0, 1, 2), (3, 4, 5), RED)
    assert "\nbox { <0, 1, -5>, <3, 4, -2> texture { T0 } }\n" in export_text(box)
    moved = export_text(box.transform([(1, 2, 3, 4), (0, 1, 5, 6), (0, 0, 1, 7)]))
    assert "matrix <1, 0, -0, 2, 1, -0, -3, -5, 1, 4, 6, -7> }\n" in moved
    ring = rt.Torus((0, 0, 0), (0, 1, 0), 2, 0.5, RED)
    assert "torus { 2, 0.5" in export_text(ring) and export_text(ring).count("union") == 0
    assert export_text(ring | box).count("union {") == 1 and export_text(ring | box).count("torus {") == 1
    with pytest.raises(povray.UnavailableError, match="Paraboloid"):
        export_text(rt.Paraboloid((0, 0, 0), (0, 1, 0), 1))


def test_features_that_povray_lacks_are_refused() -> None:
    ball = rt.Sphere((0, 0, 0), 1)
    for settings in (rt.Settings(shading="blinn"), rt.Settings(shadows="diluted")):
        with pytest.raises(povray.UnavailableError):
            export_text(ball, settings=settings)
    for material in (rt.Material(ks=(0.1, 0.2, 0.3)), rt.Material(ka=0.1, kd=0)):
        with pytest.raises(povray.UnavailableError):
            export_text(rt.Sphere((0, 0, 0), 1, material))


@pytest.mark.gl
@pytest.mark.skipif(not shutil.which("povray"), reason="povray is not installed (Debian package povray)")
def test_povray_renders_the_same_picture_of_the_assignment(renderer: Renderer) -> None:
    settings = rt.Settings()
    theirs, seconds = povray.run(povray.source(scenes.assignment(), SIZE, settings), SIZE, 1)
    ours = renderer.render(scenes.assignment(), SIZE, settings).srgb8().astype(int)
    assert seconds > 0
    assert np.mean(np.abs(ours - theirs).max(axis=2) > TOLERANCE) <= SAME_RAYS


@pytest.mark.gl
@pytest.mark.skipif(not shutil.which("povray"), reason="povray is not installed (Debian package povray)")
def test_povray_renders_the_same_picture_of_bodies_under_a_shear(renderer: Renderer) -> None:
    corners = (0, 0, 0), (1, 0.1, 0), (0.2, 1, 0.1), (0.1, 0.3, 1)
    kinds = [
        rt.Box((0, 0, 0), (0.8, 0.9, 1)) - rt.Cylinder((0.4, 0.5, -1), (0.4, 0.4, 2), 0.3, RED),
        rt.Cone((0, 0, 0), (0.1, 1, 0), 0.5, 0.2, RED),
        rt.Ellipsoid((0.4, 0.4, 0), (0.5, 0.4, 0.3)),
        rt.Torus((0.4, 0.4, 0), (1, 2, 2), 0.4, 0.15, RED),
        rt.Polyhedron(corners),
    ]
    shear = [(1, 0.3, 0, -2.4), (0, 1, 0.2, -0.4), (0.1, 0, 1, 0)]
    scene = scenes.lit_scene(*(kind.transform(shear).translate((i, 0, 0)) for i, kind in enumerate(kinds)))
    theirs, _ = povray.run(povray.source(scene, SIZE, rt.Settings()), SIZE, 1)
    ours = renderer.render(scene, SIZE, rt.Settings()).srgb8().astype(int)
    assert np.count_nonzero(ours != ours[0, 0]) > 3000
    assert np.mean(np.abs(ours - theirs).max(axis=2) > TOLERANCE) <= SAME_RAYS
