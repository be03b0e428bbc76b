"""The preprocessor: resolves `#include` in the files of `shaders/`, each file once.

It writes `#line` numbers, so that a compiler's message can be traced back to a file and line.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from raytracer.core.files import find_data_folder, read_packaged

# The GLSL versions without and with doubles, which need OpenGL 4.0.
_VERSION, _VERSION_WITH_DOUBLES = 330, 400

_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"\n]+)"[ \t]*$')
# The step of line numbers between files: line 12 of file 3 has the number 3000012. #line could also set a file number,
# but Mesa reports it only with syntax errors.
_LINES = 1_000_000
FileVersion = tuple[int, int]  # a file's modification time (ns) and size
# The number of files in the cache: all files, and earlier versions of some.
_KEPT_FILES = 256
# The forms of a line number in a message. Mesa: "0:3000012(5): error: ...", NVIDIA: "0(3000012) : error ...", others:
# "ERROR: 0:3000012: ...".
_PLACE = re.compile(r"\b0(?::(\d+)(?:\(\d+\))?|\((\d+)\))")


class ShaderError(RuntimeError):
    """The GLSL compiler rejected a text. The message names files and lines of `shaders/`."""


def shaders_folder() -> Path:
    """Return the folder of the shaders."""
    return find_data_folder("shaders", "shaders")


class Source(NamedTuple):
    """A complete text, with the files that it consists of, in the order of their `#line` numbers."""

    text: str
    files: tuple[str, ...]
    versions: tuple[tuple[str, FileVersion], ...]  # the names and versions of the files that are not generated

    def explain(self, log: str) -> str:
        """Replace file numbers in a compiler's log by names: `geometry/sphere.glsl:12: error ...`."""

        def name(match: re.Match[str]) -> str:
            file, line = divmod(int(match[1] or match[2]), _LINES)
            return f"{self.files[file]}:{line}" if file < len(self.files) else match[0]

        return _PLACE.sub(name, log)


def is_current(versions: Mapping[str, FileVersion]) -> bool:
    """Return whether all files of `shaders/` in `versions` still have these versions."""
    folder = shaders_folder()
    try:
        return all(_version(f"{folder}/{name}") == version for name, version in versions.items())
    except OSError:  # the file was removed
        return False


def _version(path: str) -> FileVersion:
    """Return the version of a file."""
    status = os.stat(path)
    return status.st_mtime_ns, status.st_size


class _Piece(NamedTuple):
    """The lines of a file up to an `#include`, or to the end."""

    line: int  # the number of its first line
    text: str | None  # None without lines
    include: str  # the included file, or "" at the end of the file
    end: int  # the number of the line with the `#include`


def _split(text: str) -> list[_Piece]:
    """Split a file's text at its `#include` lines."""
    pieces: list[_Piece] = []
    first = 0
    lines = text.splitlines()
    includes = [(i, match[1]) for i, line in enumerate(lines) if (match := _INCLUDE.match(line))]
    for i, name in (*includes, (len(lines), "")):
        pieces.append(_Piece(first + 1, "\n".join(lines[first:i]) if first < i else None, name, i + 1))
        first = i + 1
    return pieces


def _read(folder: Path, name: str, wanted_by: str) -> tuple[list[_Piece], FileVersion]:
    """Return the pieces of a file of `shaders/`, and the file's version. Raises ShaderError."""
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
    """Return the pieces of a file. The version is a part of the cache key, so a changed file is read again."""
    return _split(read_packaged(Path(path)))


def assemble(
    top: str, defines: Mapping[str, int | str] | None = None, generated: Mapping[str, str] | None = None
) -> Source:
    """Assemble the text of the file `top` and all files that it includes, each once, where it is first included.

    `defines` become `#define NAME value`. `generated` holds generated texts, by the names of the files that they stand
    for. Raises ShaderError for a missing file.
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

    version = _VERSION_WITH_DOUBLES if defines and "DOUBLES" in defines else _VERSION
    head = f"#version {version} core\n" + "".join(
        f"#define {name} {value}\n" for name, value in (defines or {}).items()
    )
    return Source(head + "\n".join(expand(top, top)) + "\n", tuple(files), tuple(versions.items()))
