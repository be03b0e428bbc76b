"""A picture in bands of rows, which are drawn one by one or by workers and written as they come.

So a picture needs no more memory than a few bands, however large it is. A band has the same bits as these rows of the
whole picture, unless a stopping rule (`max_error`) decides on its samples: then the band is a picture of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from raytracer.core.progress import Progress
from raytracer.core.validation import InputError
from raytracer.farm.tasks import Done, Failed, Run
from raytracer.formats.estimate import Estimate, join_estimates
from raytracer.formats.image_files import FORMATS, check_bits
from raytracer.formats.radiance import row_blocks
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import metadata, shared_renderer
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

if TYPE_CHECKING:
    from raytracer.gpu.context import Backend

# The number of rows that are written at a time, because writers copy them: four blocks of 16 rows, which EXR compresses
# together.
_WRITTEN_ROWS = 64


class BandJob(NamedTuple):
    """The inputs of one band.

    Attributes:
        scene, size, settings: as for render().
        rows: the first row of pixels from the bottom, a multiple of CELL, and the number of rows.
        suffix: the format of the picture's file, one with rows.
        bits: the number of bits per channel. None: the default of the format.
        transparent: whether the picture has an alpha.
        backend, device: as for render().
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings
    rows: tuple[int, int]
    suffix: str
    bits: int | None = None
    transparent: bool = False
    backend: Backend | None = None
    device: int | str | None = None


class DrawnBand(NamedTuple):
    """One band.

    Attributes:
        pixels: the pixels as the format stores them [rows, W, 3 or 4], the top row first.
        estimate: the estimated error of the band.
        fewest, most: the fewest and the most samples of a pixel.
    """

    pixels: NDArray[Any]
    estimate: Estimate
    fewest: int
    most: int


class BandedPicture(NamedTuple):
    """The picture that write_bands() has written: its estimate, and the fewest and the most samples of a pixel."""

    estimate: Estimate
    fewest: int
    most: int


def draw_band(job: BandJob) -> DrawnBand:
    """Draw one band. Any process can call this, once or often. Raises InputError as render() does."""
    form = FORMATS[job.suffix]
    assert form.rows
    renderer = shared_renderer(shared_device(job.backend, job.device))
    low, height = job.rows
    part = 0, low, job.size[0], height
    image = renderer.render(job.scene, job.size, job.settings, part=part, geometry=False, transparent=job.transparent)
    assert image.estimate
    bits = check_bits(job.suffix, job.bits)
    radiance, alpha = image.radiance, image.alpha
    # Some rows at a time, because to encode takes more memory than to store.
    encoded = [
        form.rows.encode(radiance[rows], None if alpha is None else alpha[rows], **bits)
        for rows in row_blocks(radiance.shape)
    ]
    counts = image.samples
    fewest, most = (job.settings.samples,) * 2 if counts is None else (int(counts.min()), int(counts.max()))
    return DrawnBand(np.concatenate(encoded), image.estimate, fewest, most)


def band_jobs(whole: BandJob, rows: int) -> Iterator[tuple[int, BandJob]]:
    """Yield (index, job) of each band of `rows` rows, from the top down. `whole` has all rows of the picture."""
    height = whole.size[1]
    # Bands begin at the lowest row, because the cells of a picture do.
    for index, low in enumerate(reversed(range(0, height, rows))):
        yield index, whole._replace(rows=(low, min(rows, height - low)))


def write_bands(file: IO[bytes], whole: BandJob, rows: int, run: Run, progress: Progress) -> BandedPicture:
    """Draw a picture in bands of `rows` rows, and write it to an open and empty file of the file system.

    `whole` has all rows of the picture. Bands are written from the top down. If workers return them in another order,
    the early ones wait in a folder beside the file, not in memory. `progress` gets the numbers of rows.

    Raises InputError if a band cannot be drawn, and OSError if the file cannot be written.
    """
    width, height = whole.size
    form = FORMATS[whole.suffix].rows
    assert form
    begin = metadata(whole.scene, whole.size, whole.settings)
    estimates: list[tuple[Estimate, int, int]] = []
    fewest, most, top = math.inf, 0, 0
    writer: Any = None
    progress(0, height)
    for band in _in_order(run(draw_band, band_jobs(whole, rows)), Path(file.name).parent):
        if writer is None:
            bits = check_bits(whole.suffix, whole.bits)
            writer = form.open(file, width, height, band.pixels.shape[2], begin, **bits)
        for first in range(0, len(band.pixels), _WRITTEN_ROWS):
            writer.write_rows(band.pixels[first : first + _WRITTEN_ROWS])
        estimates.append((band.estimate, len(band.pixels) * width, top))
        fewest, most = min(fewest, band.fewest), max(most, band.most)
        top += len(band.pixels)
        progress(top, height)
    estimate = join_estimates(estimates)
    texts = metadata(whole.scene, whole.size, whole.settings, estimate)
    writer.close({name: text for name, text in texts.items() if name not in begin})
    return BandedPicture(estimate, int(fewest), most)


def _in_order(outcomes: Iterable[Done | Failed], folder: Path) -> Iterator[DrawnBand]:
    """Yield the bands in their order. Early ones wait as files in a new folder in `folder`. Raises InputError."""
    due = 0
    waiting: dict[int, DrawnBand] = {}  # without their pixels
    with TemporaryDirectory(prefix=".bands-", dir=folder) as early:
        for outcome in outcomes:
            if isinstance(outcome, Failed):
                raise InputError(outcome.reason)
            index, band = outcome
            if index != due:
                np.save(Path(early, f"{index}.npy"), band.pixels, allow_pickle=False)
                waiting[index] = band._replace(pixels=np.empty(0))
                continue
            yield band
            due += 1
            while due in waiting:
                path = Path(early, f"{due}.npy")
                pixels = np.load(path, allow_pickle=False)
                path.unlink()
                yield waiting.pop(due)._replace(pixels=pixels)
                due += 1
