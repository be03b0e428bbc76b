"""Generates the GLSL text of objects of common shapes (batches.py)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from raytracer.compiler.batches import ShapeBatch
from raytracer.compiler.bodies import WALLS
from raytracer.compiler.glsl.body_slots import Slot, handed_begins
from raytracer.compiler.glsl.csg import POINT_AT, RAY_CSG, LeafText, NamedPlane, hold_expression, owner_text
from raytracer.compiler.glsl.list_walks import nearest_plane_lines, walk_object, walk_to_change

# The kind of wall and the part of the two bodies of a torus.
_PARTS = [(WALLS.index("torus"), 0), (WALLS.index("torus"), 1)]
_OTHERS_FROM_TEXTURE = [
    "uniform sampler2D others;",
    "Nearest otherAt(Ray ray) {",
    "    vec2 other = texelFetch(others, ivec2(gl_FragCoord.xy), 0).xy;",
    "    Nearest nearest = Nearest(other.x, 0, int(other.y));",
]


def shapes_query_text(
    shapes: Sequence[ShapeBatch],
    slots: Sequence[Slot],
    planes: list[NamedPlane] | None,
    handed: int,
    *,
    with_texels: bool,
) -> list[str]:
    """Generate rayCSG() for camera rays against one object of a common shape, and otherAt() for all other objects.

    Args:
        shapes: The common shapes.
        slots: The structure of their bodies.
        planes: The single half-spaces, if there are no other objects; None if an earlier draw found the other objects.
        handed: The number of the object's spheres that the vertex shader (shapes.vert) hands on.
        with_texels: Whether it hands on the texels of the object's bodies.
    """
    spans = _spans(shapes)
    spheres = _most_spheres(shapes)
    return [
        '#include "csg/walk.glsl"',
        '#include "csg/lists.glsl"',
        "flat in int shape;",
        "flat in ivec2 first;  // index of its first sphere and of its first body",
        *(f"flat in Surface sphere{j};" for j in range(handed)),
        *_shape_holds(shapes),
        *_shape_owner(shapes),
        "// The first surface of the other objects.",
        *(_OTHERS_FROM_TEXTURE if planes is None else ["Nearest otherAt(Ray ray) {", *nearest_plane_lines(planes)]),
        "    return nearest;",
        "}",
        *RAY_CSG,
        "    P = N = real3(0.0);",
        "    mat = 0;",
        *(f"    Surface sphere{j} = surfaceOf(first.x + {j});" for j in range(handed, spheres)),
        *(f"    real2 s{j} = sphereRoots(ray, sphere{j});" for j in range(spheres)),
        *_body_roots(shapes, slots, "shape", _handed_headers(slots) if with_texels else _headers(slots, "first.y")),
        *walk_to_change(f"shapeHolds(shape, {spans}, at)", "if (next >= ray.distance) return ray.distance;"),
        f"    mat = shapeOwner(shape, first, {spans}, at);",
        *POINT_AT,
        "    return at;",
        "}",
    ]


def meet_shape_text(shapes: Sequence[ShapeBatch], slots: Sequence[Slot], with_owner: bool) -> list[str]:
    """Generate meetShape(): set `nearest` if an object of a common shape is nearer."""
    spans = _spans(shapes)
    return [
        *_shape_holds(shapes),
        *(_shape_owner(shapes) if with_owner else []),
        "void meetShape(Ray ray, int item, inout Nearest nearest) {",
        "    Item i = itemAt(item);",
        "    int object = i.object;",
        *(f"    real2 s{j} = sphereRoots(ray, surfaceOf(i, {j}));" for j in range(_most_spheres(shapes))),
        *_body_roots(shapes, slots, "i.shape", _headers(slots, "i.first.y")),
        *walk_object(
            f"shapeHolds(i.shape, {spans}, at)",
            f"shapeOwner(i.shape, i.first, {spans}, at)" if with_owner else "1",
        ),
    ]


def _most_spheres(shapes: Sequence[ShapeBatch]) -> int:
    return max(shape.spheres for shape in shapes)


def _most_bodies(shapes: Sequence[ShapeBatch]) -> int:
    return max(shape.bodies for shape in shapes)


def _spans(shapes: Sequence[ShapeBatch], kind: str = "") -> str:
    """Return the names of the roots of spheres, s0, s1, ..., and of bodies, body0, body1, ..., each after its
    `kind`."""
    counts = {"s": _most_spheres(shapes), "body": _most_bodies(shapes)}
    return ", ".join(f"{kind}{name}{j}" for name, count in counts.items() for j in range(count))


def _leaf_text(shape: ShapeBatch, leaf: int) -> LeafText:
    """Return the expressions for the roots of a leaf, and for its surface's index + 1."""
    if leaf < shape.spheres:
        return f"s{leaf}", f"(first.x + {leaf + 1})"
    return f"body{leaf - shape.spheres}", f"(first.y + {leaf - shape.spheres + 1})"


