"""Plots of reflectance models: lobes in polar coordinates, albedos, and a lit ball."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from raytracer.analysis.figures import CURVE_STYLES, DOTS_PER_INCH, new_figure, plain_axes, save_figure, set_text
from raytracer.analysis.reflectance.pictures import draw_material, white_light
from raytracer.analysis.reflectance.properties import DEGREES, MaterialProperties, measure_material, unit_direction
from raytracer.analysis.reflectance.quadrature import Array
from raytracer.core.output import Writer, write_atomically
from raytracer.core.progress import Progress
from raytracer.core.validation import MAX_EXPONENT, number
from raytracer.gpu.device import Device
from raytracer.rendering.brdf import evaluate
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material

# Angles between light and normal, in degrees: one for each of CURVE_STYLES.
_INCIDENCE = (0.0, 30.0, 60.0, 80.0)
# If a lobe is longer than _LONG, in 1/sr, the radial scale is linear up to _LINEAR_TO and logarithmic beyond: a linear
# scale would hide all other lobes. The lobe of a white diffuse surface is 1/pi = 0.32 long.
_LONG, _LINEAR_TO = 5.0, 0.1
# The most labels of a radial scale that stand apart.
_MOST_LABELS = 6
# Albedos above _HIGHEST are cut off, unless most albedos of a material are larger.
_HIGHEST = 2.0
# Angles of albedos in degrees. Albedos change most at grazing angles.
_DEGREES = (*range(0, 85, 5), *np.arange(85.0, 89.6, 0.5), 89.8, DEGREES[-1])
_ALBEDO_COLOR = "#882255"
# Inches: the width of a column; the heights of the legend, of the model's name, of a line of parameters, and of the
# three panels with their labels; the radius of the half disc of lobes, the size of the albedo's axes, the side of the
# ball's picture.
_COLUMN, _LEGEND, _TITLE, _LINE = 3.2, 0.55, 0.3, 0.15
_LOBES, _ALBEDO, _BALL = 2.05, 2.3, 3.05
_RADIUS, _ALBEDO_SIZE, _SIDE = 1.15, (2.45, 1.55), 2.7
# Letters of a line of a title, and of the text over a panel.
_TITLE_LETTERS, _TEXT_LETTERS = 44, 54


class _Column(NamedTuple):
    """The data of a column of a figure."""

    label: str
    material: Material
    lobes: list[tuple[Array, Array]]  # angles of the viewer, and f there, for each of _INCIDENCE
    properties: MaterialProperties


def plot_materials(
    path: Path,
    materials: Sequence[tuple[str, Material]],
    renderer: Renderer,
    progress: Progress | None = None,
    write: Writer = write_atomically,
) -> None:
    """Write a figure with a column for each material: lobes in the plane of incidence, albedos, and a lit ball.

    All columns share one radial scale of the lobes and one scale of the albedos.

    Args:
        path: A file that ends in one of figures.SUFFIXES.
        materials: Labels and materials.
        renderer: Renders the balls.
        progress: Receives the number of finished columns and of all columns.
        write: Opens the file.
    """
    title_lines = max(len(_parameter_lines(label)) for label, _ in materials)
    height = _LEGEND + _TITLE + title_lines * _LINE + _LOBES + _ALBEDO + _BALL
    figure = new_figure(_COLUMN * len(materials) + 0.3, height, layout=None)
    columns = []
    for i, (label, material) in enumerate(materials):
        if progress:
            progress(i, len(materials))
        lobes = _lobes(material, renderer.device)
        columns.append(_Column(label, material, lobes, measure_material(material, _DEGREES, renderer.device)))
        middle, bottom = 0.3 + (i + 0.5) * _COLUMN, (_BALL - _SIDE) / 2.0
        ball = _add_axes(figure, middle - _SIDE / 2.0, bottom, _SIDE, _SIDE)
        ball.imshow(draw_material(material, round(_SIDE * DOTS_PER_INCH), 16, renderer))
        ball.set_axis_off()
        ball.set_title(
            f"lights of colour {'1 and 0.35' if white_light(material) == 1.0 else 'π and 0.35 π'}", fontsize=8
        )
    longest = max(float(f.max()) for column in columns for _, f in column.lobes)
    top = max(_highest_shown(column.properties) for column in columns)
    for i, column in enumerate(columns):
        middle = 0.3 + (i + 0.5) * _COLUMN
        _write_label(figure, column.label, middle, height - _LEGEND)
        # Axes of a half disc take the room of the whole disc, with the half disc in the middle.
        bottom = _BALL + _ALBEDO + 0.55 - 0.5 * _RADIUS
        lobes = _add_axes(figure, middle - _RADIUS, bottom, 2.0 * _RADIUS, 2.0 * _RADIUS, projection="polar")
        _draw_lobes(lobes, column.lobes, longest)
        wide, high = _ALBEDO_SIZE
        _draw_albedo(_add_axes(figure, middle + 0.1 - wide / 2.0, _BALL + 0.4, wide, high), column.properties, top)
    _add_legend(figure)
    if progress:
        progress(len(materials), len(materials))
    save_figure(figure, path, f"reflectance of {', '.join(label for label, _ in materials)}", write)


def _add_axes(figure: Any, x: float, y: float, wide: float, high: float, **options: Any) -> Any:
    """Add axes at a place in inches."""
    width, height = figure.get_size_inches()
    return figure.add_axes((x / width, y / height, wide / width, high / height), **options)


def _parameter_lines(label: str) -> list[str]:
    """Return the parameters of a label such as ggx:alpha=0.1:f0=1,0.8,0.3, in lines that fit into a column."""
    return textwrap.wrap(label.partition(":")[2].replace(":", "; "), _TITLE_LETTERS)


def _write_label(figure: Any, label: str, x: float, y: float) -> None:
    """Write a column's title from the height y downwards: the model, and its parameters in smaller letters."""
    width, height = figure.get_size_inches()
    y -= 0.12
    for i, line in enumerate([label.partition(":")[0], *_parameter_lines(label)]):
        text = figure.text(x / width, y / height, "", fontsize=11 if i == 0 else 8, ha="center", va="center")
        set_text(text, line)
        y -= 0.2 if i == 0 else _LINE


