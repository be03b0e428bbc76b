"""`raytracer render` and `raytracer view`."""

from __future__ import annotations

import argparse
import gc
import time
from typing import TYPE_CHECKING

from raytracer.app.options import add_backend, add_scene, add_settings, chosen_settings, chosen_size, warn_about
from raytracer.core.interrupts import STATUS
from raytracer.core.memory import check_memory
from raytracer.core.progress import progress_bar
from raytracer.core.terminal import complain, say
from raytracer.core.validation import about, check_size, number
from raytracer.formats.scene_file import parse_all, read
from raytracer.formats.settings_section import DEFAULT_SIZE
from raytracer.scene.sequences import PROGRESSIVE
from raytracer.scene.settings import Settings
from raytracer.scene.settings_patch import UNSET, SettingsPatch

if TYPE_CHECKING:
    from raytracer.formats.image import Image


def render_arguments(parser: argparse.ArgumentParser) -> None:
    """What `render` takes."""
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", metavar="OUT", required=True, help=".png (8-bit sRGB) or .npz (float32 arrays)"
    )
    add_settings(parser, samples=1, adaptive=True)
    add_backend(parser)
    parser.description = (
        "Render a scene to a file, with the settings that are given here or else in the scene file's [settings], and "
        "say how wrong the picture is. The status is 1, though it is written, if --max-error was not reached with the "
        "samples or in the time there were."
    )


def view_arguments(parser: argparse.ArgumentParser) -> None:
    """What `view` takes."""
    from raytracer.app.viewer.events import CONTROLS, DEFAULT_SAMPLES

    add_scene(parser)
    add_settings(parser, DEFAULT_SAMPLES, PROGRESSIVE, adaptive=False)
    parser.add_argument(
        "--budget",
        metavar="MS",
        type=float,
        default=33.0,
        help="milliseconds that a moving picture's sample may take; above, its pixels are enlarged (default: 33)",
    )
    width = max(len(control.key) for control in CONTROLS)
    controls = "".join(f"  {control.key:{width}}  {control.does}\n" for control in CONTROLS)
    parser.epilog = f"mouse and keys:\n{controls}\n{parser.epilog}"


def render(options: argparse.Namespace) -> int:
    """Run `render`; the exit status."""
    # What is wrong is found as early as it can be: most of it before NumPy and OpenGL are loaded.
    chosen = chosen_settings(options)
    chosen.resolve()
    scene, section = parse_all(*read(options.scene))
    with about(f"{options.scene}: [settings] and the options given"):  # that exclude each other
        settings = (section.settings | chosen).resolve()
    size = chosen_size(options) or section.size or DEFAULT_SIZE

    # Next to nothing of what an import makes is garbage: it is not looked for, now or when all ends.
    gc.disable()
    from raytracer.core.output import check_output
    from raytracer.formats.image import SUFFIXES
    from raytracer.rendering.limits import host_memory
    from raytracer.rendering.renderer import shared_renderer

    gc.freeze()
    gc.enable()

    check_size(size)
    output = check_output(options.output, SUFFIXES)
    geometry = output.suffix.lower() == ".npz"
    check_memory(host_memory(size, geometry, settings.refines), size)
    warn_about(options.scene, scene, settings)
    renderer = shared_renderer(options.backend, options.device)
    start = time.monotonic()
    # Beyond the driver's limits is the scene.
    with about(options.scene), progress_bar(f"rendering {output.name}") as progress:
        image = renderer.render(scene, size, settings, geometry=geometry, progress=progress, only=True)
    image.save(output)
    took = time.monotonic() - start
    say(f"wrote {output}: {size[0]}x{size[1]}, {_samples(image, settings)}, {took:.1f} s", str(image.estimate))
    if missed := _missed(image, settings):
        if _is_error_chosen(section.settings, chosen):
            complain(f"{output}: {missed}")
            return 1
        say(missed)  # the samples are as many as the user wants: no mistake
    return 0


def _samples(image: Image, settings: Settings) -> str:
    """How many samples the pixels of a picture got."""
    fewest = most = settings.samples
    if image.samples is not None:
        fewest, most = image.samples.min(), image.samples.max()
    text = f"{most} sample{'s' if most > 1 else ''} a pixel"
    if image.samples is not None and fewest < most:
        text = f"{fewest} to {text}, {image.samples.mean():.2f} on average"
    return text


def _missed(image: Image, settings: Settings) -> str:
    """What to say of a picture that is not, or not known to be, as accurate as was asked for; else ""."""
    estimate = image.estimate
    assert estimate
    if settings.max_error is None or (estimate.rmse is not None and estimate.rmse < settings.max_error):
        return ""
    found = f"its error is unknown ({estimate.unknown})"
    if estimate.rmse is not None:
        found = f"its error is about {estimate.rmse:.2g}"
    if settings.time is not None and image.samples is not None and image.samples.max() < settings.samples:
        remedy = f"{settings.time:g} s were not enough: try more --time"
    else:
        remedy = f"{settings.samples} samples were not enough: try more --samples"
    return f"{found} and was to be below {settings.max_error:g}; {remedy}"


def _is_error_chosen(of_file: SettingsPatch, chosen: SettingsPatch) -> bool:
    """Whether a user gave max_error as a number. A quality gives it with so many samples at most."""
    patches = (of_file, chosen) if chosen.quality is UNSET else (chosen,)
    return any(patch.max_error not in (UNSET, None) for patch in patches)


def view(options: argparse.Namespace) -> int:
    """Run `view`; the exit status."""
    budget = number(options.budget, "--budget", 0.001, 1e6, "milliseconds in [0.001, 1e6]") / 1000.0
    chosen = chosen_settings(options)
    chosen.resolve()

    from raytracer.app.viewer.window import view as show

    size = chosen_size(options)
    if size:
        check_size(size)
    try:
        show(options.scene, chosen, size, budget)
    except KeyboardInterrupt:  # one of the ways to close the window
        return STATUS
    return 0
