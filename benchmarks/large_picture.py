"""Peak memory and time of a large picture in bands, each size in a process of its own.

    python -m benchmarks.large_picture 16384 32768 --suffix .exr

For each side, it writes a square picture of the scene `assignment` with 1 sample per pixel into a temporary folder, and
prints one line: the size, the seconds, the size of the file and the peak of the resident
memory by getrusage(). The goal is a peak below 1 GB for 32768x32768.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path

from raytracer.farm.band_rows import default_rows
from raytracer.farm.bands import BandJob, write_bands
from raytracer.farm.tasks import run_here
from raytracer.formats.scene_file import load
from raytracer.scene.settings import Settings


def measure(side: int, suffix: str, rows: int | None, folder: str) -> None:
    """Write one picture and print its line."""
    size = side, side
    rows = rows or default_rows(size)
    begin = time.monotonic()
    last = begin

    def progress(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last > 30.0:
            print(f"  {done} of {total} rows, {now - begin:.0f} s, peak {_peak():.0f} MB", flush=True)
            last = now

    with tempfile.NamedTemporaryFile(dir=folder, suffix=suffix) as file:
        write_bands(file, BandJob(load("assignment"), size, Settings(), (0, side), suffix), rows, run_here, progress)
        file.flush()
        seconds, count = time.monotonic() - begin, Path(file.name).stat().st_size
    print(f"{side}x{side} {suffix}, bands of {rows} rows: {seconds:.1f} s, {count / 1e6:.0f} MB, peak {_peak():.0f} MB")


def _peak() -> float:
    """Return the peak of this process's resident memory, in MB (10^6 bytes)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6  # Linux counts in KiB


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sides", metavar="SIDE", nargs="*", type=int, default=[16384], help="Default: 16384. Pixels.")
    parser.add_argument("--suffix", default=".exr", choices=(".exr", ".png"), help="Default: .exr.")
    parser.add_argument("--rows", type=int, help="rows of a band. Default: as `raytracer render`.")
    parser.add_argument("--folder", default=tempfile.gettempdir(), help="Default: the folder for temporary files.")
    options = parser.parse_args()
    for side in options.sides:
        process = multiprocessing.get_context("spawn").Process(
            target=measure, args=(side, options.suffix, options.rows, options.folder)
        )
        process.start()
        process.join()
        if process.exitcode:
            raise SystemExit(f"{side}x{side}: the process ended with {process.exitcode}")  # a negative one is a signal


if __name__ == "__main__":
    main()
