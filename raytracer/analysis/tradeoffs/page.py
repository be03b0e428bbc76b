"""The page trade.html, which needs no other file, and the writing of it and of the data files.

All text that is not ours, such as the scene's name, is escaped.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from raytracer.analysis.image_difference import SCALE
from raytracer.analysis.tradeoffs import plots
from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.data_files import as_csv, as_json
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs
from raytracer.analysis.tradeoffs.strips import Tile, strips
from raytracer.analysis.tradeoffs.summaries import shadow_differences, slopes
from raytracer.analysis.tradeoffs.targets import RESOLVED_FROM
from raytracer.core.output import Writer, written_whole
from raytracer.rendering.renderer import Renderer

FILES = "trade.csv", "trade.json", "trade.html"

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
h1, h2 { line-height: 1.2 } h2 { margin-top: 2.5rem }
table { border-collapse: collapse; font-size: 13px }
td, th { border-bottom: 1px solid #ddd; padding: .15rem .6rem; text-align: left; vertical-align: top }
td.n { text-align: right; font-variant-numeric: tabular-nums } tr.front td { background: #eef6ee }
svg { max-width: 100%; height: auto } p.note { color: #555 }
.strip { display: flex; flex-wrap: wrap; gap: .8rem } figure { margin: 0; width: 240px; font-size: 12px }
figure img { width: 240px; image-rendering: pixelated; display: block }
figure b { display: block } .wide { overflow-x: auto }
"""

_HOW = (
    "Time is that of the whole of <code>Renderer.render()</code>, with read-back and, where the resolution is another "
    "one, bringing the picture to its size, once programs are compiled; without the picture's estimate of its own "
    "error, but where that is asked for or named. It is the median of {rounds} rounds, in each of which all "
    "configurations take their turn. Error is the root mean square of the difference from the reference, over pixels "
    "and channels, in linear radiance. Rays are those from the camera and at most one from each of them to every "
    "light, a pixel of the picture. A configuration is on the front if none is as fast and less wrong or as good and "
    "faster; "
    f"errors below {RESOLVED_FROM:g} times the reference's own are not resolved, and count as that; a reference whose "
    "own error is <i>at least</i> so much, as few pixels hold most of it, resolves fewer."
)


def write_tables(trade: Tradeoffs, folder: Path, write: Writer = written_whole) -> None:
    """Write trade.csv and trade.json into `folder`. Raises OSError.

    Before the page: it takes pictures, which may fail or be interrupted.
    """
    table, data, _ = FILES
    _write(folder / table, as_csv(trade), write)
    _write(folder / data, as_json(trade), write)


