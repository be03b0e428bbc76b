"""The command-line arguments that several commands share: scene, settings, size and OpenGL backend."""

from __future__ import annotations

import argparse
import re
import warnings
from functools import partial
from typing import Any, get_args

from msgspec import UNSET

from raytracer.core.validation import InputError
from raytracer.formats.scene_file import examples
from raytracer.scene.materials.models import SHADINGS
from raytracer.scene.options import (
    DEFAULT_SAMPLE_LIMIT,
    MAX_BOUNCES,
    MAX_SAMPLES,
    CompileOptions,
    Evaluator,
    Precision,
    Shadows,
    check_shading,
)
from raytracer.scene.scene import Scene
from raytracer.scene.sequences import SEQUENCES, SampleSequence
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import QUALITIES, SettingsPatch, flags
from raytracer.scene.warnings import scene_warnings

# Digits of a whole number; further digits are cut off. A number of 300 digits is beyond all limits, and longer than an
# error message shows; int() raises ValueError for more than 4300 digits.
_MOST_DIGITS = 300


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the argument SCENE."""
    parser.add_argument(
        "scene", metavar="SCENE", help=f"TOML scene file, or the name of an example: {', '.join(examples())}"
    )


def add_backend(parser: argparse.ArgumentParser) -> None:
    """Add --backend and --device."""
    parser.add_argument(
        "--backend",
        metavar="NAME",
        help="way to open OpenGL. egl: without a display, on a GPU or by Mesa on the CPU; window: by a hidden window, "
        "which needs a display; osmesa: by Mesa on the CPU, into memory; auto: the first of these that opens. Default: "
        "the environment variable RAYTRACER_BACKEND, else auto.",
    )
    parser.add_argument(
        "--device",
        metavar="N|NAME",
        help="EGL device: its index, or a part of its name, as raytracer doctor lists them. Default: the environment "
        "variable RAYTRACER_DEVICE, else the first hardware device, else the first device.",
    )


def add_size(parser: argparse.ArgumentParser, default: str = "the size in the scene file, else 1280x720") -> None:
    """Add --size. `default` appears only in the help: without the option, nothing is stored."""
    parser.add_argument(
        "--size",
        metavar="WxH",
        type=picture_size,
        default=argparse.SUPPRESS,
        help=f"width and height of the picture in pixels. Default: {default}.",
    )


def add_compile_options(
    parser: argparse.ArgumentParser, names: tuple[str, ...] = CompileOptions.__struct_fields__
) -> None:
    """Add the options in `names`, for chosen_settings(). If the user omits an option, nothing is stored for it."""
    options: dict[str, dict[str, Any]] = {
        "shading": {
            "metavar": "MODEL",
            "type": _model,
            "help": "reflectance model for all materials, which are converted as closely as the model allows. "
            "Default: none, the scene's own models. Models: " + ", ".join(SHADINGS) + ".",
        },
        "shadows": {
            "choices": get_args(Shadows),
            "help": "off: no shadows; hard: an occluded light contributes nothing; diluted: the nearer the occluder, "
            "the darker; soft: penumbras of lights with a radius. Default: hard.",
        },
        "evaluator": {
            "choices": get_args(Evaluator),
            "help": "algorithm that intersects rays with CSG solids; all draw the same picture. cells: test only the "
            "objects that may be visible in a square of 16x16 pixels; walk: step along each ray through all surfaces; "
            "roth: merge sorted hit lists (S. D. Roth, 1982). Default: cells.",
        },
        "precision": {
            "choices": get_args(Precision),
            "type": int,
            "help": "floating-point bits of ray-surface intersections; 64 needs OpenGL 4.0. Default: 32.",
        },
        "bounces": {
            "metavar": "N",
            "type": parse_integer,
            "help": f"successive mirror reflections that a ray follows. Default: 8. Range: 0-{MAX_BOUNCES}.",
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
    """Add --size, --quality and an option for each field of Settings.

    If the user omits an option, nothing is stored for it, because the scene file may set it.

    Args:
        parser: the parser of a command
        samples: the default number of samples, which appears only in the help
        sequences: the choices of --sequence
        adaptive: whether to add --adaptive
    """
    add = partial(parser.add_argument, default=argparse.SUPPRESS)
    limited = "--max-error, --time or --adaptive" if adaptive else "--max-error or --time"
    add_size(parser)
    add(
        "--quality",
        choices=tuple(QUALITIES),
        help="preset of settings, which other options override: "
        + "; ".join(f"{name}: {flags(patch)}" for name, patch in QUALITIES.items()),
    )
    add(
        "--samples",
        metavar="N",
        type=parse_integer,
        help=f"samples per pixel. Default: {samples}. With {limited}: limit of samples, default: "
        f"{DEFAULT_SAMPLE_LIMIT}. Range: 1-{MAX_SAMPLES}.",
    )
    add(
        "--max-error",
        metavar="E",
        type=_number,
        help="draw samples until the estimated root mean square error (RMSE) of the picture is below E and the "
        "estimate is certain. Linear radiance, for example 0.002; none: no such limit. Default: none.",
    )
    add(
        "--time",
        metavar="S",
        type=_number,
        help="draw samples until S seconds have passed, without the compilation of shaders. For example 0.5; none: no "
        "such limit. Default: none.",
    )
    if adaptive:
        add(
            "--adaptive",
            metavar="T",
            type=_number,
            help="draw 3 samples per pixel, which meet every detail of a pixel's size, and more only near "
            "pixels whose estimated error exceeds T. Linear radiance, for example 0.01; none: all samples in every "
            "pixel. Default: none.",
        )
    add(
        "--sequence",
        choices=sequences,
        help="pattern of the samples in a pixel; only sobol supports the error estimate. Default: sobol.",
    )
    add_compile_options(parser)


def chosen_settings(options: argparse.Namespace) -> SettingsPatch:
    """Return the settings that the user set by options."""
    names = [name for name in SettingsPatch.__struct_fields__ if hasattr(options, name)]
    fields: dict[str, Any] = {name: None if (value := getattr(options, name)) == "none" else value for name in names}
    return SettingsPatch(**fields)


def chosen_size(options: argparse.Namespace) -> tuple[int, int] | None:
    """Return the size that the user set by --size, or None."""
    return getattr(options, "size", None)


def is_error_chosen(in_file: SettingsPatch, chosen: SettingsPatch) -> bool:
    """Whether the user set max_error as a number. A quality sets max_error, too, but limits the samples as well."""
    patches = (in_file, chosen) if chosen.quality is UNSET else (chosen,)
    return any(patch.max_error not in (UNSET, None) for patch in patches)


def warn_about_scene(name: str, scene: Scene, settings: Settings) -> None:
    """Warn about everything in the scene of the file `name` that probably draws another picture than intended."""
    for warning in scene_warnings(scene, settings):
        warnings.warn(f"{name}: {warning}", stacklevel=2)


def parse_integer(text: str) -> int:
    """Parse a whole number of at least 0."""
    if not (text.isascii() and text.isdigit()):
        raise argparse.ArgumentTypeError(f"expected a whole number that is not negative, got {text!r}")
    return int(text.lstrip("0")[:_MOST_DIGITS] or "0")


def picture_size(text: str) -> tuple[int, int]:
    """Parse a size such as 1280x720."""
    match = re.fullmatch(r"([0-9]+)x([0-9]+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT in pixels, such as 1280x720, got {text!r}")
    return parse_integer(match[1]), parse_integer(match[2])


def _model(text: str) -> str:
    try:
        return check_shading(text, ("none", *SHADINGS))
    except InputError as error:
        raise argparse.ArgumentTypeError(error.reason) from None


def _number(text: str) -> float | str:
    return text if text == "none" else float(text)


# argparse prints this name in "invalid number value".
_number.__name__ = "number"
