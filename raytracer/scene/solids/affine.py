"""Affine maps x -> A x + t as tuples of floats, so that solids can be moved without importing NumPy.

Equal maps give equal bits: each function evaluates one fixed formula, whatever the values are.
"""

from __future__ import annotations

import math
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import MAX_LENGTH, InputError, Keys, Vec3, items, number

Row = tuple[float, float, float, float]
Map = tuple[Row, Row, Row]  # the rows of [A | t], 3 x 4

IDENTITY: Map = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
# The smallest ratio of the shortest to the longest axis of the image of a ball. Below it, the map is singular to
# float64: its inverse has no correct digit in float32.
_SINGULAR = 2.0**-40
# The largest difference of A^T A from a multiple of the identity, relative, with which a map counts as a similarity.
# The columns of a rotation by rounded sines and cosines are off by a few 2^-53, and products of many rotations by more.
_SIMILAR = 2.0**-44


def compose(outer: Map, inner: Map) -> Map:
    """Return the map x -> outer(inner(x)), without negative zeros."""
    columns = tuple(zip(*inner, strict=True))
    rows: list[Row] = []
    for a, b, c, t in outer:
        x, y, z, w = (a * p + b * q + c * r for p, q, r in columns)
        rows.append((x + 0.0, y + 0.0, z + 0.0, w + t + 0.0))
    return rows[0], rows[1], rows[2]


def apply(matrix: Map, point: Vec3) -> Vec3:
    """Return the image of a point."""
    x, y, z = point
    u, v, w = (a * x + b * y + c * z + t for a, b, c, t in matrix)
    return u, v, w


def pull_direction(matrix: Map, direction: Vec3) -> Vec3:
    """Return A^T d: dot(d, A x) is dot(A^T d, x)."""
    x, y, z = direction
    (a, b, c, _), (d, e, f, _), (g, h, i, _) = matrix
    return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z


