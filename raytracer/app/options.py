"""Arguments that several commands take on the command line: a scene, settings, a size, a backend."""

from __future__ import annotations

import argparse
import re
import warnings
from functools import partial
from typing import Any, get_args

from raytracer.scene.materials.models import MODELS, SHADINGS
from raytracer.scene.options import CompileOptions, Evaluator, Precision, Shadows
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES, SampleSequence
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import ASKED_SAMPLES, QUALITIES, SettingsPatch, flags
from raytracer.scene.warnings import scene_warnings

# Of a whole number. More are too many in any case, and are more than an error shows; Python refuses some thousands.
_MOST_DIGITS = 300


def add_scene(parser: argparse.ArgumentParser) -> None:
    """SCENE."""
    parser.add_argument("scene", metavar="SCENE", help="a TOML scene file, or the name of an example: assignment")


def add_backend(parser: argparse.ArgumentParser) -> None:
    """--backend and --device."""
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="how OpenGL is reached: auto, egl, window or osmesa (default: the variable RAYTRACER_BACKEND, or auto)",
    )
    parser.add_argument(
        "--device",
        metavar="N|NAME",
        help="one of EGL's devices: its index or a part of its name, as raytracer doctor lists them (default: the "
        "variable RAYTRACER_DEVICE, or the first that is hardware, or the first)",
    )


def add_size(parser: argparse.ArgumentParser, default: str = "1280x720") -> None:
    """--size, of which `default` only tells: nothing is stored that is not given."""
    parser.add_argument(
        "--size",
        metavar="WxH",
        type=picture_size,
        default=argparse.SUPPRESS,
        help=f"in pixels (default: {default})",
    )


def add_compile_options(
    parser: argparse.ArgumentParser, names: tuple[str, ...] = CompileOptions.__struct_fields__
) -> None:
    """Add the options of these names, for chosen_settings(). Nothing is stored of an option that is not there."""
    options: dict[str, dict[str, Any]] = {
        "shading": {
            "metavar": "MODEL",
            "choices": ("none", *SHADINGS),
            "type": _model,
            "help": "a model for all materials, as like theirs as it can be (default: none, each one's own): "
            + ", ".join(SHADINGS),
        },
        "shadows": {"choices": get_args(Shadows), "help": "default: hard"},
        "evaluator": {
            "choices": get_args(Evaluator),
            "help": "how CSG is evaluated: cells (the default: only what a cell of the picture can see), walk (all of "
            "it everywhere) or roth (the assignment's hit lists)",
        },
        "precision": {
            "choices": get_args(Precision),
            "type": int,
            "help": "bits of the numbers in which rays meet surfaces (default: 32; 64 needs OpenGL 4.0)",
        },
        "bounces": {
            "metavar": "N",
            "type": whole,
            "help": "mirrors in a row that light is followed through (default: 8)",
        },
    }
    for name in names:
        parser.add_argument(f"--{name}", default=argparse.SUPPRESS, **options[name])


def add_settings(
    parser: argparse.ArgumentParser,
    samples: int,
    sequences: tuple[SampleSequence, ...] = tuple(SEQUENCES),
    *,
    adaptive: bool,
) -> None:
    """Add --size, --quality and all of Settings, without --adaptive if that is False.

    `samples` is the default, which is only told: nothing is stored of an option that is not there, as a scene file may
    give it.
    """
    add = partial(parser.add_argument, default=argparse.SUPPRESS)
    limited = "--max-error, --time or --adaptive" if adaptive else "--max-error or --time"
    add_size(parser)
    add(
        "--quality",
        choices=tuple(QUALITIES),
        help="settings by a name, " + "; ".join(f"{name}: {flags(patch)}" for name, patch in QUALITIES.items()),
    )
    add(
        "--samples",
        metavar="N",
        type=whole,
        help=f"rays a pixel (default: {samples}); with {limited} the most (default: {ASKED_SAMPLES})",
    )
    add(
        "--max-error",
        metavar="E",
        type=_number,
        help="samples until the picture's root mean square error, in linear radiance, is estimated to be below E, and "
        "the estimate is certain: 0.002; or none",
    )
    add("--time", metavar="S", type=_number, help="samples as long as S seconds last: 0.5; or none")
    if adaptive:
        add(
            "--adaptive",
            metavar="T",
            type=_number,
            help="more than 3 samples only where a pixel's error is estimated to be above T, in linear radiance: 0.01; "
            "or none (default: all samples everywhere)",
        )
    add(
        "--sequence",
        choices=sequences,
        help="where in a pixel its samples lie (default: sobol, the only one that tells the error)",
    )
    add_compile_options(parser)


def chosen_settings(options: argparse.Namespace) -> SettingsPatch:
    """The settings that the command line gives."""
    names = [name for name in SettingsPatch.__struct_fields__ if hasattr(options, name)]
    fields: dict[str, Any] = {name: None if (value := getattr(options, name)) == "none" else value for name in names}
    return SettingsPatch(**fields)


def chosen_size(options: argparse.Namespace) -> tuple[int, int] | None:
    """The size that the command line gives, or None."""
    return getattr(options, "size", None)


def warn_about(name: str, scene: Scene, settings: Settings) -> None:
    """Warn of everything in the scene of file `name` that makes its picture another one than meant."""
    for warning in scene_warnings(scene, settings):
        warnings.warn(f"{name}: {warning}", stacklevel=2)


def whole(text: str) -> int:
    """A whole number that is not negative."""
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"expected a whole number that is not negative, got {text!r}")
    return int(text.lstrip("0")[:_MOST_DIGITS] or "0")


def picture_size(text: str) -> tuple[int, int]:
    """A size such as 1280x720."""
    match = re.fullmatch(r"([0-9]+)x([0-9]+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT in pixels, such as 1280x720, got {text!r}")
    return whole(match[1]), whole(match[2])


def _model(text: str) -> str:
    if text in MODELS and text not in SHADINGS:
        table = f'model = "{text}" and file = "..."'
        raise argparse.ArgumentTypeError(f"{text} needs a table, which only a material of a scene file gives: {table}")
    return text


def _number(text: str) -> float | str:
    return text if text == "none" else float(text)


# As argparse names what it is not.
_number.__name__ = "number"
