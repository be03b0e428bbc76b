"""Gallery: one labelled picture of the same scene for each reflectance model."""

from __future__ import annotations

import os
from typing import Any

from PIL import Image, ImageDraw, ImageFont

from raytracer.analysis.reflectance.pictures import draw_material
from raytracer.analysis.reflectance.properties import COMPLETE
from raytracer.core.output import Writer, check_output, written_whole
from raytracer.core.progress import Progress
from raytracer.core.validation import number
from raytracer.formats.material_library import published, read_collection
from raytracer.rendering.renderer import Renderer
from raytracer.scene.materials.material import Material

_COLUMNS = 6
_GAP, _BELOW, _CAPTION = 6, 34, 26
_PAPER, _INK, _FAINT = (250, 249, 246), (30, 30, 30), (110, 110, 110)
_CAPTION_TEXT = (
    "The lights have the colours pi and 0.35 pi, because a diffuse f is rho / pi. "
    "For phong, blinn and strauss, which omit 1/pi, they have 1 and 0.35."
)
_RUST = (0.78, 0.3, 0.12)


def write_gallery(
    path: str | os.PathLike[str],
    side: int,
    samples: int,
    merl: str | None,
    renderer: Renderer,
    progress: Progress | None,
    write: Writer = written_whole,
) -> None:
    """Render all models, and write the sheet of pictures.

    Args:
        path: the .png file
        side: width and height of each picture in pixels. Range: 64-2048.
        samples: samples per pixel
        merl: file of a measured material to show besides; None: none
        renderer: the renderer
        progress: called with the number of pictures drawn, and of all pictures
        write: opens the file to write. Default: the file is written whole or not at all.
    """
    output = check_output(path, (".png",))
    side = int(number(side, "--cell", 64, 2048, "pixels in [64, 2048]"))
    cells = [(name, *shown) for name, shown in shown_materials().items()]
    if merl is not None:
        cells.append(("merl", Material("merl", file=merl), os.path.basename(merl)))
    rows = -(-len(cells) // _COLUMNS)
    width = _COLUMNS * (side + _GAP) + _GAP
    sheet = Image.new("RGB", (width, rows * (side + _BELOW + _GAP) + _GAP + _CAPTION), _PAPER)
    draw = ImageDraw.Draw(sheet)
    name_font, small_font = (ImageFont.load_default(size) for size in (15, 11))
    for i, (name, material, about) in enumerate(cells):
        if progress:
            progress(i, len(cells))
        x, y = _GAP + i % _COLUMNS * (side + _GAP), _GAP + i // _COLUMNS * (side + _BELOW + _GAP)
        sheet.paste(Image.fromarray(draw_material(material, side, samples, renderer)), (x, y))
        draw.text((x + 2, y + side + 1), name, _INK, name_font)
        draw.text((x + 2, y + side + 18), about, _FAINT, small_font)
    draw.text((_GAP + 2, sheet.height - _CAPTION + 4), _CAPTION_TEXT, _FAINT, small_font)
    if progress:
        progress(len(cells), len(cells))
    with write(output) as file:
        sheet.save(file, "png", optimize=True)


def shown_materials() -> dict[str, tuple[Material, str]]:
    """Return for each model a material that shows the model's use, and the second line of its label."""
    # n and k at 650, 550 and 450 nm: Johnson and Christy 1972, in assets/materials/conductors.toml.
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
