"""Text for a person, on standard output and standard error: no name in it makes it fail or controls the terminal."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from raytracer.core.shown import printable

if TYPE_CHECKING:
    from rich.table import Table

# Characters of either end of a message: a path on Linux has 4096 at most, and a person reads no more than this.
_ENDS = 500
# Columns of a table where there is no terminal.
_WIDTH = 160


def say(*lines: str) -> None:
    """Print lines on standard output. What would control the terminal in them is shown as Python escapes it."""
    for line in lines:
        print(printable(line), flush=True)


def complain(*lines: str) -> None:
    """Print `raytracer: ` and the lines on standard error, as note() does, without the middle of a very long one."""
    first, *others = (_shortened(line) for line in lines or ("",))
    note(f"raytracer: {first}", *others)


def _shortened(line: str) -> str:
    return line if len(line) <= 2 * _ENDS else f"{line[:_ENDS]} ... {line[-_ENDS:]}"


def note(*lines: str) -> None:
    """Print lines on standard error, as say() does, if it can be written to."""
    if sys.stderr is None:  # which print() would take for standard output
        return
    with suppress(OSError):
        for line in lines:
            print(printable(line), file=sys.stderr)


def say_json(text: str) -> None:
    """Print JSON on standard output."""
    print(text.replace("\x7f", "\\u007f"))  # which JSON has raw, unlike all other control characters


def say_table(table: Table) -> None:
    """Print a table on standard output. Its cells are as cell() makes them."""
    if sys.stdout is None:
        return
    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else _WIDTH).print(table)


def cell(text: str) -> str:
    """Text for a table's cell: it is no markup, and holds no control characters."""
    from rich.markup import escape

    return escape(printable(text))


@contextmanager
def tolerant_output() -> Iterator[None]:
    """Let standard output escape the characters that it cannot encode, as Python does; standard error always does.

    At the end of the block everything is written. Raises OSError if it cannot be.
    """
    stream = sys.stdout
    if not isinstance(stream, io.TextIOWrapper):  # there is none, or a caller put another kind in its place
        yield
        return
    errors = stream.errors
    stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        stream.reconfigure(errors=errors)


def drop_output() -> None:
    """Forget what standard output does not take, or the end of the interpreter fails for it."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
