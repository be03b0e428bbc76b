"""Remedies in error messages: the known name most similar to an unknown one, and the extra with a missing package."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from raytracer.core.shown import shorten

# Longer names, and names beyond this number, are not compared: one comparison takes time in proportion to the product
# of both lengths, and a scene file may have very many and very long names.
_MAX_LENGTH = 64
_MAX_NAMES = 4096
# The smallest similarity (difflib's ratio, 0 to 1) of a suggestion. "rde" and "red" have 0.67, "name" and "camera" 0.6.
_CUTOFF = 0.65
# The fewest characters of a name that is searched for inside longer names, as "fov" in "vertical_fov". A shorter name
# would be part of too many names.
_WORD = 3


def find_nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the one of `names` that is most similar to `name`, ignoring case, or None if none is similar."""
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


def known_names(names: Iterable[str]) -> str:
    """Return a list of the first known names: `known: a, b, c`."""
    listed = ", ".join(map(shorten, itertools.islice(names, 12)))
    return f"known: {listed}" if len(listed) <= 120 else f"known: {listed[:120]}..."


def did_you_mean(name: str, names: Iterable[str]) -> str:
    """Return `; did you mean "near"?` for the end of an error about `name`, or "" if none of `names` is similar."""
    near = find_nearest(name, names)
    return f'; did you mean "{near}"?' if near else ""


def did_you_mean_file(path: Path, others: Iterable[str] = ()) -> str:
    """Return `; did you mean "near"?` for the end of an error about a file, or "" if the file exists.

    The suggestion is a similar file in the same folder, whose suffix must also be similar, or one of the names
    `others`. Files come first if `path` has a suffix, and the other names come first if it has none.
    """
    beside: list[str] = []
    with suppress(OSError, ValueError):
        if os.path.lexists(path):
            return ""
        with os.scandir(path.parent) as entries:
            names = (entry.name for entry in itertools.islice(entries, _MAX_NAMES) if not entry.is_dir())
            beside = sorted(name for name in names if _is_of_kind(name, path.suffix))
    file = did_you_mean(path.name, beside)
    others = [*others]
    other = f'; did you mean "{path.stem}"?' if path.stem in others else did_you_mean(path.stem, others)
    return file or other if path.suffix else other or file


def _is_of_kind(name: str, suffix: str) -> bool:
    """Whether the file `name` has this suffix or a similar one. An empty suffix accepts every file."""
    own = Path(name).suffix
    return not suffix or own == suffix or bool(find_nearest(suffix[1:], [own[1:]]))


def install_command(extra: str) -> str:
    """Return the shell command that installs an extra. It works in the checkout."""
    return f"pip install -e '.[{extra}]'"


def missing_extra(use: str, package: str, extra: str) -> str:
    """Return the error message for a `use` that needs a package of an extra, such as "plots need", "matplotlib"."""
    remedy = f"install the extra {extra} in the checkout: {install_command(extra)}"
    return f"{use} {package}, which is not installed; {remedy}"
