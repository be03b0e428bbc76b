"""Places of instances in an `.npz` file: arrays `positions` [N, 3] and, optionally, `scales` [N] and `rotations`.

Rotations are quaternions [N, 4] or matrices [N, 3, 3].
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from raytracer.core.npz import read_arrays
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.formats import companion_files
from raytracer.scene.instances import Instances
from raytracer.scene.solids.limits import MAX_SURFACES
from raytracer.scene.solids.solid import Solid


def read(solid: Solid, data: bytes) -> Instances:
    """Return instances of `solid` with the places in a file's bytes. Raises InputError."""
    return Instances(solid, **read_arrays(io.BytesIO(data), _choose, _check_header, companion_files.MAX_BYTES))


# The shapes of the arrays, in the words of error messages, and the sizes of all dimensions but the first.
_SHAPES: dict[str, tuple[str, tuple[tuple[int, ...], ...]]] = {
    "positions": ("(N, 3)", ((3,),)),
    "scales": ("(N,) or ()", ((),)),
    "rotations": ("(N, 4) or (N, 3, 3)", ((4,), (3, 3))),
}


def _choose(names: list[str]) -> list[str]:
    if "positions" not in names or not {*names} <= {*_SHAPES}:
        got = format_value(", ".join(names))
        raise InputError(f"expected the arrays positions and, optionally, scales and rotations, got {got}")
    return names


def _check_header(name: str, shape: Sequence[int], dtype: Any) -> None:
    if dtype.kind not in "iuf":
        raise InputError(f"expected numbers, got an array of {format_value(str(dtype))}", name)
    expected, sizes = _SHAPES[name]
    is_right = tuple(shape[1:]) in sizes if len(shape) else name == "scales"
    if not is_right or not all(0 <= n <= MAX_SURFACES for n in shape):
        raise InputError(f"expected an array {expected} with N at most {MAX_SURFACES}, got {format_value(shape)}", name)
