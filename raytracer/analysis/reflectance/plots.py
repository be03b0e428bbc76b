"""Pictures of reflectances, by matplotlib: polar lobes, albedos, and a lit ball."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from raytracer.analysis.reflectance.pictures import draw_material, light_of
from raytracer.analysis.reflectance.properties import DEGREES, measure_material, unit_direction
from raytracer.analysis.reflectance.quadrature import Array
from raytracer.core.output import Writer, written_whole
from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.gpu.device import Device
from raytracer.rendering.brdf import evaluate
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material

_INCIDENCE = (0.0, 30.0, 60.0, 80.0)
_COLORS = ("#4477aa", "#228833", "#ccbb44", "#ee6677")
# Lobes that are longer than this are drawn by the logarithm: else nothing but they would be seen.
_LONG = 5.0
# Albedos above are cut off, unless most are.
_HIGHEST = 2.0
_DEGREES = (*range(0, 85, 5), *np.arange(85.0, 89.6, 0.5), 89.8, DEGREES[-1])
_INCHES, _DOTS = 3.1, 100


def _figure(width: float, height: float) -> Any:
    """An empty figure, which needs no screen."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("plots need matplotlib, which is not installed: pip install 'roth-raytracer[plots]'") from None
    figure = Figure(figsize=(width, height), dpi=_DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, path: Path, write: Writer) -> None:
    with write(path) as file:
        figure.savefig(file, format="png")


def plot_materials(
    path: Path,
    materials: Sequence[tuple[str, Material]],
    renderer: Renderer,
    progress: Progress | None = None,
    write: Writer = written_whole,
) -> None:
    """A column for each material, by its label: lobes in the plane of incidence, albedo, and a lit ball."""
    figure = _figure(_INCHES * len(materials) + 0.4, 8.6)
    grid = figure.add_gridspec(3, len(materials), height_ratios=(0.8, 0.8, 1.0))
    for i, (label, material) in enumerate(materials):
        if progress:
            progress(i, len(materials))
        lobes = figure.add_subplot(grid[0, i], projection="polar")
        lobes.set_title(label.replace(":", "\n", 1), fontsize=11)
        _draw_lobes(lobes, material, renderer.device)
        _draw_albedo(figure.add_subplot(grid[1, i]), material, renderer.device, legend=i == 0)
        ball = figure.add_subplot(grid[2, i])
        ball.imshow(draw_material(material, round(_INCHES * _DOTS), 16, renderer))
        ball.set_axis_off()
        ball.set_title(f"light of colour {'1' if light_of(material) == 1.0 else 'π'}", fontsize=8)
    lines = figure.axes[0].get_lines()[::2]
    figure.legend(
        lines,
        [f"{x:g}°" for x in _INCIDENCE],
        title="light from",
        title_fontsize=8,
        loc="outside upper left",
        ncols=4,
        fontsize=8,
    )
    if progress:
        progress(len(materials), len(materials))
    _save(figure, path, write)


def _draw_lobes(axes: Any, material: Material, device: Device) -> None:
    """f, the mean of its channels, by the viewer in the plane of incidence, for light from some angles."""
    curves = []
    for degrees in _INCIDENCE:
        wi = unit_direction(degrees, 180.0)
        angles = _viewers(degrees)
        wo = np.column_stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)])
        curves.append((angles, (evaluate(material, wi, wo, device=device) / wi[2]).mean(axis=1)))
    longest = max(float(f.max()) for _, f in curves)
    logarithmic = longest > _LONG
    for (angles, f), degrees, color in zip(curves, _INCIDENCE, _COLORS, strict=True):
        axes.plot(angles, np.log10(1.0 + f) if logarithmic else f, color=color, lw=1.3, label=f"{degrees:g}°")
        axes.plot([-math.radians(degrees)], [1.0], marker="v", color=color, ms=5, clip_on=False, transform=_rim(axes))
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetalim(-math.pi / 2, math.pi / 2)
    axes.set_thetagrids(range(-90, 91, 30), fontsize=7)
    axes.tick_params(axis="y", labelsize=6)
    radius = 1.05 * (math.log10(1.0 + longest) if logarithmic else longest) or 1.0
    axes.set_ylim(0.0, radius)
    step = 10.0 ** math.floor(math.log10(radius / 2.0))
    axes.set_yticks(np.arange(0.0, radius, step * next(k for k in (1, 2, 5, 10) if radius / (k * step) < 5.0)))
    text = "$\\log_{10}(1 + f)$, f in 1/sr" if logarithmic else "f, in 1/sr"
    if longest == 0.0:
        text = "f is 0: it is a delta"
    axes.text(0.5, 0.06, text, transform=axes.transAxes, ha="center", fontsize=8)


