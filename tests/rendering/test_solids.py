"""Pictures of solids that are empty. The ledger compares random trees of solids with the ground truth."""

from __future__ import annotations

import pytest

import raytracer as rt
from raytracer.rendering.renderer import Renderer
from tests.solids import EXAMPLES

pytestmark = pytest.mark.gl

MATERIALS = [rt.Material(kd=kd) for kd in ((0.8, 0.2, 0.2), (0.2, 0.7, 0.3), (0.2, 0.3, 0.8), 0.6)]
KINDS = [*EXAMPLES]


def primitive(kind: str, material: rt.Material) -> rt.Solid:
    """Return a primitive of about the size 1 around the origin."""
    return EXAMPLES[kind].with_material(material)


@pytest.mark.parametrize("kind", KINDS)
def test_a_solid_less_itself_is_empty(renderer: Renderer, kind: str) -> None:
    solid = primitive(kind, MATERIALS[0]).rotate((1, 2, 3), 40).scale((1, 2, 0.5)).translate((0.3, 0.1, 0))
    again = primitive(kind, MATERIALS[1]).rotate((1, 2, 3), 40).scale((1, 2, 0.5)).translate((0.3, 0.1, 0))
    scene = rt.Scene([solid - again], [rt.PointLight((4, 7, 4))], rt.Camera((1, 1, 5), (0, 0, 0)))
    image = renderer.render(scene, (160, 90), rt.Settings(samples=1))
    assert image.material is not None and (image.material == -1).all()


def test_a_box_less_its_half_spaces_is_empty(renderer: Renderer) -> None:
    box = rt.Box((-1, -0.5, -0.7), (1, 0.5, 0.7), MATERIALS[0])
    sides = [
        *(rt.Plane((sign, 0, 0), 1) for sign in (1, -1)),
        *(rt.Plane((0, sign, 0), 0.5) for sign in (1, -1)),
        *(rt.Plane((0, 0, sign), 0.7) for sign in (1, -1)),
    ]
    planes = sides[0] & sides[1] & sides[2] & sides[3] & sides[4] & sides[5]
    for solid in (box - planes, box.rotate((1, 2, 3), 40) - planes.rotate((1, 2, 3), 40)):
        scene = rt.Scene([solid], [rt.PointLight((4, 7, 4))], rt.Camera((1, 1, 5), (0, 0, 0)))
        image = renderer.render(scene, (160, 90), rt.Settings(samples=1))
        assert image.material is not None and (image.material == -1).all()
