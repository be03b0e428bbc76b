"""Renderer: renders scenes to images on one device, and keeps the last scene on the GPU."""

from __future__ import annotations

from typing import Any, NamedTuple

from raytracer.compiler.bright_features import bright_features
from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.draws import SAMPLES_AT_ONCE
from raytracer.compiler.features import NO_FEATURES
from raytracer.compiler.frame import Frame, make_frame
from raytracer.compiler.meshes import Rectangle
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate, picture_texts
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.rendering.accumulation import is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.geometry import DrawnGeometry, GeometryRequest
from raytracer.rendering.picture_arrays import PictureArrays
from raytracer.rendering.pixel_blocks import surrounding_area
from raytracer.rendering.programs import ScenePrograms, picture_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import TILE, split, tile_size
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# The number of samples of all pixels together from which a program for plane-only cells saves more time than it takes
# to compile. With adaptive sampling, skipped samples count, too.
_WORTH_PLANE_ONLY = 2**20
# The most pixels of targets that stay after a picture: at up to 65 bytes per pixel, with measurements, 136 MB.
_KEPT_PIXELS = 2**21
# The most bytes of a frame's numbers that stay, in memory and on the GPU: 10,000 objects and a light take a tenth.
_KEPT_BYTES = 2**26


def metadata(
    scene: Scene, size: tuple[int, int], settings: Settings, estimate: Estimate | None = None
) -> dict[str, str]:
    """Return the text entries of a picture's file, by name."""
    return picture_texts(scene.name, f"{size[0]}x{size[1]}, {settings}", estimate)


class _Kept(NamedTuple):
    """The last scene, which stays on the GPU."""

    frame: Frame
    plane_only: bool  # whether plane-only cells have a program of their own
    several: bool  # whether there may be a program for several samples at once in plane-only cells
    transparent: bool  # whether the programs are those of a transparent picture
    programs: ScenePrograms
    tiles: TileRenderer
    measurements: BlockMeasurements | None

    def is_large(self) -> bool:
        """Whether the scene takes more memory than may stay between pictures."""
        width, height = self.tiles.target
        numbers = sum(part.nbytes for parts in self.frame.textures.values() for part in parts)
        return width * height > _KEPT_PIXELS or numbers > _KEPT_BYTES

    def shows(self, compiled: CompiledScene, size: tuple[int, int], part: Rectangle, *, plane_only: bool) -> bool:
        """Whether the frame fits a part of a picture of this scene and size."""
        frame = self.frame
        is_same = frame.compiled is compiled and frame.size == size and frame.part == part
        return is_same and self.plane_only == plane_only

    def draws(self, compiled: CompiledScene, *, plane_only: bool, several: bool, transparent: bool) -> bool:
        """Whether the programs fit that scene."""
        known = self.frame.compiled
        has_objects = compiled.scene.objects is known.scene.objects  # compile() lets equal objects be the same
        is_alike = compiled is known or (has_objects and compiled.structure == known.structure)
        has_programs = self.plane_only == plane_only and (self.several or not several)
        has_programs &= self.transparent == transparent
        return is_alike and has_programs and self.programs.are_current()