def cofactors(matrix: Map) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of the cofactor matrix det(A) A^-T, which maps normals to normals."""
    (a, b, c, _), (d, e, f, _), (g, h, i, _) = matrix
    return (
        (e * i - f * h, f * g - d * i, d * h - e * g),
        (c * h - b * i, a * i - c * g, b * g - a * h),
        (b * f - c * e, c * d - a * f, a * e - b * d),
    )


def determinant(matrix: Map) -> float:
    """Return det(A)."""
    a, b, c, _ = matrix[0]
    x, y, z = cofactors(matrix)[0]
    return a * x + b * y + c * z


def inverse(matrix: Map) -> Map:
    """Return the inverse map."""
    volume = determinant(matrix)
    columns = cofactors(matrix)
    rows: list[Row] = []
    for i in range(3):
        x, y, z = (column[i] / volume for column in columns)
        rows.append((x, y, z, -(x * matrix[0][3] + y * matrix[1][3] + z * matrix[2][3])))
    return rows[0], rows[1], rows[2]


def map_plane(matrix: Map, normal: Vec3, offset: float) -> tuple[Vec3, float]:
    """Return the image (normal, offset) of the half-space dot(normal, x) <= offset.

    The numbers have a common factor. The image of the complement has the negated bits.
    """
    x, y, z = normal
    u, v, w = (p * x + q * y + r * z for p, q, r in cofactors(matrix))
    volume = determinant(matrix)
    shift = u * matrix[0][3] + v * matrix[1][3] + w * matrix[2][3]
    if volume < 0.0:
        return (-u, -v, -w), -(volume * offset + shift)
    return (u, v, w), volume * offset + shift


def unit_plane(normal: Vec3, offset: float) -> tuple[Vec3, float]:
    """Return the unit normal and its offset. Coincident planes have bit-identical or exactly negated results."""
    scale = max(normal, key=abs)
    x, y, z, offset = (c / scale for c in (*normal, offset))
    # hypot() would round better, but NumPy has no equal: affine_arrays.py must give the same bits.
    length = math.copysign(math.sqrt(x * x + y * y + z * z), scale)
    return (x / length, y / length, z / length), offset / length


def similarity(matrix: Map) -> float | None:
    """Return the factor by which a map scales all lengths, up to rounding; None if the factors differ."""
    columns = [tuple(row[j] for row in matrix) for j in range(3)]
    # Not sum(), which rounds differently from one version of Python to another.
    squares = [x * x + y * y + z * z for x, y, z in columns]
    largest = max(squares)
    products = (sum(x * y for x, y in zip(columns[i], columns[j], strict=True)) for i, j in ((0, 1), (1, 2), (2, 0)))
    if largest - min(squares) > _SIMILAR * largest or any(abs(p) > _SIMILAR * largest for p in products):
        return None
    return math.sqrt(squares[0])


def translation(offset: Vec3) -> Map:
    """Return the map that adds `offset`."""
    x, y, z = offset
    return (1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z)


def rotation(axis: Vec3, degrees: float) -> Map:
    """Return the rotation around an axis through the origin, counterclockwise as seen from the axis's tip.

    Quarter turns are exact. `axis` has any length but 0 (Rodrigues 1840).
    """
    scale = max(map(abs, axis))
    length = math.hypot(*(c / scale for c in axis))
    x, y, z = (c / scale / length for c in axis)
    degrees = math.remainder(degrees, 360.0)  # exact
    quarters = round(degrees / 90.0)
    rest = math.radians(degrees - 90.0 * quarters)
    s, c = math.sin(rest), math.cos(rest)
    s, c = ((s, c), (c, -s), (-s, -c), (-c, s))[quarters % 4]
    k = 1.0 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s, 0.0),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s, 0.0),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k, 0.0),
    )


def scaling(factors: Vec3) -> Map:
    """Return the map that multiplies the coordinates by `factors`."""
    x, y, z = factors
    return (x, 0.0, 0.0, 0.0), (0.0, y, 0.0, 0.0), (0.0, 0.0, z, 0.0)


def reflection(normal: Vec3) -> Map:
    """Return the mirror image at the plane through the origin with this normal, of any length but 0."""
    scale = max(map(abs, normal))
    n = tuple(c / scale for c in normal)
    k = 2.0 / sum(c * c for c in n)
    rows: list[Row] = []
    for i in range(3):
        x, y, z = ((1.0 if i == j else 0.0) - k * n[i] * n[j] for j in range(3))
        rows.append((x, y, z, 0.0))
    return rows[0], rows[1], rows[2]


def around(matrix: Map, center: Vec3) -> Map:
    """Return a linear map with `center` as its fixed point in place of the origin."""
    if center == (0.0, 0.0, 0.0):
        return matrix
    return compose(translation(center), compose(matrix, translation((-center[0], -center[1], -center[2]))))


def check_matrix(value: Any, key: str | Keys) -> Map:
    """Return a matrix of 3 x 4 or 4 x 4 numbers as a map. The last row of four must be 0, 0, 0, 1. Raises InputError.

    Raises InputError also for a matrix that is singular to float64.
    """
    expected = f"3 or 4 rows of 4 numbers within +-{MAX_LENGTH:g}"
    rows = items(value, 4)
    lists = [items(row, 4) for row in rows or ()]
    if len(lists) not in (3, 4) or any(row is None or len(row) != 4 for row in lists):
        raise InputError(f"expected {expected}, got {format_value(value)}", key)
    numbers = [
        tuple(number(x, key, -MAX_LENGTH, MAX_LENGTH, expected) for x in row) for row in lists if row is not None
    ]
    if len(numbers) == 4 and numbers[3] != (0.0, 0.0, 0.0, 1.0):
        raise InputError(f"expected 0, 0, 0, 1 as the last of four rows, got {format_value(list(numbers[3]))}", key)
    made: Any = tuple(numbers[:3])
    return check_map(made, key)


def check_map(matrix: Map, key: str | Keys) -> Map:
    """Return a map without negative zeros, so that equal maps have equal bits. Raises InputError.

    Raises InputError for a number beyond +-1e12, and for a map that is singular to float64.
    """
    if not all(abs(x) <= MAX_LENGTH for row in matrix for x in row):
        raise InputError(f"expected a map with numbers within +-{MAX_LENGTH:g}, got {format_value(matrix)}", key)
    check_invertible(matrix, key)
    made: Any = tuple(tuple(x + 0.0 for x in row) for row in matrix)
    return made


def check_invertible(matrix: Map, key: str | Keys) -> None:
    """Raise InputError for a map that is singular to float64, or beyond float64."""
    largest = max(abs(x) for row in matrix for x in row[:3])
    if largest > 0.0 and all(math.isfinite(x) for row in matrix for x in row):
        # The volume of the image of a cube, relative to the cube of its longest edge.
        a, b, c = (tuple(x / largest for x in (*row[:3], 0.0)) for row in matrix)
        scaled: Any = (a, b, c)
        # The longest axis is about 1. Up to a factor of 2, the area is the length of the middle one, and the quotient
        # of volume and area is the length of the shortest. Both must count: rounding alone makes quotients of 1.
        area = max(math.hypot(*row) for row in cofactors(scaled))
        if area > _SINGULAR and abs(determinant(scaled)) > _SINGULAR * area:
            return
    raise InputError("expected a map that can be inverted, got a matrix that is singular to float64", key)
