"""The text of a scene file: the line that gives a key."""

from __future__ import annotations

import re

# Possessive, so that no text makes the search slow.
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_KEY = rf"{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*+"
_HEADER = re.compile(rf"[ \t]*+\[(\[?+)[ \t]*+({_KEY})[ \t]*+\]")
_ENTRY = re.compile(rf"[ \t]*+({_KEY})[ \t]*+=")
_SYNTAX = re.compile(r"expected TOML: .*\(at (?:line (\d+), |end of document)")
_UNKNOWN = re.compile(r"(?:(.*): )?unknown key `(.*)` \(known")


def line_of_error(text: str, message: str) -> int | None:
    """The line of a TOML text that an InputError's message is about; None if it is about the whole.

    A message begins with the key it is about, as the messages of `scene_file.loads` do.
    """
    if syntax := _SYNTAX.match(message):
        return int(syntax[1]) if syntax[1] else text.count("\n") + 1
    if unknown := _UNKNOWN.match(message):
        return line_of(text, ".".join(filter(None, unknown.groups())))
    return line_of(text, message.partition(": ")[0])


def line_of(text: str, key: str) -> int | None:
    """The line, from 1, of the header or assignment that gives `key`, e.g. `lights[1].color`.

    Where that is inside a value, such as an inline table, it is the line on which the value begins;
    where the key is not given, the line of the table that should hold it.
    """
    best, length = None, 0
    table = ""
    counts: dict[str, int] = {}
    for number, line in enumerate(text.split("\n"), start=1):
        if header := _HEADER.match(line):
            here = table = _plain(header[2])
            if header[1]:
                counts[here] = counts.get(here, -1) + 1
                here = table = f"{here}[{counts[here]}]"
        elif entry := _ENTRY.match(line):
            here = ".".join(filter(None, (table, _plain(entry[1]))))
        else:
            continue
        if len(here) > length and (key == here or key.startswith((f"{here}.", f"{here}["))):
            best, length = number, len(here)
    return best


def _plain(key: str) -> str:
    """A TOML key as messages spell it: without quotes, and blanks around its dots."""
    return ".".join(part.strip("\"'") for part in re.findall(_PART, key))
