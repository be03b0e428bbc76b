"""The gallery: a picture of every reflectance model on the same scene, with labels."""

from __future__ import annotations

import math
import os
from typing import Any

from PIL import Image, ImageDraw, ImageFont

from raytracer.analysis.reflectance.pictures import draw_material
from raytracer.analysis.reflectance.properties import COMPLETE
from raytracer.core.output import Writer, check_output, write_atomically
from raytracer.core.progress import Progress
from raytracer.core.validation import number
from raytracer.formats.material_library import published, read_collection
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material

_COLUMNS = 6
_GAP, _MARGIN = 10, 8
_PAPER, _INK, _FAINT = (255, 255, 255), (30, 30, 30), (90, 90, 90)
# Font sizes in pixels: legible when a page shows the sheet at 80 % of its size.
_NAME_SIZE, _SMALL_SIZE = 18, 14
# Text is drawn larger by this factor and then reduced. At its own size, the font's spaces are rounded to 2 pixels.
_OVERSAMPLING = 4
_CAPTION = (
    "The lights have the colours pi and 0.35 pi, because a diffuse reflectance is rho / pi. For phong, blinn and "
    "strauss, which have no 1 / pi, the lights have the colours 1 and 0.35."
)
_RUST = (0.78, 0.3, 0.12)


def write_gallery(
    path: str | os.PathLike[str],
    side: int,
    samples: int,
    merl: str | None,
    renderer: Renderer,
    progress: Progress | None,
    write: Writer = write_atomically,
) -> None:
    """Write the gallery, whole or not at all.

    Args:
        path: A .png file.
        side: The side of each picture. Range: 64-2048. Pixels.
        samples: Samples per pixel.
        merl: A file in MERL's format, for an additional picture. None: no such picture.
        renderer: Renders the pictures.
        progress: Receives the number of finished pictures and of all pictures.
        write: Opens the file.
    """
    output = check_output(path, (".png",))
    side = int(number(side, "--cell", 64, 2048, "pixels in [64, 2048]"))
    cells = [(name, *shown) for name, shown in gallery_materials().items()]
    if merl is not None:
        cells.append(("merl", Material("merl", file=merl), os.path.basename(merl)))
    # A column is as wide as its picture and its longest name; longer descriptions are wrapped.
    wide = max(side, *(math.ceil(_length(name, _NAME_SIZE)) for name, _, _ in cells))
    descriptions = [_wrap(about, wide, ", ") for _, _, about in cells]
    below = 2 + _NAME_SIZE + 4 + max(map(len, descriptions)) * (_SMALL_SIZE + 3)
    columns = min(_COLUMNS, len(cells))
    width = columns * (wide + _GAP) - _GAP + 2 * _MARGIN
    caption = _wrap(_CAPTION, width - 2 * _MARGIN)
    bottom = _MARGIN + -(-len(cells) // _COLUMNS) * (side + below + _GAP)
    sheet = Image.new("RGB", (width, bottom + len(caption) * (_SMALL_SIZE + 4) + _MARGIN), _PAPER)
    for i, (name, material, _) in enumerate(cells):
        if progress:
            progress(i, len(cells))
        x, y = _MARGIN + i % _COLUMNS * (wide + _GAP), _MARGIN + i // _COLUMNS * (side + below + _GAP)
        sheet.paste(Image.fromarray(draw_material(material, side, samples, renderer)), (x, y))
        _write_line(sheet, (x, y + side + 2), name, _INK, _NAME_SIZE)
        for k, line in enumerate(descriptions[i]):
            _write_line(sheet, (x, y + side + 6 + _NAME_SIZE + k * (_SMALL_SIZE + 3)), line, _FAINT, _SMALL_SIZE)
    for k, line in enumerate(caption):
        _write_line(sheet, (_MARGIN, bottom + k * (_SMALL_SIZE + 4)), line, _FAINT, _SMALL_SIZE)
    if progress:
        progress(len(cells), len(cells))
    with write(output) as file:
        sheet.save(file, "png", optimize=True)


def _length(text: str, size: int) -> float:
    """Return the width of a line in pixels."""
    return ImageFont.load_default(size * _OVERSAMPLING).getlength(text) / _OVERSAMPLING


def _wrap(text: str, width: float, separator: str = " ") -> list[str]:
    """Split a text at some separators into lines of at most this width in pixels. A single part may be wider."""
    lines = [""]
    for part in text.split(separator):
        joined = f"{lines[-1]}{separator}{part}" if lines[-1] else part
        if not lines[-1] or _length(joined, _SMALL_SIZE) <= width:
            lines[-1] = joined
        else:
            lines[-1] += separator.rstrip()
            lines.append(part)
    return lines


def _write_line(sheet: Image.Image, place: tuple[int, int], text: str, color: tuple[int, int, int], size: int) -> None:
    """Write a line of text whose top left corner is at `place`."""
    large = Image.new("L", (math.ceil(_length(text, size) + 1) * _OVERSAMPLING, (size + 4) * _OVERSAMPLING))
    ImageDraw.Draw(large).text((0, 0), text, 255, ImageFont.load_default(size * _OVERSAMPLING))
    sheet.paste(
        color, place, large.resize((large.width // _OVERSAMPLING, large.height // _OVERSAMPLING), Image.Resampling.BOX)
    )


def gallery_materials() -> dict[str, tuple[Material, str]]:
    """Return a typical material of each model, and its description."""
    # At 650, 550 and 450 nm (Johnson and Christy 1972), as in assets/materials/conductors.toml.
    table = read_collection("conductors")["copper"]
    copper: dict[str, Any] = {"fresnel": "conductor", "n": table["n"], "k": table["k"]}
    chosen = {
        "phong": (Material("phong", kd=_RUST), "h 32"),
        "blinn": (Material("blinn", kd=_RUST, h=128.0), "h 128"),
        "lambert": (Material("lambert", rho=_RUST), ""),
        "minnaert": (Material("minnaert", rho=_RUST, k=0.6), "k 0.6"),
        "phong_normalized": (Material("phong_normalized", kd=_RUST, ks=0.06), "ks 0.06, h 32"),
        "blinn_normalized": (Material("blinn_normalized", kd=_RUST, ks=0.06, h=128.0), "ks 0.06, h 128"),
        "strauss": (Material("strauss", color=_RUST, metalness=0.6), "smoothness 0.7, metalness 0.6"),
        "lafortune": (published("lafortune/clay"), "clay, as published"),
        "oren_nayar": (Material("oren_nayar", rho=_RUST, sigma=40.0), "sigma 40 degrees"),
        "eon": (Material("eon", rho=_RUST, roughness=1.0), "roughness 1"),
        "torrance_sparrow": (Material("torrance_sparrow", **copper, m=0.5), "copper, m 0.5"),
        "cook_torrance": (Material("cook_torrance", **copper, m=0.5), "copper, m 0.5"),
        "ggx": (Material("ggx", **copper, alpha=0.5), "copper, alpha 0.5"),
        "beckmann": (Material("beckmann", **copper, alpha=0.5), "copper, alpha 0.5"),
        "split": (Material("split", rho=_RUST, alpha=0.2), "f0 0.04, alpha 0.2"),
        "diffuse_microfacet": (Material("diffuse_microfacet", rho=_RUST, alpha=0.8), "alpha 0.8"),
        "he": (Material("he", fresnel="conductor", rho=0.05), "gold, sigma0 0.18 um"),
        "mirror": (Material("mirror", f0=(0.95, 0.93, 0.88)), "f0 0.95"),
    }
    return {model: chosen.get(model) or (Material(model), "") for model in COMPLETE}
