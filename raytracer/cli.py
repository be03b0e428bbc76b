"""The command line: `raytracer render`, `view`, `extremes`, `brdf` (in `brdf_cli.py`),
`reference` and `compare` (in `compare_cli.py`), `trade` and `tune` (in `trade_cli.py`) and `doctor`.

Exit status: 0 done; 2 the input is wrong, with one line on standard error that says what and
where, and nothing written; 1 anything else.
"""

from __future__ import annotations

import argparse
import gc
import os
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn, get_args

from raytracer import __version__
from raytracer.checks import InputError, number, printable
from raytracer.progress import progress_bar
from raytracer.scene_file import load
from raytracer.settings import Evaluator, Precision, Settings, Shading, Shadows, precision_warning

# Pictures that need more host memory than this say so before they start.
_MEMORY_WORTH_MENTION = 2**30

_EXAMPLES = """\
examples:
  raytracer render assets/scenes/assignment.toml -o assignment.png
  raytracer render assignment -o big.png --size 1920x1080 --samples 16 --adaptive 0.01
  raytracer render my.toml -o my.npz --shading blinn --shadows diluted
  raytracer view assets/scenes/assignment.toml
  raytracer extremes -o benchmarks/results
  raytracer extremes --fuzz 10000
  raytracer brdf list ggx
  raytracer brdf check ggx --set alpha=0.1
  raytracer brdf plot blinn phong_normalized ggx:alpha=0.1 -o lobes.png
  raytracer brdf gallery -o gallery.png
  raytracer brdf bake ggx:alpha=0.3 -o ggx.binary
  raytracer reference assignment -o reference.npz
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
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.showwarning = _show_warning
            options = _parser().parse_args(arguments)
            return options.run(options)
    except InputError as error:
        print(f"raytracer: {printable(str(error))}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("raytracer: interrupted, nothing written", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of our output has gone: no message, also at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except MemoryError:
        print("raytracer: the picture does not fit into memory; try a smaller --size", file=sys.stderr)
        return 1
    except (RuntimeError, OSError) as error:  # ContextError, ShaderError; a full disk, a vanished folder
        print(f"raytracer: {error}", file=sys.stderr)
        return 1


def _show_warning(message: Warning | str, *_: object) -> None:
    print(f"raytracer: warning: {printable(str(message))}", file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


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
    for name, summary, arguments, run in (
        ("render", "render a scene to a file", _render_arguments, _render),
        ("view", "show a scene in a window", _view_arguments, _view),
        ("extremes", "measure how wrong pictures are where numbers get extreme", _extremes_arguments, _extremes),
        ("brdf", "measure and show the reflectance models", _brdf_arguments, None),
        ("reference", "what a scene's picture converges to, in float64", _reference_arguments, None),
        ("compare", "how far a picture is from a reference", _compare_arguments, None),
        ("trade", "measure what each knob costs on a scene, and what error it leaves", _trade_arguments, None),
        ("tune", "find the fastest settings that meet an error, or the best within a time", _tune_arguments, None),
        ("doctor", "which OpenGL contexts open here, and what to install if none does", _doctor_arguments, _doctor),
    ):
        examples = [line for line in _EXAMPLES.splitlines()[1:] if f"raytracer {name}" in line]
        command = commands.add_parser(
            name,
            help=summary,
            description=summary[0].upper() + summary[1:] + ".",
            epilog="\n".join(["examples:", *examples]),
            formatter_class=argparse.RawDescriptionHelpFormatter,
            arguments=arguments,
        )
        command.set_defaults(run=run)
    return parser


def _render_arguments(parser: argparse.ArgumentParser) -> None:
    _add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="OUT", required=True, help=".png (8-bit sRGB) or .npz (float32 arrays)"
    )
    _add_settings(parser, samples=1)
    parser.add_argument(
        "--adaptive",
        metavar="T",
        type=float,
        help="more than 3 samples only where a pixel's error is estimated to be above T, in linear radiance: "
        "--samples 16 --adaptive 0.01 (default: all samples everywhere)",
    )
    _add_backend(parser)


def _view_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.interaction import CONTROLS, DEFAULT_SAMPLES

    _add_scene(parser)
    _add_settings(parser, samples=DEFAULT_SAMPLES)
    parser.add_argument(
        "--budget",
        metavar="MS",
        type=float,
        default=33.0,
        help="milliseconds that a moving picture's sample may take; above, its pixels are enlarged (default: 33)",
    )
    width = max(len(control.key) for control in CONTROLS)
    controls = "".join(f"  {control.key:{width}}  {control.does}\n" for control in CONTROLS)
    parser.epilog = f"mouse and keys:\n{controls}\n{parser.epilog}"


def _extremes_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o",
        "--output",
        metavar="FOLDER",
        default=".",
        help="gets extremes.csv and extremes.md, over those that are there (default: here)",
    )
    parser.add_argument("--short", action="store_true", help="only the ends of the ranges, as in the tests")
    parser.add_argument(
        "--fuzz", metavar="N", type=_whole, default=1000, help="random scenes over all ranges together (default: 1000)"
    )
    _add_backend(parser)


def _brdf_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.brdf_cli import add_commands

    add_commands(parser)


def _reference_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.compare_cli import reference_arguments

    reference_arguments(parser)


def _compare_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.compare_cli import compare_arguments

    compare_arguments(parser)


def _trade_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.trade_cli import trade_arguments

    trade_arguments(parser)


def _tune_arguments(parser: argparse.ArgumentParser) -> None:
    from raytracer.trade_cli import tune_arguments

    tune_arguments(parser)


def _doctor_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def _add_scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", help="a TOML scene file, or the name of an example: assignment")


def _add_backend(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="how OpenGL is reached: auto, egl, window or osmesa (default: the variable RAYTRACER_BACKEND, or auto)",
    )


def _add_settings(parser: argparse.ArgumentParser, samples: int) -> None:
    parser.add_argument("--size", metavar="WxH", type=_size, default=(1280, 720), help="in pixels (default: 1280x720)")
    parser.add_argument(
        "--samples", metavar="N", type=_whole, default=samples, help=f"rays a pixel (default: {samples})"
    )
    parser.add_argument(
        "--shading",
        metavar="MODEL",
        choices=get_args(Shading),
        help="a model for all materials, as like theirs as it can be (default: each one's own): "
        + ", ".join(get_args(Shading)),
    )
    parser.add_argument("--shadows", choices=get_args(Shadows), default="hard", help="default: hard")
    parser.add_argument(
        "--evaluator",
        choices=get_args(Evaluator),
        default="cells",
        help="how CSG is evaluated: cells (the default: only what a cell of the picture can see), walk (all of it "
        "everywhere) or roth (the assignment's hit lists)",
    )
    parser.add_argument(
        "--precision",
        choices=get_args(Precision),
        type=int,
        default=32,
        help="bits of the numbers in which rays meet surfaces (default: 32; 64 needs OpenGL 4.0)",
    )
    parser.add_argument(
        "--bounces",
        metavar="N",
        type=_whole,
        default=8,
        help="mirrors in a row that light is followed through (default: 8)",
    )


def _settings(options: argparse.Namespace, adaptive: float | None = None) -> Settings:
    return Settings(
        samples=options.samples,
        adaptive=adaptive,
        shading=options.shading,
        shadows=options.shadows,
        evaluator=options.evaluator,
        precision=options.precision,
        bounces=options.bounces,
    )


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"([0-9]+)x([0-9]+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT in pixels, such as 1280x720, got {text!r}")
    return _whole(match[1]), _whole(match[2])


def _whole(text: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"expected a whole number that is not negative, got {text!r}")
    return int(text.lstrip("0")[:9] or "0")  # more digits are too many in any case


def _render(options: argparse.Namespace) -> int:
    # What is wrong is found as early as it can be: most of it before NumPy and OpenGL are loaded.
    settings = _settings(options, options.adaptive)
    scene = load(options.scene)

    # Next to nothing of what an import makes is garbage: it is not looked for, now or when all ends.
    gc.disable()
    from raytracer.film import check_output
    from raytracer.limits import check_size, host_memory
    from raytracer.renderer import shared_renderer

    gc.freeze()
    gc.enable()

    check_size(options.size)
    output = check_output(options.output)
    geometry = output.suffix.lower() == ".npz"
    _check_memory(host_memory(options.size, geometry, settings.adaptive is not None), options.size)
    if warning := precision_warning(scene, settings):
        warnings.warn(f"{options.scene}: {warning}", stacklevel=1)
    renderer = shared_renderer(options.backend)
    start = time.monotonic()
    with _named(options.scene), progress_bar(f"rendering {output.name}") as progress:
        image = renderer.render(scene, options.size, settings, geometry=geometry, progress=progress, only=True)
    image.save(output)
    width, height = options.size
    samples = f"{settings.samples} sample{'s' if settings.samples > 1 else ''} a pixel"
    if image.samples is not None and (fewest := image.samples.min()) < settings.samples:
        samples = f"{fewest} to {samples}, {image.samples.mean():.2f} on average"
    print(f"wrote {output}: {width}x{height}, {samples}, {time.monotonic() - start:.1f} s")
    return 0


def _view(options: argparse.Namespace) -> int:
    settings = _settings(options)
    budget = number(options.budget, "--budget", 0.001, 1e6, "milliseconds in [0.001, 1e6]") / 1000.0

    from raytracer.limits import check_size
    from raytracer.viewer import view

    check_size(options.size)
    with suppress(KeyboardInterrupt):  # one of the ways to close the window
        view(options.scene, settings, options.size, budget)
    return 0


@contextmanager
def _named(scene: str) -> Iterator[None]:
    """Errors in the block are the scene's, such as being beyond the driver's limits: they name its file."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{scene}: {error}") from None


def _check_memory(needed: int, size: tuple[int, int]) -> None:
    gib = needed / 2**30
    try:
        physical = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not on this system
        physical = needed
    if needed > physical:
        raise InputError(
            f"--size: expected a picture that fits into this machine's {physical / 2**30:.1f} GiB of memory, "
            f"got {size[0]}x{size[1]}, which needs {gib:.1f} GiB"
        )
    if needed > _MEMORY_WORTH_MENTION:
        print(f"raytracer: this picture needs {gib:.1f} GiB of memory", file=sys.stderr)


def _extremes(options: argparse.Namespace) -> int:
    from raytracer.extremes.report import report
    from raytracer.film import check_folder
    from raytracer.renderer import shared_renderer

    folder = Path(options.output)
    check_folder(folder)
    with progress_bar("measuring") as progress:
        kept = report(shared_renderer(options.backend), folder, options.short, options.fuzz, progress)
    return 0 if kept else 1


def _doctor(options: argparse.Namespace) -> int:
    from raytracer.doctor import examine, print_report

    reports = examine()
    print_report(reports, as_json=options.json)
    return 0 if any(report.opens for report in reports) else 1
