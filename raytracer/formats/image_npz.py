"""Pictures as `.npz` files: all arrays of an image, and its metadata as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from raytracer.core.npz import read_arrays, read_shape
from raytracer.core.validation import InputError
from raytracer.formats.radiance import MAX_PIXELS, check_pixels, check_radiance

# The largest size of the array `radiance`, in bytes: 16 for the widest floating-point numbers.
_MAX_ARRAY = 16 * 3 * MAX_PIXELS
# The largest size of the array `metadata`, in bytes, 4 a character. The program writes some 2,000.
_MAX_METADATA = 1 << 20


def write(file: IO[bytes], arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]) -> None:
    """Write a picture's arrays by name, and its metadata."""
    import json  # imported here, because .png files do not need it

    # The metadata is stored as text, so that loading it needs no pickles.
    contents: dict[str, Any] = {**arrays, "metadata": np.array(json.dumps(dict(metadata)))}
    np.savez(file, **contents)


def read_size(file: IO[bytes]) -> tuple[int, int]:
    """Read only the (width, height) of a picture. Raises InputError."""
    height, width, _ = read_shape(file, "radiance", _check_array, _MAX_ARRAY)
    return width, height


def read_radiance(file: IO[bytes]) -> NDArray[Any]:
    """Read the array `radiance` [H, W, 3]. Raises InputError."""
    [picture] = read_arrays(file, lambda names: ["radiance"], _check_array, _MAX_ARRAY).values()
    check_radiance(picture, "radiance")
    return picture


def read_metadata(file: IO[bytes]) -> dict[str, str]:
    """Return the texts of a picture by their names. Raises InputError for a damaged or incomplete file."""
    import json

    [array] = read_arrays(file, lambda names: ["metadata"], _check_metadata, _MAX_METADATA).values()
    try:
        texts = json.loads(str(array))
    except (ValueError, RecursionError):
        texts = None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise InputError("expected a JSON object of texts", "metadata")
    return texts


def _check_metadata(name: str, shape: tuple[int, ...], dtype: Any) -> None:
    if shape or dtype.kind != "U":
        raise InputError(f"expected a text, got {shape} of {dtype}", name)


def _check_array(name: str, shape: tuple[int, ...], dtype: Any) -> None:
    if len(shape) != 3 or shape[2] != 3 or min(shape) < 1 or dtype.kind != "f":
        raise InputError(f"expected an array (H, W, 3) of floating-point numbers, got {shape} of {dtype}", name)
    check_pixels(shape[1], shape[0])
