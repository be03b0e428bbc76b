"""The renderer: a scene becomes an image on one device, which keeps the scene that was drawn last."""

from __future__ import annotations

from typing import Any, NamedTuple

from raytracer.compiler.bright_features import bright_features
from raytracer.compiler.compiled_scene import CompiledScene, compile
from raytracer.compiler.draws import TOGETHER
from raytracer.compiler.features import NO_FEATURES
from raytracer.compiler.frame import Frame, make_frame
from raytracer.core.progress import Progress
from raytracer.formats.estimate import Estimate
from raytracer.formats.image import Image
from raytracer.gpu.device import Device
from raytracer.rendering.accumulation import is_measured, margin
from raytracer.rendering.block_measurements import BlockMeasurements
from raytracer.rendering.geometry import DrawnGeometry, GeometryRequest
from raytracer.rendering.picture_arrays import PictureArrays
from raytracer.rendering.programs import ScenePrograms, picture_programs
from raytracer.rendering.tile_renderer import TileRenderer
from raytracer.rendering.tiles import TILE, split, tile_size
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings

# Samples of all pixels together, adaptive ones as if none were left out: a picture of fewer gains less by a program for
# plane-only cells than it takes to compile.
_WORTH_PLANE_ONLY = 2**20
# Pixels of the targets that stay after a picture: at up to 65 bytes a pixel, with measurements, 136 MB.
_KEPT_PIXELS = 2**21
# Bytes of a frame's numbers that stay, here and on the GPU: 10,000 objects and a light take a tenth.
_KEPT_BYTES = 2**26


def metadata(
    scene: Scene, size: tuple[int, int], settings: Settings, estimate: Estimate | None = None
) -> dict[str, str]:
    """The text in a picture's file: names and values."""
    from raytracer.version import __version__

    text = {
        "Title": scene.name,
        "Software": f"raytracer {__version__}",
        "Description": f"{size[0]}x{size[1]}, {settings}",
    }
    if estimate:
        text |= {"Samples": f"{estimate.samples:.6g}", "Seconds": f"{estimate.seconds:.3g}", "Error": str(estimate)}
    return text


class _Kept(NamedTuple):
    """The scene that was drawn last, on the GPU."""

    frame: Frame
    plane_only: bool  # whether its plane-only cells are known, and have a program
    several: bool  # whether they may have a program for several samples at once
    programs: ScenePrograms
    tiles: TileRenderer
    measurements: BlockMeasurements | None

    def is_large(self) -> bool:
        """Whether the scene takes more memory than is kept between pictures."""
        width, height = self.tiles.target
        numbers = sum(part.nbytes for parts in self.frame.textures.values() for part in parts)
        return width * height > _KEPT_PIXELS or numbers > _KEPT_BYTES

    def shows(self, compiled: CompiledScene, size: tuple[int, int], *, plane_only: bool) -> bool:
        """Whether a picture of this scene and size has this frame."""
        return self.frame.compiled is compiled and self.frame.size == size and self.plane_only == plane_only

    def draws(self, compiled: CompiledScene, *, plane_only: bool, several: bool) -> bool:
        """Whether the programs draw that scene."""
        known = self.frame.compiled
        # By identity: to compare thousands of equal objects takes longer than to make the texts.
        has_objects = compiled.scene.objects is known.scene.objects
        is_alike = compiled is known or (has_objects and compiled.structure == known.structure)
        has_programs = self.plane_only == plane_only and (self.several or not several)
        return is_alike and has_programs and self.programs.are_current()


class Renderer:
    """Renders scenes on one device.

    The numbers, programs and targets of the scene drawn last stay, up to _KEPT_PIXELS and _KEPT_BYTES. The same scene
    is then drawn again without preparations, and one with the same objects with few.
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
        geometry: bool = True,
        progress: Progress | None = None,
        tile: int = TILE,
        single_picture: bool = False,
        estimates: bool = True,
    ) -> Image:
        """Render `scene` as `rt.render()` does. `tile` is the side of the largest target in pixels.

        A `single_picture` is the process's only one: programs that take longer to compile than they save are left out.
        Without `estimates` the image has no estimate of its error, unless samples are taken by the estimate.
        """
        options, (width, height) = settings.sampling, size
        estimates |= options.has_stopping_rule
        kept = self._kept
        compiled = compile(scene, settings.compile_options, kept.frame.compiled if kept else None)
        self.device.limits.check(compiled)
        tile = min(tile, self.device.limits.target - 2 * margin(options))
        features = None
        if estimates:
            # An error that the samples do not tell needs no features.
            features = bright_features(compiled, size) if options.estimates_error else NO_FEATURES
        arrays = PictureArrays(size, options, features)
        # Plane-only cells have programs of their own where those save more than their compilation takes.
        plane_only = not single_picture or width * height * options.samples >= _WORTH_PLANE_ONLY
        # Within a time, samples are drawn one by one.
        several = options.samples >= TOGETHER and options.time is None
        largest = tile_size(size, tile, is_drawn_once=options.samples == 1)
        around = 2 * margin(options)
        target = min(width, largest[0] + around), min(height, largest[1] + around)
        with self.device.turn():
            try:
                loaded = self._load(compiled, size, target, plane_only=plane_only, several=several)
                tiles, measurements = loaded.tiles, None
                if is_measured(options, estimates=estimates):
                    measurements = loaded.measurements
                    if measurements is None or not measurements.are_current():
                        measurements = BlockMeasurements(self.device, tiles.player, tiles.target)
                    loaded = loaded._replace(measurements=measurements)
                self._kept = loaded
                seconds = arrays.draw(tiles, measurements, list(split(size, largest)), progress)
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
        )

    def _load(
        self,
        compiled: CompiledScene,
        size: tuple[int, int],
        target: tuple[int, int],
        *,
        plane_only: bool,
        several: bool,
    ) -> _Kept:
        """Bring to the GPU the parts of a scene that are not there. `target` is the size of the largest tile."""
        kept = self._kept
        if kept and kept.shows(compiled, size, plane_only=plane_only):
            frame = kept.frame
        else:
            previous = kept.frame if kept else None
            frame = make_frame(compiled, size, self.device.limits, previous, plane_only=plane_only)
        if kept and kept.draws(compiled, plane_only=plane_only, several=several):
            programs, several = kept.programs, kept.several
        else:
            programs = picture_programs(self.device, compiled, plane_only=plane_only, several=several)
        if kept is None or kept.tiles.target[0] < target[0] or kept.tiles.target[1] < target[1]:
            self.close()
            kept = _Kept(frame, plane_only, several, programs, TileRenderer(self.device, target), None)
        self._kept = kept._replace(frame=frame, plane_only=plane_only, several=several, programs=programs)
        kept.tiles.load(programs.by_name, frame)
        return self._kept

    def close(self) -> None:
        """Release the kept scene. The next picture brings its own. The context must be current."""
        kept, self._kept = self._kept, None  # first, as an interrupt may come while it is given back
        if kept:
            kept.tiles.close()


# A device's renderer lives as long as the device: gpu/device.py keeps one of each kind.
_shared: dict[Device, Renderer] = {}


def shared_renderer(device: Device) -> Renderer:
    """The renderer of a shared device, for all calls of rt.render()."""
    return _shared.setdefault(device, Renderer(device))
