"""Help of all commands: the purpose of a command, its exit statuses, examples, and the page to read on.

`HELP` is the table of commands. The texts of options are in `commands/NAME_cli.py` and `options.py`. Descriptions are
wrapped to the terminal's width, except for indented lines.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterable
from typing import Any, NamedTuple

from raytracer.core.suggest import install_command

_FAILED = "failed, for example because no OpenGL context opens or the disk is full"
_FAILED_WITHOUT_OPENGL = "failed, for example because the disk is full"
_INTERRUPTED = "interrupted by Ctrl-C"
_NEEDS_PLOTS = f"Needs matplotlib: {install_command('plots')} in the checkout."


class CommandHelp(NamedTuple):
    """The help of one command. Examples are without "raytracer" and the command's name."""

    summary: str  # one sentence, without a period
    examples: tuple[str, ...]
    page: str
    details: str = ""
    failure: str = ""  # exit status 1, besides the failures that every command may have
    interrupt: str = _INTERRUPTED  # exit status 130
    uses_opengl: bool = True


HELP = {
    "render": CommandHelp(
        "render a scene to a file and state the error of the picture",
        (
            "assignment -o assignment.png",
            "assignment -o soft.png --shadows soft --samples 64",
            "assignment -o exact.npz --size 320x180 --max-error 0.002",
            "assignment -o cut.exr --size 320x180 --samples 16 --transparent",
        ),
        "docs/command-line.md",
        "Options override the [settings] of the scene file. The stated error is an estimate, or a lower bound if the "
        "samples cannot tell more. With --max-error E, the exit status is 1 unless the error is known to be at most E. "
        "With --quality, the exit status is 0 even if the samples do not reach the error of the preset.",
        "--max-error was not reached (the picture is written)",
    ),
    "animate": CommandHelp(
        "render the frames of an animated scene, and write a movie",
        (
            "turntable -o turntable.mp4",
            "turntable -o turntable.webp --size 320x180 --frames 0:12",
            "turntable -o frames/%04d.npz --max-error 0.004",
        ),
        "docs/animation.md",
        "The scene file has a table [animation]. Options override the [settings] of the scene file. The frames of a "
        "movie are made in the folder OUT.frames. After Ctrl-C, the same command goes on: it draws the frames that are "
        "missing, and those that were drawn with other settings or by another driver.",
        "a frame failed (the others are made), or did not reach --max-error",
        "interrupted by Ctrl-C; the frames until then are kept",
    ),
    "view": CommandHelp(
        "show a scene in a window",
        ("assignment", "my.toml --shadows soft --samples 1024"),
        "docs/window.md",
        "The picture gains samples while nothing moves. The window redraws the picture when the scene file changes on "
        "disk. Options override the [settings] of the scene file.",
    ),
    "sweep": CommandHelp(
        "render a scene with many values of its file, and write a table of their errors",
        (
            "assignment --set lights.0.radius=0.2:1:5 -o radii --shadows soft --samples 16",
            "assignment --set settings.samples=1:256:9:log --reference 8 -o convergence",
            "materials --table values.csv -o pictures --format npz",
        ),
        "docs/sweeps.md",
        "A path names a value of the scene file, as in lights.0.position. Options override the [settings] of the scene "
        "file. A second run draws only the pictures that are missing or were made with other values or settings.",
        "the scene refuses some values (all others are drawn), --max-error was not reached",
        "interrupted by Ctrl-C; the pictures until then are kept, and the same command goes on with them",
    ),
    "extremes": CommandHelp(
        "measure the error of pictures at the ends of all value ranges",
        ("--short --fuzz 20", "--fuzz 10000"),
        "docs/accuracy.md",
        "Each error is compared with its bound. Prints a table, and writes it to extremes.md and extremes.csv.",
        "an error exceeds its bound",
    ),
    "brdf": CommandHelp(
        "measure, plot and export the reflectance models",
        (
            "list ggx",
            "check ggx --set alpha=0.1",
            "plot blinn phong_normalized ggx:alpha=0.1 -o lobes.png",
        ),
        "docs/reflectance.md",
        failure="check: a measurement differs from the expected result",
    ),
    "brdf list": CommandHelp(
        "list the reflectance models, their parameters and their measured properties",
        ("", "ggx", "--schema"),
        "docs/models.md",
        "The properties are measured with OpenGL. --markdown and --schema need no OpenGL.",
    ),
    "brdf check": CommandHelp(
        "measure whether reflectance models are reciprocal and conserve energy",
        ("ggx --set alpha=0.1", "phong blinn", "lafortune/clay"),
        "docs/reflectance.md",
        "The results are compared with the results expected by theory. Without --set, a model is measured with its "
        "default parameters, at both ends of each parameter's range, and with some combinations.",
        "a measurement differs from the expected result",
    ),
    "brdf plot": CommandHelp(
        "plot polar lobes, albedo and a lit sphere of materials, side by side",
        ("blinn phong_normalized ggx:alpha=0.1 -o lobes.png", "--lecture -o lecture.png"),
        "docs/reflectance.md",
        _NEEDS_PLOTS,
    ),
    "brdf gallery": CommandHelp(
        "render the same scene with each reflectance model",
        ("-o gallery.png", "-o small.png --cell 96 --samples 4"),
        "docs/reflectance.md",
        "Writes all pictures to one file, each with the name of its model.",
    ),
    "brdf bake": CommandHelp(
        "write an isotropic material as a table in the file format of the MERL database",
        ("ggx:alpha=0.3 -o ggx.binary", "ggx --set alpha=0.3 -o ggx.binary"),
        "docs/reflectance.md",
        'A material with model = "merl" reads the table.',
    ),
    "reference": CommandHelp(
        "trace a scene's ground truth in float64, with an error estimate for each pixel",
        ("assignment -o reference.npz", "assignment -o reference.npz --size 640x360 --shadows soft"),
        "docs/accuracy.md",
        "Slow: it uses the CPU, none of the shaders, and up to --samples rays per pixel.",
        uses_opengl=False,
    ),
    "compare": CommandHelp(
        "measure how far a picture is from a reference",
        (
            "assignment.npz reference.npz --tolerance 0.002",
            "assignment.png reference.npz -o difference.png --json",
        ),
        "docs/accuracy.md",
        failure="the root mean square error (RMSE) is above --tolerance",
        uses_opengl=False,
    ),
    "trade": CommandHelp(
        "measure the time and the error of each setting for a scene",
        ("assignment -o trade", "assignment -o trade --quick"),
        "docs/choosing.md",
        "Settings are measured alone and in useful combinations, and shown as plots in trade.html. Takes minutes. "
        + _NEEDS_PLOTS,
        interrupt="interrupted by Ctrl-C; the results until then are written",
    ),
    "tune": CommandHelp(
        "find the fastest settings for an error, or the most accurate for a time",
        ("assignment --max-error 0.002", "assignment --time 0.5 --shadows soft"),
        "docs/choosing.md",
        "Prints the settings as options and as a [settings] table for the scene file.",
        "no settings reach the target (the closest are printed)",
        "interrupted by Ctrl-C; the best settings until then are printed",
    ),
    "doctor": CommandHelp(
        "list the OpenGL contexts that open on this computer, and what to install for others",
        ("", "--json"),
        "docs/command-line.md",
        failure="no context opens",
    ),
}
EXAMPLES = (
    "raytracer render assignment -o assignment.png",
    "raytracer render assignment -o good.png --quality high",
    "raytracer view assignment",
    "raytracer reference assignment -o reference.npz",
    "raytracer tune assignment --max-error 0.002",
)


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Wraps each line of a description to the terminal's width. Indented lines stay unchanged."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        # argparse forgets the indentation of commands, and would put the summary of the longest one on the next line.
        self._action_max_length = 4 + max(len(name) for name in HELP if " " not in name)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(line if line.startswith(" ") else textwrap.fill(line, width) for line in text.splitlines())


def command_texts(name: str) -> tuple[str, str]:
    """Return the description of a command, and the text under its options."""
    command = HELP[name]
    description = f"{command.summary[0].upper()}{command.summary[1:]}. {command.details}".strip()
    examples = (f"raytracer {name} {arguments}".strip() for arguments in command.examples)
    failed = _FAILED if command.uses_opengl else _FAILED_WITHOUT_OPENGL
    failure = f"{command.failure}, or the command failed" if command.failure else failed
    return description, _epilog(examples, command.page, failure, command.interrupt)


def program_epilog() -> str:
    """Return the text under the list of commands."""
    explained = "raytracer COMMAND --help explains a command; raytracer alone prints this help, with exit status 2."
    return f"{explained}\n\n{_epilog(EXAMPLES, 'docs/command-line.md', _FAILED, _INTERRUPTED)}"


def _epilog(examples: Iterable[str], page: str, failure: str, interrupt: str) -> str:
    return "\n".join(
        [
            "exit status:",
            "  0    done",
            f"  1    {failure}",
            "  2    wrong input; nothing is written",
            f"  130  {interrupt}",
            "",
            "examples:",
            *(f"  {example}" for example in examples),
            "",
            f"Read on: {page}",
        ]
    )
