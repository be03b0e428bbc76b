"""Jobs that draw one picture each, in any process: a frame of a movie, or a picture of a sweep."""

from __future__ import annotations

import hashlib
import io
import json
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from raytracer.core.record import Record
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.formats.image_files import FORMATS
from raytracer.gpu.device import shared_device
from raytracer.rendering.renderer import shared_renderer
from raytracer.scene.canonical import canonical
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.version import __version__

if TYPE_CHECKING:
    from raytracer.gpu.context import Backend

# The names of the texts that a job adds to the metadata of its file: the key of the job, the driver that drew the
# picture, and whether the picture reached the requested error.
KEY, DRIVER, REACHED = "Key", "Driver", "Reached"


class FrameJob(Record, frozen=True):
    """A picture to draw.

    Attributes:
        scene: the scene.
        size: (width, height) in pixels.
        settings: the settings.
        suffix: the file format of the picture, such as ".png".
        transparent: whether the picture has the coverage of surfaces as alpha. Default: False.
        bits: bits per channel of a .png, or None for the default.
        backend: way to open OpenGL, or None for the default of the process that draws.
        device: EGL device, or None for the default of the process that draws.
    """

    scene: Scene
    size: tuple[int, int]
    settings: Settings
    suffix: str
    transparent: bool = False
    bits: int | None = None
    backend: Backend | None = None
    device: int | str | None = None

    def key(self) -> str:
        """Return a hash of everything that the picture depends on except for the driver."""
        facts: dict[str, Any] = {
            "scene": canonical(self.scene),
            "name": self.scene.name,
            "size": self.size,
            "settings": msgspec.structs.asdict(self.settings),
            "suffix": self.suffix,
            "transparent": self.transparent,
            "bits": self.bits,
            "version": __version__,
        }
        return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


class DrawnFrame(NamedTuple):
    """A drawn picture.

    Attributes:
        data: the content of the picture's file.
        driver: the name of the driver that drew the picture.
        seconds: the time for drawing and encoding.
        samples: the mean number of samples per pixel.
        estimate: the estimated error.
    """

    data: bytes
    driver: str
    seconds: float
    samples: float
    estimate: Estimate


def draw_frame(job: FrameJob) -> DrawnFrame:
    """Draw a picture and return the content of its file, as draw_image() does."""
    frame, _ = draw_image(job)
    return frame


def draw_image(job: FrameJob) -> tuple[DrawnFrame, Image]:
    """Draw a picture, and return the content of its file and the image, which are those of `rt.render` on this driver.

    The file's metadata has the job's key and the driver, which FrameStore.read_current() compares.

    Raises InputError for a scene beyond the driver's limits.
    """
    start = time.monotonic()
    form = FORMATS[job.suffix]
    device = shared_device(job.backend, job.device)
    image = shared_renderer(device).render(
        job.scene, job.size, job.settings, geometry=form.has_geometry, transparent=job.transparent
    )
    estimate = image.estimate
    assert estimate
    driver = device.limits.driver
    texts = {KEY: job.key(), DRIVER: driver, REACHED: "no" if estimate.reached is False else "yes"}
    file = io.BytesIO()
    image.replace(metadata={**image.metadata, **texts}).write(file, job.suffix, job.bits)
    frame = DrawnFrame(file.getvalue(), driver, time.monotonic() - start, estimate.samples, estimate)
    return frame, image