def write_page(trade: Tradeoffs, renderer: Renderer, folder: Path, write: Writer = written_whole) -> Path:
    """Write trade.html into `folder`, and return its path. Where that fails, no page of another trade is left there.

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
    """The whole page."""
    title = f"What it costs and how wrong it is: {trade.scene}"
    width, height = trade.size
    body = [
        f"<h1>{escape(title)}</h1>",
        "" if trade.complete else "<p><b>Interrupted: this is what was measured by then.</b></p>",
        f"<p>{width}x{height}. {escape('; '.join(f'{key}: {value}' for key, value in trade.machine.items()))}.</p>",
        f'<p class="note">{_HOW.format(rounds=trade.rounds)}</p>',
        *(f'<p class="note">{escape(knob)}: {escape(why)}.</p>' for knob, why in trade.plan.left_out),
        *_main(trade),
        *_sequences(trade),
        *_strips(strips(trade, renderer)),
        *_shadows(trade),
        *_approximations(trade),
        *_all(trade),
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n' + "\n".join(body) + "\n</body></html>\n"


def _main(trade: Tradeoffs) -> Iterable[str]:
    if trade.of(MAIN):
        yield "<h2>Error against time</h2>"
        yield plots.error_against_time(trade, MAIN)
        yield "<p>The front:</p>"
        front = sorted((r for r in trade.of(MAIN) if r.beaten_by is None), key=lambda result: result.median)
        yield _table(front)


def _sequences(trade: Tradeoffs) -> Iterable[str]:
    for knob, title in (("sequence", "Error against samples"), ("sequence, soft shadows", "The same, soft shadows")):
        if trade.of_knob(knob):
            yield f"<h2>{title}</h2>"
            yield plots.error_against_samples(trade, knob)
            rows = [(name, f"{fit[0]:.2f}", f"{fit[1]:.2g}") for name, fit in slopes(trade, knob).items() if fit]
            yield _rows(("sequence", "p of error = c n^-p", "c"), rows)


def _strips(strips_by_title: dict[str, list[Tile]]) -> Iterable[str]:
    for title, tiles in strips_by_title.items():
        yield f"<h2>{escape(title)}</h2>"
        figures = []
        for tile in tiles:
            images = "".join(
                f'<img alt="" src="data:image/png;base64,{b64encode(png).decode()}">'
                for png in (tile.png, tile.difference)
                if png
            )
            figures.append(f"<figure><b>{escape(tile.heading)}</b>{images}{escape(tile.text)}</figure>")
        yield f'<div class="strip">{"".join(figures)}</div>'
    if strips_by_title:
        yield f'<p class="note">Below each: {escape(SCALE)}.</p>'


def _shadows(trade: Tradeoffs) -> Iterable[str]:
    for target in ("off shadows", "diluted shadows", "soft shadows"):
        if trade.of(target):
            yield f"<h2>{target.capitalize()}: error against time</h2>"
            yield plots.error_against_time(trade, target)
    if apart := shadow_differences(trade):
        yield "<h2>What kinds of shadows are apart</h2>"
        yield '<p class="note">The root mean square difference of their references from that of soft shadows, under '
        yield "the same lights: a difference of models, which no sample removes.</p>"
        yield _rows(("shadows", "difference"), [(name, f"{value:.3g}") for name, value in apart.items()])


def _approximations(trade: Tradeoffs) -> Iterable[str]:
    targets = [name for name, target in trade.plan.targets.items() if target.same_samples and trade.of(name)]
    if not targets:
        return
    yield "<h2>Shading: approximations against what they approximate</h2>"
    samples = {trade.plan.targets[name].settings.samples for name in targets}
    yield (
        f'<p class="note">The scene with other materials; both sides take the same samples ({samples.pop()} a pixel), '
        "so only the approximation differs.</p>"
    )
    yield plots.error_of_approximations(trade, targets)
    for name in targets:
        yield f"<p>{escape(name)}</p>{_table(trade.of(name))}"


def _all(trade: Tradeoffs) -> Iterable[str]:
    yield "<h2>All</h2>"
    yield _rows(
        ("reference", "made by", "its own error", "resolved from"),
        [
            (name, reference.kind, reference.in_words, f"{reference.resolved_from:.2g}")
            for name, reference in trade.references.items()
            if not trade.plan.targets[name].same_samples
        ],
    )
    for name, target in trade.plan.targets.items():
        if not target.same_samples and (results := trade.of(name)):
            yield f"<h3>{escape(name.capitalize())}</h3>{_table(sorted(results, key=lambda result: result.median))}"
    if refused := [result for result in trade.results if result.refused]:
        yield "<h3>Refused</h3>"
        yield _rows(("configuration", "why"), [(r.configuration.label, r.refused) for r in refused])


def _table(results: Sequence[Result]) -> str:
    heading = ("configuration", "knobs", "ms", "from", "to", "samples", "rays", "error", "largest", "beaten by")
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
            f"<td>{escape(result.beaten_by or 'none: on the front')}</td></tr>"
        )
    return f'<div class="wide"><table>{_heading(heading)}{"".join(lines)}</table></div>'


def _rows(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{_heading(heading)}{''.join(lines)}</table>"


def _heading(cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in cells) + "</tr>"
