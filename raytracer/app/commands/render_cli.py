"""`raytracer render`: arguments, and the picture in a file."""

from __future__ import annotations

import argparse
import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from msgspec import UNSET

from raytracer.app.options import add_backend, add_scene, add_settings, chosen_settings, chosen_size, warn_about
from raytracer.core.memory import check_memory, picture_bytes
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import complain, say
from raytracer.core.validation import about, check_size
from raytracer.formats.scene_file import find_scene, read_document
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import SettingsPatch

if TYPE_CHECKING:
    from raytracer.formats.image import Image


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `render`."""
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="OUT", required=True, help=".png (8-bit sRGB) or .npz (float32 arrays)"
    )
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    parser.description = (
        "Render a scene to a file, with the settings that are given here or else in the scene file's [settings], and "
        "say how wrong the picture is: about so much, or at least so much where its samples do not tell more. The "
        "status is 1, though the picture is written, if --max-error was not reached, or is not known to be, with the "
        "samples or in the time there were."
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Run `render`; the exit status."""
    # What is wrong is found as early as it can be: most of it before NumPy and OpenGL are loaded.
    chosen = chosen_settings(options)
    chosen.resolve()
    document = read_document(find_scene(options.scene))
    scene, section = document.scene, document.section
    with about(f"{options.scene}: [settings] and the options given"):  # that exclude each other
        settings = (section.settings | chosen).resolve()
    size = chosen_size(options) or section.size or DEFAULT_SIZE

    with _imports_kept():
        from raytracer.core.output import check_output
        from raytracer.formats.image_files import FORMATS
        from raytracer.gpu.device import shared_device
        from raytracer.rendering.renderer import Renderer

    check_size(size)
    output = check_output(options.output, FORMATS)
    geometry = FORMATS[output.suffix.lower()].has_geometry
    sampling = settings.sampling
    check_memory(picture_bytes(size, geometry, sampling.is_adaptive, sampling.has_stopping_rule), size)
    warn_about(options.scene, scene, settings)
    renderer = Renderer(shared_device(options.backend, options.device))
    start = time.monotonic()
    # Beyond the driver's limits is the scene.
    with about(options.scene), progress_bar(f"rendering {output.name}") as progress:
        image = renderer.render(scene, size, settings, geometry=geometry, progress=progress, single_picture=True)
    with options.write(output) as file:
        image.write(file, output.suffix)
    took = time.monotonic() - start
    say(f"wrote {output}: {size[0]}x{size[1]}, {_samples(image, settings)}, {took:.1f} s", str(image.estimate))
    if missed := _missed(image, settings):
        if _is_error_chosen(section.settings, chosen):
            complain(f"{output}: {missed}")
            return 1
        say(missed)  # the samples are as many as the user wants: no mistake
    return 0


@contextmanager
def _imports_kept() -> Iterator[None]:
    """Keep Python's garbage collector away from all that is imported in the block.

    Next to nothing of a module is garbage, and the collector would look through NumPy's modules several times: while
    they are imported, and at the end of the process. Without, a small picture takes a tenth less time.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _samples(image: Image, settings: Settings) -> str:
    """The number of samples of a picture's pixels, in words."""
    fewest = most = settings.samples
    if image.samples is not None:
        fewest, most = image.samples.min(), image.samples.max()
    text = f"{most} sample{'s' if most > 1 else ''} a pixel"
    if image.samples is not None and fewest < most:
        text = f"{fewest} to {text}, {image.samples.mean():.2f} on average"
    return text


def _missed(image: Image, settings: Settings) -> str:
    """A sentence about a picture that is not, or not known to be, as accurate as max_error asks; else ""."""
    estimate = image.estimate
    assert estimate
    if estimate.reached is not False:
        return ""
    error = f"its error is {estimate.in_words}" + (f" ({estimate.unknown})" if estimate.unknown else "")
    if settings.time is not None and image.samples is not None and image.samples.max() < settings.samples:
        remedy = f"{settings.time:g} s were not enough: try more --time"
    else:
        samples = f"{settings.samples} samples were" if settings.samples > 1 else "1 sample was"
        remedy = f"{samples} not enough: try more --samples"
    return f"{error} and was to be at most {settings.max_error:g}; {remedy}"


def _is_error_chosen(in_file: SettingsPatch, chosen: SettingsPatch) -> bool:
    """Whether a user gave max_error as a number. A quality gives it with so many samples at most."""
    patches = (in_file, chosen) if chosen.quality is UNSET else (chosen,)
    return any(patch.max_error not in (UNSET, None) for patch in patches)
