"""Picture files, made according to the standards."""

import struct
import zlib
from pathlib import Path

import numpy as np

from raytracer.formats.image import Image


def grey(value: float, size: tuple[int, int] = (8, 6)) -> np.ndarray:
    return np.full((size[1], size[0], 3), value)


def save(path: Path, radiance: np.ndarray) -> str:
    if path.suffix == ".npz":
        np.savez(path, radiance=radiance)
    else:
        Image(radiance).save(path)
    return str(path)


def chunk(kind: bytes, data: bytes = b"") -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png16(pixels: np.ndarray) -> bytes:
    """Return a PNG file of 16 bits by the standard (ISO/IEC 15948), with differences to left neighbours in all rows."""
    height, width, channels = pixels.shape
    rows = pixels.astype(">u2").view(np.uint8).reshape(height, -1)
    left = np.pad(rows, ((0, 0), (2 * channels, 0)))[:, : rows.shape[1]]
    data = np.pad(rows - left, ((0, 0), (1, 0)), constant_values=1).tobytes()
    kinds = {1: 0, 2: 4, 3: 2, 4: 6}
    head = struct.pack(">2I5B", width, height, 16, kinds[channels], 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(data)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(kind, data) for kind, data in chunks)


def png(pixels: np.ndarray, bits: int, colour: int, interlaced: bool, more: bytes = b"") -> list[bytes]:
    """Return a PNG file by the standard, in parts: signature, IHDR, `more`, two IDAT, IEND. Pixels: [H, W, samples]."""
    height, width, _ = pixels.shape
    whole = [(0, 0, 1, 1)]
    passes = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    data = b""
    for x, y, dx, dy in passes if interlaced else whole:
        part = pixels[y::dy, x::dx]
        for row in part if part.size else ():
            digits = "".join(f"{int(value):0{bits}b}" for value in row.ravel())
            digits += "0" * (-len(digits) % 8)
            data += b"\0" + int(digits, 2).to_bytes(len(digits) // 8)
    data = zlib.compress(data)
    head = struct.pack(">2I5B", width, height, bits, colour, 0, 0, int(interlaced))
    half = len(data) // 2
    idat = chunk(b"IDAT", data[:half]), chunk(b"IDAT", data[half:])
    return [b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), more, *idat, chunk(b"IEND")]
