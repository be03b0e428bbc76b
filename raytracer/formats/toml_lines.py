"""Lines of a TOML text: the line that gives the value at a path of keys."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

# The pieces of a text that TOML's parser has taken, so that nothing here need be refused. Possessive, so that no text
# makes the search slow. Numbers, dates, true and false are "bare", as are keys without quotes.
_STRING = r"""\"{3}(?:[^"\\]|\\.|"{1,2}(?!"))*+"{3,5}|'{3}(?:[^']|'{1,2}(?!'))*+'{3,5}
    |"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+'"""
_PIECE = re.compile(
    rf"""(?:[ \t\r]++|\#[^\n]*+)*+
    (?:(?P<newline>\n)|(?P<open>[\[{{])|(?P<close>[\]}}])|(?P<comma>,)|(?P<end>=)|(?P<dot>\.)|(?P<string>{_STRING})
    |(?P<bare>[^\s\[\]{{}}=,."'#]++))""",
    re.VERBOSE | re.DOTALL,
)
# As much of a value beside the path as has no brackets, at once.
_SKIPPED = re.compile(
    rf"""(?P<open>[\[{{])|(?P<close>[\]}}])|(?P<newline>\n)|(?:[^\[\]{{}}\n"'#]++|\#[^\n]*+|{_STRING})++""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))")
_ESCAPED = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r"}


def find_line(text: str, keys: Sequence[str | int]) -> int | None:
    """Find the line, from 1, on which a TOML text gives the value at a path of keys: its key's, header's or item's.

    Where the value is not given, the line of the innermost table or list around it; None if there is none either.
    `text` must be TOML that tomllib reads. The time is linear in its length.
    """
    search = _Search(text, keys)
    while not search.is_done() and (piece := search.next()):
        if piece.lastgroup == "open":
            search.read_header(piece.start("open"))
        elif piece.lastgroup in ("bare", "string"):
            search.read_entry(piece)
    return None if search.position is None else text.count("\n", 0, search.position) + 1


@dataclass
class _Open:
    """A list or inline table that is open: how many of the keys lead to it."""

    depth: int
    is_list: bool
    index: int = 0
    is_at_start: bool = True  # of an item, or of a key


class _Search:
    """The longest part of a path of keys that a text gives, and its `position`. A depth counts the keys that lead to a
    place; None if the place is beside their path."""

    def __init__(self, text: str, keys: Sequence[str | int]) -> None:
        self.position: int | None = None
        self._text = text
        self._at = 0
        self._keys = keys
        self._longest = 0
        self._table: int | None = 0
        # The index of the last table in each list of tables on the path, by the number of keys to the list.
        self._last: dict[int, int] = {}

    def is_done(self) -> bool:
        """Whether the value itself has been met."""
        return self._longest == len(self._keys)

    def next(self) -> re.Match[str] | None:
        """The next piece of the text."""
        piece = _PIECE.match(self._text, self._at)
        if piece:
            self._at = piece.end()
        return piece

    def read_header(self, start: int) -> None:
        """`a.b]` after a `[` at `start`, or `[a.b]]`, an item of a list of tables."""
        is_item = self._text.startswith("[[", start)
        if is_item:
            self.next()
        depth: int | None = 0
        for name in self._names():
            if depth in self._last:
                depth = self._step(depth, self._last[depth])
            depth = self._step(depth, name)
        if is_item and depth is not None:
            self._last[depth] = self._last.get(depth, -1) + 1
        if depth in self._last:
            depth = self._step(depth, self._last[depth])
        self._table = depth
        self._note(depth, start)
        self._skip()

    def read_entry(self, first: re.Match[str]) -> None:
        """`a.b = ...`, to the end of its line, with the lists and inline tables in it."""
        depth = self._read_key(self._table, first)
        levels: list[_Open] = []
        while self._is_open(depth) or levels:
            if self.is_done():
                return
            piece = self.next()
            kind = piece.lastgroup if piece else "newline"
            if piece is None or (kind == "newline" and not levels):
                return
            if kind == "newline":
                continue
            level = levels[-1] if levels else None
            if level and kind == "comma":
                level.index += 1
                level.is_at_start = True
            elif kind == "close":
                levels.pop()
            elif level and level.is_at_start and not level.is_list:
                level.is_at_start = False
                depth = self._read_key(level.depth, piece)
            else:
                if level and level.is_at_start:
                    level.is_at_start = False
                    depth = self._step(level.depth, level.index)
                    self._note(depth, piece.start(kind or 0))
                if kind == "open" and depth is not None and self._is_open(depth):
                    levels.append(_Open(depth, piece[kind] == "["))
                elif kind == "open":
                    self._skip(brackets=1)
        self._skip()

    def _is_open(self, depth: int | None) -> bool:
        """Whether more of the keys may be inside."""
        return depth is not None and depth < len(self._keys)

    def _read_key(self, depth: int | None, first: re.Match[str]) -> int | None:
        for name in (_name(first), *self._names()):
            depth = self._step(depth, name)
        self._note(depth, first.start(first.lastgroup or 0))
        return depth

    def _names(self) -> list[str]:
        """The parts of a dotted key up to the "=" or "]" that ends it, which are taken, too."""
        names: list[str] = []
        while (piece := self.next()) and piece.lastgroup not in ("end", "close"):
            if piece.lastgroup != "dot":
                names.append(_name(piece))
        return names

    def _skip(self, brackets: int = 0) -> None:
        """Go on to where so many brackets are closed; without brackets to the end of a line that is in none."""
        is_line = brackets == 0
        while piece := _SKIPPED.match(self._text, self._at):
            self._at = piece.end()
            match piece.lastgroup:
                case "open":
                    brackets += 1
                case "close":
                    brackets -= 1
                    if brackets <= 0 and not is_line:
                        return
                case "newline" if is_line and brackets <= 0:
                    return

    def _step(self, depth: int | None, name: str | int) -> int | None:
        """The depth of `name` in the table or list at `depth`. Everything inside the value has the value's depth."""
        if depth is None or depth == len(self._keys):
            return depth
        return depth + 1 if self._keys[depth] == name else None

    def _note(self, depth: int | None, position: int) -> None:
        if depth is not None and depth > self._longest:
            self._longest, self.position = depth, position


def _name(piece: re.Match[str]) -> str:
    """The part of a key that a piece writes."""
    text = piece[piece.lastgroup or 0]
    if text[0] == '"':
        return _ESCAPE.sub(_unescaped, text[1:-1])
    return text[1:-1] if text[0] == "'" else text


def _unescaped(match: re.Match[str]) -> str:
    code = match[1] or match[2]
    return chr(int(code, 16)) if code else _ESCAPED.get(match[3], match[3])
