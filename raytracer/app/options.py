"""What several commands take on the command line: a scene, settings, a size, a backend."""

from __future__ import annotations

import argparse
import re
import warnings
from functools import partial
from typing import Any, get_args

from raytracer.scene.materials.models import MODELS
from raytracer.scene.presets import OWN, QUALITIES, Fields, flags
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES, Sequence
from raytracer.scene.settings import ASKED_SAMPLES, Evaluator, Precision, Settings, Shading, Shadows, scene_warnings

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


def add_own(parser: argparse.ArgumentParser, *names: str) -> None:
    """Those of presets.OWN that are named: what given() looks for. Nothing is stored that is not given."""
    options: dict[str, dict[str, Any]] = {
        "shading": {
            "metavar": "MODEL",
            "choices": ("none", *get_args(Shading)),
            "type": _model,
            "help": "a model for all materials, as like theirs as it can be (default: none, each one's own): "
            + ", ".join(get_args(Shading)),
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
    parser: argparse.ArgumentParser, samples: int, sequences: tuple[Sequence, ...] = SEQUENCES, *, adaptive: bool
) -> None:
    """--size, --quality and all of Settings, of which `adaptive` may be left out: what given() looks for.

    `samples` is the default, which is only told: nothing is stored that is not given, as a scene file may give it.
    """
    add = partial(parser.add_argument, default=argparse.SUPPRESS)
    limited = "--max-error, --time or --adaptive" if adaptive else "--max-error or --time"
    add_size(parser)
    add(
        "--quality",
        choices=tuple(QUALITIES),
        help="settings by a name, " + "; ".join(f"{name}: {flags(fields)}" for name, fields in QUALITIES.items()),
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
        help="samples until the picture's root mean square error is estimated to be below E, in linear radiance: "
        "0.002; or none",
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
    add_own(parser, *OWN)


def given(options: argparse.Namespace) -> Fields:
    """What the command line gives of that, for presets.combined()."""
    names = (*Settings.__struct_fields__, "quality", "size")
    found = {name: getattr(options, name) for name in names if hasattr(options, name)}
    return {name: None if value == "none" else value for name, value in found.items()}


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
    if text in MODELS and text not in get_args(Shading):
        table = f'model = "{text}" and file = "..."'
        raise argparse.ArgumentTypeError(f"{text} needs a table, which only a material of a scene file gives: {table}")
    return text


def _number(text: str) -> float | str:
    return text if text == "none" else float(text)


# As argparse names what it is not.
_number.__name__ = "number"
