"""Make the pictures of README.md, docs/tutorial.md and docs/solids.md in docs/pictures/: `make pictures`.

A picture of a scene comes from its page: this program saves the page's TOML blocks, and runs the page's own
`raytracer render` commands and its Python. The other pictures are figures from examples/lecture_figures.py, two
enlarged crops, and the window on its own display (Xvfb). The same software on the same machine makes the same files,
except for the time in the title of viewer.png.

    python -m tools.pictures [NAME ...]

NAME: only these pictures, by their file names without .png.
"""

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import raytracer as rt
from examples import lecture_figures as figures
from tests.displays import window
from tests.pages import blocks, page_text
from tests.processes import run_for_output, run_to_end
from tests.scenes import CHECKOUT

FOLDER = CHECKOUT / "docs/pictures"
PAGES = ("README.md", "docs/tutorial.md", "docs/solids.md")

# Sizes in pixels. Pages show rows of five, four and two pictures at about half of these sizes, because GitHub shrinks a
# table to its page, which is about 830 wide. So pictures are sharp on displays with two pixels for one.
STAGE, OPTION, WINDOW = (300, 300), (380, 284), (1120, 630)
# The window beside README's lens.png of 640x600, with a bar of this height for the title. The letters of the title are
# as large as the page's own text when the page shows the picture 410 wide.
TITLED, TITLE_BAR, TITLE_LETTER = (640, 564), 36, 18
# VIEW of the lecture figures, wider and turned up, so that the light's marker is in the picture.
TITLED_CAMERA = figures.VIEW.replace(look_at=(0, 2.45, 0.3), vertical_fov=44)
TITLE_GROUND, TITLE_INK = (46, 48, 56), (236, 236, 240)
# Seconds: longer than the window shows its first hint, "H: help".
HINT_SECONDS = 7.0
# The corner of the solid at the cut: edges in all directions. (left, upper, right, lower) of a picture of CROPPED.
CROPPED, CROP = (320, 240), (90, 98, 128, 126)
# The camera of the window, which has the default shape: VIEW of the lecture figures, turned so that the table of keys
# is beside the solid.
WINDOW_CAMERA = figures.VIEW.replace(look_at=(-0.6, 1.8, 0.9), vertical_fov=34)
# Samples per pixel of the window's picture.
WINDOW_SAMPLES = 256

Pixels = NDArray[np.uint8]


