"""The command line: which commands there are, how their arguments are read, and what an error or Ctrl-C prints.

`raytracer NAME` is in `commands/NAME_cli.py`, which is imported when its command is the one given. The file has two
functions: `add_arguments(parser)`, and `run(options)`, whose result is the exit status. `options.write` opens the files
that a command writes (core.output.Writer), so that after Ctrl-C the command line says which were written.

Exit status: 0 done; 2 the input is wrong, with one line on standard error that says what and
where, and nothing written; 1 anything else, such as a picture less accurate than `--max-error`; 130 after Ctrl-C.
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

from raytracer.core.interrupts import STATUS
from raytracer.core.output import written_whole
from raytracer.core.shown import shown
from raytracer.core.suggest import did_you_mean
from raytracer.core.terminal import complain, drop_output, tolerant_output
from raytracer.core.validation import InputError
from raytracer.version import __version__

_COMMANDS = {
    "render": "render a scene to a file",
    "view": "show a scene in a window",
    "extremes": "measure how wrong pictures are where numbers get extreme",
    "brdf": "measure and show the reflectance models",
    "reference": "what a scene's picture converges to, in float64",
    "compare": "how far a picture is from a reference",
    "trade": "measure what each knob costs on a scene, and what error it leaves",
    "tune": "find the fastest settings that meet an error, or the best within a time",
    "doctor": "which OpenGL contexts open here, and what to install if none does",
}
_EXAMPLES = """\
examples:
  raytracer render assets/scenes/assignment.toml -o assignment.png
  raytracer render assignment -o big.png --size 1920x1080 --samples 16 --adaptive 0.01
  raytracer render my.toml -o my.npz --shading blinn --shadows diluted
  raytracer render assignment -o good.png --max-error 0.002 --samples 256 --time 10
  raytracer render assignment -o better.png --quality high
  raytracer view assets/scenes/assignment.toml
  raytracer extremes -o benchmarks/results
  raytracer extremes --fuzz 10000
  raytracer brdf list ggx
  raytracer brdf check ggx --set alpha=0.1
  raytracer brdf plot blinn phong_normalized ggx:alpha=0.1 -o lobes.png
  raytracer brdf gallery -o gallery.png
  raytracer brdf bake ggx:alpha=0.3 -o ggx.binary
  raytracer reference assignment -o reference.npz
  raytracer render assignment -o assignment.npz --size 320x180 --max-error 0.002
  raytracer compare assignment.npz reference.npz --tolerance 0.002
  raytracer compare assignment.png reference.npz -o difference.png --json
  raytracer trade assignment -o trade
  raytracer tune assignment --max-error 0.002
  raytracer tune assignment --time 0.5 --shadows soft
  raytracer doctor
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with `arguments` (default: sys.argv) and return the exit status."""
    # NumPy's OpenBLAS starts a thread for each core as it is imported, which takes long. There is no work for them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    written: list[Path] = []
    defaults = argparse.Namespace(write=partial(written_whole, finish=written.append))
    try:
        with tolerant_output(), warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", ResourceWarning)  # where an interrupt leaves a file open
            warnings.showwarning = _show_warning
            options = _parser().parse_args(arguments, defaults)
            return options.run(options)
    except InputError as error:
        complain(str(error))
        return 2
    except KeyboardInterrupt:
        files = ", ".join(map(str, written))
        complain(f"interrupted, after writing {files}" if files else "interrupted, nothing written")
        return STATUS
    except BrokenPipeError:  # the reader of our output has gone: no message, also at exit
        drop_output()
        return 1
    except MemoryError:
        complain("this does not fit into memory; try it with a smaller picture")
        return 1
    except (RuntimeError, OSError) as error:  # ContextError, ShaderError; a full disk, a vanished folder
        complain(*str(error).splitlines())
        drop_output()
        return 1


def _show_warning(message: Warning | str, *_: object) -> None:
    complain(f"warning: {message}")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        args = [*(sys.argv[1:] if args is None else args)]
        if args and self._subparsers and args[0].startswith("-"):  # before it says that the command is missing
            option = args[0].partition("=")[0]
            name = option if option.startswith("--") else option[:2]
            if not any(known.startswith(name) for known in self._option_string_actions):
                self._refuse(option)
        namespace, rest = super().parse_known_args(args, namespace)
        if rest:
            option = next((text.partition("=")[0] for text in rest if text.startswith("-")), None)
            if option is None:
                self.error(f"expected no more arguments, got {shown(rest[0])}")
            self._refuse(option)
        return namespace, rest

    def _refuse(self, option: str) -> NoReturn:
        self.error(f"unknown option {shown(option)}{did_you_mean(option, self._option_string_actions)}")

    def _get_values(self, action: argparse.Action, arg_strings: list[str]) -> Any:
        if action.option_strings and action.nargs is None and arg_strings == ["--"]:  # argparse makes a list of it
            raise argparse.ArgumentError(action, "expected a value, got '--'")
        return super()._get_values(action, arg_strings)  # pyright: ignore[reportAttributeAccessIssue]

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            names = [str(choice) for choice in action.choices]
            near = did_you_mean(str(value), names)
            raise argparse.ArgumentError(action, f"expected one of {', '.join(names)}, got {shown(value)}{near}")


class _Command(_Parser):
    """One command's parser. What it takes is looked up once it is the one given: no other needs what that imports."""

    def __init__(self, *, arguments: Callable[[argparse.ArgumentParser], None], **options: Any) -> None:
        super().__init__(**options)
        self._arguments = arguments

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        self._arguments(self)
        return super().parse_known_args(args, namespace)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="raytracer",
        description="A GLSL ray tracer for constructive solid geometry.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"raytracer {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=_Command)
    for name, summary in _COMMANDS.items():
        examples = [line for line in _EXAMPLES.splitlines()[1:] if f"raytracer {name}" in line]
        commands.add_parser(
            name,
            help=summary,
            description=summary[0].upper() + summary[1:] + ".",
            epilog="\n".join(["examples:", *examples]),
            formatter_class=argparse.RawDescriptionHelpFormatter,
            arguments=partial(_add_arguments, name),
        )
    return parser


def _add_arguments(name: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of a command, and its function `run` as a default."""
    import_module(f"raytracer.app.commands.{name}_cli").add_arguments(parser)