def _rim(axes: Any) -> Any:
    """Polar coordinates whose radius 1 is the axes' rim, whatever its scale."""
    return axes.get_xaxis_transform(which="grid") if hasattr(axes, "get_xaxis_transform") else axes.transData


def _viewers(degrees: float) -> Array:
    """Angles of the viewer, from -90 to 90 degrees: near the mirror direction so many that no lobe is missed."""
    near = np.geomspace(1e-5, 1.0, 300)
    mirror = math.radians(degrees)
    limit = math.radians(89.9)
    angles = np.concatenate([np.linspace(-limit, limit, 721), [mirror], mirror + near, mirror - near])
    return np.unique(angles[np.abs(angles) <= limit])


def _draw_albedo(axes: Any, material: Material, device: Device, legend: bool) -> None:
    properties = measure_material(material, _DEGREES, device)
    axes.axhline(1.0, color="0.6", lw=0.8)
    curves = [("of what is seen", properties.albedos, "-")]
    if properties.beams != properties.albedos:
        curves.append(("of a beam", properties.beams, "--"))
    for label, curve, style in curves:
        x, y = [a.degrees for a in curve], [a.value for a in curve]
        axes.plot(x, y, style, color="#aa3377", lw=1.4, label=label)
        open_ = [a for a in curve if not a.resolved]
        axes.plot([a.degrees for a in open_], [a.value for a in open_], "o", mfc="none", color="#aa3377", ms=4)
    highest = max(max(a.value for a in curve) for _, curve, _ in curves)
    usual = float(np.median([a.value for a in properties.albedos]))
    top = min(max(1.05, 1.05 * highest), max(_HIGHEST, 1.5 * usual))
    axes.set_ylim(0.0, top)
    axes.set_xlim(0.0, 90.0)
    axes.set_xticks(range(0, 91, 30), [f"{x}°" for x in range(0, 91, 30)])
    axes.tick_params(labelsize=7)
    mark = [] if properties.reciprocal else ["not reciprocal"]
    mark += {True: [], False: ["not conserving"], None: ["not resolved everywhere (o)"]}[properties.conserving]
    if highest > top:
        mark.append(f"up to {highest:.3g}")
    axes.set_title(", ".join(["albedo", *mark]), fontsize=8)
    if legend or len(curves) > 1:
        axes.legend(fontsize=7, loc="lower left")


def plot_lecture(path: Path, h: float | None, device: Device, write: Writer = written_whole) -> None:
    """The lecture's (R.V)^h against (N.H)^(4 h), both by the GLSL: over the viewer's angle from the mirror direction.

    For light from several angles, in the plane of incidence and square to it, where they differ most.
    """
    h = 32.0 if h is None else h
    phong, blinn = (Material(model, kd=0.0, ks=1.0, h=e) for model, e in (("phong", h), ("blinn", 4.0 * h)))
    figure = _figure(9.0, 6.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, 1.0))
    off = np.radians(np.linspace(-45.0, 45.0, 901))
    for column, across in enumerate((False, True)):
        both, apart = figure.add_subplot(grid[0, column]), figure.add_subplot(grid[1, column])
        for degrees, color in zip(_INCIDENCE, _COLORS, strict=True):
            wi, wo = unit_direction(degrees, 180.0), _around(unit_direction(degrees), off, across)
            up = wo[:, 2] > 0.0
            r, n = (evaluate(m, wi, wo[up], device=device)[:, 0].astype(float) for m in (phong, blinn))
            x = np.degrees(off[up])
            both.plot(x, r, color=color, lw=1.4, label=f"{degrees:g}°")
            both.plot(x, n, color=color, lw=1.1, ls="--")
            apart.plot(x, n - r, color=color, lw=1.2, label=f"{degrees:g}°: {np.abs(n - r).max():.2g}")
        both.set_title("square to the plane of incidence" if across else "in the plane of incidence", fontsize=10)
        both.set_ylabel(f"$(R \\cdot V)^{{{h:g}}}$, dashed $(N \\cdot H)^{{{4 * h:g}}}$", fontsize=9)
        both.legend(title="light from", fontsize=8, title_fontsize=8)
        apart.set_ylabel("dashed less full", fontsize=9)
        apart.set_xlabel("viewer's angle to the mirror direction, in degrees", fontsize=9)
        apart.legend(title="largest", fontsize=7, title_fontsize=8)
    _save(figure, path, write)


def _around(axis: Array, angles: Array, across: bool) -> Array:
    """Directions at angles to an axis in the plane y = 0: in that plane, positive downwards, or square to it."""
    side = np.array([0.0, 1.0, 0.0]) if across else np.array([axis[2], 0.0, -axis[0]])
    return np.cos(angles)[:, None] * axis + np.sin(angles)[:, None] * side
