"""The commands of the command line, with their parsers and pages."""

import argparse
from collections.abc import Iterator

from raytracer.app.cli import _parser


def commands(parser: argparse.ArgumentParser, name: str = "") -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield each command of the command line, with the parser that has its arguments."""
    subparsers = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    for action in subparsers:
        for command, child in action.choices.items():
            arguments = getattr(child, "_arguments", None)
            if arguments:
                arguments(child)
            yield from commands(child, f"{name} {command}".strip())
    if not subparsers:
        yield name, parser


COMMANDS = dict(commands(_parser()))
# The page that has the options of a command, by the first word of the command.
PAGE_OF = {
    "animate": "docs/animation.md",
    "brdf": "docs/reflectance.md",
    "sweep": "docs/sweeps.md",
    "view": "docs/window.md",
}
