"""The report trade.html, a page that needs no other file, and the writing of the report and of its data files.

All text from a user, such as the scene's name, is escaped.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from raytracer.analysis.difference_figure import color_bar
from raytracer.analysis.figures import inline_svg, svg_text
from raytracer.analysis.tradeoffs import plots
from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.data_files import as_csv, as_json
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs
from raytracer.analysis.tradeoffs.strips import Tile, make_strips
from raytracer.analysis.tradeoffs.summaries import fit_slopes, shadow_differences
from raytracer.analysis.tradeoffs.targets import RESOLVED_FROM
from raytracer.core.output import Writer, write_atomically
from raytracer.rendering.renderer import Renderer

FILES = "trade.csv", "trade.json", "trade.html"

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
h1, h2 { line-height: 1.2 } h2 { margin-top: 2.5rem }
table { border-collapse: collapse; font-size: 13px }
td, th { border-bottom: 1px solid #ddd; padding: .15rem .6rem; text-align: left; vertical-align: top }
td.n { text-align: right; font-variant-numeric: tabular-nums } tr.front td { background: #eef6ee }
svg { max-width: 100%; height: auto } p.note { color: #555 } p.file { font-size: 13px; margin-top: 0 }
.strip { display: flex; flex-wrap: wrap; gap: .8rem } figure { margin: 0; width: 240px; font-size: 12px }
figure img { width: 240px; image-rendering: pixelated; display: block }
figure b { display: block } .wide { overflow-x: auto }
"""

# The explanation at the top: each sentence is a list entry.
_HOW = (
    "<b>Time</b> is the median of {rounds} rounds of <code>Renderer.render()</code>. It includes reading the picture "
    "back and resizing it, but not compiling shaders. It includes the picture's error estimate only if the name of the "
    "configuration says so. In each round, all configurations take turns.",
    "<b>Error</b> is the root mean square difference from the reference over all pixels and channels (RMSE), in linear "
    "radiance, where 1 is white.",
    f"Errors below {RESOLVED_FROM:g} times the reference's own error are <i>not resolved</i>. They count as equal to "
    "this limit. The limit is higher if few pixels hold most of the reference's error, because that error is then only "
    "a lower bound.",
    "<b>Samples</b> and <b>rays</b> are means per pixel of the picture. Each sample casts one camera ray, and at most "
    "one ray to each light.",
    "A configuration is on the <b>Pareto front</b> if no other one is at least as fast and at least as accurate, and "
    "better in at least one of both.",
)


def write_tables(trade: Tradeoffs, folder: Path, write: Writer = write_atomically) -> None:
    """Write trade.csv and trade.json into `folder`. Raises OSError.

    The caller writes the tables before the report, because the report renders pictures, which may fail.
    """
    table, data, _ = FILES
    _write(folder / table, as_csv(trade), write)
    _write(folder / data, as_json(trade), write)


def write_page(trade: Tradeoffs, renderer: Renderer, folder: Path, write: Writer = write_atomically) -> Path:
    """Write trade.html into `folder` and return its path. If this fails, remove an older trade.html from the folder.

    Raises InputError, OSError.
    """
    path = folder / FILES[-1]
    try:
        _write(path, as_html(trade, renderer), write)
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return path


def _write(path: Path, text: str, write: Writer) -> None:
    with write(path) as file:
        file.write(text.encode())