def _add_legend(figure: Any) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=color, ls=style, marker=marker, ms=5, label=f"{degrees:g}°")
        for degrees, (color, marker, style) in zip(_INCIDENCE, CURVE_STYLES, strict=True)
    ]
    figure.legend(
        handles=handles,
        title="light's angle to the normal (markers at the rim)",
        title_fontsize=8,
        fontsize=8,
        loc="upper center",
        ncols=len(handles),
        frameon=False,
    )


def _lobes(material: Material, device: Device) -> list[tuple[Array, Array]]:
    """Return f, the mean of its channels, by the viewer's angle in the plane of incidence, for each of _INCIDENCE."""
    lobes = []
    for degrees in _INCIDENCE:
        wi, angles = unit_direction(degrees, 180.0), _viewers(degrees)
        wo = np.column_stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)])
        lobes.append((angles, (evaluate(material, wi, wo, device=device) / wi[2]).mean(axis=1)))
    return lobes


def _draw_lobes(axes: Any, lobes: Sequence[tuple[Array, Array]], longest: float) -> None:
    """Draw lobes at a radial scale that shows the longest lobe of the figure."""
    is_logarithmic = longest > _LONG

    def radius(f: Any) -> Any:
        return np.log10(1.0 + f / _LINEAR_TO) if is_logarithmic else f

    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetalim(-math.pi / 2, math.pi / 2)
    axes.set_ylim(0.0, 1.05 * float(radius(longest)) or 1.0)
    rim = axes.get_xaxis_transform(which="grid")
    for (angles, f), degrees, (color, marker, style) in zip(lobes, _INCIDENCE, CURVE_STYLES, strict=True):
        axes.plot(angles, radius(f), color=color, ls=style, lw=1.3)
        axes.plot([-math.radians(degrees)], [1.0], marker=marker, color=color, ms=5, clip_on=False, transform=rim)
    axes.set_thetagrids(range(-90, 91, 30), [f"{abs(x)}°" for x in range(-90, 91, 30)], fontsize=7)
    ticks = _logarithmic_ticks(longest) if is_logarithmic else _linear_ticks(longest or 1.0)
    axes.set_yticks([float(radius(f)) for f in ticks], [_radius_label(f) for f in ticks])
    axes.tick_params(axis="y", labelsize=7)
    axes.grid(color="0.85", lw=0.6)
    text = f"f (1/sr), {f'logarithmic from {_LINEAR_TO:g}' if is_logarithmic else 'linear'}"
    if not any(f.any() for _, f in lobes):
        text = "f is 0 except in the mirror direction"
    axes.text(0.5, 0.1, text, transform=axes.transAxes, ha="center", va="center", fontsize=8)


