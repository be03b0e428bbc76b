"""Entry point of the command line: `raytracer`, or `python -m raytracer` where no script is installed.

From here on, Ctrl-C ends the program with exit status 130 and without a traceback. So this module imports next to
nothing before the Ctrl-C handler is set.
"""

from __future__ import annotations

import sys

# Replaces typing.TYPE_CHECKING, which would need an import.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> int:
    """Run the command line with sys.argv and return the exit status."""
    try:
        from raytracer.core.interrupts import run_guarded

        return run_guarded(_load)
    except KeyboardInterrupt:  # before the handler was set, or after it was removed
        return 130


def _load() -> Callable[[], int]:
    """Import the command line and return its main function."""
    from raytracer.app.cli import main

    return main


if __name__ == "__main__":
    sys.exit(main())
