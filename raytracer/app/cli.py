"""The command line: dispatch to commands, parsing of arguments, and messages for errors and Ctrl-C.

`raytracer NAME` is in `commands/NAME_cli.py`, which is imported only if the user runs that command. The file has two
functions: `add_arguments(parser)`, and `run(options)`, which returns the exit status. Commands open the files that they
write with `options.write` (core.output.Writer), so that the message after Ctrl-C can list the files that were written.

Exit status:
    0    done
    1    any other failure, for example a picture that did not reach `--max-error`
    2    wrong input: one line on standard error says where and what, and nothing is written; or no command: the help
    130  after Ctrl-C
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from raytracer.app.help_text import HELP, HelpFormatter, command_texts, program_epilog
from raytracer.core.interrupts import STATUS
from raytracer.core.output import write_atomically
from raytracer.core.shown import format_value
from raytracer.core.suggest import did_you_mean
from raytracer.core.terminal import drop_output, print_error, tolerant_output
from raytracer.core.validation import InputError
from raytracer.version import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with `arguments` and return the exit status. Default: sys.argv."""
    # When NumPy is imported, OpenBLAS starts one thread per core, which takes long. The program has no work for them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    written: list[Path] = []
    defaults = argparse.Namespace(write=partial(write_atomically, finish=written.append))
    try:
        with tolerant_output(), warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", ResourceWarning)  # an interrupt may leave a file open
            warnings.showwarning = _show_warning
            options = _parser().parse_args(arguments, defaults)
            return options.run(options)
    except InputError as error:
        print_error(str(error))
        return 2
    except KeyboardInterrupt:
        files = ", ".join(map(str, written))
        print_error(f"interrupted, after writing {files}" if files else "interrupted, nothing written")
        return STATUS
    except BrokenPipeError:  # the process that reads the output has ended: no message, also at exit
        drop_output()
        return 1
    except MemoryError:
        print_error("not enough memory; try a smaller picture")
        return 1
    except (RuntimeError, OSError) as error:  # ContextError, ShaderError; a full disk, a deleted folder
        print_error(*str(error).splitlines())
        drop_output()
        return 1


def _show_warning(message: Warning | str, *_: object) -> None:
    print_error(f"warning: {message}")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        args = [*(sys.argv[1:] if args is None else args)]
        if not args and self._subparsers:
            self.print_help()
            self.exit(2)
        if args and self._subparsers and args[0].startswith("-"):  # before argparse reports a missing command
            option = args[0].partition("=")[0]
            name = option if option.startswith("--") else option[:2]
            if not any(known.startswith(name) for known in self._option_string_actions):
                self._refuse(option)
        namespace, rest = super().parse_known_args(args, namespace)
        if rest:
            option = next((text.partition("=")[0] for text in rest if text.startswith("-")), None)
            if option is None:
                self.error(f"expected no more arguments, got {format_value(rest[0])}")
            self._refuse(option)
        return namespace, rest

    def _refuse(self, option: str) -> NoReturn:
        self.error(f"unknown option {format_value(option)}{did_you_mean(option, self._option_string_actions)}")

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        if action.option_strings and action.nargs is None and arg_strings == ["--"]:  # argparse would return a list
            raise argparse.ArgumentError(action, "expected a value, got '--'")
        return super()._get_values(action, arg_strings)  # pyright: ignore[reportAttributeAccessIssue]

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            near = did_you_mean(str(value), names)
            raise argparse.ArgumentError(action, f"expected one of {', '.join(names)}, got {format_value(value)}{near}")


class _Command(_Parser):
    """The parser of one command. Its module is imported, and its arguments added, only if the user runs the command."""

    def __init__(self, *, arguments: Callable[[argparse.ArgumentParser], None], **options: Any) -> None:
        super().__init__(**options)
        self._arguments = arguments

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        self._arguments(self)
        return super().parse_known_args(args, namespace)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="raytracer",
        description="A GLSL ray tracer for constructive solid geometry that states the error of its pictures.",
        epilog=program_epilog(),
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"raytracer {__version__}", help="print the version")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=_Command)
    for name in (name for name in HELP if " " not in name):
        description, epilog = command_texts(name)
        commands.add_parser(
            name,
            help=HELP[name].summary,
            description=description,
            epilog=epilog,
            formatter_class=HelpFormatter,
            arguments=partial(_add_arguments, name),
        )
    return parser


def _add_arguments(name: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of a command, and set its function `run` as the default of `options.run`."""
    import_module(f"raytracer.app.commands.{name}_cli").add_arguments(parser)
