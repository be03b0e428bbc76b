"""Companion files: files in a scene file's folder that the scene file names.

A companion file is untrusted input, like the scene file. Its name must be a plain file name, and the total size of a
scene's companion files is limited. Every error begins with the file's name.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PureWindowsPath

from raytracer.core.files import read_bounded
from raytracer.core.output import write_new
from raytracer.core.suggest import did_you_mean_file
from raytracer.core.validation import InputError

# The largest total size of a scene's companion files, and the largest inflated array, in bytes: enough for the
# positions of as many instances as a scene can have.
MAX_BYTES = 64 * 1024 * 1024
# The size that a smaller file counts as. Opening and checking a file takes 0.1 ms, so the number of files is limited.
_LEAST_BYTES = 4096


class ByteBudget:
    """The number of bytes that may still be read from a scene's companion files."""

    def __init__(self) -> None:
        self.left = MAX_BYTES

    def spend(self, count: int) -> None:
        """Subtract the size of a file, in bytes."""
        self.left = max(0, self.left - max(count, _LEAST_BYTES))


def is_plain_name(name: str, suffixes: Collection[str]) -> bool:
    """Whether `name` is a file name without a path, on every operating system, and has one of the suffixes."""
    plain = PureWindowsPath(name).name == name and ":" not in name and name.isprintable()
    return plain and PureWindowsPath(name).suffix.lower() in suffixes


def read_companion(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read a companion file of at most `most` bytes, inside its folder even if it is a link. Raises InputError."""
    try:
        data = read_bounded(path, most, path.parent)
    except OSError as error:
        reason = f"{error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(f"expected a file beside the scene file: {reason}", file=path.name) from None
    if len(data) > most:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes, with the scene's others", file=path.name)
    return data


@contextmanager
def copy_files(files: Sequence[Path], folder: Path) -> Iterator[None]:
    """Copy companion files into `folder`, except those that exist there with the same content.

    Links out of the folder of `files` are not followed. If the block raises an exception, the copies are removed.
    Raises RuntimeError if a file cannot be copied, or if a different file with its name exists.
    """
    made: list[Path] = []
    try:
        for file in files:
            target = folder / file.name
            try:
                data = read_companion(file)
                if not os.path.lexists(target):
                    write_new(target, lambda copy, data=data: copy.write(data))
                    made.append(target)
                elif read_companion(target) != data:
                    raise InputError(
                        f"expected no file of this name in {folder.absolute()}, or one of the same content"
                    )
            except (OSError, InputError) as error:
                raise RuntimeError(f"{file}: expected to be copied to {folder.absolute()}: {error}") from None
        yield
    except BaseException:
        for target in made:
            target.unlink(missing_ok=True)
        raise
