"""The program: `raytracer`, and `python -m raytracer` where no script is installed.

Ctrl-C ends it with the status 130 and without a traceback, from here on: so next to nothing is imported before.
"""

from __future__ import annotations

import sys

# As typing.TYPE_CHECKING: no module is imported that need not be.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> int:
    """Run the command line with sys.argv; the exit status."""
    try:
        from raytracer.core.interrupts import run_guarded

        return run_guarded(_load)
    except KeyboardInterrupt:  # before there was a handler, or as its work was over
        return 130


def _load() -> Callable[[], int]:
    """Import the command line."""
    from raytracer.app.cli import main

    return main


if __name__ == "__main__":
    sys.exit(main())
