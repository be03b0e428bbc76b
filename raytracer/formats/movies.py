"""Movies from pictures of 8 bits: .mp4 and .webm by PyAV, lossless .webp and .png (APNG) by Pillow."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from raytracer.core.memory import physical_memory
from raytracer.core.progress import Progress
from raytracer.core.suggest import missing_extra
from raytracer.core.validation import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL.Image import Image

    # The picture of a frame: sRGB uint8 [H, W, 3], or [H, W, 4] with alpha.
    Picture = NDArray[np.uint8]
    # A function that returns the picture of a frame, counted from 0.
    Pictures = Callable[[int], Picture]

# The constant rate factor if the user chooses none: x264's scale, on which 18 is called visually lossless.
DEFAULT_CRF = 18
# The largest constant rate factors: 51 for x264, 63 for VP9. They share the smaller range.
MAX_CRF = 51
# The denominator of a rate: 29.97 is 2997/100, and 23.976 is 2997/125.
_MOST_PER_SECOND = 1000
# FFmpeg's code of BT.709, for primaries, transfer function and matrix alike, and of the range 16 to 235.
_BT709, _LIMITED, _FULL = 1, 1, 2
# The largest side of WebP, in pixels.
_MAX_WEBP_SIDE = 16383


class Movie(NamedTuple):
    """A movie format.

    Attributes:
        about: the format in words, for messages.
        write: a function of (file, pictures, count, frames per second, constant rate factor, progress).
        codec: the name of the encoder in FFmpeg, or "" for a format that Pillow writes.
        max_side: the largest width and height in pixels.
        keeps_all: whether the library keeps all frames in memory, 4 bytes per pixel.
        has_alpha: whether the format keeps transparency.
    """

    about: str
    write: Callable[[IO[bytes], Pictures, int, float, int, Progress], None]
    codec: str
    max_side: int
    keeps_all: bool
    has_alpha: bool


def check_movie(path: Path, size: tuple[int, int], count: int) -> Movie:
    """Return the format of a movie by its suffix, after checks that need no frames.

    Args:
        path: the file of the movie.
        size: (width, height) in pixels.
        count: the number of frames.

    Raises:
        InputError: another suffix, a size that the format cannot have, or more frames than the memory can hold.
        RuntimeError: a package is missing. The message names the extra.
    """
    form = MOVIES.get(path.suffix.lower())
    if form is None:
        raise InputError(f"expected a movie that ends in {', '.join(MOVIES)}", file=str(path))
    if max(size) > form.max_side:
        got = f"{size[0]}x{size[1]}"
        raise InputError(f"expected at most {form.max_side} pixels a side for {path.suffix}, got {got}", file=str(path))
    needed, physical = 4 * size[0] * size[1] * count, physical_memory()
    if form.keeps_all and physical is not None and needed > physical:
        raise InputError(
            f"expected frames that fit into {physical / 2**30:.1f} GiB of memory together, as {path.suffix} needs, got "
            f"{needed / 2**30:.1f} GiB; .webp is lossless, too",
            file=str(path),
        )
    if form.codec:
        _import_av()
    return form


def write_movie(
    path: Path, file: IO[bytes], pictures: Pictures, count: int, fps: float, crf: int, progress: Progress
) -> None:
    """Write a movie.

    Args:
        path: the file's final name, whose suffix is one of MOVIES.
        file: the file, opened for writing, with a name.
        pictures: a function that returns the picture of a frame, counted from 0. All have the same shape. At most a
            few pictures are in memory at a time, except for .png.
        count: the number of frames, at least 1.
        fps: frames per second.
        crf: the constant rate factor of .mp4 and .webm: 0 is the best picture. Lossless formats ignore it.
        progress: a function of (frames written, frames).
    """
    MOVIES[path.suffix.lower()].write(file, pictures, count, fps, crf, progress)


def _import_av() -> Any:
    try:
        import av
    except ImportError:
        raise RuntimeError(missing_extra("movies of .mp4 and .webm need", "PyAV", "video")) from None
    return av


def _write_mp4(file: IO[bytes], pictures: Pictures, count: int, fps: float, crf: int, progress: Progress) -> None:
    # With the index in front, a browser plays the movie while it loads.
    _encode(file, pictures, count, fps, {"crf": str(crf)}, ("mp4", "libx264", {"movflags": "+faststart"}), progress)


def _write_webm(file: IO[bytes], pictures: Pictures, count: int, fps: float, crf: int, progress: Progress) -> None:
    # Without a bit rate of 0, VP9 takes the factor as a bound only. Rows are encoded by several threads.
    options = {"crf": str(crf), "b": "0", "row-mt": "1"}
    _encode(file, pictures, count, fps, options, ("webm", "libvpx-vp9", {}), progress)


def _encode(
    file: IO[bytes],
    pictures: Pictures,
    count: int,
    fps: float,
    options: dict[str, str],
    container: tuple[str, str, dict[str, str]],
    progress: Progress,
) -> None:
    """Encode a video of BT.709 with 4:2:0 chroma, which every player shows.

    Args:
        file, pictures, count, fps, progress: see write_movie().
        options: the options of the encoder.
        container: the name of the container, the name of the encoder, and the options of the container.

    Raises:
        RuntimeError: the encoder refuses the frames.
    """
    av = _import_av()
    try:
        _encode_frames(av, file, pictures, count, fps, options, container, progress)
    except av.FFmpegError as error:
        raise RuntimeError(f"expected frames that {container[1]} can encode: {error.strerror}") from None


def _encode_frames(
    av: Any,
    file: IO[bytes],
    pictures: Pictures,
    count: int,
    fps: float,
    options: dict[str, str],
    container: tuple[str, str, dict[str, str]],
    progress: Progress,
) -> None:
    name, codec, flags = container
    height, width = pictures(0).shape[:2]
    # By its name, because the index can be moved to the front of a file with a name only.
    with av.open(file.name, "w", format=name, options=flags) as output:
        stream = output.add_stream(codec, rate=_rate(fps), options=options)
        stream.width, stream.height, stream.pix_fmt = width + width % 2, height + height % 2, "yuv420p"
        context = stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        context.color_range = _LIMITED
        for k in range(count):
            frame = av.VideoFrame.from_ndarray(_pad(pictures(k)[..., :3]), format="rgb24")
            frame = frame.reformat(
                format="yuv420p",
                src_color_range=_FULL,
                dst_color_range=_LIMITED,
                dst_colorspace=_BT709,
                interpolation="LANCZOS",  # of the chroma; it loses less of coloured edges than the default
            )
            frame.pts = k
            frame.time_base = 1 / _rate(fps)
            output.mux(stream.encode(frame))
            progress(k + 1, count)
        output.mux(stream.encode())


def _rate(fps: float) -> Fraction:
    """Return frames per second as a fraction."""
    return Fraction(fps).limit_denominator(_MOST_PER_SECOND)


def _pad(picture: Picture) -> Picture:
    """Return a picture of even width and height: 4:2:0 chroma has squares of 2x2 pixels. The edge is repeated."""
    import numpy as np  # imported here, because the help of the command line needs none

    height, width = picture.shape[:2]
    return np.ascontiguousarray(np.pad(picture, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge"))


def _write_webp(file: IO[bytes], pictures: Pictures, count: int, fps: float, crf: int, progress: Progress) -> None:
    _save_all(file, "WEBP", pictures, count, fps, progress, lossless=True)


def _write_apng(file: IO[bytes], pictures: Pictures, count: int, fps: float, crf: int, progress: Progress) -> None:
    _save_all(file, "PNG", pictures, count, fps, progress)


def _save_all(
    file: IO[bytes], form: str, pictures: Pictures, count: int, fps: float, progress: Progress, **options: Any
) -> None:
    """Write an endless loop of pictures by Pillow, which asks for one frame after another."""
    # Each frame ends at a whole millisecond, the unit of the formats, so that rounding errors do not add up.
    ends = [round(1000.0 * k / fps) for k in range(count + 1)]
    durations = [end - start for start, end in pairwise(ends)]
    _frames(pictures, count, progress).save(file, format=form, save_all=True, duration=durations, loop=0, **options)


def _frames(pictures: Pictures, count: int, progress: Progress) -> Image:
    """Return a Pillow image of several frames, which are read when Pillow comes to them."""
    from PIL import Image  # takes long to import

    class Frames(Image.Image):
        n_frames = count
        is_animated = count > 1

        def __init__(self) -> None:
            super().__init__()
            self._at, self._loaded = 0, -1
            self.load()

        def seek(self, frame: int) -> None:
            if frame >= count:
                raise EOFError
            self._at = frame

        def load(self) -> Any:
            # Pillow comes to each frame twice, first for its mode alone.
            if self._at != self._loaded:
                picture = Image.fromarray(pictures(self._at))
                self.im, self._mode, self._size, self._loaded = picture.im, picture.mode, picture.size, self._at
                progress(self._at + 1, count)
            return super().load()

        def tell(self) -> int:
            return self._at

    return Frames()


# Movie formats by suffix.
MOVIES: dict[str, Movie] = {
    ".mp4": Movie("H.264", _write_mp4, "libx264", 16384, False, False),
    ".webm": Movie("VP9", _write_webm, "libvpx-vp9", 65535, False, False),
    ".webp": Movie("lossless WebP", _write_webp, "", _MAX_WEBP_SIDE, False, True),
    ".png": Movie("APNG", _write_apng, "", 2**31 - 1, True, True),
}
