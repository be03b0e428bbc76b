"""Reading arrays from untrusted `.npz` files.

No pickle is loaded. The size of each array is checked before the array is read, because a small compressed file can
inflate to a huge array. Every error is an `InputError` without the file's name.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterable
from typing import IO, TYPE_CHECKING, Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError

if TYPE_CHECKING:
    from zipfile import ZipFile, ZipInfo

# The largest size of a zip archive's directory of members, in bytes. The archives that this program writes have 8
# members of about 60 bytes each in the directory. The module zipfile would take long to list a million members.
_DIRECTORY = 1 << 14
# The end-of-archive record of a zip file without a comment, as NumPy writes it; and the signature and the size of the
# zip64 locator, which precedes the record in archives of more than 4 GB.
_END, _LARGE, _LARGE_SIZE = struct.Struct("<4s4H2LH"), b"PK\x06\x07", 20
# The largest size of an array's header, in bytes. A header states its own length, up to 4 GB; for plain numbers it has
# 128 bytes.
_HEADER = 1 << 14

# A function of (name, shape, dtype) of an array that is about to be read. It raises InputError to reject the array.
Check = Callable[[str, tuple[int, ...], Any], None]


def read_arrays(
    file: IO[bytes], choose: Callable[[list[str]], Iterable[str]], check: Check, most: int
) -> dict[str, Any]:
    """Read some arrays of an `.npz` file, by name.

    Args:
        file: the open file.
        choose: a function that picks the names of the arrays to read from the names of all arrays in the file.
        check: a function that rejects arrays by their name, shape or dtype.
        most: the largest size of one array, in bytes.

    Raises:
        InputError: the file is no `.npz` file, lacks an array, or `check` or `most` rejects an array.
    """
    return _read_chosen(file, choose, lambda archive, info, name: _array(archive, info, name, check, most))


def read_shape(file: IO[bytes], name: str, check: Check, most: int) -> tuple[int, ...]:
    """Return the shape of the array `name` without reading the array. Raises InputError as read_arrays() does."""
    return _read_chosen(file, lambda _: [name], lambda archive, info, name: _shape(archive, info, name, check, most))[
        name
    ]


def _read_chosen(
    file: IO[bytes],
    choose: Callable[[list[str]], Iterable[str]],
    read: Callable[[ZipFile, ZipInfo, str], Any],
) -> dict[str, Any]:
    from zipfile import ZipFile  # takes long to import

    try:
        _check_directory(file)
        with ZipFile(file) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            names = list(choose([*members]))
            if missing := [name for name in names if name not in members]:
                raise InputError(f"expected an array {missing[0]}, got {format_value(', '.join(members))}")
            return {name: read(archive, members[name], name) for name in names}
    except (InputError, MemoryError):
        raise
    except Exception as error:  # zipfile and NumPy do not document the errors that damaged files cause
        raise InputError(f"expected an .npz file: {' '.join(str(error).split())[:100]}") from None


def _check_directory(file: IO[bytes]) -> None:
    """Raise ValueError unless the archive has a small directory and an unambiguous end-of-archive record."""
    tail = _LARGE_SIZE + _END.size
    file.seek(-min(tail, file.seek(0, 2)), 2)
    data = file.read().rjust(tail, b"\0")
    signature, _, _, _, _, size, _, comment = _END.unpack(data[_LARGE_SIZE:])
    if signature != b"PK\x05\x06" or comment or data.startswith(_LARGE):
        raise ValueError("File is not a zip file as numpy.savez writes it")
    if size > _DIRECTORY:
        raise ValueError("it has too many members")


def _shape(archive: ZipFile, info: ZipInfo, name: str, check: Check, most: int) -> tuple[int, ...]:
    from zipfile import ZIP_DEFLATED, ZIP_STORED

    from numpy.lib import format as npy

    # NumPy writes no other compression, and the decoders of other ones allocate as much memory as the archive states.
    if info.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        raise InputError("expected an array as numpy.savez writes it, got another compression", name)
    # The module zipfile inflates at most the size that the directory states, so this check bounds the memory.
    if info.file_size > most:
        raise InputError(f"expected at most {most} bytes, got {info.file_size}", name)
    with archive.open(info) as file:
        begin = io.BytesIO(file.read(_HEADER))
    version = npy.read_magic(begin)
    if version not in ((1, 0), (2, 0)):
        raise InputError("expected an array of numbers in .npy format 1.0 or 2.0", name)
    shape, _, dtype = (npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0)(begin)
    check(name, shape, dtype)
    return shape


def _array(archive: ZipFile, info: ZipInfo, name: str, check: Check, most: int) -> Any:
    from numpy.lib import format as npy

    _shape(archive, info, name, check, most)
    with archive.open(info) as file:
        return npy.read_array(file, allow_pickle=False)
