"""Tables of the models and of their verifications: on the terminal, as JSON, and as Markdown for docs/models.md."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from raytracer.analysis.reflectance.expectations import EXPECTATIONS, NOT_RECIPROCAL
from raytracer.analysis.reflectance.properties import RECIPROCAL, RECIPROCAL_TABLE, RESOLVED, MaterialProperties
from raytracer.analysis.reflectance.tried_parameters import Parameters
from raytracer.analysis.reflectance.verification import Verification
from raytracer.core.terminal import print_lines, print_table, table_cell
from raytracer.scene.materials.models import AMBIENT_SHARE, MODELS, Parameter

_HEADING = ("model", "settings", "reciprocal", "conserving", "largest albedo", "furnace", "(vi)", "outcome")
_ANSWERS = {True: "yes", False: "no", None: "?"}


def print_checks(checks: Sequence[Verification]) -> None:
    """Print a table of all verifications, and each difference in words. For a single one, print its albedos, too."""
    from rich.table import Table

    table = Table(*_HEADING)
    for check in checks:
        table.add_row(*map(table_cell, _row(check)))
    print_table(table)
    if len(checks) == 1:
        _print_albedos(checks[0].properties)
    share = f"{RECIPROCAL:g} (in a measured table {RECIPROCAL_TABLE:g}), which is rounding"
    print_lines(f"reciprocal: the relative difference of f(wi, wo) and f(wo, wi) is at most {share}")
    print_lines(
        f"largest albedo: over 0 to 89.9 degrees; ?: not resolved to {RESOLVED:g}; *: includes an ideal reflection"
    )
    print_lines("furnace, (vi): difference from 1 of the weak white furnace test, and of the area of visible facets")
    for check in checks:
        for differs in check.differences:
            print_lines(f"{check.name} {parameters_text(check.parameters)}: {differs}".replace("  ", " "))
    wrong = sum(bool(check.differences) for check in checks)
    without = sum(check.expectation is None for check in checks)
    partly = sum(check.expectation is not None and check.expectation.conserving is None for check in checks)
    parts = [f"{len(checks)} measured, {f'{wrong} not' if wrong else 'all'} as expected"]
    parts += [f"{without} without an expectation"] if without else []
    parts += [f"{partly} without an expectation about energy"] if partly else []
    print_lines("; ".join(parts))


def _row(check: Verification) -> list[str]:
    properties = check.properties
    largest = properties.largest
    mark = "" if largest.resolved else "?"
    facets = [f"{properties.facets.furnace:.0e}", f"{properties.facets.normals:.0e}"] if properties.facets else ["", ""]
    return [
        check.name,
        parameters_text(check.parameters) or "-",
        "yes" if properties.reciprocal else f"no: {properties.reciprocity:.2g}",
        _ANSWERS[properties.conserving],
        f"{largest.value:.4g}{mark} at {largest.degrees:.4g}{'*' if properties.delta else ''}",
        *facets,
        _outcome(check),
    ]


def _outcome(check: Verification) -> str:
    if check.differences:
        return "DIFFERS"
    if check.expectation is None:
        return "-"
    return "as expected" if check.expectation.conserving is not None else "reciprocal as expected"


def _print_albedos(properties: MaterialProperties) -> None:
    from rich.table import Table

    same = properties.beams == properties.albedos
    table = Table("degrees", "albedo", "+-", *(() if same else ("of a beam", "+-")))
    for seen, beam in zip(properties.albedos, properties.beams, strict=True):
        pairs = (seen,) if same else (seen, beam)
        cells = [text for a in pairs for text in (f"{a.value:.5f}{'' if a.resolved else '?'}", f"{a.error:.0e}")]
        table.add_row(f"{seen.degrees:.4g}", *cells)
    print_table(table)
    if not same:
        print_lines("Not reciprocal: the albedo under equal light from everywhere differs from the albedo of a beam.")


def parameters_text(parameters: Parameters) -> str:
    """Format parameters in the form of `--set`."""
    return " ".join(f"{name}={_value_text(value)}" for name, value in parameters.items())


def _value_text(value: Any) -> str:
    if isinstance(value, float | int):
        return f"{value:g}"
    if isinstance(value, str):
        return value
    if all(isinstance(part, float | int) for part in value):
        return ",".join(f"{part:g}" for part in value) or "[]"
    return "[...]"  # lobes


def checks_json(checks: Sequence[Verification]) -> str:
    """Return all measurements as JSON. Numbers that are not finite are null."""
    return _json({"checks": [_check_json(check) for check in checks]})


def _check_json(check: Verification) -> dict[str, Any]:
    properties, expectation = check.properties, check.expectation
    return {
        "name": check.name,
        "model": properties.material.model,
        "settings": dict(check.parameters),
        "finite": properties.finite,
        "least": properties.least,
        "reciprocity": properties.reciprocity,
        "reciprocal": properties.reciprocal,
        "conserving": properties.conserving,
        "largest": _albedo_json(properties.largest),
        "albedo": [_albedo_json(a) for a in properties.albedos],
        "beam": [_albedo_json(a) for a in properties.beams],
        "delta": properties.delta,
        "facets": properties.facets
        and {name: getattr(properties.facets, name) for name in ("furnace", "normals", "error")},
        "expected": expectation
        and {"reciprocal": expectation.reciprocal, "conserving": expectation.conserving, "why": expectation.why},
        "differs": check.differences,
    }


def _albedo_json(albedo: Any) -> dict[str, Any]:
    return {
        "degrees": albedo.degrees,
        "value": albedo.value,
        "error": albedo.error,
        "resolved": albedo.resolved,
    }


def _json(value: Any) -> str:
    def plain(x: Any) -> Any:
        if isinstance(x, float):
            return x if math.isfinite(x) else None
        if isinstance(x, Mapping):
            return {k: plain(v) for k, v in x.items()}
        return [plain(v) for v in x] if isinstance(x, list | tuple) else x

    return json.dumps(plain(value), indent=1, allow_nan=False)


def describe_properties(checks: Sequence[Verification]) -> dict[str, str]:
    """Describe whether a model is reciprocal and conserves energy, and for which part of its range."""
    return {name: _describe_over_range(checks, name) for name in ("reciprocal", "conserving")}


def _describe_over_range(checks: Sequence[Verification], name: str) -> str:
    by_answer = {answer: [c for c in checks if getattr(c.properties, name) is answer] for answer in (True, False, None)}
    yes, no, open_ = by_answer.values()

    def where(some: Sequence[Verification]) -> str:
        named = ", ".join(parameters_text(c.parameters) or "defaults" for c in some[:4])
        return f"{len(some)} of {len(checks)} settings ({named}{', ...' if len(some) > 4 else ''})"

    unresolved = f"not resolved in {where(open_)}" if open_ else ""
    if not no:
        return f"yes, but {unresolved}" if yes and open_ else unresolved or "yes"
    answer = f"no, in {where(no)}" if yes or open_ else "no"
    return f"{answer}; {unresolved}" if open_ else answer


def print_models(models: Sequence[str], measured: Mapping[str, Sequence[Verification]]) -> None:
    """Print each model's name and source, its measured properties, and a table of its parameters."""
    from rich.table import Table

    for name in models:
        model = MODELS[name]
        print_lines("", f"{name}: {model.about} ({model.source})")
        if checks := measured.get(name):
            answers = describe_properties(checks)
            print_lines(f"reciprocal: {answers['reciprocal']}; conserving: {answers['conserving']}")
        else:
            print_lines("not measured: the model needs a file")
        table = Table("name", "kind", "range", "default", "unit", "meaning", "source")
        for parameter in model.parameters.values():
            table.add_row(*map(table_cell, _parameter_row(parameter)))
        print_table(table)


