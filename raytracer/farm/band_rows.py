"""The choice between a picture as a whole and bands of rows, and the number of rows of a band."""

from __future__ import annotations

from typing import Any

from raytracer.compiler.direction_cells import CELL
from raytracer.core.memory import physical_memory
from raytracer.core.validation import MAX_SIDE, InputError, integer
from raytracer.formats.image_files import FORMATS
from raytracer.scene.settings import Settings

# The number of pixels of a band, if the user does not choose its rows. In float32 a band takes 100 MB, and a picture of
# 32768x32768 has 128 bands: more of them would only repeat the preparation of a frame, some milliseconds each.
_BAND_PIXELS = 2**23
# The least number of bands of a picture that a farm draws, as far as a band has CELL rows: four for each of 16 workers,
# so that the last ones wait little for each other.
_FARM_BANDS = 64
# The most bytes of a picture that is drawn as a whole if its file holds no more than bands give: a picture that needs
# more memory would have a warning (core/memory.py), and takes no longer in bands.
_WHOLE_BYTES = 2**30


def check_rows(rows: Any, suffix: str, settings: Settings) -> int:
    """Return the number of rows of a band that the user set: a multiple of CELL, in [CELL, MAX_SIDE].

    Raises InputError for another number, a format without rows, and settings with a time limit.
    """
    where = "--bands"
    _check_bands(where, suffix, settings)
    expected = f"a multiple of {CELL} in [{CELL}, {MAX_SIDE}]"
    count = integer(rows, where, 0, MAX_SIDE)
    if count == 0 or count % CELL:
        raise InputError(f"expected {expected}, got {count}", where)
    return count


def rows_of_farm(size: tuple[int, int], suffix: str, settings: Settings, option: str) -> int:
    """Return the number of rows of a band of a picture that workers draw, if the user does not choose it.

    The number does not depend on the workers, so that their number does not change the picture. `option` is the option
    that chose the workers.

    Raises InputError for a format without rows, and for settings with a stopping rule, which decides for each band.
    """
    _check_bands(option, suffix, settings)
    if settings.sampling.has_stopping_rule:
        raise InputError("expected --bands ROWS, too: with --max-error, each band reaches E by itself", option)
    return default_rows(size, _FARM_BANDS)


def _check_bands(where: str, suffix: str, settings: Settings) -> None:
    """Raise InputError, with the key `where`, for a format without rows and settings with a time limit."""
    if FORMATS[suffix].rows is None:
        kinds = " or ".join(name for name, form in FORMATS.items() if form.rows)
        raise InputError(f"expected an output that ends in {kinds}, got {suffix}, which has no rows to append", where)
    if settings.time is not None:
        raise InputError("cannot be combined with --time, which is for the whole picture: use --max-error", where)


def rows_of_large(size: tuple[int, int], needed: int, suffix: str, settings: Settings) -> int | None:
    """Return the number of rows of a band for a picture that is too large as a whole, None for any other picture.

    Bands leave out the geometry that a format can hold, so a picture with geometry is too large only if it needs more
    memory than this machine has. No picture with a stopping rule is too large, because bands would change it.

    Args:
        size: (width, height) in pixels.
        needed: the bytes that the whole picture needs.
        suffix: the format.
        settings: the settings of the picture.
    """
    form = FORMATS[suffix]
    most = physical_memory() if form.has_geometry else _WHOLE_BYTES
    if form.rows is None or settings.sampling.has_stopping_rule or most is None or needed <= most:
        return None
    return default_rows(size)


def default_rows(size: tuple[int, int], least: int = 1) -> int:
    """Return the number of rows of a band of a picture of `size` (width, height).

    `least` is the least number of bands, as far as a band has CELL rows.
    """
    pixels = min(_BAND_PIXELS, size[0] * size[1] // least)
    return max(CELL, pixels // size[0] // CELL * CELL)
