"""Files beside a scene file that the scene file names: plain names, bounded reading, copies.

A companion file is untrusted input as the scene file is: the bytes of all of them together are bounded. Every error
begins with the file's name.
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

# Bytes of all files of a scene, and of an array when inflated: all places that a scene can have, generously written.
MAX_BYTES = 64 * 1024 * 1024
# For which a file counts at least, as opening and checking one takes time, too: some 0.1 ms.
_LEAST_BYTES = 4096


class ByteBudget:
    """The number of bytes that a scene's companion files may still have."""

    def __init__(self) -> None:
        self.left = MAX_BYTES

    def spend(self, count: int) -> None:
        """Take the bytes of a file off."""
        self.left = max(0, self.left - max(count, _LEAST_BYTES))


def is_plain_name(name: str, suffixes: Collection[str]) -> bool:
    """Whether `name` can only name a file in a folder, with one of the suffixes, on any system."""
    plain = PureWindowsPath(name).name == name and ":" not in name and name.isprintable()
    return plain and PureWindowsPath(name).suffix.lower() in suffixes


def read_companion(path: Path, most: int = MAX_BYTES) -> bytes:
    """Read a file of at most `most` bytes. Raises InputError."""
    try:
        data = read_bounded(path, most, path.parent)
    except OSError as error:
        reason = f"{error.strerror or error}{did_you_mean_file(path)}"
        raise InputError(f"expected a file beside the scene file: {reason}", file=path.name) from None
    if len(data) > most:
        raise InputError(f"expected a file of at most {MAX_BYTES} bytes, with the scene's others", file=path.name)
    return data


@contextmanager
def copied(files: Sequence[Path], folder: Path) -> Iterator[None]:
    """Put copies of the files that a scene names into `folder`, but those that are there with the same content.

    Only files that a scene may read are copied: none outside the folder of `files`, to which a link leads. The copies
    vanish when the block does not end well. Raises RuntimeError if a copy cannot be made or if another file
    has its name.
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
