"""`python -m raytracer`: the command line, where no script is installed."""

import sys

from raytracer.cli import main

if __name__ == "__main__":
    sys.exit(main())
