"""Chunks of PNG files (ISO/IEC 15948): a writer by rows, and the integrity check of untrusted files before decoding.

The check is needed because decoders accept truncated files and fill up the missing pixels. Every error is an
`InputError` without the file's name.

The writer replaces Pillow's: importing Pillow, and its search for the best filter of each row, take longer than writing
the file here, and Pillow writes no RGB of 16 bits.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.validation import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
# The first chunk, IHDR: its length and kind; width, height, bits, colour type, compression, filter, interlace; its CRC.
_BEGIN = struct.Struct(">L4s2L5BL")
# For each colour type: the number of channels, and the allowed numbers of bits per channel.
_COLOURS = {0: (1, (1, 2, 4, 8, 16)), 2: (3, (8, 16)), 3: (1, (1, 2, 4, 8)), 4: (2, (8, 16)), 6: (4, (8, 16))}
_PALETTE = 3  # the colour type of pictures with a palette
# The passes of an interlaced picture: first column, first row, column step and row step.
_PASSES = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
# The only pass of a picture that is not interlaced, in the form of _PASSES.
_WHOLE = ((0, 0, 1, 1),)
# The colour type of pictures by their number of channels, as PngWriter writes them: RGB and RGBA.
_WRITTEN = {3: 2, 4: 6}
# The number of bytes that are processed at once.
_PIECE = 1 << 16
# The most chunks of a file. For a picture of 2^25 pixels libpng writes at most 32,768.
_MOST_CHUNKS = 1 << 17
# The largest total size of all chunks without pixels, such as text, colour profiles and thumbnails, in bytes.
_MOST_BESIDE = 1 << 24
_LIMITS = f"expected a PNG file of at most {_MOST_CHUNKS} chunks and {_MOST_BESIDE} bytes beside its pixels"


class Header(NamedTuple):
    """The picture's properties in the first chunk, IHDR."""

    width: int
    height: int
    bits: int
    colour: int
    interlaced: int

    def size(self) -> int:
        """Return the number of bytes of all inflated rows of pixels, each with a leading filter byte."""
        total = 0
        for column, row, columns, rows in _PASSES if self.interlaced else _WHOLE:
            width, height = -((column - self.width) // columns), -((row - self.height) // rows)
            if width > 0:
                total += max(0, height) * (1 + (width * _COLOURS[self.colour][0] * self.bits + 7) // 8)
        return total


class PngWriter:
    """Writes a PNG file row by row, from the top, so that a picture need not fit into memory."""

    def __init__(
        self, file: IO[bytes], width: int, height: int, channels: int, texts: Mapping[str, str], bits: int = 8
    ) -> None:
        """Write the begin of the file.

        Args:
            file: an open binary file.
            width, height: the picture's size in pixels.
            channels: 3 for RGB, 4 for RGBA with straight alpha.
            texts: texts by their names of 1 to 79 characters of Latin-1.
            bits: 8 or 16, per channel.
        """
        self._file = file
        self._row = width * channels
        self._pixel = channels * bits // 8  # bytes
        self._dtype = np.dtype(np.uint8 if bits == 8 else ">u2")  # PNG has the upper byte first
        # Run-length encoding suits the filtered rows: in flat areas, differences to the left neighbour are zeros.
        self._compressor = zlib.compressobj(strategy=zlib.Z_RLE)
        file.write(SIGNATURE)
        _write_chunk(file, b"IHDR", struct.pack(">2I5B", width, height, bits, _WRITTEN[channels], 0, 0, 0))
        self._write_texts(texts)

    def _write_texts(self, texts: Mapping[str, str]) -> None:
        for key, value in texts.items():
            data = key.encode("latin-1") + bytes(5) + value.encode()  # plain, no language
            _write_chunk(self._file, b"iTXt", data)

    def write_rows(self, levels: NDArray[Any]) -> None:
        """Write the next rows: whole numbers [rows, width, channels] in the range of the bits."""
        rows = np.ascontiguousarray(levels.reshape(-1, self._row), self._dtype).view(np.uint8)
        left = self._pixel
        filtered = np.ones((len(rows), 1 + rows.shape[1]), np.uint8)  # a row begins with its filter type: 1 is "Sub"
        filtered[:, 1 : 1 + left] = rows[:, :left]
        np.subtract(rows[:, left:], rows[:, :-left], out=filtered[:, 1 + left :])
        if data := self._compressor.compress(filtered.data):
            _write_chunk(self._file, b"IDAT", data)

    def close(self, texts: Mapping[str, str] | None = None) -> None:
        """Write the end of the file, with more `texts` that only the finished picture has. The file stays open."""
        _write_chunk(self._file, b"IDAT", self._compressor.flush())
        self._write_texts(texts or {})
        _write_chunk(self._file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, data: bytes) -> None:
    file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


def read_header(file: IO[bytes], most_pixels: int) -> Header:
    """Read the first chunk of a file. Raises InputError for a wrong one, and for more than `most_pixels` pixels."""
    if file.read(len(SIGNATURE)) != SIGNATURE:
        raise InputError("expected a PNG file")
    begin = file.read(_BEGIN.size)
    if len(begin) < _BEGIN.size or begin[:8] != b"\0\0\0\rIHDR":
        raise InputError("expected a PNG file")
    return _header(begin, most_pixels)


def _header(begin: bytes, most_pixels: int) -> Header:
    _, _, width, height, bits, colour, compression, filtering, interlaced, crc = _BEGIN.unpack(begin)
    if width * height > most_pixels:
        raise InputError(f"expected at most {most_pixels} pixels, got {width}x{height}")
    is_valid = width and height and colour in _COLOURS and bits in _COLOURS[colour][1]
    if not is_valid or compression or filtering or interlaced > 1 or crc != zlib.crc32(begin[4:-4]):
        raise InputError("expected a PNG file: its header is damaged")
    return Header(width, height, bits, colour, interlaced)


def check_whole(file: IO[bytes], most_pixels: int) -> Header:
    """Read a complete file and return its header. Raises InputError if a chunk or a row of pixels is missing."""
    header = read_header(file, most_pixels)
    inflater = zlib.decompressobj()
    left, beside = header.size(), 0  # bytes of pixels still to come, and bytes of other chunks
    last, once = b"IHDR", {b"IHDR"}  # the kind of the last chunk, and the kinds that may not come again
    for number, (length, kind) in enumerate(_chunks(file)):
        if kind == b"IHDR":
            if length == 13:
                _header(struct.pack(">L4s", length, kind) + _read_exactly(file, 17), most_pixels)
            raise InputError("expected a PNG file: it has two headers")
        beside += 0 if kind == b"IDAT" else length
        if number > _MOST_CHUNKS or beside > _MOST_BESIDE:
            raise InputError(_LIMITS)
        if kind in once and not kind == last == b"IDAT":
            raise InputError(f"expected a PNG file: its {kind.decode()} chunks are not consecutive")
        once |= {kind} & {b"IDAT", b"PLTE"}
        if kind == b"PLTE" and not (0 < length <= 3 << min(header.bits, 8) and length % 3 == 0):
            raise InputError("expected a PNG file: its palette has a wrong length")
        if kind == b"IDAT" and header.colour == _PALETTE and b"PLTE" not in once:
            raise InputError("expected a PNG file: its palette is missing")
        last = kind
        crc = zlib.crc32(kind)
        while length:
            data = _read_exactly(file, min(length, _PIECE))
            length -= len(data)
            crc = zlib.crc32(data, crc)
            if kind == b"IDAT":
                left -= _inflate(inflater, data, left)
        if crc != int.from_bytes(_read_exactly(file, 4)):
            raise InputError(f"expected a PNG file: its chunk {kind.decode()} is damaged")
    if left or not inflater.eof:
        raise InputError("expected a PNG file: pixels are missing")
    return header


def read_texts(file: IO[bytes]) -> dict[str, str]:
    """Return the texts of a file that check_whole() has accepted, by their keywords, without compressed ones."""
    file.seek(len(SIGNATURE) + _BEGIN.size)
    texts: dict[str, str] = {}
    for length, kind in _chunks(file):
        if kind != b"iTXt":
            file.seek(length + 4, 1)
            continue
        keyword, _, rest = _read_exactly(file, length).partition(b"\0")
        file.seek(4, 1)
        # Compression flag and method, language, translated keyword, text.
        parts = rest[2:].split(b"\0", 2)
        if rest[:1] == b"\0" and len(parts) == 3:
            texts[keyword.decode("latin-1")] = parts[2].decode(errors="replace")
    return texts


def _chunks(file: IO[bytes]) -> Iterator[tuple[int, bytes]]:
    """Yield the length and kind of each chunk after the header. The caller reads the chunk's data and CRC."""
    while True:
        length, kind = struct.unpack(">L4s", _read_exactly(file, 8))
        if length >= 1 << 31 or not kind.isalpha():
            raise InputError("expected a PNG file: a chunk is damaged")
        yield length, kind
        if kind == b"IEND":
            if length or file.read(1):
                raise InputError("expected a PNG file: something comes behind its end")
            return


def _read_exactly(file: IO[bytes], size: int) -> bytes:
    data = file.read(size)
    if len(data) < size:
        raise InputError("expected a PNG file: it is cut off")
    return data


def _inflate(inflater: zlib._Decompress, data: bytes, left: int) -> int:
    """Inflate the next bytes and return the number of bytes of pixels. Raises InputError for more than `left`."""
    total = 0
    try:
        while True:
            piece = inflater.decompress(data, _PIECE)
            data = inflater.unconsumed_tail
            total += len(piece)
            if total > left or inflater.unused_data:
                raise InputError("expected a PNG file: it has more pixels than its header says")
            if not data and len(piece) < _PIECE:
                return total
    except zlib.error:
        raise InputError("expected a PNG file: its pixels are damaged") from None