def models_json(models: Sequence[str], measured: Mapping[str, Sequence[Verification]]) -> str:
    """Return the data of print_models() as JSON."""
    return _json(
        {
            name: {
                "about": MODELS[name].about,
                "source": MODELS[name].source,
                "parameters": [
                    dict(zip(_COLUMNS, _parameter_row(p), strict=True)) for p in MODELS[name].parameters.values()
                ],
                "measured": [_check_json(check) for check in measured.get(name, ())],
            }
            for name in models
        }
    )


_COLUMNS = ("name", "kind", "range", "default", "unit", "meaning", "source")


def _parameter_row(p: Parameter) -> list[str]:
    ranges = {
        "choice": ", ".join(p.choices),
        "lobes": "at most 16 of { cx, cy, cz, n, scale }",
        "measured": "a file",
        "direction": "not 0",
    }
    share = f"{AMBIENT_SHARE:g} {p.diffuse}" if p.diffuse else ""
    default = {"lobes": "one, of Phong's kind", "measured": "none"}.get(p.kind) or share or _default_text(p.default)
    only = f", only with {p.when[0]} = {p.when[1]}" if p.when else ""
    return [
        p.name,
        p.kind,
        ranges.get(p.kind, f"{p.low:g} to {p.high:g}"),
        default,
        p.unit,
        p.meaning + only,
        p.source,
    ]