def _radius_label(f: float) -> str:
    """Return a number, as a power of 10 where its digits would run into the next label."""
    return f"{f:g}" if f < 1e3 else "10" + "".join("⁰¹²³⁴⁵⁶⁷⁸⁹"[int(digit)] for digit in f"{math.log10(f):.0f}")


def _linear_ticks(longest: float) -> list[float]:
    step = 10.0 ** math.floor(math.log10(longest / 2.0))
    step *= next(k for k in (1, 2, 5, 10) if longest / (k * step) < _MOST_LABELS - 1)
    return [float(f"{i * step:g}") for i in range(int(longest / step) + 1)]


def _logarithmic_ticks(longest: float) -> list[float]:
    decades = math.floor(math.log10(longest / _LINEAR_TO))
    step = -(-(decades + 1) // (_MOST_LABELS - 1))
    return [float(f"{_LINEAR_TO * 10.0**i:g}") for i in range(0, decades + 1, step)]


def _viewers(degrees: float) -> Array:
    """Return angles of the viewer between -90 and 90 degrees, dense near the mirror direction of narrow lobes."""
    near = np.geomspace(1e-5, 1.0, 300)
    mirror = math.radians(degrees)
    limit = math.radians(89.9)
    angles = np.concatenate([np.linspace(-limit, limit, 721), [mirror], mirror + near, mirror - near])
    return np.unique(angles[np.abs(angles) <= limit])


def _highest_shown(properties: MaterialProperties) -> float:
    """Return the largest albedo that a plot of this material should show."""
    highest = max(a.value for a in (*properties.albedos, *properties.beams))
    usual = float(np.median([a.value for a in properties.albedos]))
    return min(max(1.05, 1.05 * highest), max(_HIGHEST, 1.5 * usual))


def _draw_albedo(axes: Any, properties: MaterialProperties, top: float) -> None:
    """Draw albedos up to `top`, the highest albedo that the figure shows."""
    axes.axhline(1.0, color="0.6", lw=0.8)
    curves = [("seen from this angle", properties.albedos, "-")]
    if properties.beams != properties.albedos:
        curves.append(("lit from this angle", properties.beams, "--"))
    for label, curve, style in curves:
        x, y = [a.degrees for a in curve], [a.value for a in curve]
        axes.plot(x, y, style, color=_ALBEDO_COLOR, lw=1.4, label=label)
        unresolved = [a for a in curve if not a.resolved]
        axes.plot([a.degrees for a in unresolved], [a.value for a in unresolved], "o", mfc="none", color=_ALBEDO_COLOR)
    axes.set_ylim(0.0, top)
    axes.set_xlim(0.0, 90.0)
    axes.set_xticks(range(0, 91, 30), [f"{x}°" for x in range(0, 91, 30)])
    axes.set_xlabel("angle to the normal", fontsize=8)
    axes.set_ylabel("albedo", fontsize=8)
    axes.tick_params(labelsize=7)
    plain_axes(axes)
    notes = [] if properties.reciprocal else ["not reciprocal"]
    notes += {True: [], False: ["not energy-conserving"], None: ["not resolved at circles"]}[properties.conserving]
    if (highest := max(a.value for _, curve, _ in curves for a in curve)) > top:
        notes.append(f"up to {highest:.3g}")
    axes.set_title("\n".join(textwrap.wrap(", ".join(notes), _TEXT_LETTERS)), fontsize=8)
    if len(curves) > 1:
        axes.legend(fontsize=7, loc="best")


def plot_lecture(path: Path, h: float | None, device: Device, write: Writer = write_atomically) -> None:
    """Write a figure of Phong's (R.V)^h and Blinn's (N.H)^(4 h), both computed by the shaders, and of their difference.

    Columns: the viewer in the plane of incidence, and across the plane, where the two differ most. All panels of a row
    have the same scales.

    Args:
        path: A file that ends in one of figures.SUFFIXES.
        h: The exponent. None: 32. Range: 0 to 250000.
        device: Evaluates the shaders.
        write: Opens the file.

    Raises:
        InputError: another exponent.
    """
    from matplotlib.lines import Line2D

    most = MAX_EXPONENT / 4.0
    h = 32.0 if h is None else number(h, "h", 0.0, most, f"a number in [0, {most:g}], which blinn takes times 4")
    phong, blinn = (Material(model, kd=0.0, ks=1.0, h=e) for model, e in (("phong", h), ("blinn", 4.0 * h)))
    figure = new_figure(9.0, 6.2)
    panels = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(1.3, 1.0))
    off = np.radians(np.linspace(-45.0, 45.0, 901))
    for column, across in enumerate((False, True)):
        both, apart = panels[:, column]
        for i, (degrees, (color, marker, _)) in enumerate(zip(_INCIDENCE, CURVE_STYLES, strict=True)):
            wi, wo = unit_direction(degrees, 180.0), _directions_around(unit_direction(degrees), off, across)
            up = wo[:, 2] > 0.0
            r, n = (evaluate(m, wi, wo[up], device=device)[:, 0].astype(float) for m in (phong, blinn))
            # Markers of coinciding curves stand side by side.
            points: dict[str, Any] = {"color": color, "marker": marker, "ms": 5, "markevery": (30 * i, 120)}
            x = np.degrees(off[up])
            both.plot(x, r, lw=1.4, **points)
            both.plot(x, n, lw=1.1, ls="--", **points)
            apart.plot(x, n - r, lw=1.2, label=f"{degrees:g}°: {np.abs(n - r).max():.2g}", **points)
        both.set_title("across the plane of incidence" if across else "in the plane of incidence", fontsize=10)
        apart.set_xlabel("angle between viewer and mirror direction (degrees)", fontsize=9)
        apart.legend(title="largest difference", fontsize=7, title_fontsize=7, loc="lower left")
        for axes in (both, apart):
            plain_axes(axes)
            axes.tick_params(labelsize=8, labelleft=True, labelbottom=True)
    panels[0, 0].set_ylabel(f"highlight, h = {h:g}", fontsize=9)
    panels[1, 0].set_ylabel("Blinn minus Phong", fontsize=9)
    handles = [Line2D([], [], color="0.2", ls="-", label="Phong: (R·V)^h"), Line2D([], [], color="0.2", ls="--")]
    handles[1].set_label("Blinn: (N·H)^(4h)")
    handles += [
        Line2D([], [], color=color, marker=marker, ms=5, label=f"light at {degrees:g}°")
        for degrees, (color, marker, _) in zip(_INCIDENCE, CURVE_STYLES, strict=True)
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=8, frameon=False)
    save_figure(figure, path, f"Phong's and Blinn's highlight, h = {h:g}", write)


def _directions_around(axis: Array, angles: Array, across: bool) -> Array:
    """Return directions at angles to an axis in the plane y = 0: in it, positive downwards, or across it."""
    side = np.array([0.0, 1.0, 0.0]) if across else np.array([axis[2], 0.0, -axis[0]])
    return np.cos(angles)[:, None] * axis + np.sin(angles)[:, None] * side
