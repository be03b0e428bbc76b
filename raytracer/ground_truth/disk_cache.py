"""Truths (converged.py) on the disk: made once for all that decides them, and kept while there is room for them."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import warnings
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from raytracer.core.files import opened
from raytracer.core.npz import read_arrays
from raytracer.core.output import replaced_whole
from raytracer.core.validation import InputError
from raytracer.formats.image import Image
from raytracer.scene.materials.material import Material
from raytracer.scene.materials.merl import Measured
from raytracer.scene.solids import Primitive, Solid, postfix

if TYPE_CHECKING:
    from raytracer.ground_truth.converged import Job
    from raytracer.scene.scene import Scene

# The packages whose change makes older truths worthless: this one, and all that it may import; and the root.
_SOURCES = ("core", "scene", "formats", "ground_truth")
# Bytes of all truths that are kept. Beyond, those go that were not asked for for the longest time. Of 320x180 pixels
# one has 5 MB.
MOST_BYTES = 10**9
# Beyond any radiance: lights and materials keep it within float32.
_LARGEST = float(np.finfo(np.float32).max)
# The length of a normal, with its rounding.
_UNIT = 1.0 + 1e-9


def folder() -> Path:
    """Where truths are kept: the variable RAYTRACER_CACHE, or the system's place for what can be made again."""
    from platformdirs import user_cache_dir

    return Path(os.environ.get("RAYTRACER_CACHE") or user_cache_dir("raytracer"))


def path_of(job: Job, samples: int, tolerance: float) -> Path:
    """The file of a truth, named by a hash of all that decides what is in it."""
    decides = {
        "scene": canonical(job.scene),
        "size": list(map(int, job.size)),
        "settings": [job.settings.shading, job.settings.shadows, job.settings.bounces],
        "samples": int(samples),
        "tolerance": tolerance,
        "numpy": np.__version__,  # other random numbers
        "sources": _sources(),
    }
    text = json.dumps(decides, sort_keys=True)
    return folder() / f"truth-{hashlib.sha256(text.encode()).hexdigest()}.npz"


def read(path: Path, size: tuple[int, int], materials: int, samples: tuple[int, int]) -> Image | None:
    """The truth in a file; None if there is none, or it is damaged, or it cannot be the truth.

    The scene has so many `materials`; a pixel has from `samples[0]` to `samples[1]` samples.
    """
    width, height = size
    arrays = {
        "radiance": ((height, width, 3), np.float64),
        "depth": ((height, width), np.float64),
        "normal": ((height, width, 3), np.float64),
        "material": ((height, width), np.int32),
        "samples": ((height, width), np.int32),
        "error": ((height, width), np.float64),
    }

    def check(name: str, shape: tuple[int, ...], dtype: Any) -> None:
        if (shape, dtype) != arrays[name]:
            raise InputError(f"expected {arrays[name]}, got {shape} of {dtype}", name)

    try:
        with opened(path, path.parent) as file:
            image = Image(**read_arrays(file, lambda names: arrays, check, os.fstat(file.fileno()).st_size))
    except (OSError, InputError):
        return None
    if not _may_be(image, materials, samples):
        return None
    with suppress(OSError):
        os.utime(path)  # asked for now
    return image


def _may_be(image: Image, materials: int, samples: tuple[int, int]) -> bool:
    """Whether the numbers of an image are within the ranges of a truth's. NaN is in no range."""
    assert image.depth is not None and image.normal is not None and image.material is not None
    assert image.samples is not None and image.error is not None
    ranges = (
        (image.radiance, 0.0, _LARGEST),
        (image.error, 0.0, _LARGEST),
        (image.depth, 0.0, np.inf),
        (image.normal, -_UNIT, _UNIT),
        (image.material, -1, materials - 1),
        (image.samples, *samples),
    )
    within = all(bool(((values >= low) & (values <= high)).all()) for values, low, high in ranges)
    return within and bool((np.isinf(image.depth) == (image.material < 0)).all())


def write(path: Path, image: Image) -> None:
    """Keep a truth. Where that cannot be, a warning says so: the truth itself is none the worse for it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced_whole(path) as file:
            fields = msgspec.structs.asdict(image)
            arrays: dict[str, Any] = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
            np.savez(file, **arrays)
        _make_room(path.parent)
    except OSError as error:
        reason = error.strerror or error
        warnings.warn(f"{path.parent}: the reference was not kept for the next time: {reason}", stacklevel=1)


def _make_room(folder: Path) -> None:
    """Remove the truths that were not asked for for the longest time, until the others have MOST_BYTES or less."""
    found = []
    for file in folder.glob("truth-*.npz"):
        with suppress(OSError):  # another process removed it
            status = file.lstat()
            if stat.S_ISREG(status.st_mode):  # and was written here
                found.append((status.st_mtime, status.st_size, file))
    total = 0
    for k, (_, size, file) in enumerate(sorted(found, reverse=True)):
        total += size
        if total > MOST_BYTES and k:  # never the newest
            with suppress(OSError):
                file.unlink()


def canonical(scene: Scene) -> Any:
    """What `scene` is, in lists, numbers and strings: the same for scenes that make the same truth, else another one.

    Names of the scene and of materials do not count. Arrays are there by their hash, other numbers as they are, which
    JSON has to the last bit.
    """
    number = {material: i for i, material in enumerate(scene.materials)}

    def plain(value: Any) -> Any:
        match value:
            case Material():  # of a leaf
                return number[value]
            case Measured():
                return plain(value.values)
            case np.ndarray():
                return [list(value.shape), value.dtype.str, hashlib.sha256(value.tobytes()).hexdigest()]
            case tuple() | list():
                return [plain(part) for part in value]
            case Solid() if not isinstance(value, Primitive):
                nodes = postfix(value)
                return [plain(node) if isinstance(node, Primitive) else type(node).__name__ for node in nodes]
            case msgspec.Struct():
                return [type(value).__name__, *(plain(getattr(value, name)) for name in value.__struct_fields__)]
        return value

    materials = [[m.model, {key: plain(value) for key, value in m.parameters.items()}] for m in scene.materials]
    others = {
        name: plain(getattr(scene, name)) for name in scene.__struct_fields__ if name not in ("materials", "name")
    }
    return {"materials": materials, **others}


def _sources() -> list[list[str]]:
    root = Path(__file__).parent.parent
    files = sorted([*root.glob("*.py"), *(file for package in _SOURCES for file in (root / package).rglob("*.py"))])
    return [[file.relative_to(root).as_posix(), hashlib.sha256(file.read_bytes()).hexdigest()] for file in files]
