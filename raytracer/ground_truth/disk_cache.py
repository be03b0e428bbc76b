"""Disk cache of converged pictures. A hash of everything that a picture depends on is the cache key."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from raytracer.core.files import open_regular
from raytracer.core.npz import read_arrays
from raytracer.core.output import replace_atomically
from raytracer.core.validation import InputError
from raytracer.formats.image import Image
from raytracer.ground_truth.job import FIRST_SAMPLES, Job
from raytracer.scene.canonical import canonical

_ROOT = Path(__file__).parent.parent
# The packages whose source code is part of the cache key: this package and all packages that it imports.
_PACKAGES = ("core", "scene", "formats", "ground_truth")
# The largest size of the cache, in bytes. When it is exceeded, the least recently used files are deleted. A picture of
# 320x180 pixels has 4 MB.
MOST_BYTES = 10**9
# The largest possible radiance: the limits of lights and materials keep radiance within float32.
_LARGEST = float(np.finfo(np.float32).max)
# The largest component of a unit normal, with rounding.
_UNIT = 1.0 + 1e-9


def cache_folder() -> Path:
    """Return the cache's folder: the environment variable RAYTRACER_CACHE, or the user's cache folder."""
    from platformdirs import user_cache_dir

    return Path(os.environ.get("RAYTRACER_CACHE") or user_cache_dir("raytracer"))


def cache_path(job: Job) -> Path:
    """Return the file of a job's picture. Its name is a hash of everything that the picture depends on."""
    cache_key = {
        "scene": canonical(job.scene),
        "size": list(map(int, job.size)),
        "settings": [job.settings.shading, job.settings.shadows, job.settings.bounces],
        "samples": job.samples,
        "tolerance": job.tolerance,
        "numpy": np.__version__,  # another version may have other random numbers
        "sources": _hash_sources(),
    }
    text = json.dumps(cache_key, sort_keys=True)
    return cache_folder() / f"truth-{hashlib.sha256(text.encode()).hexdigest()}.npz"


def read(path: Path, job: Job) -> Image | None:
    """Read a job's picture; return None if the file is missing, damaged, or not a possible picture of the job."""
    width, height = job.size
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
        with open_regular(path, path.parent) as file:
            image = Image(**read_arrays(file, lambda names: arrays, check, os.fstat(file.fileno()).st_size))
    except (OSError, InputError):
        return None
    if not _is_possible(image, job):
        return None
    with suppress(OSError):
        os.utime(path)  # mark the file as recently used
    return image


def _is_possible(image: Image, job: Job) -> bool:
    """Whether all numbers of an image are in the ranges of a job's picture. NaN is out of range."""
    assert image.depth is not None and image.normal is not None and image.material is not None
    assert image.samples is not None and image.error is not None
    ranges = (
        (image.radiance, 0.0, _LARGEST),
        (image.error, 0.0, _LARGEST),
        (image.depth, 0.0, np.inf),
        (image.normal, -_UNIT, _UNIT),
        (image.material, -1, len(job.scene.materials) - 1),
        (image.samples, FIRST_SAMPLES, job.most_samples),
    )
    within = all(bool(((values >= low) & (values <= high)).all()) for values, low, high in ranges)
    return within and bool((np.isinf(image.depth) == (image.material < 0)).all())


def write(path: Path, image: Image) -> None:
    """Store a picture in the cache. If that fails, warn and continue."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_atomically(path) as file:
            fields = msgspec.structs.asdict(image)
            arrays: dict[str, Any] = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
            np.savez(file, **arrays)
        _make_room(path.parent)
    except OSError as error:
        reason = error.strerror or error
        warnings.warn(f"{path.parent}: the reference could not be stored in the cache: {reason}", stacklevel=1)


def _make_room(folder: Path) -> None:
    """Delete the least recently used pictures until the others have MOST_BYTES or less."""
    files = []
    for file in folder.glob("truth-*.npz"):
        with suppress(OSError):  # another process may have deleted it
            status = file.lstat()
            if stat.S_ISREG(status.st_mode):  # not a link or folder, which the cache does not create
                files.append((status.st_mtime, status.st_size, file))
    total = 0
    for k, (_, size, file) in enumerate(sorted(files, reverse=True)):
        total += size
        if total > MOST_BYTES and k:  # the newest file is always kept
            with suppress(OSError):
                file.unlink()


def _hash_sources() -> list[list[str]]:
    """Return the name and a hash of each source file on which a traced picture depends."""
    packages = (file for package in _PACKAGES for file in (_ROOT / package).rglob("*.py"))
    files = sorted([*_ROOT.glob("*.py"), *packages])
    return [[file.relative_to(_ROOT).as_posix(), hashlib.sha256(file.read_bytes()).hexdigest()] for file in files]
