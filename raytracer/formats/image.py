"""Image: a finished picture with linear radiance, geometry, and its estimated error."""

from __future__ import annotations

import io
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import IO, Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import DTypeLike, NDArray

from raytracer.core.output import write_atomically
from raytracer.core.record import Record, public
from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, check_choice, check_text, locate_errors
from raytracer.formats.estimate import Estimate
from raytracer.formats.image_files import FORMATS, check_bits, check_picture_output
from raytracer.formats.planar_depth import planar_depth
from raytracer.formats.srgb import encode_srgb8
from raytracer.scene.camera import Camera


def _is_numbers(value: Any) -> bool:
    """Whether `value` is an array of real numbers, none of them masked."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iuf":
        return False
    return type(value) is np.ndarray or not np.ma.is_masked(value)  # numpy.ma takes long to import


def _kind(value: Any) -> str:
    return f"one of shape {value.shape} of {value.dtype}" if isinstance(value, np.ndarray) else format_value(value)


def _check_keyword(key: Any) -> None:
    """Raise InputError unless PNG accepts `key` as a text's keyword: 1 to 79 printable Latin-1 characters."""
    if not (isinstance(key, str) and key.isprintable() and 1 <= len(key) < 80 and max(key) <= "\xff"):
        raise InputError(f"expected names of 1 to 79 characters of Latin-1, got {format_value(key)}", "metadata")


class Geometry(NamedTuple):
    """The surfaces that the rays through the pixels' centres hit: three arrays of an Image."""

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    material: NDArray[np.int32]


class GeometrySource(ABC):
    """Lazy geometry: an object that an Image may hold in place of each of the three arrays, to compute them later."""

    shape: tuple[int, int]  # (height, width) of the picture

    @abstractmethod
    def geometry(self) -> Geometry:
        """Return the arrays. The first call computes them."""


