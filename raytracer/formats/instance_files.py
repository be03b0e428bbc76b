"""Instances' places in a file beside the scene file, in a format by the file's suffix.

A new format is a module with a function `read`, and an entry in READERS. Every error is an `InputError` that begins
with the file's name.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PurePath

from raytracer.core.shown import shown
from raytracer.core.validation import InputError, about
from raytracer.formats import instance_csv, instance_npz
from raytracer.formats.companion_files import ByteBudget, is_plain_name, read_companion
from raytracer.scene.instances import Instances
from raytracer.scene.solids import Solid

# Each makes instances of a solid at the places that a file's bytes give, which may be any. Raises InputError.
READERS: dict[str, Callable[[Solid, bytes], Instances]] = {".csv": instance_csv.read, ".npz": instance_npz.read}


def read_instances(solid: Solid, folder: Path, name: str, budget: ByteBudget | None = None) -> Instances:
    """Read `solid` at the places that the file `name` in `folder` gives. The file takes its part of `budget`.

    Raises InputError.
    """
    if not is_plain_name(name, READERS):
        expected = f"the plain name of a {' or '.join(READERS)} file in the scene file's folder"
        raise InputError(f"expected {expected}, got {shown(name)}")
    budget = budget or ByteBudget()
    data = read_companion(folder / name, budget.left)
    budget.spend(len(data))
    with about(name):
        return READERS[PurePath(name).suffix.lower()](solid, data)
