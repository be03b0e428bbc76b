"""Reading files: files installed with the package, and untrusted files of the user."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import IO

# The largest size of a file that is installed with the package, in bytes. The largest such file has 20,000.
_MOST_BYTES = 1 << 20


def find_data_folder(installed: str, checkout: str) -> Path:
    """Return a data folder of the package.

    Args:
        installed: the folder's path in the package, if the package was installed from a wheel.
        checkout: the folder's path beside the package, in a checkout of the repository.
    """
    package = Path(__file__).parent.parent
    folder = package / installed
    return folder if folder.is_dir() else package.parent / checkout


def read_packaged(path: Path) -> str:
    """Read a text file from a folder that find_data_folder() returned. Raises OSError and UnicodeDecodeError."""
    data = read_bounded(path, _MOST_BYTES)
    if len(data) > _MOST_BYTES:
        raise OSError(0, f"it has more than {_MOST_BYTES} bytes")
    return data.decode()


def open_regular(path: Path, folder: Path | None = None) -> IO[bytes]:
    """Open a regular file for reading.

    Args:
        path: the file.
        folder: a folder that must contain the file after all symbolic links are resolved. None allows any place.

    Raises:
        OSError: the file cannot be opened, is outside `folder`, or is a folder, a pipe or a device. Reading a pipe or
            a device could block for ever, so the error is raised without waiting.
    """
    _check_regular(path.stat())  # before opening, because opening a device may already start it
    if folder is not None:
        real = Path(os.path.realpath(path))
        if not real.is_relative_to(os.path.realpath(folder)):
            raise OSError(0, "it leads out of the folder")
        path = real
    # Another process may have replaced the file by a pipe or a link since the check: do not block, and do not follow.
    flag_names = ("O_NONBLOCK", "O_NOCTTY", "O_BINARY", *(() if folder is None else ("O_NOFOLLOW",)))
    flags = sum(getattr(os, flag, 0) for flag in flag_names)
    # The file object owns the descriptor from the start, so that an interrupt closes it once.
    file = open(path, "rb", opener=lambda name, _: os.open(name, flags))  # noqa: SIM115  (the caller closes it)
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
    """Read the first `most` + 1 bytes of a regular file. A result of more than `most` bytes means: too large.

    Args:
        path: the file.
        most: the largest accepted size, in bytes.
        folder: a folder that must contain the file, as for open_regular().
        stdin: whether `path` may be /dev/stdin, a pipe. Default: False.

    Raises:
        OSError: as for open_regular(), or standard input has no data.
    """
    with path.open("rb") if stdin and path == Path("/dev/stdin") else open_regular(path, folder) as file:
        data = file.read(most + 1)
    if data is None:  # a special file of the system that has no data yet
        raise OSError(0, "there is nothing to read")
    return data
