"""The plots of trade.html, by matplotlib, as SVG text that stands in a page by itself."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any

from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs
from raytracer.analysis.tradeoffs.summaries import slopes
from raytracer.core.validation import InputError
from raytracer.scene.settings import Settings

# Paul Tol's bright and muted schemes: told apart by the colour-blind.
_COLORS = (
    "#4477aa",
    "#ee6677",
    "#228833",
    "#ccbb44",
    "#66ccee",
    "#aa3377",
    "#bbbbbb",
    "#882255",
    "#999933",
    "#000000",
    "#332288",
    "#dd7711",
)
_MARKS = "osD^vP*Xhd<>"
_REFERENCE_SLOPES = (0.5, 0.75)
# Times that differ by more are shown by their logarithm.
_WIDE = 5.0
# What float32 does not tell from 0.
_LEAST = 1e-8


def check_matplotlib() -> None:
    """Raise InputError unless there is what plots are made by."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise InputError("plots need matplotlib, which is not installed: pip install 'roth-raytracer[plots]'") from None


def _figure(width: float, height: float) -> Any:
    """An empty figure, which needs no screen."""
    check_matplotlib()
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasSVG(figure)
    return figure


def _svg(figure: Any) -> str:
    """A figure as an element of a page, without all that only files need, or that would name other places."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    svg = text.getvalue()
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    # Names of this plot's parts would be those of another's in the same page.
    return svg.replace(' xmlns="http://www.w3.org/2000/svg"', "")


def error_against_time(trade: Tradeoffs, target: str) -> str:
    """A point for each configuration, marked by what it is, and the front."""
    figure = _figure(9.0, 5.2)
    axes = figure.add_subplot()
    results = trade.of(target)
    floor = trade.references[target].resolved_from
    kinds = [_kind(result, trade.plan.targets[target].settings) for result in results]
    for k, kind in enumerate(dict.fromkeys(kinds)):
        own = [result for result, its in zip(results, kinds, strict=True) if its == kind]
        axes.plot(
            [1e3 * result.median for result in own],
            [_error(result) for result in own],
            _MARKS[k % len(_MARKS)],
            color=_COLORS[k % len(_COLORS)],
            ms=6,
            mec="white",
            mew=0.5,
            label=kind,
        )
    _draw_front(axes, results)
    _label(axes, "milliseconds, median", "error (RMSE, linear radiance)")
    _draw_floor(axes, floor)
    axes.legend(fontsize=8, loc="upper right")
    return _svg(figure)


def _kind(result: Result, base: Settings) -> str:
    """The sequence, unless another knob is turned from where `base` has it."""
    configuration = result.configuration
    settings = configuration.settings
    if configuration.scale != 1.0:
        return "resolution"
    if configuration.estimates:
        return "with its error"
    if settings.adaptive is not None:
        return "adaptive"
    if settings.max_error is not None:
        return "max error"
    if (settings.precision, settings.evaluator) != (base.precision, base.evaluator):
        return "precision, evaluator"
    return settings.sequence


def _error(result: Result) -> float:
    return max(result.error.rmse, _LEAST) if result.error else _LEAST


def _draw_front(axes: Any, results: Sequence[Result]) -> None:
    front = sorted((result for result in results if result.beaten_by is None), key=lambda result: result.median)
    axes.step(
        [1e3 * result.median for result in front],
        [_error(result) for result in front],
        where="post",
        color="0.3",
        lw=1.0,
        zorder=1,
        label="front: none is faster and less wrong",
    )


def _draw_floor(axes: Any, floor: float) -> None:
    """Shade the errors that the reference does not resolve, if the plot has them."""
    low, high = axes.get_ylim()
    if floor > low:
        axes.axhspan(low, floor, color="0.9", zorder=0, label="not resolved by the reference")
        axes.set_ylim(low, high)


def _ticks(axes: Any) -> None:
    """A logarithmic x axis with plain numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _label(axes: Any, x: str, y: str) -> None:
    _ticks(axes)
    axes.set_yscale("log")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(which="major", color="0.9", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def error_against_samples(trade: Tradeoffs, knob: str) -> str:
    """A line for each sequence, with its slope."""
    figure = _figure(9.0, 4.6)
    axes = figure.add_subplot()
    results = trade.of_knob(knob)
    fits = slopes(trade, knob)
    for k, (sequence, fit) in enumerate(fits.items()):
        own = sorted(
            (result for result in results if result.configuration.settings.sequence == sequence and result.samples > 1),
            key=lambda result: result.samples,
        )
        text = f"{sequence}: n^-{fit[0]:.2f}" if fit else f"{sequence}: not resolved"
        axes.plot(
            [result.samples for result in own],
            [_error(result) for result in own],
            _MARKS[k] + "-",
            color=_COLORS[k],
            label=text,
            ms=5,
            lw=1.2,
        )
    _draw_slopes(axes)
    _label(axes, "samples a pixel", "error (RMSE, linear radiance)")
    if results:
        _draw_floor(axes, trade.references[results[0].configuration.target].resolved_from)
    axes.legend(fontsize=8)
    return _svg(figure)


def _draw_slopes(axes: Any) -> None:
    """Dotted lines of known slopes through the first point."""
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) > 1]
    if not lines:
        return
    x, start = lines[0].get_xdata(), max(float(line.get_ydata()[0]) for line in lines)
    for p in _REFERENCE_SLOPES:
        y = [start * (n / x[0]) ** -p for n in x]
        axes.plot(x, y, ":", color="0.5", lw=1.0)
        axes.annotate(f"n^-{p:g}", (x[-1], y[-1]), fontsize=8, color="0.4")


def error_of_approximations(trade: Tradeoffs, targets: Sequence[str]) -> str:
    """A small plot for each target: error against time of its approximations, each named."""
    columns = 3
    rows = -(-len(targets) // columns)
    figure = _figure(3.4 * columns, 2.6 * rows)
    for place, target in enumerate(targets, 1):
        axes = figure.add_subplot(rows, columns, place)
        results = trade.of(target)
        exact = [result for result in results if result.error and result.error.rmse == 0.0]
        for k, result in enumerate(result for result in results if result not in exact):
            x, y = 1e3 * result.median, _error(result)
            axes.plot(x, y, "o", color=_COLORS[0], ms=4)
            above = (0, 5) if k % 2 else (0, -10)  # so that neighbours' names stand apart
            axes.annotate(
                result.configuration.label, (x, y), above, textcoords="offset points", fontsize=6.5, ha="center"
            )
        for result in exact:
            axes.axvline(1e3 * result.median, color="0.5", lw=1.0, ls="--")
        axes.set_title(target, fontsize=8)
        axes.set_yscale("log")
        axes.margins(0.3)
        times = [1e3 * result.median for result in results]
        if max(times) > _WIDE * min(times):
            _ticks(axes)
            axes.set_xlim(0.5 * min(times), 2.0 * max(times))
        else:
            axes.set_xlim(0.0, 1.25 * max(times))
        axes.set_xlabel("milliseconds; dashed: the exact form's", fontsize=7)
        axes.set_ylabel("RMSE", fontsize=7)
        axes.tick_params(labelsize=7, which="both")
        axes.grid(which="major", color="0.9", lw=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    return _svg(figure)