def _default_text(value: Any) -> str:
    if isinstance(value, tuple) and len(set(value)) == 1:
        value = value[0]
    return _value_text(value)


def models_markdown() -> str:
    """Return the text of docs/models.md: the models with their parameters and expectations."""
    ambient, emission = map(_parameter_row, (MODELS["phong"].parameters[name] for name in ("ka", "le")))
    ambient[_COLUMNS.index("default")] += " (phong, blinn), 0 (others)"
    lines = [
        "# Reflectance models",
        "",
        "Written by `raytracer brdf list --markdown` from `raytracer/scene/materials/models.py` and",
        "`raytracer/analysis/reflectance/expectations.py`.",
        "",
        "The GLSL of a model is `shaders/brdf/MODEL.glsl`; in float64, `raytracer/ground_truth/reflectance.py`. A",
        "colour is three numbers, linear RGB, or one for all three. Every model also has `ka` and `le`, listed once",
        "here. The default `ka` is 0.15/0.8 of `kd` in `phong` and `blinn`, and 0 in all other models.",
        "",
        "Each row states, with the reason, whether a model is *reciprocal* and *conserving* (never reflects more light",
        "than it receives), for the parameters in the first column and the defaults of all others. If several rows",
        "match, the last one applies. A *law* holds for any values of the other parameters. Models other than",
        f"{', '.join(NOT_RECIPROCAL)} are always reciprocal. `raytracer brdf check` measures all rows with the GLSL.",
        "",
        "[References](reflectance.md#references) has the titles of the papers, of the article and of the cheat sheet.",
        "",
        *_parameter_lines([ambient, emission]),
    ]
    for name, model in MODELS.items():
        lines += ["", f"## {name}", "", f"{model.about[0].upper()}{model.about[1:]} ({model.source}).", ""]
        lines += _parameter_lines([_parameter_row(p) for p in model.parameters.values() if p.name not in ("ka", "le")])
        if rows := [expectation for expectation in EXPECTATIONS if expectation.model == name]:
            cells = [
                ["where", "law", "reciprocal", "conserving", "largest albedo", "why"],
                ["---"] * 6,
                *(
                    [
                        _condition_text(row.when),
                        "law" if row.law else "",
                        _ANSWERS[row.reciprocal],
                        _ANSWERS[row.conserving],
                        f"{row.largest[0]:.4g}" + (f" at {row.at:g}°" if row.at is not None else "")
                        if row.largest
                        else "",
                        row.why,
                    ]
                    for row in rows
                ),
            ]
            lines += ["", *_markdown_rows(cells)]
    return "\n".join(lines) + "\n"


def _condition_text(when: Parameters) -> str:
    def text(name: str, value: Any) -> str:
        return (
            f"{name} {value[0]:g} to {value[1]:g}"
            if isinstance(value, tuple) and value
            else f"{name} = {_value_text(value)}"
        )

    return ", ".join(text(*item) for item in when.items()) or "otherwise"


def _parameter_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    return _markdown_rows([_COLUMNS, ["---"] * len(_COLUMNS), *([f"`{row[0]}`", *row[1:]] for row in rows)])


def _markdown_rows(rows: Sequence[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
