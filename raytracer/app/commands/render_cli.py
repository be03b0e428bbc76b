"""`raytracer render`: render a scene to a file, and print the error of the picture."""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from raytracer.app.farm_options import add_farm_options, check_farm_options, open_farm
from raytracer.app.options import (
    add_backend,
    add_picture_options,
    add_scene,
    add_settings,
    chosen_settings,
    chosen_size,
    is_error_chosen,
    parse_integer,
    warn_about_scene,
)
from raytracer.core.memory import check_memory, picture_bytes
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import print_error, print_lines
from raytracer.core.validation import check_size, locate_errors
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.settings import Settings

if TYPE_CHECKING:
    from pathlib import Path

    from raytracer.core.progress import Progress
    from raytracer.farm.tasks import Run
    from raytracer.formats.estimate import Estimate
    from raytracer.rendering.renderer import Renderer
    from raytracer.scene.scene import Scene


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `render`."""
    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="file to write: .png (sRGB), .npz (float32 arrays) or .exr (float32 channels)",
    )
    add_picture_options(parser)
    parser.add_argument(
        "--bands",
        metavar="ROWS",
        type=parse_integer,
        help="draw and write the picture in bands of ROWS rows, so that it need not fit into memory: .png, or .exr "
        "with radiance only. With --max-error, each band reaches E by itself. Not with --time. A multiple of 16. "
        "Default: as a whole, or in bands if a .png needs more than 1 GiB, or an .exr more memory than there is.",
    )
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    add_farm_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `render` and return the exit status: 1 if the picture did not reach the `max_error` that the user set."""
    # Most input is checked before NumPy and OpenGL are loaded, so that errors appear at once.
    chosen = chosen_settings(options)
    chosen.resolve()
    has_farm = check_farm_options(options)
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    with locate_errors(f"{options.scene}: [settings] and the options given"):  # settings that exclude each other
        settings = (section.settings | chosen).resolve()
    size = chosen_size(options) or section.size or DEFAULT_SIZE

    with _keep_imports():
        from raytracer.farm.band_rows import check_rows, rows_of_farm, rows_of_large
        from raytracer.formats.image_files import FORMATS, check_picture_output
        from raytracer.gpu.device import shared_device
        from raytracer.rendering.renderer import Renderer

    check_size(size)
    output = check_picture_output(options.output, options.bits)
    suffix = output.suffix.lower()
    picture = _Picture(scene, size, settings, output, suffix, options.bits, options.transparent)
    needed = _needed_bytes(picture, size, geometry=FORMATS[suffix].has_geometry)
    rows = rows_of_large(size, needed, suffix, settings)
    if options.bands is not None:
        rows = check_rows(options.bands, suffix, settings)
    elif has_farm:
        rows = rows_of_farm(size, suffix, settings, "--scheduler" if options.scheduler else "--workers")
    if rows is None:
        by_rows = " or ".join(name for name, form in FORMATS.items() if form.rows)
        remedy = f"; --bands 64 and {by_rows} need far less" if settings.time is None else ""
        check_memory(needed, size, remedy)
    else:
        band = size[0], min(rows, size[1])
        check_memory(_needed_bytes(picture, band, geometry=False), band)
    warn_about_scene(options.scene, scene, settings)
    with open_farm(options) as farm:
        renderer = None if has_farm else Renderer(shared_device(options.backend, options.device))
        start = time.monotonic()
        # Errors about the driver's limits begin with the name of the scene file.
        with locate_errors(options.scene), progress_bar(f"rendering {output.name}") as progress:
            if renderer and rows is None:
                drawn = _draw_whole(renderer, picture, options, progress)
            else:
                assert rows
                drawn = _draw_bands(picture, rows, options, farm.run, progress)
        seconds = time.monotonic() - start
    bands = "" if rows is None else f", in bands of {rows} rows"
    print_lines(f"wrote {output}: {size[0]}x{size[1]}{bands}, {_samples(drawn)}, {seconds:.1f} s", str(drawn.estimate))
    if rows is not None and FORMATS[suffix].has_geometry:
        print_lines(f"bands hold radiance only: {output.name} has no depth, normals, materials or errors")
    if missed := _missed_error_warning(drawn, settings):
        if is_error_chosen(section.settings, chosen):
            print_error(f"{output}: {missed}")
            return 1
        print_lines(missed)  # a quality set max_error, and limits the samples: no failure
    return 0


