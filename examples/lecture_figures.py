"""Figures for a lecture on constructive solid geometry (CSG) and local shading, as .svg, .pdf or .png files.

    python examples/lecture_figures.py -o figures --format pdf

The command writes four figures: the stages of a CSG solid, its Roth diagram, the four kinds of shadows, and Phong's
highlight beside Blinn's. It needs matplotlib: pip install -e '.[plots]'.

The solid is the one of the assignment: two spheres A and B intersect in a lens, a sphere C is added, a sphere D is cut
out. Change `A` to `D`, `RAY_ORIGIN` or `VIEW` to draw figures of another solid.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

import raytracer as rt
from raytracer.analysis.figures import new_figure, require_matplotlib, save_figure
from raytracer.core.output import check_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Linear RGB of the solids, and the colours of the same solids in diagrams.
RED, BLUE, GREEN = (rt.Material(kd=kd) for kd in ((0.64, 0.08, 0.08), (0.08, 0.16, 0.72), (0.08, 0.64, 0.16)))
FLOOR = rt.Plane((0, 1, 0), 0, rt.Material(kd=0.48))
INK = {"A": "#c0392b", "B": "#e08283", "C": "#2d5fd0", "D": "#2e9e4f"}

A, B = rt.Sphere((-1, 2, 0), 1.5, RED), rt.Sphere((1, 2, 0), 1.5, RED)
C, D = rt.Sphere((0, 2.7, -0.3), 0.8, BLUE), rt.Sphere((0, 2.8, 0.3), 0.8, GREEN)
SPHERES = {"A": A, "B": B, "C": C, "D": D}
STAGES: dict[str, rt.Solid] = {
    "A": A,
    "B": B,
    "A & B": A & B,
    "(A & B) | C": (A & B) | C,
    "((A & B) | C) - D": ((A & B) | C) - D,
}

# This camera sees the lens at 31 degrees from its axis, so that its disc, its edge and the cut are all visible.
VIEW = rt.Camera((5, 4.2, 3), (0, 2, 0), vertical_fov=34)
LIGHT = rt.PointLight((4, 7, 4), radius=0.4)

# The ray of the Roth diagram. It enters and leaves all four spheres, at eight places that are well apart.
RAY_ORIGIN, RAY_DIRECTION = np.array((-3.0, 0.3, -0.1)), np.array((1.0, 0.6, 0.0))

# Error of each picture (RMSE, linear radiance): a third of an 8-bit level in middle grey, so that no noise is visible.
MAX_ERROR = 0.001

Interval = tuple[float, float]
Shadows = Literal["off", "hard", "diluted", "soft"]


def scene_of(solid: rt.Solid, camera: rt.Camera = VIEW) -> rt.Scene:
    """Return the scene with one solid over the floor."""
    return rt.Scene([solid, FLOOR], [LIGHT], camera)


def stage_images(size: tuple[int, int]) -> dict[str, rt.Image]:
    """Render each stage of the CSG solid. The keys are the expressions."""
    # Farther away, the camera sees the whole spheres A and B.
    camera = VIEW.replace(position=(10, 6.6, 6), look_at=(0.1, 1.75, -0.15), vertical_fov=22.5)
    return {name: picture(scene_of(solid, camera), size, "soft") for name, solid in STAGES.items()}


def shadow_images(size: tuple[int, int]) -> dict[str, rt.Image]:
    """Render the solid with each kind of shadow. The keys are the values of `--shadows`."""
    # The shadow lies behind the solid, on the right.
    scene = scene_of(STAGES["((A & B) | C) - D"], VIEW.replace(look_at=(-0.6, 1.7, 0)))
    return {shadows: picture(scene, size, shadows) for shadows in get_args(Shadows)}


def highlight_images(size: tuple[int, int]) -> dict[str, rt.Image]:
    """Render a glossy floor under grazing light by both models. The keys are the values of `--shading`."""
    ball = rt.Sphere((0.4, 1, 0), 1, RED)
    floor = rt.Plane((0, 1, 0), 0, rt.Material(kd=0.3, ks=0.6))
    lights = rt.PointLight((-6, 2, -4)), rt.PointLight((5, 4, 6), color=(0.5, 0.5, 0.5))
    scene = rt.Scene([ball, floor], lights, rt.Camera((3, 1.6, 7), (-0.3, 0.75, 0), vertical_fov=34))
    return {model: rt.render(scene, size, max_error=MAX_ERROR, shading=model) for model in ("phong", "blinn")}


def picture(scene: rt.Scene, size: tuple[int, int], shadows: Shadows) -> rt.Image:
    """Render a picture without visible noise."""
    return rt.render(scene, size, max_error=MAX_ERROR, shadows=shadows)


def roth_intervals() -> dict[str, list[Interval]]:
    """Return the intervals of the ray inside each solid: Roth's algorithm, from the spheres to the whole solid.

    The intervals are distances along the ray, in lengths of RAY_DIRECTION.
    """
    a, b, c, d = (crossing(sphere) for sphere in SPHERES.values())
    lens = merged(a, b, lambda in_a, in_b: in_a and in_b)
    joined = merged(lens, c, lambda in_lens, in_c: in_lens or in_c)
    whole = merged(joined, d, lambda in_joined, in_d: in_joined and not in_d)
    return {"A": a, "B": b, "A & B": lens, "C": c, "(A & B) | C": joined, "D": d, "((A & B) | C) - D": whole}


def crossing(sphere: rt.Sphere) -> list[Interval]:
    """Return the interval of the ray inside a sphere: between the roots of |origin + t direction - center| = radius."""
    to_center = np.array(sphere.center) - RAY_ORIGIN
    squared_length = float(RAY_DIRECTION @ RAY_DIRECTION)
    middle = float(to_center @ RAY_DIRECTION) / squared_length
    discriminant = middle**2 - (float(to_center @ to_center) - sphere.radius**2) / squared_length
    return [(middle - discriminant**0.5, middle + discriminant**0.5)] if discriminant > 0 else []


def merged(first: list[Interval], second: list[Interval], operation: Callable[[bool, bool], bool]) -> list[Interval]:
    """Merge two sorted lists of intervals by a Boolean operation on "the ray is inside the solid"."""
    ends = sorted({end for interval in first + second for end in interval})
    result: list[Interval] = []
    for start, end in pairwise(ends):
        middle = (start + end) / 2
        in_first, in_second = (any(a < middle < b for a, b in intervals) for intervals in (first, second))
        if operation(in_first, in_second):
            joins = bool(result) and result[-1][1] == start
            result[-1:] = [(result[-1][0], end)] if joins else [*result[-1:], (start, end)]
    return result


def first_hit() -> float:
    """Return the distance of the first hit by the ray tracer, from a picture of one pixel along the ray."""
    camera = rt.Camera(vector(RAY_ORIGIN), vector(RAY_ORIGIN + RAY_DIRECTION))
    depth = rt.render(scene_of(STAGES["((A & B) | C) - D"], camera), (1, 1)).depth
    assert depth is not None
    return float(depth[0, 0]) / float(np.linalg.norm(RAY_DIRECTION))


def vector(array: np.ndarray) -> tuple[float, float, float]:
    """Return an array of three numbers as a tuple."""
    x, y, z = map(float, array)
    return x, y, z


def stages_figure() -> Figure:
    """Draw the stages of the CSG solid side by side."""
    return row_of(stage_images((360, 360)))


def shadows_figure() -> Figure:
    """Draw the four kinds of shadows side by side."""
    return row_of(shadow_images((480, 360)))


def highlights_figure() -> Figure:
    """Draw Phong's and Blinn's highlight side by side."""
    return row_of(highlight_images((640, 400)))


def row_of(images: dict[str, rt.Image]) -> Figure:
    """Draw images side by side, with their names as titles."""
    width, height = next(iter(images.values())).radiance.shape[1::-1]
    figure = new_figure(3 * len(images), 3 * height / width + 0.3)
    for axes, (name, image) in zip(figure.subplots(1, len(images)), images.items(), strict=True):
        axes.imshow(image.srgb8())
        axes.set_title(name, family="monospace", fontsize=11)
        axes.axis("off")
    return figure


def roth_figure() -> Figure:
    """Draw the Roth diagram under a section through the solid, in the plane of the ray.

    The camera looks at the plane of the section at a right angle. So circles stay circles, and places along the ray are
    above their places in the diagram.
    """
    intervals = roth_intervals()
    whole = intervals["((A & B) | C) - D"]
    assert abs(first_hit() - whole[0][0]) < 1e-5, "the diagram and the ray tracer disagree"
    # Inches: both axes are 5.8 wide, and the section is as high as its 6 x 3.6 units of length need.
    width, height = 7.7, 5.9
    figure = new_figure(width, height, layout=None)
    section = figure.add_axes((1.8 / width, 2.4 / height, 5.8 / width, 5.8 * 0.6 / height))
    diagram = figure.add_axes((1.8 / width, 0.3 / height, 5.8 / width, 2.1 / height), sharex=section)
    _draw_section(section, whole)
    _draw_intervals(diagram, intervals)
    for end in sorted({end for interval in whole for end in interval}):
        x, y = _point_at(end)
        diagram.axvline(x, color="0.3", linewidth=0.8, linestyle=":")
        section.plot((x, x), (y, -1.0), color="0.3", linewidth=0.8, linestyle=":")
    return figure


def _point_at(distance: float) -> tuple[float, float]:
    x, y, _ = RAY_ORIGIN + distance * RAY_DIRECTION
    return float(x), float(y)


def _draw_section(axes: Axes, whole: list[Interval]) -> None:
    from matplotlib.patches import Circle

    left, right, bottom, top = -3.0, 3.0, 0.2, 3.8
    z = float(RAY_ORIGIN[2])
    center, distance = ((left + right) / 2, (bottom + top) / 2, z), 12.0
    fov = 2 * float(np.degrees(np.arctan((top - bottom) / 2 / distance)))
    camera = rt.Camera((center[0], center[1], z + distance), center, vertical_fov=fov)
    # A thin slice, whose front face has the colours of the solids that it cuts.
    front = {name: rt.Plane((0, 0, 1), z, SPHERES[name].material.replace(ks=0)) for name in "AC"}
    back = rt.Plane((0, 0, 1), z - 0.001)
    section = ((A & B & front["A"]) | (C & front["C"])) - D - back
    scene = rt.Scene([section], [rt.PointLight((0, 2, 40))], camera, background=(1, 1, 1))
    image = rt.render(scene, (960, round(960 * (top - bottom) / (right - left))), samples=64)
    axes.imshow(image.srgb8(), extent=(left, right, bottom, top))
    for name, sphere in SPHERES.items():
        x, y, depth = sphere.center
        radius = (sphere.radius**2 - (depth - z) ** 2) ** 0.5
        axes.add_patch(Circle((x, y), radius, fill=False, color=INK[name], linewidth=1.6))
    for name, (x, y) in {"A": (-2.1, 2.3), "B": (2.1, 2.3), "C": (0.62, 3.38), "D": (-0.4, 3.05)}.items():
        axes.text(x, y, name, color=INK[name], fontsize=13, fontweight="bold", ha="center", va="center")
    axes.annotate("", _point_at(5.7), _point_at(0), arrowprops={"arrowstyle": "->", "linewidth": 1.4})
    axes.text(-2.9, 0.62, "ray", fontsize=11)
    for interval in whole:
        axes.plot(*zip(*map(_point_at, interval), strict=True), color="black", linewidth=4.5, solid_capstyle="butt")
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.axis("off")


def _draw_intervals(axes: Axes, intervals: dict[str, list[Interval]]) -> None:
    for row, (name, parts) in enumerate(intervals.items()):
        axes.axhline(row, color="0.85", linewidth=0.8, zorder=0)
        for start, end in parts:
            x = _point_at(start)[0]
            axes.barh(row, _point_at(end)[0] - x, left=x, height=0.5, color=INK.get(name, "0.35"))
    axes.set_yticks(range(len(intervals)), list(intervals), family="monospace", fontsize=10)
    axes.invert_yaxis()
    axes.set_xticks([])
    axes.set_xlabel("distance along the ray \N{RIGHTWARDS ARROW}")
    axes.tick_params(left=False)
    axes.spines[:].set_visible(False)


FIGURES = {
    "csg-stages": stages_figure,
    "roth-diagram": roth_figure,
    "shadows": shadows_figure,
    "phong-blinn": highlights_figure,
}


def main() -> int:
    """Write all figures, and return the exit status: 2 for a wrong folder and without matplotlib."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("figures"), help="folder (default: figures)")
    parser.add_argument("--format", choices=("svg", "pdf", "png"), default="svg", help="default: svg")
    options = parser.parse_args()
    paths = {name: options.output / f"{name}.{options.format}" for name in FIGURES}
    try:
        require_matplotlib()
        options.output.mkdir(parents=True, exist_ok=True)
        check_folder(options.output, *(path.name for path in paths.values()))
    except (rt.InputError, OSError) as error:
        reason = error if isinstance(error, rt.InputError) else f"{options.output}: {error.strerror}"
        print(f"{parser.prog}: {reason}", file=sys.stderr)
        return 2
    for name, path in paths.items():
        save_figure(FIGURES[name](), path, name)
        print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
