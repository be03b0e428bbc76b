"""Movies of 48 frames: what is read back against the frames, and the time of a second run.

python -m benchmarks.movies [--size WxH] [--samples N]

Two scenes are animated: the assignment, whose light moves while the camera goes round, and the die, which turns by a
track of its transform. Each movie is written by `raytracer animate`, and read back by PyAV and Pillow. The table has
the number and the size of the frames, and the mean and the largest difference to the frames, in levels of 0 to 255.
The frames are drawn once: the seconds of the first movie include drawing. Then each frame is rendered once more by
rt.render, and its array is compared bit for bit.
"""

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.video.reformatter import Interpolation
from PIL import Image
from rich.console import Console
from rich.table import Table

import raytracer as rt
from raytracer.app.cli import main as raytracer
from raytracer.app.options import picture_size
from raytracer.formats.scene_file import examples

FRAMES = 48
TRACKS = {
    "assignment": """
turntable = 360
[[animation.tracks]]
path = "lights.0.position"
keys = { 0 = [4, 7, 4], 47 = [-4, 7, 4] }
interpolation = "smooth"
""",
    "die": """
[[animation.tracks]]
path = "parts.second.transform.1.degrees"
keys = { 0 = 38, 47 = 398 }
[[animation.tracks]]
path = "parts.second.transform.2.translate"
keys = { 0 = [1.75, 1.0, -0.9], 47 = [1.0, 1.0, -0.9] }
""",
}
MOVIES = ".mp4", ".webm", ".webp", ".png"
# Rounding of swscale is off by half a level without these flags.
_EXACT = Interpolation.BICUBIC | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT


def read_movie(path: Path) -> np.ndarray:
    """Return the frames of a movie as 8-bit sRGB [N, H, W, 3]."""
    if path.suffix in (".webp", ".png"):
        with Image.open(path) as movie:
            return np.stack([_seek(movie, k) for k in range(getattr(movie, "n_frames", 1))])
    with av.open(str(path)) as container:
        to_rgb: dict[str, Any] = {"format": "rgb24", "src_colorspace": 1, "src_color_range": 1, "dst_color_range": 2}
        frames = container.decode(video=0)
        return np.stack([f.reformat(**to_rgb, interpolation=_EXACT).to_ndarray() for f in frames])


def _seek(movie: Image.Image, frame: int) -> np.ndarray:
    movie.seek(frame)
    return np.asarray(movie.convert("RGB"))


def animate(scene: Path, output: Path, *options: str) -> float:
    """Run `raytracer animate` and return its seconds."""
    start = time.perf_counter()
    status = raytracer(["animate", str(scene), "-o", str(output), *options])
    assert status == 0, output
    return time.perf_counter() - start


def main() -> None:
    """Measure the movies of both scenes and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=picture_size, default=(480, 270), help="default: 480x270")
    parser.add_argument("--samples", type=int, default=4, help="samples per pixel; default: 4")
    chosen = parser.parse_args()
    width, height = chosen.size
    options = "--size", f"{width}x{height}", "--samples", str(chosen.samples), "--max-error", "none"
    table = Table("scene", "output", "frames", "size", "bytes", "mean difference", "largest", "seconds", "again")
    for name, tracks in TRACKS.items():
        with tempfile.TemporaryDirectory() as folder:
            scene = Path(folder, f"{name}.toml")
            scene.write_text(f"{examples()[name].read_text()}\n[animation]\nframes = {FRAMES}\n{tracks}")
            pattern = Path(folder, "%02d.npz")
            seconds, again = animate(scene, pattern, *options), animate(scene, pattern, *options)
            animation = rt.animation(scene)
            settings = rt.load_settings(scene).replace(samples=chosen.samples, max_error=None)
            images = [rt.render(animation.scene(k), chosen.size, settings) for k in range(FRAMES)]
            equal = sum(
                np.array_equal(np.load(folder + f"/{k:02}.npz")["radiance"], image.radiance)
                for k, image in enumerate(images)
            )
            bits = f"{equal} of {FRAMES} frames have the bits of rt.render"
            table.add_row(
                name, ".npz", str(FRAMES), f"{width}x{height}", "", bits, "", f"{seconds:.1f}", f"{again:.1f}"
            )
            pictures = np.stack([image.srgb8() for image in images]).astype(int)
            frames = Path(folder, "none")
            for suffix in MOVIES:
                movie = Path(folder, f"{name}{suffix}")
                if frames.exists():  # of the movie before
                    frames.rename(f"{movie}.frames")
                times = [f"{animate(scene, movie, *options, '--keep'):.1f}" for _ in range(2)]
                frames = Path(f"{movie}.frames")
                read = read_movie(movie)
                difference = np.abs(read[:, :height, :width] - pictures)
                facts = f"{read.shape[2]}x{read.shape[1]}", str(movie.stat().st_size), f"{difference.mean():.3f}"
                table.add_row(name, suffix, str(len(read)), *facts, str(difference.max()), *times)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
