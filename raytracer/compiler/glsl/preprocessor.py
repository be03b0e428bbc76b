"""GLSL text from the files of `shaders/`: `#include` once each, with `#line`, so that a compiler's
message can be traced back to a file and line."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from raytracer.core.files import packaged, read_packaged

# Doubles came with OpenGL 4.0.
_VERSION, _VERSION_OF_DOUBLES = 330, 400

_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"\n]+)"[ \t]*$')
# Line 12 of file 3 is numbered 3000012: #line can give a number of the file too, but Mesa forgets that
# in all errors but those of syntax.
_LINES = 1_000_000
FileVersion = tuple[int, int]  # the time and the size of a file
# Pieces of so many files are kept: of all there are, and of some that were changed meanwhile.
_KEPT_FILES = 256
# Mesa: "0:3000012(5): error: ...", NVIDIA: "0(3000012) : error ...", others: "ERROR: 0:3000012: ...".
_PLACE = re.compile(r"\b0(?::(\d+)(?:\(\d+\))?|\((\d+)\))")


class ShaderError(RuntimeError):
    """The GLSL compiler refused a text; the message names files and lines of `shaders/`."""


def shaders_folder() -> Path:
    """Where the shaders' files are."""
    return packaged("shaders", "shaders")


class Source(NamedTuple):
    """A complete text, and the files that it is made from, in the order of their `#line` numbers."""

    text: str
    files: tuple[str, ...]
    versions: tuple[tuple[str, FileVersion], ...]  # of the files that are not generated, with their names

    def explain(self, log: str) -> str:
        """A compiler's log with the numbers of files replaced by names: `geometry/sphere.glsl:12: error ...`."""

        def name(match: re.Match[str]) -> str:
            file, line = divmod(int(match[1] or match[2]), _LINES)
            return f"{self.files[file]}:{line}" if file < len(self.files) else match[0]

        return _PLACE.sub(name, log)


def is_current(versions: Mapping[str, FileVersion]) -> bool:
    """Whether no file of `shaders/` has changed since these were its versions."""
    folder = shaders_folder()
    try:
        return all(_version(f"{folder}/{name}") == version for name, version in versions.items())
    except OSError:  # it is gone
        return False


def _version(path: str) -> FileVersion:
    status = os.stat(path)
    return status.st_mtime_ns, status.st_size


class _Piece(NamedTuple):
    """The lines of a file up to an `#include`, or to the end."""

    line: int  # the number of the first
    text: str | None  # None for no lines
    include: str  # the name of a file, or "" at the end
    end: int  # the number of the line with the `#include`


def _split(text: str) -> list[_Piece]:
    pieces: list[_Piece] = []
    first = 0
    lines = text.splitlines()
    includes = [(i, match[1]) for i, line in enumerate(lines) if (match := _INCLUDE.match(line))]
    for i, name in (*includes, (len(lines), "")):
        pieces.append(_Piece(first + 1, "\n".join(lines[first:i]) if first < i else None, name, i + 1))
        first = i + 1
    return pieces


def _read(folder: Path, name: str, wanted_by: str) -> tuple[list[_Piece], FileVersion]:
    """The pieces of a file of `shaders/`, and the file's version. Raises ShaderError."""
    path = f"{folder}/{name}"
    try:
        version = _version(path)
        return _file_pieces(path, version), version
    except OSError:
        raise ShaderError(f'{wanted_by}: no file "{name}" in {folder}') from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise ShaderError(f"{name}:{line}: error: expected UTF-8 text: {error.reason}") from None


@lru_cache(maxsize=_KEPT_FILES)
def _file_pieces(path: str, _version: FileVersion) -> list[_Piece]:
    """The pieces of a file, which are read anew when it was changed: with another time or size of the file."""
    return _split(read_packaged(Path(path)))


def assemble(
    top: str, defines: Mapping[str, int | str] | None = None, generated: Mapping[str, str] | None = None
) -> Source:
    """The text of file `top` with everything that it includes, each file once, at its first mention.

    `defines` become `#define NAME value`. `generated` holds texts that stand for files, by name.
    Raises ShaderError for a file that is not there.
    """
    folder = shaders_folder()
    files: list[str] = []
    versions: dict[str, FileVersion] = {}

    def expand(name: str, wanted_by: str) -> list[str]:
        if name in files:
            return []
        number = len(files)
        files.append(name)
        if generated and name in generated:
            pieces = _split(generated[name])
        else:
            pieces, versions[name] = _read(folder, name, wanted_by)
        texts: list[str] = []
        for piece in pieces:
            texts.append(f"#line {number * _LINES + piece.line}")
            if piece.text is not None:
                texts.append(piece.text)
            if piece.include:
                texts += expand(piece.include, f"{name}:{piece.end}")
        return texts

    version = _VERSION_OF_DOUBLES if defines and "DOUBLES" in defines else _VERSION
    head = f"#version {version} core\n" + "".join(
        f"#define {name} {value}\n" for name, value in (defines or {}).items()
    )
    return Source(head + "\n".join(expand(top, top)) + "\n", tuple(files), tuple(versions.items()))