def _headers(slots: Sequence[Slot], first: str) -> list[str]:
    """Generate the lines that read the headers of an object's bodies, header0, header1, ..."""
    lines: list[str] = []
    for j, slot in enumerate(slots):
        lines.append(f"    ivec4 header{j} = headerOf({first} + {j});")
        for member, value in zip("yzw", slot, strict=True):
            lines += [] if value is None else [f"    header{j}.{member} = {value};"]
    return lines


def _handed_headers(slots: Sequence[Slot]) -> list[str]:
    """Generate the headers of bodies whose texels the vertex shader hands on: with negative numbers of texels."""
    return [
        f"    const ivec4 header{j} = ivec4({begin} - HANDED_TEXELS, {slot.slabs}, {slot.kind}, {slot.part});"
        for j, (slot, begin) in enumerate(zip(slots, handed_begins(slots), strict=False))
    ]


def _body_roots(shapes: Sequence[ShapeBatch], slots: Sequence[Slot], shape: str, headers: list[str]) -> list[str]:
    """Generate the lines that compute the roots of an object's bodies, body0, body1, ..., by their `headers`.

    The code of a slot has only the slabs and the wall that its bodies have: llvmpipe executes all code of a loop's
    round, whatever the conditions in it.
    """
    lines = [*headers]
    tori = [
        j for j, pair in enumerate(itertools.pairwise(slots)) if [(slot.kind, slot.part) for slot in pair] == _PARTS
    ]
    for j in range(len(slots)):
        if j - 1 in tori:
            lines.append(f"    real2 body{j} = parts{j - 1}.zw;")
        elif j in tori:
            lines.append(f"    real4 parts{j} = rootsOfParts(ray, header{j});")
            lines.append(f"    real2 body{j} = parts{j}.xy;")
        else:
            lines.append(f"    real2 body{j} = rootsOf(ray, header{j});")
    for j in range(len(slots)):
        absent = [f"{shape} == {k}" for k, batch in enumerate(shapes) if batch.bodies <= j]
        lines += [f"    if ({' || '.join(absent)}) body{j} = real2(INF, -INF);"] if absent else []
    return lines


def _choice(shape: str, texts: list[str]) -> str:
    """Return the expression that is one of `texts`, by the number of the shape."""
    return "(" + "".join(f"{shape} == {k} ? {text} : " for k, text in enumerate(texts[:-1])) + texts[-1] + ")"


def _shape_holds(shapes: Sequence[ShapeBatch]) -> list[str]:
    """Generate shapeHolds(): the distance up to which a shape's value at `at` holds."""
    holds = [
        hold_expression(batch.tree, lambda leaf, batch=batch: f"holds({_leaf_text(batch, leaf)[0]}, at)")
        for batch in shapes
    ]
    return [
        f"real shapeHolds(int shape, {_spans(shapes, 'real2 ')}, real at) {{",
        f"    return {_choice('shape', holds)};",
        "}",
    ]


def _shape_owner(shapes: Sequence[ShapeBatch]) -> list[str]:
    """Generate shapeOwner(): the surface of a shape at `at`."""
    lines = [f"int shapeOwner(int shape, ivec2 first, {_spans(shapes, 'real2 ')}, real at) {{", "    int mat = 0;"]
    for k, batch in enumerate(shapes):
        owner = owner_text([batch.tree], lambda leaf, batch=batch: _leaf_text(batch, leaf))
        lines += [f"    if (shape == {k}) {{", *(f"    {line}" for line in owner), "    }"]
    return [*lines, "    return mat;", "}"]