class _Picture(NamedTuple):
    """The picture to draw, and its file."""

    scene: Scene
    size: tuple[int, int]
    settings: Settings
    output: Path
    suffix: str
    bits: int | None
    transparent: bool


class _Drawn(NamedTuple):
    """The estimate of a picture, and the fewest and the most samples of a pixel."""

    estimate: Estimate
    fewest: int
    most: int


def _needed_bytes(picture: _Picture, size: tuple[int, int], *, geometry: bool) -> int:
    """Return the memory that `size` pixels of a picture need, in bytes."""
    from raytracer.formats.image_files import FORMATS

    sampling = picture.settings.sampling
    drawing = picture_bytes(size, geometry, sampling.is_adaptive, sampling.has_stopping_rule, picture.transparent)
    return drawing + size[0] * size[1] * FORMATS[picture.suffix].writing_bytes


def _draw_whole(renderer: Renderer, picture: _Picture, options: argparse.Namespace, progress: Progress) -> _Drawn:
    """Draw and write a picture as a whole."""
    from raytracer.formats.image_files import FORMATS

    image = renderer.render(
        picture.scene,
        picture.size,
        picture.settings,
        geometry=FORMATS[picture.suffix].has_geometry,
        progress=progress,
        single_picture=True,
        transparent=picture.transparent,
    )
    with options.write(picture.output) as file:
        image.write(file, picture.suffix, picture.bits)
    assert image.estimate
    if image.samples is None:
        return _Drawn(image.estimate, picture.settings.samples, picture.settings.samples)
    return _Drawn(image.estimate, image.samples.min(), image.samples.max())


def _draw_bands(picture: _Picture, rows: int, options: argparse.Namespace, run: Run, progress: Progress) -> _Drawn:
    """Draw and write a picture in bands of `rows` rows."""
    from raytracer.farm.bands import BandJob, write_bands

    scene, size, settings, output, suffix, bits, transparent = picture
    job = BandJob(scene, size, settings, (0, size[1]), suffix, bits, transparent, options.backend, options.device)
    with options.write(output) as file:
        return _Drawn(*write_bands(file, job, rows, run, progress))


@contextmanager
def _keep_imports() -> Iterator[None]:
    """Keep Python's garbage collector away from modules that are imported in the block.

    Modules hold almost no garbage, but the collector would search NumPy's modules several times: during the import, and
    at the end of the process. Without these searches a small picture takes a tenth less time.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _samples(drawn: _Drawn) -> str:
    """Describe the number of samples per pixel."""
    text = f"{drawn.most} sample{'s' if drawn.most > 1 else ''} per pixel"
    if drawn.fewest < drawn.most:
        text = f"{drawn.fewest} to {text}, {drawn.estimate.samples:.2f} on average"
    return text


def _missed_error_warning(drawn: _Drawn, settings: Settings) -> str:
    """Return a message if the picture did not reach `max_error`, or may not have reached it; else ""."""
    estimate = drawn.estimate
    if estimate.reached is not False:
        return ""
    error = f"the error is {estimate.in_words}" + (f" ({estimate.unknown})" if estimate.unknown else "")
    if settings.time is not None and drawn.most < settings.samples:
        remedy = f"{settings.time:g} s were not enough: try more --time"
    else:
        samples = f"{settings.samples} samples were" if settings.samples > 1 else "1 sample was"
        remedy = f"{samples} not enough: try more --samples"
    return f"{error}, but at most {settings.max_error:g} was requested; {remedy}"
