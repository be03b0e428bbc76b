"""The program: `raytracer`, and `python -m raytracer` where no script is installed.

Ctrl-C ends it with the status 130 and without a traceback, from here on: so next to nothing is imported before.
"""

import sys


def main() -> int:
    """Run the command line with sys.argv; the exit status."""
    try:
        from raytracer.core.interrupts import run_guarded

        return run_guarded()
    except KeyboardInterrupt:  # before there was a handler, or as its work was over
        return 130


if __name__ == "__main__":
    sys.exit(main())
