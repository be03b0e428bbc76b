"""Parser of the materials that users pass to `raytracer brdf`: MODEL:NAME=VALUE, and NAME=VALUE after --set."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from raytracer.core.suggest import did_you_mean
from raytracer.core.validation import InputError
from raytracer.formats.toml_text import parse_toml
from raytracer.scene.materials.models import MODELS, Parameter

if TYPE_CHECKING:
    from raytracer.scene.materials.material import Material

# The most characters of an argument that an error message shows.
_SHOWN = 80


def labelled_materials(texts: Sequence[str], common: Sequence[str]) -> list[tuple[str, Material]]:
    """Parse materials, and return each with its text as a label. Raises InputError.

    Args:
        texts: each MODEL[:NAME=VALUE...]
        common: NAME=VALUE, for all models that have the parameter NAME
    """
    from raytracer.analysis.reflectance.verification import make_material

    parts = [text.split(":") for text in texts]
    known = [_parameters(name) for name, *_ in parts]
    for item in common:
        key = _parse_name(item, "--set ")
        if not any(key in parameters for parameters in known):
            raise InputError(f"no material has a parameter {_short(key)}", file=_short(f"--set {item}"))
    materials = []
    for text, (name, *own), parameters in zip(texts, parts, known, strict=True):
        shared = parse_parameters(name, [item for item in common if _parse_name(item, "--set ") in parameters])
        parameters_set = {**shared, **parse_parameters(name, own, f"{name}:")}
        try:
            materials.append((text, make_material(name, parameters_set)))
        except InputError as error:
            raise error.at(_short(text)) from None
    return materials


def model_parameters(name: str) -> dict[str, Parameter]:
    """Return the parameters of a model by name. Raises InputError for an unknown model."""
    if name not in MODELS:
        raise InputError(f"expected one of {', '.join(MODELS)}{did_you_mean(name, MODELS)}", file=name)
    return MODELS[name].parameters


def _parameters(name: str) -> dict[str, Parameter]:
    """Return the parameters of a model, or of a published material's model, by name."""
    if "/" in name:
        from raytracer.formats.material_library import MaterialLibrary

        name = MaterialLibrary().material(name).model
    return model_parameters(name)


def parse_parameters(name: str, items: Sequence[str], prefix: str = "--set ") -> dict[str, Any]:
    """Parse the parameters of a material. Raises InputError.

    Args:
        name: a model or a published material; its table of parameters defines the types of the values
        items: each NAME=VALUE
        prefix: the text before NAME=VALUE on the command line, for error messages
    """
    known = _parameters(name)
    parsed = {}
    for item in items:
        key = _parse_name(item, prefix)
        if key not in known:
            near = did_you_mean(key, known)
            raise InputError(
                f"{name} has no parameter {_short(key)} (known: {', '.join(known)}){near}", file=_short(prefix + item)
            )
        parsed[key] = _value(known[key], item.partition("=")[2], prefix + item)
    return parsed


def _parse_name(item: str, prefix: str) -> str:
    name, equals, _ = item.partition("=")
    if not equals:
        raise InputError("expected NAME=VALUE, such as alpha=0.1", file=_short(prefix + item))
    return name


def _value(parameter: Parameter, text: str, argument: str) -> Any:
    parse: dict[str, tuple[Callable[[str], Any], str]] = {
        "number": (float, "a number"),
        "whole": (float, "a whole number"),
        "color": (_numbers, "a number, or three with commas between: 1,0.8,0.3"),
        "direction": (_numbers, "three numbers with commas between: 1,0,0"),
        "lobes": (
            lambda text: parse_toml(f"x = {text}")["x"],
            "lobes as in a scene file: [{ cx = -1, cz = 1, n = 20 }]",
        ),
    }
    if parameter.kind not in parse:
        return text
    convert, expected = parse[parameter.kind]
    try:
        return convert(text)
    except ValueError:  # InputError is a ValueError
        raise InputError(f"expected {expected}", file=_short(argument)) from None


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _numbers(text: str) -> Any:
    parts = [float(part) for part in text.split(",")]
    return parts[0] if len(parts) == 1 else parts