class Renderer:
    """Renders scenes on one device.

    The numbers, programs and targets of the last scene stay, up to _KEPT_PIXELS and _KEPT_BYTES. The next picture of
    the same scene needs no preparation, and a scene with the same objects needs little.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: _Kept | None = None

    def render(
        self,
        scene: Scene,
        size: tuple[int, int],
        settings: Settings,
        *,
        part: Rectangle | None = None,
        geometry: bool = True,
        progress: Progress | None = None,
        tile: int = TILE,
        single_picture: bool = False,
        estimates: bool = True,
        transparent: bool = False,
    ) -> Image:
        """Render `scene` as `rt.render()` does.

        Args:
            scene, size, settings, geometry, progress, transparent: see `rt.render()`
            part: the pixels to draw (x, y, width, height), with the lower left one first, in whole cells of CELL pixels
                or up to the picture's edge. The image then shows only them, and needs memory only for them: without a
                stopping rule, it has the same bits as the whole picture; with one, its error is measured for itself.
                `geometry` must be False. Default: the whole picture.
            tile: side of the largest target in pixels
            single_picture: whether this is the process's only picture, which leaves out programs that take longer to
                compile than they save
            estimates: whether to estimate the image's error. A stopping rule estimates the error in any case.
        """
        options, (width, height) = settings.sampling, size
        estimates |= options.has_stopping_rule
        whole = 0, 0, width, height
        part = part or whole
        assert part == whole or not geometry
        kept = self._kept
        compiled = compile(scene, settings.compile_options, kept.frame.compiled if kept else None)
        self.device.limits.check(compiled)
        tile = min(tile, self.device.limits.target - 2 * margin(options))
        features = None
        if estimates:
            # If the samples do not support an error estimate, no features are needed.
            features = bright_features(compiled, size).within(part, size) if options.estimates_error else NO_FEATURES
        arrays = PictureArrays(part, options, features, transparent=transparent)
        # Plane-only cells have programs of their own if these save more time than their compilation takes.
        plane_only = not single_picture or width * height * options.samples >= _WORTH_PLANE_ONLY
        # With a time limit, samples are drawn one by one.
        several = options.samples >= SAMPLES_AT_ONCE and options.time is None
        largest = tile_size(part[2:], tile, is_drawn_once=options.samples == 1)
        around = 2 * margin(options)
        target = min(width, largest[0] + around), min(height, largest[1] + around)
        with self.device.turn():
            try:
                shown = surrounding_area(part, whole) if around else part
                loaded = self._load(
                    compiled, size, shown, target, plane_only=plane_only, several=several, transparent=transparent
                )
                tiles, measurements = loaded.tiles, None
                if is_measured(options, estimates=estimates):
                    measurements = loaded.measurements
                    if measurements is None or not measurements.are_current():
                        measurements = BlockMeasurements(self.device, tiles.player, tiles.target)
                    loaded = loaded._replace(measurements=measurements)
                self._kept = loaded
                seconds = arrays.draw(tiles, measurements, list(split(part, largest)), size, progress)
            except BaseException:
                self.close()
                raise
            if loaded.is_large():
                self.close()
        source: Any = DrawnGeometry(self.device, GeometryRequest(compiled, size, tile)) if geometry else None
        estimate = arrays.estimate(seconds)
        return Image(
            arrays.radiance,
            depth=source,
            normal=source,
            material=source,
            samples=arrays.samples,
            error=arrays.errors() if geometry and estimates else None,
            estimate=estimate,
            metadata=metadata(scene, size, settings, estimate),
            alpha=arrays.alpha,
            camera=scene.camera,
        )

    def _load(
        self,
        compiled: CompiledScene,
        size: tuple[int, int],
        part: Rectangle,
        target: tuple[int, int],
        *,
        plane_only: bool,
        several: bool,
        transparent: bool,
    ) -> _Kept:
        """Upload the parts of a scene that are not on the GPU, for a part of the picture of `size`.

        `target` is the size of the largest tile.
        """
        kept = self._kept
        if kept and kept.shows(compiled, size, part, plane_only=plane_only):
            frame = kept.frame
        else:
            previous = kept.frame if kept else None
            frame = make_frame(compiled, size, self.device.limits, previous, part=part, plane_only=plane_only)
        if kept and kept.draws(compiled, plane_only=plane_only, several=several, transparent=transparent):
            programs, several = kept.programs, kept.several
        else:
            programs = picture_programs(
                self.device, compiled, plane_only=plane_only, several=several, transparent=transparent
            )
        is_small = kept is None or kept.tiles.target[0] < target[0] or kept.tiles.target[1] < target[1]
        if kept is None or is_small or kept.transparent != transparent:
            self.close()
            tiles = TileRenderer(self.device, target, transparent=transparent)
            kept = _Kept(frame, plane_only, several, transparent, programs, tiles, None)
        self._kept = kept._replace(frame=frame, plane_only=plane_only, several=several, programs=programs)
        kept.tiles.load(programs.by_name, frame)
        return self._kept

    def close(self) -> None:
        """Release the kept scene. The next picture uploads its scene again. The context must be current."""
        kept, self._kept = self._kept, None  # before the release, which an interrupt may end
        if kept:
            kept.tiles.close()


# The renderer of each shared device. Shared devices are never released: gpu/device.py keeps one for each backend and
# adapter.
_shared: dict[Device, Renderer] = {}


def shared_renderer(device: Device) -> Renderer:
    """Return the renderer of a shared device, which all calls of rt.render() use."""
    return _shared.setdefault(device, Renderer(device))
