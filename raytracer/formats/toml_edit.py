"""Edits of a scene file's text: other positions of its camera and lights, and all else as it was.

tomlkit keeps how a text is laid out. Its time grows with the square of some texts' lengths, so that tomlkit gets only
the statements that give positions.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from raytracer.core.validation import Vec3
from raytracer.formats.toml_text import statements

# Characters of all these statements; tomlkit takes a second or two for so many.
_MOST = 1 << 18
_HEADER = re.compile(r"""[ \t]*\[\[?[ \t]*(?:(["']?)(camera|lights)\1[ \t]*\])?""")
_KEY = re.compile(r"""[ \t]*(["']?)(camera|lights|position)\1[ \t]*[.=]""")


def replace_positions(text: str, camera: Vec3, lights: Sequence[Vec3]) -> str:
    """Replace the position in the table `camera` of a TOML text, and the positions in its `lights`.

    Raises ValueError for a text with which that cannot be done.
    """
    import tomlkit  # takes long to import, and few sessions need it
    from tomlkit.exceptions import TOMLKitError

    left = iter(lights)

    def move(table: Any, position: Vec3) -> None:
        if table["position"] != list(position):
            table["position"] = list(position)

    parts: list[str] = []
    copied, room = 0, _MOST
    table: str | None = ""  # which the statements are in: "" before the first header, None in others
    for at in statements(text):
        if header := _HEADER.match(text, at.start, at.stop):
            table = header[2]
        key = _KEY.match(text, at.start, at.stop)
        if table is None or not key or (key[2] == "position") != bool(table):
            continue
        room -= at.stop - at.start
        if room < 0:
            raise ValueError(f"expected positions in at most {_MOST} characters")
        try:
            document: Any = tomlkit.parse(text[at])
            if table:
                move(document, camera if table == "camera" else next(left))
            elif "position" in document.get("camera", ()):
                move(document["camera"], camera)
            for light in document.get("lights", ()):
                move(light, next(left))
            parts += text[copied : at.start], tomlkit.dumps(document)
        # There are texts that tomllib reads and tomlkit does not.
        except (TOMLKitError, ValueError, TypeError, LookupError, RecursionError, StopIteration) as error:
            raise ValueError(f"expected positions in TOML that tomlkit reads: {error}") from None
        copied = at.stop
    return "".join((*parts, text[copied:]))
