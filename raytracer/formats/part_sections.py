"""Parts in scene files: solids made of shapes and other parts, which objects and further parts can name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

from raytracer.core.shown import shorten
from raytracer.core.validation import InputError, within
from raytracer.formats import csg_expression
from raytracer.formats.shape_sections import check_name
from raytracer.formats.toml_tables import as_table, check_table
from raytracer.formats.transforms import transform_solid
from raytracer.scene.materials.material import Material
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.tree import list_distinct

# The most primitives and operators that parts with a material copy: as many as a scene can have primitives. A chain of
# parts, each painted, would otherwise take time and memory with the square of its length.
MAX_PAINTED = MAX_SURFACES
# The most names of a cycle in an error message, which is one line.
_SHOWN = 8


def read_parts(
    value: Any, shapes: Mapping[str, Solid], objects: Any, find_material: Callable[[Any], Material]
) -> dict[str, Solid]:
    """Build all parts, each after the parts that it uses.

    Args:
        value: the table of the parts, by name.
        shapes: the shapes, by name.
        objects: the table of the objects, whose names parts cannot use.
        find_material: a function that returns the material of a name, and raises InputError for a wrong name.

    Raises:
        InputError: a wrong name or value, or parts that use each other in a cycle.
    """
    tables: dict[str, dict[str, Any]] = {}
    for name, table in as_table(value).items():
        with within(name):
            check_name(name)
            if name in shapes:
                raise InputError("expected another name: a shape has this one")
            tables[name] = check_table(table, ("solid", "transform", "material"), ("solid",))
            csg_expression.check_text(tables[name]["solid"], "solid")
    solids = dict(shapes)
    painted = 0
    for name in _sort_parts(tables):
        table = tables[name]
        with within(name):
            with within("solid"):
                solid = csg_expression.parse(table["solid"], solids, objects)
            if "transform" in table:
                with within("transform"):
                    solid = transform_solid(solid, table["transform"])
            if "material" in table:
                with within("material"):
                    material = find_material(table["material"])
                    painted += len(list_distinct(solid))
                    if painted > MAX_PAINTED:
                        expected = f"at most {MAX_PAINTED} primitives and operators in all parts with a material"
                        raise InputError(f"expected {expected}, got {painted} or more")
                solid = solid.paint(material)
            solids[name] = solid
    return {name: solids[name] for name in tables}


def find_used(expressions: Iterable[str], parts: Mapping[str, Any]) -> set[str]:
    """Return the names of all shapes and parts that expressions use, directly or through parts.

    Args:
        expressions: the expressions.
        parts: the tables of the parts, by name.
    """
    used: set[str] = set()
    pending = list(expressions)
    while pending:
        names = csg_expression.list_names(pending.pop()) - used
        used |= names
        pending += [parts[name]["solid"] for name in names if name in parts]
    return used


def _sort_parts(tables: Mapping[str, dict[str, Any]]) -> list[str]:
    """Return the names of all parts, each after the parts that it uses. Raises InputError for a cycle."""
    uses = {
        name: [used for used in sorted(csg_expression.list_names(table["solid"])) if used in tables]
        for name, table in tables.items()
    }
    try:
        return [*TopologicalSorter(uses).static_order()]
    except CycleError as error:
        # Each name of the cycle is used by the next one.
        cycle: list[str] = error.args[1][:0:-1]
    ranks = {name: rank for rank, name in enumerate(tables)}
    first = cycle.index(min(cycle, key=ranks.__getitem__))
    cycle = [*cycle[first:], *cycle[:first]]
    names = [*map(shorten, cycle[:_SHOWN]), *(["..."] if len(cycle) > _SHOWN else []), shorten(cycle[0])]
    raise InputError(f"expected parts without a cycle, got {' -> '.join(names)}", (cycle[0], "solid"))
