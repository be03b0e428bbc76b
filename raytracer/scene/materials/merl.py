"""Measured isotropic reflectance in the format of the MERL database (Matusik et al. 2003): `.binary` files.

A file contains three int32 (90, 90, 180), then the float64 values of red, of green and of blue. Each channel is an
array [theta_h, theta_d, phi_d] in C order, by Rusinkiewicz's half and difference angles. theta_h is sampled evenly in
its square root, the other angles evenly. phi_d ends at pi, because phi_d + pi gives the same value by reciprocity. A
stored value is f divided by the scale of its channel. Negative values, for directions below the horizon, count as 0.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from raytracer.core.files import read_bounded
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError, check_path, locate_errors

SHAPE = (90, 90, 180)
SCALES = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)
_BYTES = 12 + 8 * 3 * 90 * 90 * 180
# The largest accepted value of f: its product with the largest colour is still finite in float32.
_LARGEST = 1e12


class Measured:
    """A table of measured reflectance. Two tables are equal if all their values are.

    Attributes:
        values: f in 1/sr, float32, read-only [theta_h 90, theta_d 90, phi_d 180, RGB 3].
        path: the file from which the table was read, "" for none.

    Raises InputError for values of another shape, above 1e12, or NaN.
    """

    def __init__(self, values: ArrayLike, path: str = "") -> None:
        numbers = np.asarray(values)
        if numbers.shape != (*SHAPE, 3):
            raise InputError(f"expected values of shape {(*SHAPE, 3)}, got {numbers.shape}")
        if not (numbers <= _LARGEST).all():  # NaN fails this comparison, too
            raise InputError(f"expected values of at most {_LARGEST:g}")
        self.values: NDArray[np.float32] = (np.maximum(numbers, 0.0) + 0.0).astype(np.float32)  # + 0.0 replaces -0.0
        self.values.flags.writeable = False
        self.path = path
        self._digest = hashlib.sha256(self.values.tobytes()).digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Measured) and self._digest == other._digest

    def __reduce__(self) -> tuple[Any, ...]:
        return Measured, (self.values, self.path)

    def __hash__(self) -> int:
        return hash(self._digest)

    def __repr__(self) -> str:
        return repr(self.path) if self.path else "Measured(...)"


def read(path: str | os.PathLike[str], folder: Path | None = None) -> Measured:
    """Read a `.binary` file.

    Args:
        path: the file.
        folder: a folder that must contain the file after all symbolic links are resolved. None allows any place.

    Raises:
        InputError: the file cannot be read, or is not in MERL's format.
    """
    path = check_path(path, "path")
    try:
        data = read_bounded(path, _BYTES, folder)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        near = did_you_mean_file(path)
        raise InputError(f"expected a readable .binary file: {reason}{near}", file=str(path)) from None
    if len(data) != _BYTES or tuple(np.frombuffer(data, "<i4", 3)) != SHAPE:
        expected = f"a MERL file: the numbers 90, 90, 180 and {_BYTES} bytes in all"
        raise InputError(f"expected {expected}", file=str(path))
    planes = np.frombuffer(data, "<f8", offset=12).reshape(3, *SHAPE)
    with locate_errors(path):
        return Measured(np.moveaxis(planes, 0, -1) * SCALES, str(path))


def write(measured: Measured, file: IO[bytes]) -> None:
    """Write a table to an open `.binary` file."""
    file.write(np.array(SHAPE, "<i4").tobytes())
    for channel, scale in enumerate(SCALES):
        file.write((measured.values[..., channel].astype("<f8") / scale).tobytes())


def directions() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the directions (wi, wo) at the centres of the table's cells, as unit vectors [90, 90, 180, 3] each.

    The normal is +z. Some directions are below the surface.
    """
    counts = (np.arange(n) + 0.5 for n in SHAPE)
    h, d, phi = np.meshgrid(*counts, indexing="ij")
    theta_h, theta_d, phi_d = (h / 90.0) ** 2 * np.pi / 2.0, np.radians(d), np.radians(phi)
    along, across, up = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    sine, cosine = np.sin(theta_h), np.cos(theta_h)
    half = np.stack([sine, np.zeros_like(h), cosine], -1)
    wi = np.stack([cosine * along + sine * up, across, cosine * up - sine * along], -1)
    return wi, 2.0 * up[..., None] * half - wi
