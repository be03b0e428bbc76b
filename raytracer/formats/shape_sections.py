"""Shapes in scene files: a primitive with a material and a transform each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from raytracer.core.validation import InputError, within
from raytracer.formats import csg_expression
from raytracer.formats.toml_tables import as_table, build, build_each, check_table
from raytracer.formats.transforms import transform_solid
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.flattening import leaves
from raytracer.scene.solids.kinds import KINDS
from raytracer.scene.solids.polyhedron import MAX_POINTS
from raytracer.scene.solids.solid import Solid

# The largest sum of the squared numbers of points of all polyhedra: four of 4,096 points, or 67 of 1,000. The time of a
# hull grows with the square in the worst case, points on a moment curve, and is 12 s for 4,096 of them.
MAX_SQUARES = 4 * MAX_POINTS**2


def read_shapes(value: Any, find_material: Callable[[Any], Material]) -> dict[str, Solid]:
    """Build all shapes.

    Args:
        value: the table of the shapes, by name.
        find_material: a function that returns the material of a name, and raises InputError for a wrong name.

    Raises:
        InputError: a wrong name or value, or a shape beyond the limits of lengths after its transform.
    """
    tables = as_table(value)
    _check_points(tables)
    return build_each(tables, lambda table, name: _read_shape(table, name, find_material))


def _check_points(tables: dict[str, Any]) -> None:
    """Raise InputError if the hulls of all polyhedra may take too long."""
    squares = 0
    for name, table in tables.items():
        match table:
            case {"polyhedron": {"points": [*points]}} if len(points) <= MAX_POINTS:
                squares += len(points) ** 2
        if squares > MAX_SQUARES:
            expected = f"polyhedra whose squared numbers of points have a sum of at most {MAX_SQUARES}"
            raise InputError(f"expected {expected}, got {squares} up to here", (name, "polyhedron", "points"))


def _read_shape(value: Any, name: str, find_material: Callable[[Any], Material]) -> Solid:
    check_name(name)
    table = check_table(value, ("material", "transform", *KINDS), ("material",))
    with within("material"):
        material = find_material(table["material"])
    kinds = [kind for kind in KINDS if kind in table]
    if len(kinds) != 1:
        raise InputError(f"expected one of {', '.join(KINDS)}, got {' and '.join(kinds) or 'none of them'}")
    with within(kinds[0]):
        shape = build(KINDS[kinds[0]], table[kinds[0]], material=material)
    if "transform" not in table:
        return shape
    with within("transform"):
        moved = transform_solid(shape, table["transform"])
        count_leaves(moved)
    return moved


def check_name(name: str) -> None:
    """Raise InputError unless an expression can hold the name."""
    if not csg_expression.is_name(name):
        raise InputError('expected a name of letters, digits and "_" that does not begin with a digit')


def count_leaves(solid: Solid) -> int:
    """Return the number of leaves of a solid.

    Raises InputError, with keys that begin inside the solid, if there are too many or one is beyond the limits.
    """
    try:
        return len(leaves(solid))
    except InputError as error:
        raise InputError(
            error.reason, tuple(key for key in error.keys if key not in ("objects", "transform"))
        ) from None