def page_pictures(page: str, is_requested: Callable[[str], bool]) -> Iterator[tuple[str, Pixels]]:
    """Run the page's own `raytracer render` commands and `image.save()` scripts, and yield their pictures."""
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    with tempfile.TemporaryDirectory() as folder:
        texts = {language: [] for language in ("bash", "python")}
        for block in blocks(page):
            if block.file:
                (Path(folder) / block.file).write_text(block.text)
            elif block.language in texts:
                texts[block.language].append(block.text)
        for command in "".join(texts["bash"]).splitlines():
            output = re.match(r"raytracer render .*-o ([\w-]+)\.png", command)
            if output and is_requested(output[1]):
                run = [sys.executable, "-m", *shlex.split(command)]
                subprocess.run(run, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
                yield output[1], pixels_of(Path(folder) / f"{output[1]}.png")
        for code in texts["python"]:
            output = re.search(r'image\.save\("([\w-]+)\.png"\)', code)
            if output and is_requested(output[1]):
                run = [sys.executable, "-c", code]
                subprocess.run(run, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
                yield output[1], pixels_of(Path(folder) / f"{output[1]}.png")


def pixels_of(path: Path) -> Pixels:
    """Return the pixels of an image file as (H, W, 3)."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def csg_stages() -> Iterator[tuple[str, Pixels]]:
    """Make the stages of the CSG solid."""
    names = "csg-a", "csg-b", "csg-and", "csg-or", "csg-minus"
    for name, image in zip(names, figures.stage_images(STAGE).values(), strict=True):
        yield name, image.srgb8()


def roth_diagram() -> Iterator[tuple[str, Pixels]]:
    """Make the Roth diagram."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "roth.png"
        figures.roth_figure().savefig(path, dpi=90)
        yield "roth", pixels_of(path)


def shadow_kinds() -> Iterator[tuple[str, Pixels]]:
    """Make a picture of each kind of shadow."""
    for shadows, image in figures.shadow_images(OPTION).items():
        yield f"shadows-{shadows}", image.srgb8()


def highlights() -> Iterator[tuple[str, Pixels]]:
    """Make a picture of each highlight."""
    for model, image in figures.highlight_images(OPTION).items():
        yield model, image.srgb8()


def antialiasing() -> Iterator[tuple[str, Pixels]]:
    """Make enlarged crops with 1 sample and with 16, pixels as squares."""
    scene = figures.scene_of(figures.STAGES["((A & B) | C) - D"])
    for samples in (1, 16):
        crop = Image.fromarray(rt.render(scene, CROPPED, samples=samples).srgb8()).crop(CROP)
        yield f"samples-{samples}", np.asarray(crop.resize(OPTION, Image.Resampling.NEAREST))


def window_with_keys() -> Iterator[tuple[str, Pixels]]:
    """Make the window with its table of keys."""
    _, pixels = shown_window(WINDOW, WINDOW_CAMERA, "key h")
    yield "window", pixels


def window_with_title() -> Iterator[tuple[str, Pixels]]:
    """Make the window without the table, for a display of two pixels for one, under a bar with its title.

    Xvfb has no window manager, so this function draws the bar. The text is the window's own title, with the time of the
    last sample.
    """
    title, pixels = shown_window(TITLED, TITLED_CAMERA, "", scale=2)
    bar = Image.new("RGB", (TITLED[0], TITLE_BAR), TITLE_GROUND)
    font = ImageFont.load_default(TITLE_LETTER)
    while font.getlength(title) > TITLED[0] - 2 * TITLE_LETTER:  # as a window manager shortens a title
        title = title.removesuffix("...")[:-1] + "..."
    ImageDraw.Draw(bar).text((TITLE_LETTER, TITLE_BAR / 2), title, TITLE_INK, font, anchor="lm")
    yield "viewer", np.concatenate([np.asarray(bar), pixels])


def shown_window(size: tuple[int, int], camera: rt.Camera, actions: str, scale: int = 1) -> tuple[str, Pixels]:
    """Return the title and the pixels of a window that shows the assignment, after all samples.

    Args:
        size: width and height of the window, pixels of the display.
        camera: replaces the camera of the assignment.
        actions: words for xdotool, such as "key h". None if empty.
        scale: display scale, by which the window enlarges its letters.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "assignment.toml").write_text(with_camera("assignment", camera))
        arguments = "assignment.toml", "--shadows", "soft", "--samples", str(WINDOW_SAMPLES)
        wide, high = size[0] // scale, size[1] // scale  # the window multiplies its size by the scale
        with window(Path(folder), *arguments, size=(wide, high), display=size, scale=scale) as opened:
            if actions:
                opened.act(actions)
            search = "xdotool", "search", "--name", f" {WINDOW_SAMPLES} of {WINDOW_SAMPLES} samples"
            opened.wait_until(
                lambda: run_to_end(*search, env=opened.variables).returncode == 0, "the picture was not refined"
            )
            # The title changes before the last picture is on the display, and the hint over the picture ends later.
            time.sleep(HINT_SECONDS)
            title = run_for_output(*search, "getwindowname", env=opened.variables).strip()
            pixels = opened.grab_picture(size).astype(np.uint8)
            opened.close()
    return title, pixels


def with_camera(example: str, camera: rt.Camera) -> str:
    """Return the text of an example scene file with another camera."""
    text = (CHECKOUT / f"assets/scenes/{example}.toml").read_text()
    for key in ("position", "look_at", "vertical_fov"):
        value = getattr(camera, key)
        line = f"{key} = {list(value) if isinstance(value, tuple) else value}"
        text = re.sub(rf"(?m)^{key} = .*$", line, text, count=1)  # the camera is the first table
    return text


# The pictures that each function makes, so that a run for some names does no other work.
MAKERS: dict[Callable[[], Iterator[tuple[str, Pixels]]], tuple[str, ...]] = {
    csg_stages: ("csg-a", "csg-b", "csg-and", "csg-or", "csg-minus"),
    roth_diagram: ("roth",),
    shadow_kinds: ("shadows-off", "shadows-hard", "shadows-diluted", "shadows-soft"),
    highlights: ("phong", "blinn"),
    antialiasing: ("samples-1", "samples-16"),
    window_with_keys: ("window",),
    window_with_title: ("viewer",),
}


def main() -> None:
    """Make the pictures, and report their sizes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    names = {*parser.parse_args().names}
    shown = {name for page in PAGES for name in re.findall(r"pictures/([\w-]+)\.png", page_text(page))}

    def is_requested(name: str) -> bool:
        return name in (names or shown)

    def made() -> Iterator[tuple[str, Pixels]]:
        for page in PAGES:
            yield from page_pictures(page, is_requested)
        for maker, own in MAKERS.items():
            if any(map(is_requested, own)):
                yield from maker()

    FOLDER.mkdir(exist_ok=True)
    for name, pixels in made():
        path = FOLDER / f"{name}.png"
        Image.fromarray(pixels).save(path, optimize=True)
        print(f"{path.relative_to(CHECKOUT)}: {pixels.shape[1]}x{pixels.shape[0]}, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
