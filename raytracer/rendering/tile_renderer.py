"""Tile renderer: draws the samples of tiles one after another, and reads their sums."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.draws import Sample, sample_at, sample_draws
from raytracer.compiler.frame import Frame
from raytracer.compiler.light_scale import light_scale, scale_light
from raytracer.compiler.meshes import (
    EMPTY,
    PER_CELL,
    PICTURE,
    PLANE_ONLY,
    SEE,
    SEVERAL,
    SHADE,
    SHAPES,
    Coverage,
    Mask,
    Meshes,
    Rectangle,
    tile_meshes,
)
from raytracer.compiler.rounds import MAX_ROUNDS
from raytracer.core.validation import InputError
from raytracer.formats.image import Geometry
from raytracer.gpu.device import Device
from raytracer.gpu.draw_player import DrawPlayer
from raytracer.gpu.gl import Program, set_constants
from raytracer.gpu.scene_buffers import SceneBuffers
from raytracer.scene.options import SamplingOptions

# The value of CUT_SHORT in cut_short.glsl.
_CUT_SHORT = -(2**31)
# Less than INF in real.glsl, and more than any light.
_INFINITE = 1e29
# The textures of which each tile has its own: the sums of its samples, a kept copy of earlier sums, and the sums before
# the current ones.
_SUMS = "radiance", "coverage", "earlierSum", "summedBefore"
_PROGRAMS = SEE, SHAPES, SHADE, PICTURE, PLANE_ONLY, SEVERAL, EMPTY


class TileRenderer:
    """Draws tiles into targets of `target` (width, height) pixels. Holds targets and scene on the GPU until closed.

    With `geometry` there is also a target for distances and normals, which the program SEE draws. If `transparent`,
    there is one for the coverage, and the programs must be those of a transparent picture.
    """

    def __init__(
        self, device: Device, target: tuple[int, int], *, geometry: bool = False, transparent: bool = False
    ) -> None:
        self.player = DrawPlayer(device)
        self.target = target
        self.has_geometry = geometry
        self.is_transparent = transparent
        self.draws_together = False  # whether SAMPLES_AT_ONCE samples at once take less time than one after another
        self._is_software = device.limits.is_llvmpipe
        self._buffers = SceneBuffers(device.context)
        self._frame: Frame | None = None
        self._light_scale = 1.0  # the factor of all light on the GPU
        self._tiles: dict[Rectangle, Meshes] = {}  # the meshes of whole tiles
        self._masked: dict[Rectangle, tuple[Mask, Meshes]] = {}  # the last mask of each tile, and its meshes
        self._others: dict[int, dict[str, str]] = {}  # names of the textures of tiles besides the first
        self._size = target  # size of the textures of sums
        if geometry:
            self.player.add_texture("normalDepth", target, 4)
        # RGB: the sums of the samples, times the light_scale; alpha: the sums of their squared lengths.
        self.player.add_texture("radiance", target, 4)
        if transparent:
            self.player.add_texture("coverage", target, 1)  # the numbers of samples that hit a surface

    def load(self, programs: Mapping[str, Program], frame: Frame) -> None:
        """Upload the numbers of a frame, and use `programs` (by name) to draw it.

        Does nothing if frame and programs are the current ones. Raises ShaderError if a uniform of a program has the
        wrong type.
        """
        if frame is self._frame and programs is self._programs:
            return
        self._frame = None  # until everything is uploaded
        self._to_world = frame.view.rotation.astype(np.float32)
        self._rounds = frame.rounds
        self._upload(frame, 1.0)
        self._material_index = np.append(frame.compiled.surfaces.material, np.int32(-1))  # index -1 is the background
        self.player.use(programs, replaced=_PROGRAMS)
        self._tiles.clear()
        self._masked.clear()
        self._coverage = _coverage(programs, frame)
        self._list_readers = [name for name, program in programs.items() if "list" in program]
        self._seen = self._find_seen(programs)
        self._shades = SHADE in programs or PICTURE in programs
        self.draws_together = SEVERAL in programs
        for program in programs.values():
            set_constants(program, self._constants)  # raises ShaderError for a uniform of the wrong type
            self._buffers.attach(program)
        self._frame, self._programs = frame, programs

    def _upload(self, frame: Frame, light_scale: float) -> None:
        """Upload the numbers of `frame`, with all light multiplied by `light_scale`."""
        frame = frame if light_scale == 1.0 else scale_light(frame, light_scale)
        self._buffers.upload(frame)
        self._constants = {**frame.uniforms, "two": 2}
        self._light_scale = light_scale

    def light_scale(self, brightest: float) -> float:
        """Return the light_scale for the scene, if its brightest sample is `brightest`."""
        assert self._frame
        return light_scale(self._frame, brightest)

    def _find_seen(self, programs: Mapping[str, Program]) -> tuple[str, ...]:
        """Create the textures that SEE and SHAPES draw into, and return their names."""
        if PICTURE in programs:
            return ()
        if not self.player.has_texture("surface"):
            self.player.add_texture("surface", self.target, 1, "i4")
        others = SHAPES in programs and "others" in programs[SHAPES]
        if others and not self.player.has_texture("others"):
            self.player.add_texture("others", self.target, 2)
        if SHAPES in programs and not self.player.has_texture("depth"):
            self.player.add_depth("depth", self.target)
        geometry = ("normalDepth",) if self.has_geometry else ()
        return ("surface", *(("others",) if others else ()), *geometry)

    def turn_to(self, tile: int, size: tuple[int, int]) -> None:
        """Switch to the sums of another `tile` (0, 1, ...) with this `size`. A new renderer starts with tile 0."""
        if tile and tile not in self._others:
            self._others[tile] = {name: f"{name} {tile}" for name in _SUMS}
        self.player.rename(self._others.get(tile, {}))
        self._size = size if tile else self.target
        if not self.player.has_texture("radiance"):
            for name in ("radiance", "earlierSum"):
                self.player.add_texture(name, self._size, 4)
            if self.is_transparent:
                self.player.add_texture("coverage", self._size, 1)

    def drop_others(self) -> None:
        """Switch to tile 0, and release the sums of all other tiles."""
        self.turn_to(0, self.target)
        for names in self._others.values():
            for name in names.values():
                self.player.remove_texture(name)
        self._others.clear()

    def seen_cells(self, area: Rectangle) -> Mask:
        """Return for each cell of an area of whole cells whether anything may be visible in it (rows, columns)."""
        return self._coverage.seen_cells(area)

    def draw(
        self,
        tile: Rectangle,
        samples: Sequence[Sample],
        mask: Mask | None = None,
        *,
        light_scale: float = 1.0,
        target: str = "radiance",
    ) -> None:
        """Draw samples of a tile and wait for them. They are added to the sums, or begin new sums.

        Args:
            tile: the tile; with a `mask`, it must begin where a cell begins
            samples: 1 or SAMPLES_AT_ONCE samples
            mask: the blocks to draw, in whole cells (rows, columns), the lowest row first. Default: all.
            light_scale: the factor of all light, a power of two. Default: 1.
            target: the texture of the sums, "radiance" or "replicate". Default: "radiance".

        Raises InputError if shaders are cut short because they do not terminate.
        """
        if light_scale != self._light_scale:
            assert self._frame
            self._upload(self._frame, light_scale)
        if not self.player.has_texture(target):
            self.player.add_texture(target, self.target, 4)
        self._play(self._meshes_of(tile, mask), tile, samples, target)
        if samples[0].starts_sum and self._is_software and self._rounds > MAX_ROUNDS:
            if self._shades:
                self.read_sums((0, 0, *tile[2:]))
            if self.has_geometry:  # there are no sums of light to check
                self._read_surface(tile[2:])

    def _meshes_of(self, tile: Rectangle, mask: Mask | None) -> Meshes:
        if mask is None:
            if tile not in self._tiles:
                self._tiles[tile] = tile_meshes(self._coverage, tile, None, self._list_readers)
            return self._tiles[tile]
        if tile not in self._masked or not np.array_equal(self._masked[tile][0], mask):
            self._masked[tile] = mask, tile_meshes(self._coverage, tile, mask, self._list_readers)
        return self._masked[tile][1]

    def _play(self, meshes: Meshes, tile: Rectangle, samples: Sequence[Sample], target: str = "radiance") -> None:
        self._buffers.bind()
        targets = (target, "coverage") if self.is_transparent and target == "radiance" else (target,)
        self.player.play(
            sample_draws(
                meshes, tile, samples, self._seen, shades=self._shades, constants=self._constants, targets=targets
            )
        )

    def warm(self) -> None:
        """Warm up: make the driver compile everything that single samples need, by drawing one cell."""
        coverage, area = self._coverage.one_cell(), (0, 0, CELL, CELL)
        options = SamplingOptions(samples=2)
        whole = tile_meshes(coverage, area, None, self._list_readers)
        blocks = tile_meshes(coverage, area, np.ones((PER_CELL, PER_CELL), bool), self._list_readers)
        for meshes, number in ((whole, 0), (whole, 1), (blocks, 1)):
            self._play(meshes, area, [sample_at(number, options)])
        self.player.forget_times()

    def read_sums(self, part: Rectangle, out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Read the sums of red, green and blue in a part of the target (H, W, 3), the top row first.

        The sums contain the light_scale as a factor. `out` is a C-contiguous array for them. Default: a new array.
        Raises InputError if shaders were cut short in some pixels.
        """
        sums = np.empty((part[3], part[2], 3), np.float32) if out is None else out
        self.player.read_top_first("radiance", part, sums)
        if self._rounds > MAX_ROUNDS:
            _check_rounds(sums.min(initial=0.0) < -_INFINITE)
        return sums

    def read_coverage(self, part: Rectangle) -> NDArray[np.float32]:
        """Read the numbers of samples that hit a surface in a part of the target (H, W), the top row first."""
        return self.player.read("coverage", part, 1)[::-1, :, 0]

    def read_replicate(self, part: Rectangle) -> NDArray[np.float32]:
        """Read the sums in a part of the texture "replicate" (H, W, 3), the lowest row first."""
        return self.player.read("replicate", part, 3)

    def write_sums_before(self, total: NDArray[np.floating]) -> None:
        """Upload the sums before the current ones (H, W, 3), the top row first, with the same light_scale."""
        if not self.player.has_texture("summedBefore"):
            self.player.add_texture("summedBefore", self._size, 3)
        self.player.write("summedBefore", total[::-1].astype(np.float32))

    def read_geometry(self, size: tuple[int, int]) -> Geometry:
        """Read the geometry of the last sample, in the lower left part of this size."""
        seen = self.player.read("normalDepth", (0, 0, *size), 4)[::-1]
        surface = self._read_surface(size)
        depth = np.where(surface == 0, np.float32(np.inf), seen[..., 3])
        return Geometry(depth, seen[..., :3] @ self._to_world, self._material_index[np.abs(surface) - 1])

    def _read_surface(self, size: tuple[int, int]) -> NDArray[np.int32]:
        """Read the surfaces in the lower left part of this size (H, W), the top row first. Errors: see read_sums()."""
        surface = self.player.read("surface", (0, 0, *size), 1)[..., 0]
        _check_rounds(surface.min() == _CUT_SHORT)
        return surface[::-1]

    def close(self) -> None:
        """Release all GPU resources."""
        self.player.close()
        self._buffers.close()


def _coverage(programs: Collection[str], frame: Frame) -> Coverage:
    """Return the cells and rectangles that each program draws."""
    own = {EMPTY: frame.cells.empty, PLANE_ONLY: frame.cells.plane_only, SEVERAL: frame.cells.plane_only}
    cells = {name: mask for name, mask in own.items() if name in programs}
    others = np.ones_like(frame.cells.empty)
    for mask in cells.values():
        others &= ~mask
    cells |= {name: others for name in (SEE, SHADE, PICTURE) if name in programs}
    rectangles = frame.rectangles if SHAPES in programs else None
    return Coverage(frame.part, cells, frame.camera_lists, rectangles)


def _check_rounds(cut_short: bool) -> None:
    """Raise InputError if shaders were cut short (cut_short.glsl)."""
    if cut_short:
        raise InputError(
            f"expected pixels whose rays take at most {MAX_ROUNDS} steps from primitive to primitive and in sums of "
            "reflectance models, all lights together (llvmpipe computes no more), got one whose rays take more; "
            "remedies are fewer primitives in one object, fewer lights, fewer nodes of diffuse_microfacet, fewer terms "
            "of he, or a graphics card",
            "objects",
        )