def as_html(trade: Tradeoffs, renderer: Renderer) -> str:
    """Return the text of the report."""
    title = f"Speed against accuracy: {trade.scene}"
    width, height = trade.size
    body = [
        f"<h1>{escape(title)}</h1>",
        "" if trade.complete else "<p><b>Interrupted: the report has the measurements up to then.</b></p>",
        f"<p>{width}x{height}. {escape('; '.join(f'{key}: {value}' for key, value in trade.machine.items()))}.</p>",
        '<ul class="note">',
        *(f"<li>{sentence.format(rounds=trade.rounds)}</li>" for sentence in _HOW),
        *(f"<li>{escape(knob.capitalize())}: {escape(reason)}.</li>" for knob, reason in trade.plan.left_out),
        "</ul>",
        *_main(trade),
        *_sequences(trade),
        *_strips(make_strips(trade, renderer)),
        *_shadows(trade),
        *_approximations(trade),
        *_all(trade),
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n' + "\n".join(body) + "\n</body></html>\n"


def _plot(figure: Any, name: str) -> str:
    """Return a plot as an element of the page, with a link that saves the plot as `name`.svg."""
    svg = svg_text(figure, name.replace("-", " "))
    data = b64encode(svg.encode()).decode()
    link = f'<a download="{name}.svg" href="data:image/svg+xml;base64,{data}">Save this plot as {name}.svg</a>'
    return f'{inline_svg(svg)}\n<p class="file">{link}</p>'


def _main(trade: Tradeoffs) -> Iterable[str]:
    if trade.results_for(MAIN):
        yield "<h2>Error against time</h2>"
        yield _plot(plots.error_against_time(trade, MAIN), "error-against-time")
        yield "<p>The configurations on the Pareto front:</p>"
        front = sorted((r for r in trade.results_for(MAIN) if r.beaten_by is None), key=lambda result: result.median)
        yield _table(front)


def _sequences(trade: Tradeoffs) -> Iterable[str]:
    for knob, shadows in (("sequence", "hard shadows"), ("sequence, soft shadows", "soft shadows")):
        if trade.results_for_knob(knob):
            yield f"<h2>Error against samples, {shadows}</h2>"
            yield _plot(plots.error_against_samples(trade, knob), f"error-against-samples-{shadows.replace(' ', '-')}")
            rows = [(name, f"{fit[0]:.2f}", f"{fit[1]:.2g}") for name, fit in fit_slopes(trade, knob).items() if fit]
            yield _rows(("sequence", "p in error = c n^(-p)", "c"), rows) if rows else ""


def _strips(strips_by_title: dict[str, list[Tile]]) -> Iterable[str]:
    for title, tiles in strips_by_title.items():
        yield f"<h2>{escape(title)}</h2>"
        figures = []
        for tile in tiles:
            images = "".join(
                f'<img alt="{alt}" src="data:image/png;base64,{b64encode(png).decode()}">'
                for alt, png in (("crop of the picture", tile.png), ("its differences", tile.difference))
                if png
            )
            figures.append(f"<figure><b>{escape(tile.heading)}</b>{images}{escape(tile.text)}</figure>")
        yield f'<div class="strip">{"".join(figures)}</div>'
    if strips_by_title:
        yield '<p class="note">Upper row: the crop with the largest errors. Lower row: its difference from the '
        yield "reference, with this colour scale:</p>"
        yield inline_svg(svg_text(color_bar(), "colour scale"))


def _shadows(trade: Tradeoffs) -> Iterable[str]:
    for target in ("off shadows", "diluted shadows", "soft shadows"):
        if trade.results_for(target):
            yield f"<h2>Error against time, {'no shadows' if target == 'off shadows' else target}</h2>"
            yield _plot(plots.error_against_time(trade, target), f"error-against-time-{target.replace(' ', '-')}")
    if apart := shadow_differences(trade):
        yield "<h2>Differences between shadow models</h2>"
        yield '<p class="note">The root mean square difference between the reference of each model and the reference '
        yield "of soft shadows, under the same lights. It is a difference of models: more samples do not reduce it.</p>"
        yield _rows(("shadows", "difference"), [(name, f"{value:.3g}") for name, value in apart.items()])


def _approximations(trade: Tradeoffs) -> Iterable[str]:
    targets = [name for name, target in trade.plan.targets.items() if target.same_samples and trade.results_for(name)]
    if not targets:
        return
    yield "<h2>Shading approximations</h2>"
    samples = {trade.plan.targets[name].settings.samples for name in targets}
    yield (
        '<p class="note">The scene with other materials. Each approximation is compared with the exact form at the '
        f"same samples ({samples.pop()} per pixel), so that only the shading differs. The title of a plot names the "
        "quantity and the exact form.</p>"
    )
    if measured := [name for name in targets if plots.exact_result(trade.results_for(name))]:
        yield _plot(plots.error_of_approximations(trade, measured), "error-of-approximations")
    for name in targets:
        yield f"<p>{escape(name)}</p>{_table(trade.results_for(name))}"


def _all(trade: Tradeoffs) -> Iterable[str]:
    yield "<h2>All measurements</h2>"
    yield _rows(
        ("reference", "method", "its own error (RMSE)", "errors are resolved from"),
        [
            (name, reference.kind, reference.in_words, f"{reference.resolved_from:.2g}")
            for name, reference in trade.references.items()
            if not trade.plan.targets[name].same_samples
        ],
    )
    for name, target in trade.plan.targets.items():
        if not target.same_samples and (results := trade.results_for(name)):
            yield f"<h3>{escape(name.capitalize())}</h3>{_table(sorted(results, key=lambda result: result.median))}"
    if refused := [result for result in trade.results if result.refused]:
        yield "<h3>Refused</h3>"
        yield _rows(("configuration", "reason"), [(r.configuration.label, r.refused) for r in refused])


def _table(results: Sequence[Result]) -> str:
    heading = (
        *("configuration", "settings varied", "median (ms)", "fastest (ms)", "slowest (ms)", "samples", "rays"),
        *("RMSE", "largest difference", "dominated by"),
    )
    lines = []
    for result in results:
        if result.error is None:
            continue
        milliseconds = (1e3 * value for value in (result.median, min(result.seconds), max(result.seconds)))
        numbers = [f"{value:.1f}" for value in milliseconds]
        numbers += [f"{result.samples:.3g}", f"{result.rays:.3g}"]
        numbers += [f"{result.error.rmse:.3g}{'' if result.resolved else ' (not resolved)'}"]
        numbers += [f"{result.error.largest:.2g}"]
        cells = "".join(f'<td class="n">{number}</td>' for number in numbers)
        front = ' class="front"' if result.beaten_by is None else ""
        label, knobs = result.configuration.label, ", ".join(result.configuration.knobs)
        lines.append(
            f"<tr{front}><td>{escape(label)}</td><td>{escape(knobs)}</td>{cells}"
            f"<td>{escape(result.beaten_by or 'none: Pareto front')}</td></tr>"
        )
    return f'<div class="wide"><table>{_heading(heading)}{"".join(lines)}</table></div>'


def _rows(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{_heading(heading)}{''.join(lines)}</table>"


def _heading(cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in cells) + "</tr>"
