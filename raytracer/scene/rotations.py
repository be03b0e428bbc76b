"""Rotations as arrays, from quaternions or matrices of a user. Only the functions import NumPy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from raytracer.core.arrays import float_array, number_array
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, Keys, items, number, vector
from raytracer.scene.solids.limits import MAX_SURFACES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_ROW = "finite numbers: a quaternion w, x, y, z, or a matrix, 3 rows of 3"
# The largest difference of R^T R from the identity. Rotations of float32 numbers are off by 5e-7 or less. Matrices that
# scale or shear visibly are off by more.
TOLERANCE = 1e-6
# The largest difference of R^T R from the identity with which a matrix keeps its bits: some roundings of float64. Then
# copies of a sphere are spheres (affine.similarity()).
_ROUNDED = 2.0**-47


def rotation_matrices(value: Any, count: int) -> Array:
    """Return rotation matrices (count, 3, 3), without negative zeros.

    Args:
        value: quaternions w, x, y, z (count, 4) of any length but 0, or matrices (count, 3, 3). Any array-like.
        count: the number of rotations.

    Raises:
        InputError: another value, a quaternion of length 0, or a matrix that is no rotation. The message names the
            first wrong row: `rotations[2]: expected ...`.
    """
    import numpy as np

    array = float_array(number_array(value, "rotations", MAX_SURFACES, _check_row))
    if array.shape not in ((count, 4), (count, 3, 3)):
        expected = f"{count} quaternions, an array ({count}, 4), or as many matrices, ({count}, 3, 3): one per position"
        raise InputError(f"expected {expected}, got an array of shape {array.shape}", "rotations")
    wrong = ~np.isfinite(array.reshape(count, -1)).all(axis=1)
    if wrong.any():
        _check_row(array[wrong][0].tolist(), ("rotations", int(wrong.argmax())))
    return _from_quaternions(array) if array.ndim == 2 else _orthogonal(array)


def _check_row(row: Any, keys: Keys) -> Any:
    """Return a quaternion or a matrix of finite numbers. Raises InputError."""
    parts = items(row, 4)
    if parts is not None and len(parts) == 4:
        return [number(part, keys, expected=_ROW) for part in parts]
    if parts is None or len(parts) != 3:
        raise InputError(f"expected {_ROW}, got {format_value(row)}", keys)
    return [vector(part, keys, -math.inf, math.inf, _ROW) for part in parts]


def _from_quaternions(quaternions: Array) -> Array:
    import numpy as np

    largest = np.abs(quaternions).max(axis=1)
    if not largest.all():
        i = int(largest.argmin())
        expected = "a quaternion w, x, y, z of any length but 0, such as 1, 0, 0, 0 for no rotation"
        raise InputError(f"expected {expected}, got 0, 0, 0, 0", ("rotations", i))
    w, x, y, z = (quaternions / largest[:, None]).T
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    # Dividing the sums, rather than the quaternion, leaves the rotations by 90, 120 and 180 degrees exact.
    rows = (
        (ww + xx - (yy + zz), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), ww + yy - (xx + zz), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), ww + zz - (xx + yy)),
    )
    return np.moveaxis(np.array(rows) / (ww + xx + yy + zz), -1, 0) + 0.0


def _orthogonal(matrices: Array) -> Array:
    """Return matrices (N, 3, 3), with the nearest rotation in place of each that is orthogonal only to float32."""
    import numpy as np

    with np.errstate(over="ignore", invalid="ignore"):
        products = (matrices[:, :, :, None] * matrices[:, :, None, :]).sum(axis=1)
        off = np.abs(products - np.eye(3)).max(axis=(1, 2))
    wrong = ~(off <= TOLERANCE)
    if wrong.any():
        i = int(wrong.argmax())
        expected = f"a rotation matrix R, with R^T R equal to the identity within {TOLERANCE:g}"
        raise InputError(f"expected {expected}, got {format_value(matrices[i].tolist())}", ("rotations", i))
    mirrored = np.linalg.det(matrices) < 0.0
    if mirrored.any():
        i = int(mirrored.argmax())
        got = f"a mirror image, determinant -1: {format_value(matrices[i].tolist())}"
        raise InputError(f"expected a rotation matrix, determinant 1, got {got}", ("rotations", i))
    rough = off > _ROUNDED
    if rough.any():
        u, _, v = np.linalg.svd(matrices[rough])
        matrices[rough] = (u[:, :, :, None] * v[:, None, :, :]).sum(axis=2)
    return np.ascontiguousarray(matrices) + 0.0
