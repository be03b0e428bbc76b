"""Companion files with the positions, scales and rotations of instances. The suffix decides the format.

To add a format, add a module with a function `read`, and an entry in READERS. Every error is an `InputError` that
begins with the file's name.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePath

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError, locate_errors
from raytracer.formats import instance_csv, instance_npz
from raytracer.formats.companion_files import ByteBudget, is_plain_name, read_companion
from raytracer.scene.instances import Instances
from raytracer.scene.solids.solid import Solid

# Functions of (solid, content of a file) that return instances of the solid. They raise InputError for wrong content.
READERS: dict[str, Callable[[Solid, bytes], Instances]] = {".csv": instance_csv.read, ".npz": instance_npz.read}


def read_instances(solid: Solid, folder: Path, name: str, budget: ByteBudget | None = None) -> Instances:
    """Read the places of instances from a companion file.

    Args:
        solid: the solid to copy.
        folder: the folder of the scene file.
        name: the plain name of a file in the folder.
        budget: the bytes that may be read from the scene's companion files, from which the file's size is subtracted.
            Default: a new budget.

    Raises:
        InputError: a wrong name, an unreadable file, or wrong content.
    """
    if not is_plain_name(name, READERS):
        expected = f"the plain name of a {' or '.join(READERS)} file in the scene file's folder"
        raise InputError(f"expected {expected}, got {format_value(name)}")
    budget = budget or ByteBudget()
    data = read_companion(folder / name, budget.left)
    budget.spend(len(data))
    with locate_errors(name):
        return READERS[PurePath(name).suffix.lower()](solid, data)
