"""Writer of OpenEXR files row by row: radiance and alpha as float32, compressed without loss (ZIP).

The package OpenEXR writes a picture at once, or by an older interface that ends the process for pictures with 2 GiB in
a channel. The format is short: a header, a table of the places of blocks, and blocks of 16 rows
(https://openexr.com/en/latest/OpenEXRFileLayout.html).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import IO

import numpy as np
from numpy.typing import NDArray

from raytracer.formats.image_exr import REC_709, header_texts

# The first bytes of a file: its kind, and version 2 with the rows of one picture.
_BEGIN = struct.pack("<2i", 20000630, 2)
# The codes of float32, of ZIP compression, and of rows from the top down.
_FLOAT, _ZIP, _DOWN = 2, 3, 0
# The number of rows that ZIP compresses together.
_ROWS = 16
# The level of compression. OpenEXR's level 4 saves 8 %, and takes nearly twice as long.
_LEVEL = 1
# The room in the header for texts of the finished picture, in bytes: twice its longest estimate, which is there twice.
_ROOM = 2048
_PADDING = "padding"


class ExrWriter:
    """Writes an EXR file row by row, from the top, so that a picture need not fit into memory."""

    def __init__(self, file: IO[bytes], width: int, height: int, channels: int, texts: Mapping[str, str]) -> None:
        """Write the begin of the file.

        Args:
            file: an open and empty binary file, in which the writer can seek.
            width, height: the picture's size in pixels.
            channels: 3 for R, G, B, or 4 with A.
            texts: texts by name.
        """
        self._file, self._size, self._texts = file, (width, height), dict(texts)
        self._names = "RGBA"[:channels]
        header = self._header(texts, b" " * _ROOM)
        self._header_bytes = len(header)
        self._places: list[int] = []  # of the blocks
        self._rest = np.empty((0, width, channels), np.float32)  # the last rows, which do not fill a block yet
        file.write(header)
        file.write(bytes(8 * -(-height // _ROWS)))

    def _header(self, texts: Mapping[str, str], padding: bytes) -> bytes:
        """Return the header."""
        width, height = self._size
        window = struct.pack("<4i", 0, 0, width - 1, height - 1)
        channels = (name.encode() + struct.pack("<x4i", _FLOAT, 0, 1, 1) for name in sorted(self._names))
        attributes = [
            ("channels", "chlist", b"".join(channels) + b"\0"),
            ("compression", "compression", bytes([_ZIP])),
            ("dataWindow", "box2i", window),
            ("displayWindow", "box2i", window),
            ("lineOrder", "lineOrder", bytes([_DOWN])),
            ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
            ("screenWindowCenter", "v2f", bytes(8)),
            ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
            ("chromaticities", "chromaticities", struct.pack("<8f", *REC_709)),
            *((name, "string", text.encode()) for name, text in header_texts(texts).items()),
            (_PADDING, "string", padding),
        ]
        fields = (f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data for name, kind, data in attributes)
        return _BEGIN + b"".join(fields) + b"\0"

    def write_rows(self, pixels: NDArray[np.float32]) -> None:
        """Write the next rows [rows, width, channels]: premultiplied radiance, then alpha. Raises OSError."""
        pixels = np.concatenate((self._rest, pixels))
        whole = len(pixels) - len(pixels) % _ROWS
        self._rest = pixels[whole:].copy()
        self._write_blocks([pixels[first : first + _ROWS] for first in range(0, whole, _ROWS)])

    def _write_blocks(self, blocks: list[NDArray[np.float32]]) -> None:
        # From R, G, B, A to the order of names, A, B, G, R.
        order = [self._names.index(name) for name in sorted(self._names)]
        from concurrent.futures import ThreadPoolExecutor  # it imports logging, which other commands do without

        with ThreadPoolExecutor() as threads:  # zlib and NumPy let other threads run
            for data in threads.map(lambda block: _compress(block[..., order]), blocks):
                self._places.append(self._file.tell())
                self._file.write(struct.pack("<2i", _ROWS * (len(self._places) - 1), len(data)) + data)

    def close(self, texts: Mapping[str, str] | None = None) -> None:
        """Write the last rows, and more `texts` that only the finished picture has. The file stays open.

        Raises ValueError if the texts take more than 2 KB, or rows are missing, and OSError.
        """
        if len(self._rest):
            self._write_blocks([self._rest])
        more = self._texts | dict(texts or {})
        room = self._header_bytes - len(self._header(more, b""))
        if room < 0 or len(self._places) != -(-self._size[1] // _ROWS):
            raise ValueError(f"expected short texts and all rows, got {-room} bytes more, {len(self._places)} blocks")
        self._file.seek(0)
        self._file.write(self._header(more, b" " * room))
        self._file.write(np.array(self._places, "<u8").tobytes())
        self._file.seek(0, 2)


def _compress(block: NDArray[np.float32]) -> bytes:
    """Return the data of a block of rows [rows, width, channels], whose channels are in the order of their names."""
    # Each row has all pixels of the first channel, then all of the second.
    data = np.ascontiguousarray(block.transpose(0, 2, 1), "<f4").view(np.uint8).ravel()
    # Bytes at even places, then those at odd places, and of each the difference to the one before, plus 128.
    halves = np.concatenate((data[::2], data[1::2]))
    halves[1:] -= halves[:-1].copy() - np.uint8(128)
    compressed = zlib.compress(halves.data, _LEVEL)
    return compressed if len(compressed) < len(data) else data.tobytes()
