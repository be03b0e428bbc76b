"""`raytracer brdf` and its commands: list, check, plot, gallery and bake."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

from raytracer.app.commands.material_arguments import labelled_materials, model_parameters, parse_parameters
from raytracer.app.help_text import HELP, HelpFormatter, command_texts
from raytracer.app.options import add_backend
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import print_json, print_lines
from raytracer.core.validation import InputError
from raytracer.scene.materials.models import MODELS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the commands of `brdf`. Each command sets `options.run`."""
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, arguments, run in (
        ("list", _list_arguments, _list),
        ("check", _check_arguments, _check),
        ("plot", _plot_arguments, _plot),
        ("gallery", _gallery_arguments, _gallery),
        ("bake", _bake_arguments, _bake),
    ):
        description, epilog = command_texts(f"brdf {name}")
        options: dict[str, Any] = {"arguments": arguments, "help": HELP[f"brdf {name}"].summary}
        command = commands.add_parser(
            name, description=description, epilog=epilog, formatter_class=HelpFormatter, **options
        )
        command.set_defaults(run=run)


def _list_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("models", metavar="MODEL", nargs="*", help="reflectance model. Default: all models.")
    forms = parser.add_mutually_exclusive_group()
    forms.add_argument("--json", action="store_true", help="print JSON instead of tables")
    forms.add_argument("--markdown", action="store_true", help="print docs/models.md, without measurements")
    forms.add_argument("--schema", action="store_true", help="print the JSON Schema of a scene file's materials")
    add_backend(parser)


def _check_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "models",
        metavar="MODEL",
        nargs="*",
        help="reflectance model, or published material such as lafortune/clay. Default: all models except merl, which "
        "needs --set file=FILE.",
    )
    _add_set(parser)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    add_backend(parser)


def _plot_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "materials",
        metavar="MATERIAL",
        nargs="*",
        help="reflectance model or published material, optionally with parameters of its own: "
        "ggx:alpha=0.1:f0=1,0.8,0.3",
    )
    _add_set(parser)
    parser.add_argument(
        "--lecture",
        action="store_true",
        help="plot how much Phong's (R.V)^h and Blinn's (N.H)^4h differ, instead of materials; --set h=32 sets h",
    )
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="file to write: .png, .svg or .pdf")
    add_backend(parser)


def _gallery_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="file to write: .png with all pictures")
    parser.add_argument(
        "--cell",
        metavar="N",
        type=int,
        default=176,
        help="width and height of each picture in pixels. Default: 176. Range: 64-2048.",
    )
    parser.add_argument(
        "--samples", metavar="N", type=int, default=16, help="samples per pixel. Default: 16. Range: 1-65536."
    )
    parser.add_argument(
        "--merl", metavar="FILE", help="measured material of the MERL database (.binary), shown beside the models"
    )
    add_backend(parser)


def _bake_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "material",
        metavar="MATERIAL",
        help="reflectance model or published material, optionally with parameters: ggx:alpha=0.3",
    )
    _add_set(parser)
    parser.add_argument("-o", "--output", metavar="OUT", required=True, help="file to write: .binary (35 MB)")
    add_backend(parser)


def _add_set(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="parameter, such as alpha=0.1 or f0=1,0.8,0.3; repeat for more. List: raytracer brdf list MODEL.",
    )


def _list(options: argparse.Namespace) -> int:
    models = _models(options.models)
    if options.models and (options.markdown or options.schema):
        raise InputError(
            "expected no MODEL with --markdown or --schema, which print all models", file=options.models[0]
        )
    if options.schema:
        import json

        from raytracer.formats.material_schema import materials_schema

        print_json(json.dumps(materials_schema(), indent=1))
        return 0
    from raytracer.analysis.reflectance import tables
    from raytracer.analysis.reflectance.properties import COMPLETE
    from raytracer.analysis.reflectance.verification import verify_all
    from raytracer.gpu.device import shared_device

    if options.markdown:
        print_lines(*tables.models_markdown().splitlines())
        return 0
    with progress_bar("measuring") as progress:
        checks = verify_all(
            [m for m in models if m in COMPLETE], shared_device(options.backend, options.device), progress
        )
    measured = {model: [check for check in checks if check.name == model] for model in models}
    if options.json:
        print_json(tables.models_json(models, measured))
    else:
        tables.print_models(models, measured)
    return 0


def _check(options: argparse.Namespace) -> int:
    """Run `brdf check` and return the exit status: 1 if a measurement differs from the expected result."""
    from raytracer.analysis.reflectance.properties import COMPLETE
    from raytracer.analysis.reflectance.tables import checks_json, print_checks
    from raytracer.analysis.reflectance.verification import make_material, verify, verify_all
    from raytracer.gpu.device import shared_device

    names = options.models or COMPLETE
    whole = [name for name in names if name in MODELS and not options.set]
    single = [(name, parse_parameters(name, options.set)) for name in names if name not in whole]
    for name, parameters in single:
        make_material(name, parameters)
    if missing := [name for name in whole if name not in COMPLETE]:
        raise InputError("expected a file to measure: --set file=...", file=missing[0])
    device = shared_device(options.backend, options.device)
    with progress_bar("measuring") as progress:
        checks = verify_all(whole, device, progress)
        checks += [verify(name, parameters, device) for name, parameters in single]
    if options.json:
        print_json(checks_json(checks))
    else:
        print_checks(checks)
    return 1 if any(check.differences for check in checks) else 0


def _plot(options: argparse.Namespace) -> int:
    from raytracer.analysis.figures import SUFFIXES, require_matplotlib
    from raytracer.analysis.reflectance.plots import plot_lecture, plot_materials
    from raytracer.core.output import check_output
    from raytracer.gpu.device import shared_device
    from raytracer.rendering.renderer import Renderer

    output = check_output(options.output, SUFFIXES)
    require_matplotlib()
    if options.lecture == bool(options.materials):
        raise InputError("expected either materials to plot or --lecture (see raytracer brdf plot --help)", "MATERIAL")
    if options.lecture:
        h = _find_number(options.set, "h")
        plot_lecture(output, h, shared_device(options.backend, options.device), options.write)
    else:
        materials = labelled_materials(options.materials, options.set)
        with progress_bar(f"plotting {output.name}") as progress:
            renderer = Renderer(shared_device(options.backend, options.device))
            plot_materials(output, materials, renderer, progress, options.write)
    print_lines(f"wrote {output}")
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
            options.write,
        )
    print_lines(
        f"wrote {options.output}" + ("" if options.merl else ", without the model merl (add it with --merl FILE)")
    )
    return 0


def _bake(options: argparse.Namespace) -> int:
    from raytracer.core.output import check_output
    from raytracer.gpu.device import shared_device
    from raytracer.rendering import brdf
    from raytracer.scene.materials import merl

    output = check_output(options.output, (".binary",))
    [(_, material)] = labelled_materials([options.material], options.set)
    table = brdf.bake(material, device=shared_device(options.backend, options.device))
    with options.write(output) as file:
        merl.write(table, file)
    print_lines(f'wrote {output}: {options.material}, to be used with model = "merl"')
    return 0


def _models(names: Sequence[str]) -> list[str]:
    for name in names:
        model_parameters(name)
    return list(names) or [*MODELS]


def _find_number(items: Sequence[str], name: str) -> float | None:
    """Return the value of the parameter `name`, or None. Raises InputError for any other parameter."""
    parameters = parse_parameters("phong", items)
    if other := [key for key in parameters if key != name]:
        raise InputError(f"expected only {name}", file=f"--set {other[0]}")
    return parameters.get(name)
