"""Text output for people, on standard output and standard error.

Control characters are escaped, so that no file name or key can control the terminal or make the output fail.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from raytracer.core.shown import escape_unprintable

if TYPE_CHECKING:
    from rich.table import Table

# The number of characters kept at each end of a very long line of an error. A path on Linux may have 4096 characters,
# more than a person reads.
_ENDS = 500
# The width of a table, in characters, if standard output is no terminal.
_WIDTH = 160


def print_lines(*lines: str) -> None:
    """Print lines on standard output, with control characters escaped as in Python."""
    for line in lines:
        print(escape_unprintable(line), flush=True)


def print_error(*lines: str) -> None:
    """Print an error on standard error: `raytracer: ` and the lines. The middle of a very long line is left out."""
    first, *others = (_shorten(line) for line in lines or ("",))
    print_note(f"raytracer: {first}", *others)


def _shorten(line: str) -> str:
    return line if len(line) <= 2 * _ENDS else f"{line[:_ENDS]} ... {line[-_ENDS:]}"


def print_note(*lines: str) -> None:
    """Print lines on standard error, with control characters escaped. Does nothing if standard error is closed."""
    if sys.stderr is None:  # print() would use standard output instead
        return
    with suppress(OSError):
        for line in lines:
            print(escape_unprintable(line), file=sys.stderr)


def print_json(text: str) -> None:
    """Print JSON on standard output."""
    print(text.replace("\x7f", "\\u007f"))  # DEL, the only control character that JSON encoders do not escape


def print_table(table: Table) -> None:
    """Print a table on standard output. Its cells must come from table_cell()."""
    if sys.stdout is None:
        return
    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else _WIDTH).print(table)


def table_cell(text: str) -> str:
    """Return text for a table's cell, with control characters and rich's markup escaped."""
    from rich.markup import escape

    return escape(escape_unprintable(text))


@contextmanager
def tolerant_output() -> Iterator[None]:
    """Make standard output escape the characters that its encoding lacks, within the block.

    Standard error always escapes them. The end of the block flushes standard output, and raises OSError if that fails.
    """
    stream = sys.stdout
    if not isinstance(stream, io.TextIOWrapper):  # closed, or replaced by the caller
        yield
        return
    errors = stream.errors
    stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        stream.reconfigure(errors=errors)


def drop_output() -> None:
    """Discard output that cannot be written, such as into a closed pipe: Python's shutdown would report an error."""
    if sys.stdout is None:
        return
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
