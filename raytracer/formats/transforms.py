"""Transforms in scene files: a list of tables, each of which moves a solid by one map."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from raytracer.core.validation import InputError, check_keys, within
from raytracer.formats.toml_tables import as_list, as_table
from raytracer.scene.solids.solid import Solid

# The most steps of one transform. Each step rounds the map once more: after 64, about 14 digits are right. A longer
# list comes from a program, which can write one matrix.
MAX_STEPS = 64


class _Step(NamedTuple):
    """One kind of step, by the method of Solid that does it. The key of the step holds the method's argument."""

    move: Callable[..., Solid]
    argument: str
    needed: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()


_STEPS = {
    "translate": _Step(Solid.translate, "offset"),
    "rotate": _Step(Solid.rotate, "axis", ("degrees",), ("about",)),
    "scale": _Step(Solid.scale, "factor", (), ("about",)),
    "mirror": _Step(Solid.mirror, "normal", (), ("about",)),
    "matrix": _Step(Solid.transform, "matrix"),
}
_KEYS = (*_STEPS, "degrees", "about")


def transform_solid(solid: Solid, value: Any) -> Solid:
    """Return a solid under the steps of a transform.

    Args:
        solid: the solid.
        value: the list of steps, first to last: `[{ rotate = [0, 1, 0], degrees = 30 }, { translate = [1, 2, 3] }]`.

    Raises:
        InputError: a wrong step, with its index and key.
    """
    steps = as_list(value)
    if len(steps) > MAX_STEPS:
        raise InputError(f"expected at most {MAX_STEPS} steps, got {len(steps)}; one matrix stands for any number")
    for i, step in enumerate(steps):
        with within(i):
            solid = _apply_step(solid, step)
    return solid


def _apply_step(solid: Solid, value: Any) -> Solid:
    table = as_table(value)
    check_keys(table, _KEYS)
    kinds = [kind for kind in _STEPS if kind in table]
    if len(kinds) != 1:
        raise InputError(f"expected one of {', '.join(_STEPS)}, got {' and '.join(kinds) or 'none of them'}")
    kind = kinds[0]
    step = _STEPS[kind]
    check_keys(table, (kind, *step.needed, *step.optional), step.needed)
    arguments = {step.argument if key == kind else key: argument for key, argument in table.items()}
    try:
        return step.move(solid, **arguments)
    except InputError as error:
        # The map of all steps so far may be beyond the limits although this step is not: the key is "transform" then.
        names: dict[Any, tuple[str, ...]] = {step.argument: (kind,), "transform": ()}
        raise InputError(error.reason, names.get(error.keys[0], error.keys)) from None
