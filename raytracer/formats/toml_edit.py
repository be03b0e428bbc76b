"""Edits of a scene file's text: new positions of camera and lights, with layout and comments kept.

The library tomlkit keeps the layout. For some texts its time grows with the square of the length, so it gets only the
statements that define positions.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from raytracer.core.validation import Vec3
from raytracer.formats.toml_text import statements

# The most characters of all these statements together, for which tomlkit takes a second or two.
_MOST_CHARACTERS = 1 << 18
_HEADER = re.compile(r"""[ \t]*\[\[?[ \t]*(?:(["']?)(camera|lights)\1[ \t]*\])?""")
_KEY = re.compile(r"""[ \t]*(["']?)(camera|lights|position)\1[ \t]*[.=]""")


def replace_positions(text: str, camera: Vec3, lights: Sequence[Vec3]) -> str:
    """Replace the positions of the camera and the lights in a TOML text.

    Args:
        text: the text of a scene file.
        camera: the new position of the table `camera`.
        lights: the new positions of the tables `lights`, in order.

    Raises:
        ValueError: the layout of the text is not supported.
    """
    import tomlkit  # imported here: it takes long, and few sessions need it
    from tomlkit.exceptions import TOMLKitError

    left = iter(lights)

    def move(table: Any, position: Vec3) -> None:
        if table["position"] != list(position):
            table["position"] = list(position)

    parts: list[str] = []
    copied, room = 0, _MOST_CHARACTERS
    # The current table: "" before the first header, "camera", "lights", or None for any other table.
    table: str | None = ""
    for at in statements(text):
        if header := _HEADER.match(text, at.start, at.stop):
            table = header[2]
        key = _KEY.match(text, at.start, at.stop)
        if table is None or not key or (key[2] == "position") != bool(table):
            continue
        room -= at.stop - at.start
        if room < 0:
            raise ValueError(f"expected positions in at most {_MOST_CHARACTERS} characters")
        try:
            document: Any = tomlkit.parse(text[at])
            if table:
                move(document, camera if table == "camera" else next(left))
            elif "position" in document.get("camera", ()):
                move(document["camera"], camera)
            for light in document.get("lights", ()):
                move(light, next(left))
            parts += text[copied : at.start], tomlkit.dumps(document)
        # Some texts can be read by tomllib but not by tomlkit.
        except (TOMLKitError, ValueError, TypeError, LookupError, RecursionError, StopIteration) as error:
            raise ValueError(f"expected positions in TOML that tomlkit reads: {error}") from None
        copied = at.stop
    return "".join((*parts, text[copied:]))
