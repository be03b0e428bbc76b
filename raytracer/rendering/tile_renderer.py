"""The renderer of tiles: it draws one sample of a tile after another, and reads their sums."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.draws import Sample, sample_at, sample_draws
from raytracer.compiler.frame import Frame
from raytracer.compiler.light_scale import in_light, light_scale
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

# The constant CUT_SHORT of cut_short.glsl.
_CUT_SHORT = -(2**31)
# Less than INF of real.glsl, more than any light.
_INFINITE = 1e29
# The textures that each tile has of its own: the sums of its samples, those sums of which a copy was kept, and the sums
# before them.
_SUMS = "radiance", "earlierSum", "summedBefore"
_PROGRAMS = SEE, SHAPES, SHADE, PICTURE, PLANE_ONLY, SEVERAL, EMPTY


class TileRenderer:
    """Targets of `target` (width, height) pixels, and a scene's numbers, on the GPU until closed.

    With `geometry` there are targets for distances and normals, too, for a program SEE that gives them.
    """

    def __init__(self, device: Device, target: tuple[int, int], *, geometry: bool = False) -> None:
        self.player = DrawPlayer(device)
        self.target = target
        self.has_geometry = geometry
        self.draws_together = False  # whether TOGETHER samples take less time at once than one after another
        self._is_software = device.limits.is_llvmpipe
        self._buffers = SceneBuffers(device.context)
        self._frame: Frame | None = None
        self._light_scale = 1.0  # times which light is on the GPU
        self._tiles: dict[Rectangle, Meshes] = {}  # of whole tiles
        self._masked: dict[Rectangle, tuple[Mask, Meshes]] = {}  # of parts of tiles: of each those drawn last
        self._others: dict[int, dict[str, str]] = {}  # the names of textures of tiles besides the first
        self._size = target  # of the textures of sums
        if geometry:
            self.player.add_texture("normalDepth", target, 4)
        # The sums of the samples times a light_scale, and in a of their squared lengths.
        self.player.add_texture("radiance", target, 4)

    def load(self, programs: Mapping[str, Program], frame: Frame) -> None:
        """Take the numbers of a frame. `programs` draw its structure, by their names.

        Does nothing for the frame and the programs that are there. Raises ShaderError if a program has a uniform of
        another type than it should have.
        """
        if frame is self._frame and programs is self._programs:
            return
        self._frame = None  # until all of it is there
        self._to_world = frame.view.rotation.astype(np.float32)
        self._rounds = frame.rounds
        self._upload(frame, 1.0)
        self._material_index = np.append(frame.compiled.surfaces.material, np.int32(-1))  # so also at index -1
        self.player.use(programs, replaced=_PROGRAMS)
        self._tiles.clear()
        self._masked.clear()
        self._coverage = _coverage(programs, frame)
        self._list_readers = [name for name, program in programs.items() if "list" in program]
        self._seen = self._find_seen(programs)
        self._shades = SHADE in programs or PICTURE in programs
        self.draws_together = SEVERAL in programs
        for program in programs.values():
            set_constants(program, self._constants)  # a mistake in a type comes to light here
            self._buffers.attach(program)
        self._frame, self._programs = frame, programs

    def _upload(self, frame: Frame, light_scale: float) -> None:
        """Bring the numbers of `frame` to the GPU, with all light times `light_scale`."""
        frame = frame if light_scale == 1.0 else in_light(frame, light_scale)
        self._buffers.upload(frame)
        self._constants = {**frame.uniforms, "two": 2}
        self._light_scale = light_scale

    def light_scale(self, brightest: float) -> float:
        """The light_scale for the scene where samples are so bright."""
        assert self._frame
        return light_scale(self._frame, brightest)

    def _find_seen(self, programs: Mapping[str, Program]) -> tuple[str, ...]:
        """Have the textures that SEE and SHAPES draw into, and name them."""
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
        """From now on draw, measure and read the sums of that `tile`, of `size`: 0, 1, ... At first it is tile 0."""
        if tile and tile not in self._others:
            self._others[tile] = {name: f"{name} {tile}" for name in _SUMS}
        self.player.rename(self._others.get(tile, {}))
        self._size = size if tile else self.target
        if not self.player.has_texture("radiance"):
            for name in ("radiance", "earlierSum"):
                self.player.add_texture(name, self._size, 4)

    def drop_others(self) -> None:
        """Turn to tile 0, and give back the sums of all others."""
        self.turn_to(0, self.target)
        for names in self._others.values():
            for name in names.values():
                self.player.remove_texture(name)
        self._others.clear()

    def seen_cells(self, area: Rectangle) -> Mask:
        """(rows, columns): in which cells of an area, whole ones, anything may be seen."""
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
        """Draw 1 or TOGETHER samples of a tile and wait for them: they are added to the sums, or begin new sums.

        The sums are in the texture `target`: "radiance", or "replicate" for sums beside them.

        With a `mask` only those blocks of the tile are drawn that are True in it: (rows, columns), whole cells, the
        lowest row first; the tile then begins where a cell does. The sums are of light times `light_scale`, a power of
        two. Raises InputError if shaders do not come to an end.
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
            if self.has_geometry:  # no light tells it
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
        self.player.play(
            sample_draws(
                meshes, tile, samples, self._seen, shades=self._shades, constants=self._constants, target=target
            )
        )

    def warm(self) -> None:
        """Have the driver compile everything that draws of single samples need, by draws of one cell."""
        coverage, area = self._coverage.one_cell(), (0, 0, CELL, CELL)
        options = SamplingOptions(samples=2)
        whole = tile_meshes(coverage, area, None, self._list_readers)
        blocks = tile_meshes(coverage, area, np.ones((PER_CELL, PER_CELL), bool), self._list_readers)
        for meshes, number in ((whole, 0), (whole, 1), (blocks, 1)):
            self._play(meshes, area, [sample_at(number, options)])
        self.player.forget_times()

    def read_sums(self, part: Rectangle, out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """(H, W, 3), top row first: the sums of red, green and blue in a part of the target, times the light_scale they
        were drawn with, in the array `out`, which must be C-contiguous, if there is one.

        Raises InputError if shaders did not come to an end in some pixels.
        """
        sums = np.empty((part[3], part[2], 3), np.float32) if out is None else out
        self.player.read_top_first("radiance", part, sums)
        if self._rounds > MAX_ROUNDS:
            _check_rounds(sums.min(initial=0.0) < -_INFINITE)
        return sums

    def read_replicate(self, part: Rectangle) -> NDArray[np.float32]:
        """(H, W, 3), the lowest row first: the sums in a part of the texture "replicate"."""
        return self.player.read("replicate", part, 3)

    def write_sums_before(self, total: NDArray[np.floating]) -> None:
        """Bring the sums before the target's to the GPU: (H, W, 3), the top row first, times the same light_scale."""
        if not self.player.has_texture("summedBefore"):
            self.player.add_texture("summedBefore", self._size, 3)
        self.player.write("summedBefore", total[::-1].astype(np.float32))

    def read_geometry(self, size: tuple[int, int]) -> Geometry:
        """The surfaces that the sample just drawn sees, in the lower left part of that size."""
        seen = self.player.read("normalDepth", (0, 0, *size), 4)[::-1]
        surface = self._read_surface(size)
        depth = np.where(surface == 0, np.float32(np.inf), seen[..., 3])
        return Geometry(depth, seen[..., :3] @ self._to_world, self._material_index[np.abs(surface) - 1])

    def _read_surface(self, size: tuple[int, int]) -> NDArray[np.int32]:
        """(H, W), top row first: the surfaces that the lower left part of that size sees. Errors as read_sums()."""
        surface = self.player.read("surface", (0, 0, *size), 1)[..., 0]
        _check_rounds(surface.min() == _CUT_SHORT)
        return surface[::-1]

    def close(self) -> None:
        """Give back everything on the GPU."""
        self.player.close()
        self._buffers.close()


def _coverage(programs: Collection[str], frame: Frame) -> Coverage:
    """Find which program draws which cells."""
    own = {EMPTY: frame.cells.empty, PLANE_ONLY: frame.cells.plane_only, SEVERAL: frame.cells.plane_only}
    cells = {name: mask for name, mask in own.items() if name in programs}
    others = np.ones_like(frame.cells.empty)
    for mask in cells.values():
        others &= ~mask
    cells |= {name: others for name in (SEE, SHADE, PICTURE) if name in programs}
    rectangles = frame.rectangles if SHAPES in programs else None
    return Coverage(frame.size, cells, frame.camera_lists, rectangles)


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
