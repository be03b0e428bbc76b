"""The plots of `raytracer trade`: error against time, against samples, and of shading approximations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from raytracer.analysis.figures import (
    SEQUENCE_STYLES,
    TECHNIQUE_STYLES,
    label_logarithm,
    label_samples,
    new_figure,
    plain_axes,
    set_text,
)
from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs
from raytracer.analysis.tradeoffs.summaries import fit_slopes
from raytracer.scene.settings import Settings

# Known rates of convergence, as lines to compare with: independent points, and evenly spread points on edges.
_KNOWN_RATES = ((0.5, "n^(-1/2)"), (0.75, "n^(-3/4)"))
# Errors below are drawn as this: float32 does not resolve them.
_LEAST_ERROR = 1e-8
_ERROR = "error (RMSE, linear radiance)"
# The size of the labels of approximations, and the distance of two labels one above the other, in points.
_LABEL_SIZE, _LINE_HEIGHT = 7.5, 10.0


def error_against_time(trade: Tradeoffs, target: str) -> Any:
    """Return a figure with a point for each configuration, by technique, and the Pareto front."""
    figure = new_figure(9.0, 5.0)
    axes = figure.add_subplot()
    results = trade.results_for(target)
    techniques = [_technique(result, trade.plan.targets[target].settings) for result in results]
    for name, style in {**SEQUENCE_STYLES, **TECHNIQUE_STYLES}.items():
        series = [result for result, technique in zip(results, techniques, strict=True) if technique == name]
        if series:
            x, y = [1e3 * result.median for result in series], [_error(result) for result in series]
            axes.plot(x, y, ls="", ms=9 if style.marker in "*PX" else 7, label=name, **style.options)
    front = sorted((result for result in results if result.beaten_by is None), key=lambda result: result.median)
    axes.step(
        [1e3 * result.median for result in front],
        [_error(result) for result in front],
        where="post",
        color="0.35",
        ls="--",
        lw=1.0,
        zorder=1,
        label="Pareto front",
    )
    _label_axes(axes, trade, target)
    label_logarithm(axes.xaxis)
    axes.set_xlabel("time (milliseconds, median)")
    figure.legend(loc="outside right upper", fontsize=8)
    return figure


def _technique(result: Result, base: Settings) -> str:
    """Name the technique of a configuration for the legend: its sample sequence if nothing else differs from `base`."""
    settings = result.configuration.settings
    if result.configuration.scale != 1.0:
        return "other resolution"
    if result.configuration.estimates:
        return "with error estimate"
    if settings.adaptive is not None:
        return "adaptive samples"
    if settings.max_error is not None:
        return "error limit"
    if (settings.precision, settings.evaluator) != (base.precision, base.evaluator):
        return "other precision or evaluator"
    return settings.sequence


def _error(result: Result) -> float:
    return max(result.error.rmse, _LEAST_ERROR) if result.error else _LEAST_ERROR


def _label_axes(axes: Any, trade: Tradeoffs, target: str) -> None:
    """Label the error axis, and shade the errors that the reference does not resolve, if the axis has any."""
    label_logarithm(axes.yaxis)
    axes.set_ylabel(_ERROR)
    plain_axes(axes)
    low, high = axes.get_ylim()
    if (floor := trade.references[target].resolved_from) > low:
        axes.axhspan(low, floor, color="0.9", zorder=0, label="below the reference's error")
        axes.set_ylim(low, high)


def error_against_samples(trade: Tradeoffs, knob: str) -> Any:
    """Return a figure with a line for each sequence, and the rates of convergence in its legend."""
    figure = new_figure(9.0, 4.6)
    axes = figure.add_subplot()
    results = [result for result in trade.results_for_knob(knob) if result.configuration.settings.samples > 1]
    fits = fit_slopes(trade, knob)
    for sequence, style in SEQUENCE_STYLES.items():
        series = sorted(
            (result for result in results if result.configuration.settings.sequence == sequence),
            key=lambda result: result.samples,
        )
        if series:
            fit = fits.get(sequence)
            label = f"{sequence}, p = {fit[0]:.2f}" if fit else f"{sequence}, not resolved"
            x, y = [result.samples for result in series], [_error(result) for result in series]
            axes.plot(x, y, ls="-", lw=1.2, ms=7, label=label, **style.options)
    _draw_known_rates(axes)
    if results:
        _label_axes(axes, trade, results[0].configuration.target)
    label_samples(axes.xaxis, [result.configuration.settings.samples for result in results])
    axes.set_xlabel("samples per pixel, n")
    figure.legend(loc="outside right upper", fontsize=8, title="sequence, error = c n^(-p)", title_fontsize=8)
    return figure


def _draw_known_rates(axes: Any) -> None:
    """Draw dotted lines of known rates from the largest error at the fewest samples."""
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) > 1]
    if not lines:
        return
    x, start = lines[0].get_xdata(), max(float(line.get_ydata()[0]) for line in lines)
    for rate, label in _KNOWN_RATES:
        y = [start * (n / x[0]) ** -rate for n in x]
        axes.plot(x, y, ":", color="0.5", lw=1.0)
        axes.annotate(label, (x[-1], y[-1]), (4, 0), textcoords="offset points", fontsize=8, color="0.4", va="center")


def exact_result(results: Sequence[Result]) -> Result | None:
    """Return the measurement of the exact form among the results of a shading target; None if it is missing."""
    return next((result for result in results if result.error and result.error.rmse == 0.0), None)


def error_of_approximations(trade: Tradeoffs, targets: Sequence[str]) -> Any:
    """Return a figure with a panel for each target, all of one scale: error against time relative to the exact form.

    Each of `targets` must have an exact_result().
    """
    columns = min(3, len(targets))
    rows = -(-len(targets) // columns)
    figure = new_figure(3.2 * columns, 2.4 * rows + 0.3)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    points_by_target = {target: _relative_points(trade.results_for(target)) for target in targets}
    times = [1.0, *(x for points in points_by_target.values() for _, x, _ in points)]
    errors = [y for points in points_by_target.values() for _, _, y in points] or [_LEAST_ERROR]
    limits = (min(times) / 3.0, 3.0 * max(times)), (min(errors) / 5.0, 5.0 * max(errors))
    for axes, (target, points) in zip(panels.flat, points_by_target.items(), strict=False):
        axes.set(xscale="log", yscale="log", xlim=limits[0], ylim=limits[1])
        axes.axvline(1.0, color="0.5", lw=1.0, ls="--")
        style = TECHNIQUE_STYLES["error limit"]
        axes.plot([x for _, x, _ in points], [y for _, _, y in points], ls="", marker="o", color=style.color, ms=5)
        _label_points(axes, points)
        set_text(axes.set_title("", fontsize=9), target)
        plain_axes(axes)
        label_logarithm(axes.xaxis)
        label_logarithm(axes.yaxis)
        axes.tick_params(labelsize=8, labelbottom=True, labelleft=True)
    for axes in [*panels.flat][len(targets) :]:
        axes.set_visible(False)
    figure.supxlabel("time relative to the exact form (dashed line: 1)", fontsize=9)
    figure.supylabel(_ERROR, fontsize=9)
    return figure


def _relative_points(results: Sequence[Result]) -> list[tuple[str, float, float]]:
    """Return the label, the time relative to the exact form, and the error of each approximation."""
    exact = exact_result(results)
    assert exact
    return [(r.configuration.label, r.median / exact.median, _error(r)) for r in results if r is not exact]


def _label_points(axes: Any, points: Sequence[tuple[str, float, float]]) -> None:
    """Write labels beside points, on the side with more room, moved up or down so that no two overlap."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    height = 72.0 * axes.get_position().height * axes.figure.get_size_inches()[1]
    lowest = 0.0
    for label, x, y in sorted(points, key=lambda point: point[2]):
        place = max(math.log(y / low) / math.log(high / low), lowest)
        lowest = place + _LINE_HEIGHT / height
        is_left = math.log(x / left) < 0.5 * math.log(right / left)
        text = axes.annotate(
            "",
            (x, y),
            (x * 1.25 if is_left else x / 1.25, place),
            textcoords=("data", "axes fraction"),
            fontsize=_LABEL_SIZE,
            ha="left" if is_left else "right",
            va="center",
            bbox={"fc": "white", "ec": "none", "pad": 0.8, "alpha": 0.85},
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": "0.5", "shrinkA": 1.0, "shrinkB": 2.0},
        )
        set_text(text, label)
