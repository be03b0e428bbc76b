"""Line numbers for error messages: the line of a TOML text that defines the value at a path of keys."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

# The tokens of a TOML text. The parser has accepted the text already, so these patterns need not reject anything.
# Possessive quantifiers keep the time linear for every text. Keys without quotes, numbers, dates, true and false are
# "bare".
_STRING = r"""\"{3}(?:[^"\\]|\\.|"{1,2}(?!"))*+"{3,5}|'{3}(?:[^']|'{1,2}(?!'))*+'{3,5}
    |"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+'"""
_PIECE = re.compile(
    rf"""(?:[ \t\r]++|\#[^\n]*+)*+
    (?:(?P<newline>\n)|(?P<open>[\[{{])|(?P<close>[\]}}])|(?P<comma>,)|(?P<end>=)|(?P<dot>\.)|(?P<string>{_STRING})
    |(?P<bare>[^\s\[\]{{}}=,."'#]++))""",
    re.VERBOSE | re.DOTALL,
)
# A faster pattern for values that are not on the path of keys: it skips everything up to the next bracket at once.
_SKIPPED = re.compile(
    rf"""(?P<open>[\[{{])|(?P<close>[\]}}])|(?P<newline>\n)|(?:[^\[\]{{}}\n"'#]++|\#[^\n]*+|{_STRING})++""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))")
_ESCAPED = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r"}


def find_line(text: str, keys: Sequence[str | int]) -> int | None:
    """Return the line of a value: the line of its key, its table header, or its item in a list.

    Args:
        text: a TOML text that tomllib can read.
        keys: the path of keys and list indices to the value.

    Returns:
        The line, from 1. If the text does not define the value, the line of the innermost table or list around it, or
        None if the text does not define such a table either. The time is linear in the length of the text.
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
    """An open list or inline table. `depth` is the number of keys that lead to it."""

    depth: int
    is_list: bool
    index: int = 0  # of the current item
    is_at_start: bool = True  # whether the next token begins an item or a key


class _Search:
    """A search for the longest prefix of a path of keys that a text defines, and for its `position` in the text.

    A depth is the number of keys that lead to a position of the text, or None if the position is not on the path.
    """

    def __init__(self, text: str, keys: Sequence[str | int]) -> None:
        self.position: int | None = None
        self._text = text
        self._at = 0
        self._keys = keys
        self._longest = 0
        self._table: int | None = 0
        # For each list of tables on the path, by its depth: the index of the last table so far.
        self._last: dict[int, int] = {}

    def is_done(self) -> bool:
        """Whether the search has reached the value itself."""
        return self._longest == len(self._keys)

    def next(self) -> re.Match[str] | None:
        """Return the next token of the text, or None at the end."""
        piece = _PIECE.match(self._text, self._at)
        if piece:
            self._at = piece.end()
        return piece

    def read_header(self, start: int) -> None:
        """Read a table header whose first `[` is at `start`: `[a.b]`, or `[[a.b]]` for an item of a list of tables."""
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
        """Read an entry `a.b = ...` with its lists and inline tables, to the end of its last line."""
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
        """Whether a value at this depth may contain the rest of the path."""
        return depth is not None and depth < len(self._keys)

    def _read_key(self, depth: int | None, first: re.Match[str]) -> int | None:
        for name in (_name(first), *self._names()):
            depth = self._step(depth, name)
        self._note(depth, first.start(first.lastgroup or 0))
        return depth

    def _names(self) -> list[str]:
        """Read the rest of a dotted key, with the "=" or "]" that ends it, and return the parts of the key."""
        names: list[str] = []
        while (piece := self.next()) and piece.lastgroup not in ("end", "close"):
            if piece.lastgroup != "dot":
                names.append(_name(piece))
        return names

    def _skip(self, brackets: int = 0) -> None:
        """Skip to the end of `brackets` open brackets; for 0, to the end of the first line outside all brackets."""
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
        """Return the depth of the entry `name` in the table or list at `depth`. Entries of the value keep its depth."""
        if depth is None or depth == len(self._keys):
            return depth
        return depth + 1 if self._keys[depth] == name else None

    def _note(self, depth: int | None, position: int) -> None:
        if depth is not None and depth > self._longest:
            self._longest, self.position = depth, position


def _name(piece: re.Match[str]) -> str:
    """Return the part of a key that a token stands for."""
    text = piece[piece.lastgroup or 0]
    if text[0] == '"':
        return _ESCAPE.sub(_unescape, text[1:-1])
    return text[1:-1] if text[0] == "'" else text


def _unescape(match: re.Match[str]) -> str:
    code = match[1] or match[2]
    return chr(int(code, 16)) if code else _ESCAPED.get(match[3], match[3])
