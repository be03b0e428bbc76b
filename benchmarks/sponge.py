"""Times of the Menger sponge, a cube less its tunnels as one object: first picture, growth, and frames of the window.

python -m benchmarks.sponge [LEVEL ...]

A first picture is the user's call in Python in a process of its own: the sponge is built, compiled and rendered at
1280x720, with hard shadows. The growth compares the times of small pictures with POV-Ray's from level to level: the
median of our repeated calls, and the time for which POV-Ray traces rays. benchmarks/frames.py measures the frames.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import operator
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np

import raytracer as rt
from benchmarks import povray
from benchmarks.bench import TOLERANCE, seconds

SIZE = (1280, 720)
# For POV-Ray, which takes minutes for level 4 at SIZE, and half an hour for level 5.
SMALL = (320, 180)
ROUNDS, CALLS = 3, 9
LEVELS = 3, 4, 5
_HEADER = """\
[camera]
position = [2.2, 1.9, 2.6]
look_at = [0.5, 0.45, 0.5]
vertical_fov = 35.0

[[lights]]
position = [4.0, 5.0, 3.0]

[materials.sand]
kd = [0.8, 0.7, 0.5]

[shapes.cube]
box = { min = [0, 0, 0], max = [1, 1, 1] }
material = "sand"
"""

Corner = tuple[float, float, float]


def tunnels(level: int) -> Iterator[tuple[Corner, Corner]]:
    """Yield the corners of all tunnels of a sponge in the unit cube. The tunnels are longer than the cube."""
    for k in range(1, level + 1):
        side = 3.0**-k
        for i, j in itertools.product(range(3**k), repeat=2):
            middle = [i // 3**d % 3 == 1 and j // 3**d % 3 == 1 for d in range(k)]
            if middle != [True] + [False] * (k - 1):  # a middle of its own level, and of no earlier one
                continue
            a, b = i * side, j * side
            yield (-1.0, a, b), (2.0, a + side, b + side)
            yield (a, -1.0, b), (a + side, 2.0, b + side)
            yield (a, b, -1.0), (a + side, b + side, 2.0)


def scene(level: int) -> rt.Scene:
    """Return the scene of a sponge, built in Python."""
    sand = rt.Material(kd=(0.8, 0.7, 0.5))
    holes = (rt.Box(low, high, sand) for low, high in tunnels(level))
    sponge = functools.reduce(operator.sub, holes, rt.Box((0, 0, 0), (1, 1, 1), sand))
    camera = rt.Camera((2.2, 1.9, 2.6), (0.5, 0.45, 0.5), vertical_fov=35.0)
    return rt.Scene([sponge], [rt.PointLight((4, 5, 3))], camera)


def write_file(level: int, path: Path) -> None:
    """Write the scene of a sponge as a scene file."""
    lines = [_HEADER]
    names = ["cube"]
    for k, (low, high) in enumerate(tunnels(level)):
        names.append(f"hole{k}")
        lines.append(f'[shapes.hole{k}]\nbox = {{ min = {list(low)}, max = {list(high)} }}\nmaterial = "sand"\n')
    lines.append(f'[objects]\nsponge = "{" - ".join(names)}"\n')
    path.write_text("\n".join(lines), encoding="utf-8")


def first_picture(level: int) -> float:
    """Return the seconds from the first line of Python that builds the sponge to its picture."""
    start = time.perf_counter()
    rt.render(scene(level), SIZE, rt.Settings(samples=1))
    return time.perf_counter() - start


def compare_with_povray(level: int) -> tuple[float, float, float]:
    """Return the seconds of our small picture and of POV-Ray's, and the share of pixels that differ.

    Raises UnavailableError if POV-Ray is not installed.
    """
    sponge, settings = scene(level), rt.Settings(samples=1)
    picture, theirs = povray.run(povray.source(sponge, SMALL, settings), SMALL, 1)
    ours = rt.render(sponge, SMALL, settings).srgb8()  # compiles
    off = np.abs(ours.astype(int) - picture).max(axis=2) > TOLERANCE
    return median(seconds(lambda: rt.render(sponge, SMALL, settings)) for _ in range(CALLS)), theirs, float(off.mean())


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("levels", metavar="LEVEL", nargs="*", type=int, default=LEVELS)
    parser.add_argument("--first", action="store_true", help="print the seconds of one first picture")
    options = parser.parse_args()
    if options.first:
        print(first_picture(options.levels[0]))
        return
    print("| level | boxes | first picture, s |\n|---|---|---|")
    for level in options.levels:
        command = (sys.executable, "-m", "benchmarks.sponge", str(level), "--first")
        runs = [subprocess.run(command, check=True, capture_output=True, text=True) for _ in range(ROUNDS)]
        print(f"| {level} | {len(list(tunnels(level)))} | {median(float(run.stdout) for run in runs):.2f} |")
    print(flush=True)
    if povray.version():
        print(f"| level | {SMALL[0]}x{SMALL[1]}, s | POV-Ray's, s | ratio | pixels off |\n|---|---|---|---|---|")
        for level in options.levels:
            ours, theirs, off = compare_with_povray(level)
            print(f"| {level} | {ours:.4f} | {theirs:.2f} | {theirs / ours:.0f} | {off:.3%} |", flush=True)
        print(flush=True)
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"sponge{level}.toml" for level in options.levels]
        for level, path in zip(options.levels, paths, strict=True):
            write_file(level, path)
        subprocess.run((sys.executable, "-m", "benchmarks.frames", *map(str, paths)), check=True)


if __name__ == "__main__":
    main()
