"""GLSL text from the files of `shaders/`: `#include` once each, with `#line`, so that a compiler's
message can be traced back to a file and line."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from raytracer.core.files import packaged, read_packaged

# Doubles came with OpenGL 4.0.
_VERSION, _VERSION_OF_DOUBLES = 330, 400

_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"\n]+)"[ \t]*$')
# Line 12 of file 3 is numbered 3000012: #line can give a number of the file too, but Mesa forgets that
# in all errors but those of syntax.
_LINES = 1_000_000
# Mesa: "0:3000012(5): error: ...", NVIDIA: "0(3000012) : error ...", others: "ERROR: 0:3000012: ...".
_PLACE = re.compile(r"\b0(?::(\d+)(?:\(\d+\))?|\((\d+)\))")


class ShaderError(RuntimeError):
    """The GLSL compiler refused a text; the message names files and lines of `shaders/`."""


def shaders_folder() -> Path:
    """Where the shaders' files are."""
    return packaged("shaders", "shaders")


class Source(NamedTuple):
    """A complete text, and the files it came from in the order of their `#line` numbers."""

    text: str
    files: tuple[str, ...]

    def explain(self, log: str) -> str:
        """A compiler's log with the numbers of files replaced by names: `geometry/sphere.glsl:12: error ...`."""

        def name(match: re.Match[str]) -> str:
            file, line = divmod(int(match[1] or match[2]), _LINES)
            return f"{self.files[file]}:{line}" if file < len(self.files) else match[0]

        return _PLACE.sub(name, log)


def file_versions(names: Iterable[str]) -> tuple[tuple[int, int] | None, ...]:
    """The time and the size of each file in `shaders/`, None for one that is not there: a generated one."""
    folder = shaders_folder()

    def version(name: str) -> tuple[int, int] | None:
        try:
            status = os.stat(folder / name)
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size

    return tuple(map(version, names))


def assemble(
    top: str, defines: Mapping[str, int | str] | None = None, generated: Mapping[str, str] | None = None
) -> Source:
    """The text of file `top` with everything that it includes, each file once, at its first mention.

    `defines` become `#define NAME value`. `generated` holds texts that stand for files, by name.
    Raises ShaderError for a file that is not there.
    """
    folder = shaders_folder()
    files: list[str] = []

    def expand(name: str, wanted_by: str) -> list[str]:
        if name in files:
            return []
        number = len(files)
        files.append(name)
        if generated and name in generated:
            text = generated[name]
        else:
            try:
                text = read_packaged(folder / name)
            except OSError:
                raise ShaderError(f'{wanted_by}: no file "{name}" in {folder}') from None
            except UnicodeDecodeError as error:
                line = error.object[: error.start].count(b"\n") + 1
                raise ShaderError(f"{name}:{line}: error: expected UTF-8 text: {error.reason}") from None
        lines = [f"#line {number * _LINES + 1}"]
        for i, line in enumerate(text.splitlines(), start=1):
            if match := _INCLUDE.match(line):
                lines += expand(match[1], f"{name}:{i}")
                lines.append(f"#line {number * _LINES + i + 1}")
            else:
                lines.append(line)
        return lines

    version = _VERSION_OF_DOUBLES if defines and "DOUBLES" in defines else _VERSION
    head = f"#version {version} core\n" + "".join(
        f"#define {name} {value}\n" for name, value in (defines or {}).items()
    )
    return Source(head + "\n".join(expand(top, top)) + "\n", tuple(files))
