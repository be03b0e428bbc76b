"""Edits of a scene file's text: a moved camera and moved lights, with layout and comments kept.

The library tomlkit keeps the layout. For some texts its time grows with the square of the length, so it gets only the
statements that define positions.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from raytracer.core.validation import Vec3
from raytracer.formats.toml_text import statements

# The most characters of all these statements together, for which tomlkit takes a second or two.
_MOST_CHARACTERS = 1 << 18
_HEADER = re.compile(r"""[ \t]*\[\[?[ \t]*(?:(["']?)(camera|lights)\1[ \t]*\])?""")
_KEY = re.compile(r"""[ \t]*(["']?)(camera|lights|position|height)\1[ \t]*[.=]""")


def replace_positions(text: str, camera: Mapping[str, Any], lights: Sequence[Vec3]) -> str:
    """Replace the positions of the camera and the lights in a TOML text, and the height of the camera.

    Args:
        text: the text of a scene file.
        camera: the new values of the table `camera`: `position`, and `height` if it has one.
        lights: the new positions of the tables `lights`, in order.

    Raises:
        ValueError: the layout of the text is not supported.
    """
    import tomlkit  # imported here: it takes long, and few sessions need it
    from tomlkit.exceptions import TOMLKitError

    left = iter(lights)

    def move(table: Any, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            plain = list(value) if isinstance(value, tuple) else value
            if name in table and table[name] != plain:
                table[name] = plain

    parts: list[str] = []
    copied, room = 0, _MOST_CHARACTERS
    # The current table: "" before the first header, "camera", "lights", or None for any other table.
    table: str | None = ""
    for at in statements(text):
        if header := _HEADER.match(text, at.start, at.stop):
            table = header[2]
        key = _KEY.match(text, at.start, at.stop)
        if table is None or not key or (key[2] in ("position", "height")) != bool(table):
            continue
        room -= at.stop - at.start
        if room < 0:
            raise ValueError(f"expected positions in at most {_MOST_CHARACTERS} characters")
        try:
            document: Any = tomlkit.parse(text[at])
            if table:
                move(document, camera if table == "camera" else {"position": next(left)})
            elif "camera" in document:
                move(document["camera"], camera)
            for light in document.get("lights", ()):
                move(light, {"position": next(left)})
            parts += text[copied : at.start], tomlkit.dumps(document)
        # Some texts can be read by tomllib but not by tomlkit.
        except (TOMLKitError, ValueError, TypeError, LookupError, RecursionError, StopIteration) as error:
            raise ValueError(f"expected positions in TOML that tomlkit reads: {error}") from None
        copied = at.stop
    return "".join((*parts, text[copied:]))


def add_table(text: str, name: str, values: Mapping[str, Any]) -> str:
    """Return the text with a table at its end, and with its own kind of line ends.

    The values are numbers, texts and vectors.
    """
    import tomlkit

    table = {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
    end = "\r\n" if "\r\n" in text else "\n"
    return text.rstrip("\r\n") + f"\n\n{tomlkit.dumps({name: table})}".replace("\n", end)
