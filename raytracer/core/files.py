"""Files to read: the package's own, and a user's, which may be anything."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import IO

# Bytes of a file that comes with the package. The largest file has 20,000.
_MOST_BYTES = 1 << 20


def packaged(installed: str, checkout: str) -> Path:
    """A folder that comes with the package: inside it where it is installed from a wheel, beside it in a checkout."""
    package = Path(__file__).parent.parent
    folder = package / installed
    return folder if folder.is_dir() else package.parent / checkout


def read_packaged(path: Path) -> str:
    """The text of a file in one of these folders. Raises OSError and UnicodeDecodeError."""
    data = read_bounded(path, _MOST_BYTES)
    if len(data) > _MOST_BYTES:
        raise OSError(0, f"it has more than {_MOST_BYTES} bytes")
    return data.decode()


def opened(path: Path, folder: Path | None = None) -> IO[bytes]:
    """A regular file, to be read; with `folder`, one that is in there when all links are followed.

    Raises OSError, at once, if it cannot be opened, or is a folder, a pipe or a device, which may never end.
    """
    _check_regular(path.stat())  # before it is opened, which alone may set a device going
    if folder is not None:
        real = Path(os.path.realpath(path))
        if not real.is_relative_to(os.path.realpath(folder)):
            raise OSError(0, "it leads out of the folder")
        path = real
    # Whatever has taken the file's place since is not waited for, nor followed.
    flags = ("O_NONBLOCK", "O_NOCTTY", "O_BINARY", *(() if folder is None else ("O_NOFOLLOW",)))
    number = sum(getattr(os, flag, 0) for flag in flags)
    # The file object owns the descriptor from the start, so that an interrupt closes it once.
    file = open(path, "rb", opener=lambda name, _: os.open(name, number))  # noqa: SIM115  (for the caller)
    try:
        _check_regular(os.fstat(file.fileno()))
    except BaseException:
        file.close()
        raise
    return file


def _check_regular(status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise OSError(0, "it is a folder, a pipe or a device")


def read_bounded(path: Path, most: int, folder: Path | None = None, *, stdin: bool = False) -> bytes:
    """The first `most` + 1 bytes of what `opened` opens: more than `most` are too many.

    With `stdin` a piped /dev/stdin may be read. Raises OSError.
    """
    with path.open("rb") if stdin and path == Path("/dev/stdin") else opened(path, folder) as file:
        data = file.read(most + 1)
    if data is None:  # from a file of the system's that would wait
        raise OSError(0, "there is nothing to read")
    return data
