"""Movies: read back by the libraries of players, they have the frames, the colours and the times of the pictures."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import raytracer as rt
from raytracer.formats import movies
from raytracer.formats.movies import MOVIES, check_movie, write_movie

Pictures = list[NDArray[np.uint8]]


def ramps(count: int, size: tuple[int, int] = (65, 43)) -> Pictures:
    """Pictures of slow ramps in all three channels, which move from frame to frame: chroma of 2x2 pixels shows them."""
    y, x = np.mgrid[0.0 : size[1], 0.0 : size[0]]
    phases = [np.stack([x / 120 + k / 5, y / 90 - k / 7, (x + y) / 150 + k / 3], axis=2) for k in range(count)]
    return [(127.5 + 127.5 * np.sin(phase)).astype(np.uint8) for phase in phases]


def write(path: Path, pictures: Pictures, fps: float = 24.0, crf: int = 10) -> Path:
    with path.open("wb") as file:
        write_movie(path, file, pictures.__getitem__, len(pictures), fps, crf, lambda done, total: None)
    return path


def read_video(path: Path) -> tuple[Pictures, Any, float]:
    """Return the frames, the codec and the frames per second of a movie, by the definition of BT.709 in float64."""
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        planes: Any = [frame.to_ndarray() for frame in container.decode(stream)]
        rate = stream.average_rate
        assert rate is not None
        codec = stream.codec_context
        facts = (codec.width, codec.height, codec.colorspace, codec.color_primaries, codec.color_trc, codec.color_range)
        return [from_bt709(plane, codec.width, codec.height) for plane in planes], facts, float(rate)


def from_bt709(planes: NDArray[np.uint8], width: int, height: int) -> NDArray[np.uint8]:
    luma = (planes[:height].astype(float) - 16.0) / 219.0
    u, v = (
        (half.reshape(height // 2, width // 2) - 128.0) / 224.0 for half in np.split(planes[height:].astype(float), 2)
    )
    blue, red = (np.kron(half, np.ones((2, 2))) for half in (u, v))
    r, b = luma + 1.5748 * red, luma + 1.8556 * blue
    rgb = np.stack([r, (luma - 0.2126 * r - 0.0722 * b) / 0.7152, b], axis=2)
    return (255.0 * rgb.clip(0.0, 1.0)).round().astype(np.uint8)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_video_has_the_frames_and_the_colours_of_its_pictures_in_bt709(suffix: str, tmp_path: Path) -> None:
    pictures = ramps(6)
    frames, facts, fps = read_video(write(tmp_path / f"a{suffix}", pictures, fps=23.976))
    # An odd size is one larger, by a repeated edge. 1 is BT.709, and the range 16 to 235.
    assert facts == (66, 44, 1, 1, 1, 1) and fps == pytest.approx(23.976, rel=1e-3)
    assert len(frames) == 6
    difference = np.stack(frames).astype(float) - [np.pad(p, ((0, 1), (0, 1), (0, 0)), "edge") for p in pictures]
    assert np.abs(difference).mean() < 1.0
    # The matrix of BT.601 or the full range would shift colours by 5 and more.
    assert np.abs(difference.mean(axis=(0, 1, 2))).max() < 0.5


@pytest.mark.parametrize(("suffix", "channels"), [(".webp", 3), (".png", 3), (".webp", 4), (".png", 4)])
def test_a_lossless_movie_has_the_pixels_and_the_durations(suffix: str, channels: int, tmp_path: Path) -> None:
    pictures = ramps(7)
    if channels == 4:
        alpha = np.full((43, 65, 1), 255, np.uint8)
        alpha[:20] = 128  # not 0, for which WebP may forget the colour
        pictures = [np.concatenate([picture, alpha], axis=2) for picture in pictures]
    with Image.open(write(tmp_path / f"a{suffix}", pictures, fps=30.0)) as movie:
        durations: list[float] = []
        for k, picture in enumerate(pictures):
            movie.seek(k)
            assert np.array_equal(np.asarray(movie.convert("RGBA" if channels == 4 else "RGB")), picture)
            durations.append(float(movie.info["duration"]))
        assert getattr(movie, "n_frames", 1) == 7 and movie.info["loop"] == 0
    assert durations == [33.0, 34.0, 33.0, 33.0, 34.0, 33.0, 33.0]


@pytest.mark.parametrize("suffix", MOVIES)
def test_a_movie_of_one_frame_can_be_read(suffix: str, tmp_path: Path) -> None:
    [picture] = ramps(1)
    path = write(tmp_path / f"a{suffix}", [picture], fps=0.001)
    if MOVIES[suffix].codec:
        assert len(read_video(path)[0]) == 1
    else:
        assert np.array_equal(np.asarray(Image.open(path).convert("RGB")), picture)


def test_a_better_quality_takes_more_bytes(tmp_path: Path) -> None:
    sizes = [write(tmp_path / f"{crf}.mp4", ramps(4, (320, 180)), crf=crf).stat().st_size for crf in (0, 18, 51)]
    assert sizes[0] > 2 * sizes[1] > 2 * sizes[2]


@pytest.mark.parametrize("suffix", MOVIES)
def test_each_picture_is_asked_for_when_it_is_written(suffix: str, tmp_path: Path) -> None:
    pictures, asked, path = ramps(9), list[int](), tmp_path / f"a{suffix}"

    def picture(k: int) -> NDArray[np.uint8]:
        asked.append(k)
        return pictures[k]

    with path.open("wb") as file:
        write_movie(path, file, picture, 9, 24.0, 18, lambda done, total: None)
    assert [*dict.fromkeys(asked)] == [*range(9)] and len(asked) <= 10  # the first one perhaps twice


def test_a_movie_beyond_its_format_or_the_memory_is_refused_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(rt.InputError, match=r"a\.gif: expected a movie that ends in \.mp4, \.webm, \.webp, \.png"):
        check_movie(Path("a.gif"), (64, 40), 2)
    with pytest.raises(rt.InputError, match=r"at most 16383 pixels a side for \.webp, got 20000x8"):
        check_movie(Path("a.webp"), (20000, 8), 2)
    monkeypatch.setattr(movies, "physical_memory", lambda: 2**30)
    with pytest.raises(rt.InputError, match=r"fit into 1\.0 GiB of memory together, as \.png needs, got 3\.6 GiB"):
        check_movie(Path("a.png"), (1000, 1000), 960)
    assert check_movie(Path("a.webp"), (1000, 1000), 960).has_alpha


def test_without_pyav_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with pytest.raises(RuntimeError, match=r"movies of \.mp4 and \.webm need PyAV, .*extra video"):
        check_movie(Path("a.mp4"), (64, 40), 2)


@pytest.mark.parametrize("fps", [0.001, 1.0, 23.976, 29.97, 59.94, 1000.0])
def test_a_rate_is_a_fraction_near_the_number(fps: float) -> None:
    rate = movies._rate(fps)
    assert abs(rate - Fraction(fps)) < Fraction(1, 10**9) and rate.denominator <= 1000
