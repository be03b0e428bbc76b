"""The headers of untrusted OpenEXR files (openexr.com, "The OpenEXR File Layout"): sizes, channels and texts.

Headers are read here, without the package OpenEXR: it trusts the sizes in a header, prints messages, and may crash.
Every error is an `InputError` without the file's name.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import IO, NamedTuple

from raytracer.core.validation import InputError

_MAGIC = b"\x76\x2f\x31\x01"
# The bits of the version: the number of the format, a flag for several parts, and a flag for deep pixels in one.
_NUMBER, _HAS_PARTS, _IS_DEEP = 0xFF, 0x1000, 0x800
# The largest size of all headers of a file, in bytes. Some texts and a hundred channels take a hundredth.
_MOST_BYTES = 1 << 20
# A channel behind its name: the type of its numbers, a hint with three spare bytes, and the steps between its pixels.
_CHANNEL = struct.Struct("<i4x2i")
_FLOATS = 1, 2  # the types of float16 and float32
# The number of ZIP in the attribute `compression`, and the rows of pixels that it compresses together in a chunk.
_ZIP, _ZIP_ROWS = b"\x03", 16


class Part(NamedTuple):
    """The header of one part of a file.

    Attributes:
        size: (width, height) of the pixels in the file.
        shown: (width, height) of the picture, which may be larger or smaller.
        channels: whether the numbers of each channel are floating-point, by its name.
        is_flat: whether each pixel has one number in each channel: neither deep nor subsampled.
        is_tiled: whether there are tiles, perhaps with levels of lower resolution.
        is_zip: whether the pixels are in rows that are compressed as ZIP.
        texts: the attributes of text, by name.
        end: the place in the file behind the header.
    """

    size: tuple[int, int]
    shown: tuple[int, int]
    channels: Mapping[str, bool]
    is_flat: bool
    is_tiled: bool
    is_zip: bool
    texts: Mapping[str, str]
    end: int


def read_parts(file: IO[bytes]) -> list[Part]:
    """Read the headers of all parts of a file. Raises InputError for a damaged one."""
    if file.read(4) != _MAGIC:
        raise InputError("expected an EXR file")
    data = file.read(4 + _MOST_BYTES)
    version = int.from_bytes(data[:4], "little")
    if version & _NUMBER != 2:
        raise InputError(f"expected an EXR file of version 2, got {version & _NUMBER}")
    try:
        reader = _Reader(data, 4)
        parts = [_part(reader, is_deep=bool(version & _IS_DEEP))]
        while version & _HAS_PARTS and reader.data[reader.at]:
            parts.append(_part(reader, is_deep=bool(version & _IS_DEEP)))
    except (IndexError, KeyError, ValueError, struct.error):
        more = f", or has more than {_MOST_BYTES} bytes" if len(data) > _MOST_BYTES else ""
        raise InputError(f"expected an EXR file: its header is damaged{more}") from None
    return parts


def check_whole(file: IO[bytes], part: Part) -> None:
    """Raise InputError unless a file, which has the only part `part` in ZIP, has all its chunks of pixels."""
    rows = -(-part.size[1] // _ZIP_ROWS)
    size = file.seek(0, 2)
    file.seek(part.end)
    places = file.read(8 * rows)  # behind the header: the place of each chunk
    if len(places) == 8 * rows:
        last = max(struct.unpack(f"<{rows}Q", places))
        if last < size:
            file.seek(last + 4)  # behind the number of the chunk's first row: the size of the chunk
            if last + 8 + int.from_bytes(file.read(4), "little") <= size:
                return
    raise InputError("expected an EXR file: it is cut off")


class _Reader:
    """Reads bytes one after another. Reading beyond the end raises ValueError or IndexError."""

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data = data
        self.at = at

    def name(self) -> str:
        """Read a name, which a zero byte ends. The last name of a list is empty."""
        end = self.data.index(b"\0", self.at)
        name, self.at = self.data[self.at : end].decode(errors="replace"), end + 1
        return name

    def take(self, size: int) -> bytes:
        """Read `size` bytes."""
        if not 0 <= size <= len(self.data) - self.at:
            raise ValueError
        self.at += size
        return self.data[self.at - size : self.at]


def _part(reader: _Reader, *, is_deep: bool) -> Part:
    attributes: dict[str, tuple[str, bytes]] = {}
    while name := reader.name():
        kind = reader.name()
        attributes[name] = kind, reader.take(int.from_bytes(reader.take(4), "little", signed=True))
    texts = {name: data.decode(errors="replace") for name, (kind, data) in attributes.items() if kind == "string"}
    channels, is_whole = _channels(_Reader(attributes["channels"][1]))
    form = texts.get("type", "")
    return Part(
        _size(attributes["dataWindow"][1]),
        _size(attributes["displayWindow"][1]),
        channels,
        is_whole and not is_deep and not form.startswith("deep"),
        "tiles" in attributes,
        attributes["compression"][1] == _ZIP and "tiles" not in attributes,
        texts,
        len(_MAGIC) + reader.at,
    )


def _channels(reader: _Reader) -> tuple[dict[str, bool], bool]:
    """Read a list of channels, and return which of them are floating-point, and whether none is subsampled."""
    channels: dict[str, bool] = {}
    is_whole = True
    while name := reader.name():
        kind, *steps = _CHANNEL.unpack(reader.take(_CHANNEL.size))
        channels[name] = kind in _FLOATS
        is_whole &= steps == [1, 1]
    return channels, is_whole


def _size(window: bytes) -> tuple[int, int]:
    """Return the (width, height) of a window, whose corners are in it."""
    left, top, right, bottom = struct.unpack("<4i", window)
    if right < left or bottom < top:
        raise ValueError
    return right - left + 1, bottom - top + 1
