"""Companion files with measured reflectance. The suffix decides the format.

To add a format, add a function that reads a table, and an entry in READERS.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.formats.companion_files import is_plain_name

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

# The most tables of a scene. Each takes 17 MiB of memory and 17 MiB of GPU memory.
MAX_TABLES = 16


def _read_merl(path: Path, folder: Path) -> Measured:
    from raytracer.scene.materials.merl import read  # imported here: it imports NumPy, which few scene files need

    return read(path, folder)


# Functions of (file, folder) that read a table. The file must be in the folder after all symbolic links are resolved.
# They raise InputError.
READERS: dict[str, Callable[[Path, Path], Measured]] = {".binary": _read_merl}


class MeasuredFiles:
    """The measured tables of a scene file. Each file is read once. Without a folder, no file can be read."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._tables: dict[str, Measured] = {}

    def read(self, name: object) -> Measured:
        """Read the table in the file `name` of the folder. Raises InputError."""
        if not isinstance(name, str) or not is_plain_name(name, READERS):
            expected = f"the plain name of a {' or '.join(READERS)} file in the scene file's folder"
            raise InputError(f"expected {expected}, got {format_value(name)}")
        if self._folder is None:
            raise InputError("a scene text has no folder for the file; load() the scene's file instead")
        if name not in self._tables:
            if len(self._tables) == MAX_TABLES:
                raise InputError(f"expected at most {MAX_TABLES} {' or '.join(READERS)} files in a scene")
            read = READERS[PurePath(name).suffix.lower()]
            self._tables[name] = read(self._folder / name, self._folder)
        return self._tables[name]
