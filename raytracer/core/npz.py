"""Arrays in an `.npz` file, which may be anything: no pickle is read, and an array's size is checked before the array.

A small file can inflate to a large one. Every error is an `InputError`, without the file's name.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterable
from typing import IO, TYPE_CHECKING, Any

from raytracer.core.shown import shown
from raytracer.core.validation import InputError

if TYPE_CHECKING:
    from zipfile import ZipFile, ZipInfo

# A zip archive lists its members in a directory, whose length its end states. What this program writes has 8 members,
# of some 60 bytes each there; to list a million of them would take zipfile long.
_DIRECTORY = 1 << 14
# The archive's end as NumPy writes it, without a comment, and what would stand before it and replace it in a large one.
_END, _LARGE, _LARGE_SIZE = struct.Struct("<4s4H2LH"), b"PK\x06\x07", 20
# An array begins with a header that states its own length, up to 4 GB; the header of plain numbers takes 128 bytes.
_HEADER = 1 << 14

# (name, shape, dtype) of an array that is about to be read: raises InputError if that should not be.
Check = Callable[[str, tuple[int, ...], Any], None]


def read_arrays(
    file: IO[bytes], choose: Callable[[list[str]], Iterable[str]], check: Check, most: int
) -> dict[str, Any]:
    """The arrays in a file whose names `choose` takes from all the names; other arrays are not looked at.

    None may be of more than `most` bytes. Raises InputError.
    """
    return _chosen(file, choose, lambda archive, info, name: _array(archive, info, name, check, most))


def read_shape(file: IO[bytes], name: str, check: Check, most: int) -> tuple[int, ...]:
    """The shape of the array `name` in a file, which is not read itself. Raises InputError as read_arrays()."""
    return _chosen(file, lambda _: [name], lambda archive, info, name: _shape(archive, info, name, check, most))[name]


def _chosen(
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
                raise InputError(f"expected an array {missing[0]}, got {shown(', '.join(members))}")
            return {name: read(archive, members[name], name) for name in names}
    except (InputError, MemoryError):
        raise
    except Exception as error:  # what damaged archives and headers can raise is not written down anywhere
        raise InputError(f"expected an .npz file: {' '.join(str(error).split())[:100]}") from None


def _check_directory(file: IO[bytes]) -> None:
    """Raise ValueError unless zipfile will read a short directory, from an end that cannot be taken for another."""
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

    # The others' decoders take as much memory as the archive asks for; NumPy writes only these.
    if info.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        raise InputError("expected an array as numpy.savez writes it, got another compression", name)
    # zipfile inflates no more of a member than the size that its entry states.
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
