"""A remedy for a name that is not there: the name that it is near to, and the names that there are."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from raytracer.core.shown import shortened

# A comparison takes time by the product of two lengths, and a scene file may have very many and very long names.
_MAX_LENGTH = 64
_MAX_NAMES = 4096
# The share of letters in common, 0 to 1: two letters of three have 0.67 ("rde" and "red"), "name" and "camera" 0.6.
_CUTOFF = 0.65
# Characters of a name that may stand for a longer name, as "fov" for "vertical_fov". Fewer are in too many names.
_WORD = 3


def nearest(name: str, names: Iterable[str]) -> str | None:
    """The one of `names` that `name` is most likely meant to be; None if none is near. Case does not count."""
    from difflib import get_close_matches  # few runs need it

    if len(name) > _MAX_LENGTH:
        return None
    plain = name.casefold()
    candidates = itertools.islice((n for n in names if len(n) <= _MAX_LENGTH), _MAX_NAMES)
    by_case = {candidate.casefold(): candidate for candidate in candidates if candidate != name}
    matches = get_close_matches(plain, by_case, 1, _CUTOFF)
    if not matches and len(name) >= _WORD:
        matches = [candidate for candidate in by_case if plain in candidate]
    return by_case[matches[0]] if matches else None


def known(names: Iterable[str]) -> str:
    """List the first names that there are: `known: a, b, c`."""
    listed = ", ".join(map(shortened, itertools.islice(names, 12)))
    return f"known: {listed}" if len(listed) <= 120 else f"known: {listed[:120]}..."


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """`; did you mean "near"?`, to end an error about `name`; "" if none of `names` is near."""
    near = nearest(name, names)
    return f'; did you mean "{near}"?' if near else ""


def did_you_mean_file(path: Path, others: Iterable[str] = ()) -> str:
    """End an error about a file that is not there: `did_you_mean` with a file beside it, or one of the names `others`.

    A path without a suffix is rather meant to be one of the others. "" if the file is there. A file whose suffix is not
    near to the path's is another kind of file.
    """
    beside: list[str] = []
    with suppress(OSError, ValueError):
        if os.path.lexists(path):
            return ""
        with os.scandir(path.parent) as entries:
            names = (entry.name for entry in itertools.islice(entries, _MAX_NAMES))
            beside = sorted(name for name in names if _is_of_kind(name, path.suffix))
    file = did_you_mean(path.name, beside)
    others = [*others]
    other = f'; did you mean "{path.stem}"?' if path.stem in others else did_you_mean(path.stem, others)
    return file or other if path.suffix else other or file


def _is_of_kind(name: str, suffix: str) -> bool:
    """Whether a file has that suffix, or one that it may have been meant to be."""
    own = Path(name).suffix
    return not suffix or own == suffix or bool(nearest(suffix[1:], [own[1:]]))
