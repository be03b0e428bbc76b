"""The finished picture: linear radiance, and what each pixel sees."""

from __future__ import annotations

import io
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import IO, Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import DTypeLike, NDArray

from raytracer.core.output import check_output, written_whole
from raytracer.core.record import Record, public
from raytracer.core.shown import shown
from raytracer.core.validation import InputError, about, check_choice, check_text
from raytracer.formats.estimate import Estimate
from raytracer.formats.image_files import FORMATS
from raytracer.formats.srgb import encode_srgb8


def _is_numbers(value: Any) -> bool:
    """Whether `value` is an array of real numbers, none of them masked."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iuf":
        return False
    return type(value) is np.ndarray or not np.ma.is_masked(value)  # numpy.ma takes long to import


def _kind(value: Any) -> str:
    return f"one of shape {value.shape} of {value.dtype}" if isinstance(value, np.ndarray) else shown(value)


def _check_keyword(key: Any) -> None:
    """Raise InputError for a name that PNG does not take for a text: 1 to 79 printable characters of Latin-1."""
    if not (isinstance(key, str) and key.isprintable() and 1 <= len(key) < 80 and max(key) <= "\xff"):
        raise InputError(f"expected names of 1 to 79 characters of Latin-1, got {shown(key)}", "metadata")


class Geometry(NamedTuple):
    """The surfaces that the centre rays of a picture's pixels meet: arrays as those of an Image."""

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    material: NDArray[np.int32]


class GeometrySource(ABC):
    """The maker of a picture's geometry. An Image may hold one in place of each of the three arrays."""

    shape: tuple[int, int]  # of the picture: (H, W)

    @abstractmethod
    def geometry(self) -> Geometry:
        """The arrays, made at the first call."""


@public
class Image(Record, frozen=True, eq=False):
    """A rendered picture. All arrays have the top row first.

    `radiance` is (H, W, 3) float32, linear RGB. The others are those of each pixel's centre ray,
    or None if they were not asked for: `depth` (H, W) float32, the distance along the unit ray,
    inf where nothing was hit; `normal` (H, W, 3) float32, unit, world space, towards the viewer's
    side, 0 where nothing was hit; `material` (H, W) int32, index into `Scene.materials`, -1 where
    nothing was hit. The GPU finds these three at the first access to one of them, or when the image is pickled or
    saved as .npz. The reference's images are float64. `samples` (H, W) int32: how many each pixel
    got, of a picture with adaptive samples, else None. `error` (H, W) float32: the estimated root mean square error of
    each pixel over red, green and blue, linear radiance, nan where it is not known. `estimate` says that of the
    picture. `metadata`, text by names, goes into files. `np.asarray(image)` is the radiance. Raises InputError for what
    is no such array, and for arrays of other sizes than the radiance.
    """

    radiance: NDArray[Any]
    depth: NDArray[Any] | None = None
    normal: NDArray[Any] | None = None
    material: NDArray[np.int32] | None = None
    samples: NDArray[np.int32] | None = None
    error: NDArray[Any] | None = None
    estimate: Estimate | None = None
    metadata: Mapping[str, str] = msgspec.field(default_factory=dict)

    def __post_init__(self) -> None:
        radiance: Any = self.radiance
        if not (_is_numbers(radiance) and radiance.ndim == 3 and radiance.shape[2] == 3 and radiance.size):
            raise InputError(f"expected an array (H, W, 3) of numbers, got {_kind(radiance)}", "radiance")
        shape = radiance.shape[:2]
        for name in ("depth", "normal", "material", "samples", "error"):
            value: Any = self._stored(name)
            if isinstance(value, GeometrySource):
                if value.shape == shape:
                    continue
                value = getattr(self, name)  # to say what it is
            expected = radiance.shape if name == "normal" else shape
            if value is not None and not (_is_numbers(value) and value.shape == expected):
                raise InputError(f"expected an array {expected} of numbers or None, got {_kind(value)}", name)
        if self.estimate is not None and not isinstance(self.estimate, Estimate):
            raise InputError(f"expected an Estimate or None, got {shown(self.estimate)}", "estimate")
        if not isinstance(self.metadata, Mapping):
            raise InputError(f"expected text by names, got {shown(self.metadata)}", "metadata")
        for key, text in self.metadata.items():
            _check_keyword(key)
            check_text(text, ("metadata", key))

    def _stored(self, name: str) -> Any:
        """A field's value; of an array of the geometry the source, if the field holds that."""
        return _GEOMETRY[name].stored(self) if name in _GEOMETRY else getattr(self, name)

    def __reduce__(self) -> tuple[Any, ...]:
        # With the arrays, so that no reader of the pickle needs OpenGL.
        return type(self), tuple(getattr(self, name) for name in self.__struct_fields__)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """The radiance itself, for NumPy: a copy only where NumPy asks for one, or for another `dtype`."""
        array = np.asarray(self.radiance, dtype)
        if array is self.radiance:
            return array.copy() if copy else array
        if copy is False:
            raise ValueError(f"expected a copy to be allowed, as the radiance is {self.radiance.dtype}, not {dtype}")
        return array

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        return f"<Image {width}x{height}>"

    def srgb8(self) -> NDArray[np.uint8]:
        """The picture as (H, W, 3) uint8, sRGB."""
        return encode_srgb8(self.radiance)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a .png (8-bit sRGB) or .npz (the arrays, and the metadata as JSON), whole or not at all.

        A file that is there keeps its permissions; a link stays, and its target is written. Raises InputError for
        another suffix, a place that cannot be written to, or arrays that were not rendered.
        """
        path = check_output(path, FORMATS)
        with written_whole(path) as file, about(path):
            self.write(file, path.suffix)

    def write(self, file: IO[bytes], suffix: str) -> None:
        """Write the picture to a binary file as `save` does for a path that ends in `suffix`."""
        if not callable(getattr(file, "write", None)):
            raise InputError(f"expected a binary file, got {shown(file)}", "file")
        form = FORMATS[check_choice(suffix.lower(), "suffix", FORMATS)]
        arrays = {name: getattr(self, name) for name in (*form.needed, *form.optional)}
        missing = [name for name in form.needed if arrays[name] is None]
        if missing:
            raise InputError(f"expected an image rendered with geometry=True, got none of {missing}")
        form.write(file, {name: array for name, array in arrays.items() if array is not None}, self.metadata)

    def png(self) -> bytes:
        """The picture as the bytes of a PNG file, those that `save` writes. A notebook shows them."""
        buffer = io.BytesIO()
        self.write_png(buffer)
        return buffer.getvalue()

    _repr_png_ = png

    def write_png(self, file: IO[bytes]) -> None:
        """Write the picture to a binary file as PNG (8-bit sRGB), with the metadata as text."""
        self.write(file, ".png")


class _GeometryField:
    """The attribute of an Image for an array of its geometry."""

    def __init__(self, field: Any) -> None:
        """`field` is the attribute that gives the stored value."""
        self._field = field

    def stored(self, image: Image) -> Any:
        """The array, None, or the source of the array."""
        return self._field.__get__(image)

    def __get__(self, image: Image | None, owner: type[Image] | None = None) -> Any:
        if image is None:
            return self
        value = self.stored(image)
        return getattr(value.geometry(), self._field.__name__) if isinstance(value, GeometrySource) else value


_GEOMETRY = {name: _GeometryField(getattr(Image, name)) for name in Geometry._fields}
for _name, _field in _GEOMETRY.items():
    setattr(Image, _name, _field)
