"""Row of the ledger on solids with common caps, walls and faces."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from raytracer.analysis.numerics.findings import Finding
from raytracer.analysis.numerics.pixel_errors import MATTE
from raytracer.analysis.numerics.solids import count_different_pixels
from raytracer.analysis.numerics.specimens import KINDS, lit_scene, specimen
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from raytracer.scene.solids.box import Box
from raytracer.scene.solids.cone import Cone
from raytracer.scene.solids.cylinder import Cylinder
from raytracer.scene.solids.paraboloid import Paraboloid
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere
from raytracer.scene.solids.torus import Torus

SIZE = (64, 40)
_RED, _BLUE, _GREEN, _GREY = MATTE


def _coincident() -> dict[str, tuple[Solid, Solid | None]]:
    """Return solids with coincident faces, each with an equal simpler solid; None: the solid is empty."""
    pairs: dict[str, tuple[Solid, Solid | None]] = {}
    for kind in KINDS:
        a, b = specimen(kind, _RED), specimen(kind, _BLUE)
        ball = Sphere((0.5, 0.25, 0.5), 0.75, _GREEN)
        pairs[f"{kind}: A - A"] = a - b, None
        pairs[f"{kind}: A | A"] = a | b, a
        pairs[f"{kind}: A & A"] = a & b, a
        pairs[f"{kind}: A & ~A"] = a & ~b, None
        pairs[f"{kind}: (A - B) | (A & B)"] = (a - ball) | (a & ball), a
        pairs[f"{kind}: A in B | A"] = ball | a | ball, ball | a
    low, high = Box((-0.75, -0.5, -0.5), (0.75, 0, 0.5), _RED), Box((-0.75, 0, -0.5), (0.75, 0.5, 0.5), _RED)
    whole = Box((-0.75, -0.5, -0.5), (0.75, 0.5, 0.5), _RED)
    pairs["two boxes that share a face"] = low | high, whole
    pairs["a box less its upper half"] = whole - high, low
    sides: Solid = Plane((1, 0, 0), 0.75, _RED)
    for normal, offset in (
        ((-1, 0, 0), 0.75),
        ((0, 1, 0), 0.5),
        ((0, -1, 0), 0.5),
        ((0, 0, 1), 0.5),
        ((0, 0, -1), 0.5),
    ):
        sides = sides & Plane(normal, offset, _RED)
    pairs["a box less its half-spaces"] = whole - sides, None
    pairs["half-spaces less their box"] = sides - whole, None
    pole, lower, upper = (Cylinder((0, y, 0), (0, z, 0), 0.5, _RED) for y, z in ((-1, 1), (-1, 0.25), (0.25, 1)))
    pairs["two cylinders on each other"] = lower | upper, pole
    pairs["a cylinder less its upper part"] = pole - upper, lower
    pairs["a cylinder cut by a box"] = pole & Box((-1, -1, -1), (1, 0.25, 1), _RED), lower
    core = Cylinder((0, -1, 0), (0, 1, 0), 0.25, _RED)
    pairs["a pipe and its core"] = (pole - core) | core, pole
    cone, point = Cone((0, -1, 0), (0, 1, 0), 1, 0, _RED), Cone((0, 0, 0), (0, 1, 0), 0.5, 0, _RED)
    stump = Cone((0, -1, 0), (0, 0, 0), 1, 0.5, _RED)
    pairs["a cone less its point"] = cone - point, stump
    pairs["a cone on its stump"] = stump | point, cone
    pairs["a cone cut by a half-space"] = cone & Plane((0, 1, 0), 0, _RED), stump
    tower = Cylinder((0, -1, 0), (0, 0, 0), 0.5, _RED)
    pairs["a cone on a cylinder, taken off"] = (tower | point) - point, tower
    dome, tip = (Paraboloid((0, y, 0), (0, 0.75, 0), r, _RED) for y, r in ((-0.75, 0.75), (0.375, 0.375)))
    pairs["a paraboloid less its tip"] = dome - tip, dome & Plane((0, 1, 0), 0.375, _RED)
    ring = Torus((0, 0, 0), (0, 1, 0), 0.75, 0.25, _RED)
    pairs["a torus in halves"] = (ring & Plane((0, 1, 0), 0, _RED)) | (ring - Plane((0, 1, 0), 0, _RED)), ring
    return pairs


def coincident_solids(renderer: Renderer, short: bool) -> Iterator[Finding]:
    """Solids with common caps, walls and faces, and equal simpler solids: as they are, and under equal rotations and
    shears. All pixels agree bit for bit.
    """
    shear = ((1.0, 0.3, 0.0, 0.2), (0.1, 0.9, 0.4, 0.0), (0.0, -0.2, 1.1, -0.1))
    moves: list[tuple[str, Callable[[Solid], Solid]]] = [
        ("", lambda solid: solid),
        (", rotated", lambda solid: solid.rotate((1, 2, 3), 40)),
        (", sheared", lambda solid: solid.transform(shear)),
    ]
    settings = [Settings(), *(Settings(precision=bits) for bits in renderer.device.limits.precisions if bits != 32)]
    for i, (name, (solid, simple)) in enumerate(_coincident().items()):
        if short and i % 5:
            continue
        for moved, move in moves[i // 5 % 3 :][:1] if short else moves:
            chosen = settings[:1] if short else [*settings, *([Settings(evaluator="roth")] if not moved else [])]
            for own in chosen:
                image = renderer.render(lit_scene(move(solid)), SIZE, own)
                expected = renderer.render(lit_scene(move(simple)), SIZE, own) if simple is not None else None
                wrong = count_different_pixels(image, expected)
                at = f"{name}{moved}, {own.evaluator}"
                yield Finding("coincident solids", at, own.precision, "wrong pixels", wrong, 0)
