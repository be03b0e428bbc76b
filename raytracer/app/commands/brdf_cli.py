"""`raytracer brdf`: list, check, plot, gallery, bake. Exit status as in `cli.py`; of check 1 if a verdict differs."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from raytracer.app.options import add_backend
from raytracer.core.progress import progress_bar
from raytracer.core.suggest import did_you_mean
from raytracer.core.terminal import say, say_json
from raytracer.core.validation import InputError
from raytracer.formats.toml_tables import toml
from raytracer.scene.materials.models import MODELS, Parameter

if TYPE_CHECKING:
    from raytracer.scene.materials.material import Material

# Characters of what was given that an error shows.
_SHOWN = 80


def add_commands(parser: argparse.ArgumentParser) -> None:
    """The commands, each of which sets `run`."""
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, summary, arguments, run in (
        ("list", "the models, their parameters, and what is measured of them", _list_arguments, _list),
        ("check", "measure: reciprocal? energy-conserving? and compare with what is known", _check_arguments, _check),
        ("plot", "polar lobes, albedo and a lit sphere of materials, side by side", _plot_arguments, _plot),
        ("gallery", "every model on the same scene", _gallery_arguments, _gallery),
        ("bake", "write the table of an isotropic material in MERL's format", _bake_arguments, _bake),
    ):
        options: dict[str, Any] = {"arguments": arguments, "help": summary}
        command = commands.add_parser(name, description=f"{summary[0].upper()}{summary[1:]}.", **options)
        command.set_defaults(run=run)


def _list_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("models", metavar="MODEL", nargs="*", help="default: all")
    forms = parser.add_mutually_exclusive_group()
    forms.add_argument("--json", action="store_true", help="print JSON instead of tables")
    forms.add_argument("--markdown", action="store_true", help="print docs/models.md; nothing is measured")
    forms.add_argument("--schema", action="store_true", help="print the JSON Schema of a scene file's materials")
    add_backend(parser)


def _check_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "models",
        metavar="MODEL",
        nargs="*",
        help="a model, or a published material such as lafortune/clay (default: all models but merl, which needs --set "
        "file=...). Without --set, a model is measured with its defaults, at both ends of the range of each parameter, "
        "and with some combinations",
    )
    _add_set(parser)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    add_backend(parser)


def _plot_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "materials",
        metavar="MATERIAL",
        nargs="*",
        help="a model or published material, and what is set only for it: ggx:alpha=0.1:f0=1,0.8,0.3",
    )
    _add_set(parser)
    parser.add_argument("--lecture", action="store_true", help="instead: how far apart (R.V)^h and (N.H)^4h are")
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=".png")
    add_backend(parser)


def _gallery_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=".png")
    parser.add_argument("--cell", metavar="N", type=int, default=176, help="pixels of a picture's side (default: 176)")
    parser.add_argument("--samples", metavar="N", type=int, default=16, help="rays a pixel (default: 16)")
    parser.add_argument("--merl", metavar="FILE", help="a measured material besides")
    add_backend(parser)


def _bake_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("material", metavar="MATERIAL", help="a model or published material, as for plot")
    _add_set(parser)
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help=".binary (35 MB)")
    add_backend(parser)


def _add_set(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a parameter, such as alpha=0.1 or f0=1,0.8,0.3; may be given again. See raytracer brdf list MODEL",
    )


def _list(options: argparse.Namespace) -> int:
    models = _models(options.models)
    if options.models and (options.markdown or options.schema):
        raise InputError("--markdown and --schema are of all models: expected no MODEL", file=options.models[0])
    if options.schema:
        import json

        from raytracer.formats.material_schema import materials_schema

        say_json(json.dumps(materials_schema(), indent=1))
        return 0
    from raytracer.analysis.reflectance import report
    from raytracer.analysis.reflectance.measure import COMPLETE
    from raytracer.analysis.reflectance.verification import check_all
    from raytracer.gpu.device import shared_device

    if options.markdown:
        say(*report.markdown().splitlines())
        return 0
    with progress_bar("measuring") as progress:
        checks = check_all(
            [m for m in models if m in COMPLETE], shared_device(options.backend, options.device), progress
        )
    measured = {model: [check for check in checks if check.name == model] for model in models}
    if options.json:
        say_json(report.models_json(models, measured))
    else:
        report.print_models(models, measured)
    return 0


def _check(options: argparse.Namespace) -> int:
    from raytracer.analysis.reflectance.measure import COMPLETE
    from raytracer.analysis.reflectance.report import checks_json, print_checks
    from raytracer.analysis.reflectance.verification import check, check_all, material_of
    from raytracer.gpu.device import shared_device

    names = options.models or COMPLETE
    whole = [name for name in names if name in MODELS and not options.set]
    single = [(name, settings_of(name, options.set)) for name in names if name not in whole]
    for name, settings in single:
        material_of(name, settings)
    if missing := [name for name in whole if name not in COMPLETE]:
        raise InputError("expected a file to measure: --set file=...", file=missing[0])
    device = shared_device(options.backend, options.device)
    with progress_bar("measuring") as progress:
        checks = check_all(whole, device, progress)
        checks += [check(name, settings, device) for name, settings in single]
    if options.json:
        say_json(checks_json(checks))
    else:
        print_checks(checks)
    return 1 if any(each.differs for each in checks) else 0


def _plot(options: argparse.Namespace) -> int:
    from raytracer.analysis.reflectance.plots import plot_lecture, plot_materials
    from raytracer.core.output import check_output
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    output = check_output(options.output, (".png",))
    if options.lecture == bool(options.materials):
        raise InputError("expected materials to plot, or --lecture (see raytracer brdf plot --help)", "MATERIAL")
    if options.lecture:
        plot_lecture(output, _number_of(options.set, "h"), shared_device(options.backend, options.device))
    else:
        materials = _labelled(options.materials, options.set)
        with progress_bar(f"plotting {output.name}") as progress:
            renderer = Renderer(shared_device(options.backend, options.device))
            plot_materials(output, materials, renderer, progress)
    say(f"wrote {output}")
    return 0


def _gallery(options: argparse.Namespace) -> int:
    from raytracer.analysis.reflectance.gallery import write_gallery
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    with progress_bar("rendering") as progress:
        write_gallery(
            options.output,
            options.cell,
            options.samples,
            options.merl,
            Renderer(shared_device(options.backend, options.device)),
            progress,
        )
    say(f"wrote {options.output}" + ("" if options.merl else ", without merl, which needs --merl FILE"))
    return 0


def _bake(options: argparse.Namespace) -> int:
    from raytracer.core.output import check_output, written_whole
    from raytracer.gpu.device import shared_device
    from raytracer.rendering import brdf
    from raytracer.scene.materials import merl

    output = check_output(options.output, (".binary",))
    [(_, material)] = _labelled([options.material], options.set)
    table = brdf.bake(material, device=shared_device(options.backend, options.device))
    with written_whole(output) as file:
        merl.write(table, file)
    say(f"wrote {output}: {options.material}, for a material of the model merl")
    return 0


def _models(names: Sequence[str]) -> list[str]:
    for name in names:
        _known(name, name)
    return list(names) or [*MODELS]


def _known(name: str, shown: str) -> dict[str, Parameter]:
    if name not in MODELS:
        raise InputError(f"expected one of {', '.join(MODELS)}{did_you_mean(name, MODELS)}", file=shown)
    return MODELS[name].parameters


def _labelled(texts: Sequence[str], common: Sequence[str]) -> list[tuple[str, Material]]:
    """Labels and materials, of MODEL[:NAME=VALUE...] and what is set for all that have it."""
    from raytracer.analysis.reflectance.verification import material_of

    parts = [text.split(":") for text in texts]
    known = [_parameters(name) for name, *_ in parts]
    for item in common:
        key = _name_of(item, "--set ")
        if not any(key in parameters for parameters in known):
            raise InputError(f"none of the materials has a parameter {_short(key)}", file=_short(f"--set {item}"))
    found = []
    for text, (name, *own), parameters in zip(texts, parts, known, strict=True):
        shared = settings_of(name, [item for item in common if _name_of(item, "--set ") in parameters])
        settings = {**shared, **settings_of(name, own, f"{name}:")}
        try:
            found.append((text, material_of(name, settings)))
        except InputError as error:
            raise error.at(_short(text)) from None
    return found


def _parameters(name: str) -> dict[str, Parameter]:
    """What a model, or that of a published material, takes."""
    if "/" in name:
        from raytracer.formats.material_library import material_named

        name = material_named(name).model
    return _known(name, name)


def settings_of(name: str, items: Sequence[str], prefix: str = "--set ") -> dict[str, Any]:
    """The settings of a model, or of a published material, in NAME=VALUE texts: as the table types them.

    `prefix` is what is before such a text on the command line.
    """
    known = _parameters(name)
    found = {}
    for item in items:
        key = _name_of(item, prefix)
        if key not in known:
            near = did_you_mean(key, known)
            raise InputError(
                f"{name} has no parameter {_short(key)} (known: {', '.join(known)}){near}", file=_short(prefix + item)
            )
        found[key] = _value(known[key], item.partition("=")[2], prefix + item)
    return found


def _name_of(item: str, prefix: str) -> str:
    name, equals, _ = item.partition("=")
    if not equals:
        raise InputError("expected NAME=VALUE, such as alpha=0.1", file=_short(prefix + item))
    return name


def _value(parameter: Parameter, text: str, given: str) -> Any:
    parse: dict[str, tuple[Callable[[str], Any], str]] = {
        "number": (float, "a number"),
        "whole": (float, "a whole number"),
        "color": (_numbers, "a number, or three with commas between: 1,0.8,0.3"),
        "direction": (_numbers, "three numbers with commas between: 1,0,0"),
        "lobes": (
            lambda text: toml(f"x = {text}")["x"],
            "lobes as in a scene file: [{ cx = -1, cz = 1, n = 20 }]",
        ),
    }
    if parameter.kind not in parse:
        return text
    convert, expected = parse[parameter.kind]
    try:
        return convert(text)
    except ValueError:  # InputError is one
        raise InputError(f"expected {expected}", file=_short(given)) from None


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def _numbers(text: str) -> Any:
    parts = [float(part) for part in text.split(",")]
    return parts[0] if len(parts) == 1 else parts


def _number_of(items: Sequence[str], name: str) -> float | None:
    """The only parameter that may be set here."""
    found = settings_of("phong", items)
    if other := [key for key in found if key != name]:
        raise InputError(f"expected only {name}", file=f"--set {other[0]}")
    return found.get(name)