@public
class Image(Record, frozen=True, eq=False):
    """A rendered picture. Arrays have H rows, the top row first, and W columns. `np.asarray(image)` is the radiance.

    A transparent picture has an `alpha`, and its radiance is premultiplied: the background, where the camera sees it
    directly, adds nothing to the radiance.

    `depth`, `normal` and `material` describe the surface that the ray through the pixel's centre hits. The GPU computes
    them at the first access to one of them, and when the image is pickled or saved as .npz. Arrays of floating-point
    numbers are float32 in rendered pictures and float64 in pictures of `raytracer.reference`.

    Args:
        radiance: the mean linear radiance of each pixel, red, green, blue [H, W, 3].
        depth: the distance from the camera along the ray, inf for the background [H, W]. None if not computed.
        normal: the unit normal in world space, on the camera's side of the surface, 0 for the background [H, W, 3].
            None if not computed.
        material: the index in `Scene.materials`, -1 for the background, int32 [H, W]. None if not computed.
        samples: the number of samples of each pixel, int32 [H, W]. None if all pixels have the same number.
        error: the estimated error of each pixel, root mean square over red, green and blue, in linear radiance, NaN
            if unknown [H, W]. None if not computed.
        estimate: the estimated error of the whole picture. None if there is no estimate.
        metadata: texts by name, which are stored in files. Default: none.
        alpha: the share of each pixel that surfaces cover, in [0, 1] [H, W]. None if the picture is opaque.
        camera: the camera of the picture, from which `planar_depth` follows. None if unknown.

    Raises:
        InputError: an argument is no such array, or its size differs from the radiance.
    """

    radiance: NDArray[Any]
    depth: NDArray[Any] | None = None
    normal: NDArray[Any] | None = None
    material: NDArray[np.int32] | None = None
    samples: NDArray[np.int32] | None = None
    error: NDArray[Any] | None = None
    estimate: Estimate | None = None
    metadata: Mapping[str, str] = msgspec.field(default_factory=dict)
    alpha: NDArray[Any] | None = None
    camera: Camera | None = None

    def __post_init__(self) -> None:
        radiance: Any = self.radiance
        if not (_is_numbers(radiance) and radiance.ndim == 3 and radiance.shape[2] == 3 and radiance.size):
            raise InputError(f"expected an array (H, W, 3) of numbers, got {_kind(radiance)}", "radiance")
        shape = radiance.shape[:2]
        for name in ("depth", "normal", "material", "samples", "error", "alpha"):
            value: Any = self._stored(name)
            if isinstance(value, GeometrySource):
                if value.shape == shape:
                    continue
                value = getattr(self, name)  # the array itself, for the error message
            expected = radiance.shape if name == "normal" else shape
            if value is not None and not (_is_numbers(value) and value.shape == expected):
                raise InputError(f"expected an array {expected} of numbers or None, got {_kind(value)}", name)
        if self.estimate is not None and not isinstance(self.estimate, Estimate):
            raise InputError(f"expected an Estimate or None, got {format_value(self.estimate)}", "estimate")
        if self.camera is not None and not isinstance(self.camera, Camera):
            raise InputError(f"expected a Camera or None, got {format_value(self.camera)}", "camera")
        if not isinstance(self.metadata, Mapping):
            raise InputError(f"expected text by names, got {format_value(self.metadata)}", "metadata")
        for key, text in self.metadata.items():
            _check_keyword(key)
            check_text(text, ("metadata", key))

    def _stored(self, name: str) -> Any:
        """Return the stored value of a field: for the geometry, an array or the object that computes it."""
        return _GEOMETRY[name].stored(self) if name in _GEOMETRY else getattr(self, name)

    def __reduce__(self) -> tuple[Any, ...]:
        # Pickle the arrays, not the object that computes them, so that unpickling needs no OpenGL.
        return type(self), tuple(getattr(self, name) for name in self.__struct_fields__)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Return the radiance for NumPy, without a copy unless NumPy requests one or another `dtype`."""
        array = np.asarray(self.radiance, dtype)
        if array is self.radiance:
            return array.copy() if copy else array
        if copy is False:
            raise ValueError(f"expected a copy to be allowed, as the radiance is {self.radiance.dtype}, not {dtype}")
        return array

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"<Image {width}x{height}>"

    @property
    def planar_depth(self) -> NDArray[Any] | None:
        """The distance from the camera along its direction of view, inf for the background [H, W].

        None if the picture has no `depth` or no `camera`.
        """
        depth, camera = self.depth, self.camera
        return None if depth is None or camera is None else planar_depth(depth, camera)

    def srgb8(self) -> NDArray[np.uint8]:
        """Return the radiance as 8-bit sRGB, uint8 [H, W, 3], clipped to [0, 1]. Premultiplied by alpha."""
        return encode_srgb8(self.radiance)

    def save(self, path: str | os.PathLike[str], bits: int | None = None) -> None:
        """Save the picture atomically: a complete file is written, or none.

        A replaced file keeps its permissions. A symbolic link is kept, and its target is replaced.

        Args:
            path: a file that ends in .png (sRGB), .npz (all arrays, and the metadata as JSON) or .exr (all arrays as
                float32 channels, and the metadata in the header).
            bits: the number of bits per channel of a .png: 8 or 16. Default: 8.

        Raises:
            InputError: another suffix, a path that cannot be written to, for .npz a picture without geometry, for .exr
                a missing package OpenEXR, or bits for another format than .png.
        """
        path = check_picture_output(path, bits)
        with write_atomically(path) as file, locate_errors(path):
            self.write(file, path.suffix, bits)

    def write(self, file: IO[bytes], suffix: str, bits: int | None = None) -> None:
        """Write the picture to an open binary file, in the format of `suffix`: ".png", ".npz" or ".exr".

        Errors: see save().
        """
        if not callable(getattr(file, "write", None)):
            raise InputError(f"expected a binary file, got {format_value(file)}", "file")
        suffix = check_choice(suffix.lower(), "suffix", FORMATS)
        form, options = FORMATS[suffix], check_bits(suffix, bits)
        arrays = {name: getattr(self, name) for name in (*form.needed, *form.optional)}
        missing = [name for name in form.needed if arrays[name] is None]
        if missing:
            raise InputError(f"expected an image rendered with geometry=True, got none of {missing}")
        present = {name: array for name, array in arrays.items() if array is not None}
        form.write(file, present, self.metadata, **options)

    def png(self) -> bytes:
        """Return the bytes of a PNG file of the picture, the same as `save` writes. Notebooks show pictures with it."""
        buffer = io.BytesIO()
        self.write_png(buffer)
        return buffer.getvalue()

    _repr_png_ = png

    def write_png(self, file: IO[bytes]) -> None:
        """Write the picture to an open binary file as PNG (8-bit sRGB), with the metadata as text."""
        self.write(file, ".png")


class _GeometryField:
    """Descriptor of an Image's depth, normal or material: it computes the array at the first access."""

    def __init__(self, field: Any) -> None:
        """Wrap `field`, the struct's own descriptor, which returns the stored value."""
        self._field = field

    def stored(self, image: Image) -> Any:
        """Return the stored value: an array, None, or the GeometrySource that computes the array."""
        return self._field.__get__(image)

    def __get__(self, image: Image | None, owner: type[Image] | None = None) -> Any:
        if image is None:
            return self
        value = self.stored(image)
        return getattr(value.geometry(), self._field.__name__) if isinstance(value, GeometrySource) else value


_GEOMETRY = {name: _GeometryField(getattr(Image, name)) for name in Geometry._fields}
for _name, _field in _GEOMETRY.items():
    setattr(Image, _name, _field)
