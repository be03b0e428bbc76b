"""`raytracer render`: render a scene to a file, and print the error of the picture."""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from raytracer.app.options import (
    add_backend,
    add_scene,
    add_settings,
    chosen_settings,
    chosen_size,
    is_error_chosen,
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
    from raytracer.formats.image import Image


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `render`."""
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="OUT", required=True, help="file to write: .png (8-bit sRGB) or .npz (float32 arrays)"
    )
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `render` and return the exit status: 1 if the picture did not reach the `max_error` that the user set."""
    # Most input is checked before NumPy and OpenGL are loaded, so that errors appear at once.
    chosen = chosen_settings(options)
    chosen.resolve()
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    with locate_errors(f"{options.scene}: [settings] and the options given"):  # settings that exclude each other
        settings = (section.settings | chosen).resolve()
    size = chosen_size(options) or section.size or DEFAULT_SIZE

    with _keep_imports():
        from raytracer.core.output import check_output
        from raytracer.formats.image_files import FORMATS
        from raytracer.gpu.device import shared_device
        from raytracer.rendering.renderer import Renderer

    check_size(size)
    output = check_output(options.output, FORMATS)
    geometry = FORMATS[output.suffix.lower()].has_geometry
    sampling = settings.sampling
    check_memory(picture_bytes(size, geometry, sampling.is_adaptive, sampling.has_stopping_rule), size)
    warn_about_scene(options.scene, scene, settings)
    renderer = Renderer(shared_device(options.backend, options.device))
    start = time.monotonic()
    # Errors about the driver's limits begin with the name of the scene file.
    with locate_errors(options.scene), progress_bar(f"rendering {output.name}") as progress:
        image = renderer.render(scene, size, settings, geometry=geometry, progress=progress, single_picture=True)
    with options.write(output) as file:
        image.write(file, output.suffix)
    seconds = time.monotonic() - start
    print_lines(
        f"wrote {output}: {size[0]}x{size[1]}, {_samples(image, settings)}, {seconds:.1f} s", str(image.estimate)
    )
    if missed := _missed_error_warning(image, settings):
        if is_error_chosen(section.settings, chosen):
            print_error(f"{output}: {missed}")
            return 1
        print_lines(missed)  # a quality set max_error, and limits the samples: no failure
    return 0


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


def _samples(image: Image, settings: Settings) -> str:
    """Describe the number of samples per pixel."""
    fewest = most = settings.samples
    if image.samples is not None:
        fewest, most = image.samples.min(), image.samples.max()
    text = f"{most} sample{'s' if most > 1 else ''} per pixel"
    if image.samples is not None and fewest < most:
        text = f"{fewest} to {text}, {image.samples.mean():.2f} on average"
    return text


def _missed_error_warning(image: Image, settings: Settings) -> str:
    """Return a message if the picture did not reach `max_error`, or may not have reached it; else ""."""
    estimate = image.estimate
    assert estimate
    if estimate.reached is not False:
        return ""
    error = f"the error is {estimate.in_words}" + (f" ({estimate.unknown})" if estimate.unknown else "")
    if settings.time is not None and image.samples is not None and image.samples.max() < settings.samples:
        remedy = f"{settings.time:g} s were not enough: try more --time"
    else:
        samples = f"{settings.samples} samples were" if settings.samples > 1 else "1 sample was"
        remedy = f"{samples} not enough: try more --samples"
    return f"{error}, but at most {settings.max_error:g} was requested; {remedy}"
