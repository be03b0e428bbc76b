"""The frame: all numbers of one view of a compiled scene, in the form that the shaders need. No OpenGL here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler import packing
from raytracer.compiler.chain_grids import Grids, update_grids
from raytracer.compiler.compiled_scene import CompiledScene
from raytracer.compiler.culling import occupied_cells, occupied_cells_of_light
from raytracer.compiler.direction_cells import Part, mask_shape
from raytracer.compiler.grounds import Mask, Sight, make_sight, shadowed_cells
from raytracer.compiler.limits import DriverLimits
from raytracer.compiler.material_layout import measured_tables
from raytracer.compiler.rounds import most_rounds, ray_rounds
from raytracer.compiler.scene_lists import (
    Caster,
    LightLists,
    light_casters,
    listed_cells,
    make_camera_lists,
    make_light_lists,
    turn_to_part,
)
from raytracer.compiler.surfaces import touched_surfaces
from raytracer.compiler.uniforms import frame_uniforms
from raytracer.compiler.view_space import View, make_view
from raytracer.core.validation import InputError

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

Key = tuple[object, ...]  # a cache key: all values that a part is computed from
_NO_RECTANGLES = np.zeros((0, 8), np.int32)


class SurfaceNumbers(msgspec.Struct, frozen=True, eq=False):
    """The numbers of surfaces: texels for 32 bits, or uniform blocks for 64."""

    key: Key
    coinciding: NDArray[np.int64]  # the coincidence numbers, packing.coincidences()
    blocks: dict[str, bytes]
    texels: NDArray[np.float32] | None
    bodies: NDArray[np.float32]  # the texels of body.glsl (T, 4); with 64 bits they are in the blocks


class MaterialNumbers(msgspec.Struct, frozen=True, eq=False):
    """The numbers of materials, with the tables of measured ones."""

    key: Key
    texels: NDArray[np.float32]
    measured: list[Measured]


class LightNumbers(msgspec.Struct, frozen=True, eq=False):
    """The numbers of lights."""

    key: Key
    touched: dict[Caster, int | None]  # the surface that each light lies on, by the light's position and radius
    block: bytes


class CellMasks(msgspec.Struct, frozen=True, eq=False):
    """The cells of a part that special programs may draw. Masks are (rows, columns), the lowest row first."""

    key: Key
    plane_only: Mask  # the plane-only cells that are not empty
    empty: Mask
    sight: Sight | None
    shadows: Mapping[Caster, Mask]  # the shadows of each light on half-spaces; valid while the key's first part stays


class Frame(msgspec.Struct, frozen=True, eq=False):
    """All numbers of one view. Unchanged parts are the same objects as in the previous frame."""

    compiled: CompiledScene
    size: tuple[int, int]
    part: Part  # the part of the picture whose cells have lists and masks
    view: View
    surfaces: SurfaceNumbers
    materials: MaterialNumbers
    lights: LightNumbers
    lists: LightLists | None
    grids: Grids | None  # of long chains
    cells: CellMasks
    uniforms: dict[str, object]
    rounds: int  # an upper bound of the rounds of loops for a pixel's rays: see cut_short.glsl

    @property
    def blocks(self) -> Mapping[str, bytes]:
        """The uniform blocks, by their names in the shaders."""
        return self.surfaces.blocks | {"Lights": self.lights.block}

    @property
    def textures(self) -> Mapping[str, tuple[NDArray[Any], ...]]:
        """The texels of buffer textures, by their names in the shaders: (N, 4) float32 or int32, (N, 2) or (N,) int32.

        Each texture consists of parts, one after the other. make_frame() has checked the driver's limits.
        """
        textures: dict[str, tuple[NDArray[Any], ...]] = {"materials": (self.materials.texels,)}
        if self.surfaces.texels is not None:
            textures["numbers"] = (self.surfaces.texels,)
        if len(self.surfaces.bodies):
            textures["bodies"] = (self.surfaces.bodies,)
        if self.lists:
            textures |= {"items": (self.lists.camera.items,), "objects": (self.lists.camera.objects,)}
            textures |= {"lists": self.lists.entries, "ends": self.lists.ends}
        if self.grids:
            textures |= {"grids": (self.grids.headers,), "gridLeaves": (self.grids.leaves,)}
        return textures

    @property
    def measured(self) -> list[Measured]:
        """The tables of measured materials, in their order in a volume texture."""
        return self.materials.measured

    @property
    def rectangles(self) -> NDArray[np.int32]:
        """The rectangles (N, 8) in which objects of common shapes may be seen, by Lister.rectangles()."""
        return self.lists.camera.rectangles if self.lists else _NO_RECTANGLES

    @property
    def camera_lists(self) -> NDArray[np.int32] | None:
        """Where the list of each cell of the part begins and ends (cells, 2); None without lists."""
        return self.lists.picture_ends if self.lists else None


def make_frame(
    compiled: CompiledScene,
    size: tuple[int, int],
    limits: DriverLimits,
    previous: Frame | None = None,
    *,
    part: Part | None = None,
    plane_only: bool = True,
) -> Frame:
    """Compute the numbers of a picture of `size` (width, height). The result shares unchanged parts with `previous`.

    Only the cells in a `part` of the picture, which begins at a cell's corner, have lists. Default: all cells. Without
    `plane_only`, the frame has no plane-only cells, only empty ones. Raises InputError for a scene that needs more
    texels or layers than the driver has, or candidate lists that take too much time or memory.
    """
    part = part or (0, 0, *size)
    view = _view(compiled, size, previous)
    surfaces = _surfaces(compiled, view, size, previous)
    materials = _materials(compiled, view, limits, previous)
    lists = _lists(compiled, view, surfaces, size, part, limits, previous)
    rounds = lists.rounds if lists else (ray_rounds(compiled),) * 2
    lights = _lights(compiled, view, surfaces, previous)
    grids = update_grids(compiled, view, previous.grids if previous else None)
    frame = Frame(
        compiled=compiled,
        size=size,
        part=part,
        view=view,
        surfaces=surfaces,
        materials=materials,
        lights=lights,
        lists=lists,
        grids=grids,
        cells=_cells(compiled, view, surfaces, lights, lists, size, part, plane_only, previous),
        uniforms=frame_uniforms(compiled, view, lists, size),
        rounds=most_rounds(compiled, *(ray + (grids.rounds if grids else 0) for ray in rounds)),
    )
    for name, parts in frame.textures.items():
        count = sum(map(len, parts))
        if count > limits.buffer_texels:
            elements = "entries in the lists of all cells" if name == "lists" else f"texels of {name}"
            limit = f"{limits.buffer_texels} {elements} (this driver's buffer textures)"
            raise InputError(f"expected at most {limit}, got {count}", "objects")
    return frame


def _view(compiled: CompiledScene, size: tuple[int, int], previous: Frame | None) -> View:
    """Return the surfaces in view space, shared with `previous` if they are unchanged."""
    camera = compiled.scene.camera
    kept = previous.view if previous and (camera.projection == "perspective" or previous.size == size) else None
    if kept and kept.surfaces is compiled.surfaces and kept.camera == camera:
        return kept
    return make_view(compiled.surfaces, camera, size)


def _surfaces(compiled: CompiledScene, view: View, size: tuple[int, int], previous: Frame | None) -> SurfaceNumbers:
    precision = compiled.options.precision
    key = view, compiled.batches, size, precision
    if previous and previous.surfaces.key == key:
        return previous.surfaces
    coinciding = packing.coincidences(view, precision)
    bodies = packing.face_texels(view, size, coinciding)
    if precision == 32:
        texels = packing.number_texels(view, size, coinciding, compiled.batches.order)
        with np.errstate(over="ignore"):  # a torus at 1e12 times its size, which has a warning of its precision
            return SurfaceNumbers(key, coinciding, {}, texels, bodies.astype(np.float32))
    terms = np.concatenate(packing.camera_terms(view, size, coinciding))
    blocks = {"Surfaces": packing.surface_rows(view).tobytes(), "CameraTerms": terms.tobytes()}
    blocks |= {"Bodies": bodies.tobytes()} if len(bodies) else {}
    return SurfaceNumbers(key, coinciding, blocks, None, np.zeros((0, 4), np.float32))


def _materials(compiled: CompiledScene, view: View, limits: DriverLimits, previous: Frame | None) -> MaterialNumbers:
    # Only directions depend on the camera: they are in view space.
    key = compiled.surfaces, compiled.materials, view.camera if compiled.layout.is_anisotropic else None
    if previous and previous.materials.key == key:
        return previous.materials
    tables = measured_tables(compiled.materials.values())
    if previous and tables == previous.measured:
        tables = previous.measured
    most = limits.volume_layers // len(tables[0].values) if tables else 0
    if len(tables) > most:
        raise InputError(f"expected at most {most} measured materials on this driver, got {len(tables)}", "materials")
    texels = packing.material_texels(compiled.surfaces, compiled.layout, compiled.materials, view.rotation)
    return MaterialNumbers(key, texels, tables)


def _lights(compiled: CompiledScene, view: View, surfaces: SurfaceNumbers, previous: Frame | None) -> LightNumbers:
    key = surfaces, compiled.lights
    if previous and previous.lights.key == key:
        return previous.lights
    known = previous.lights.touched if previous and previous.view.surfaces is view.surfaces else {}
    casters = light_casters(compiled.lights)
    new = {caster: light for caster, light in zip(casters, compiled.lights, strict=True) if caster not in known}
    touched_now = dict(zip(new, touched_surfaces(view.surfaces, list(new.values())), strict=True)) if new else {}
    touched = {caster: (known if caster in known else touched_now)[caster] for caster in casters}
    on = [touched[light.position, light.radius] for light in compiled.lights]
    block = packing.lights_block(view, compiled.lights, on, surfaces.coinciding, compiled.options.precision)
    return LightNumbers(key, touched, block)


def _lists(
    compiled: CompiledScene,
    view: View,
    surfaces: SurfaceNumbers,
    size: tuple[int, int],
    part: Part,
    limits: DriverLimits,
    previous: Frame | None,
) -> LightLists | None:
    if not compiled.has_lists:
        return None
    assert surfaces.texels is not None
    if previous and previous.lists and previous.surfaces is surfaces:
        camera = previous.lists.camera
        camera = camera if camera.part == part else turn_to_part(camera, size, part)
    else:
        camera = make_camera_lists(view, compiled.batches, surfaces.texels, size, part)
    return make_light_lists(
        camera,
        compiled.shadowing_lights,
        compiled.surfaces.bounded,
        limits.buffer_texels,
        has_mirrors=compiled.has_mirrors,
        previous=previous.lists if previous else None,
    )


def _cells(
    compiled: CompiledScene,
    view: View,
    surfaces: SurfaceNumbers,
    numbers: LightNumbers,
    lists: LightLists | None,
    size: tuple[int, int],
    part: Part,
    plane_only: bool,
    previous: Frame | None,
) -> CellMasks:
    planes = compiled.batches.planes if plane_only else []
    # Without plane-only cells only empty cells matter, and these show no shadow.
    lights = compiled.shadowing_lights if planes and compiled.surfaces.bounded else ()
    camera, grid = (lists.camera, lists.grid) if lists else (None, 0)
    stays = surfaces, compiled.batches, camera, grid, size, part, plane_only, compiled.has_plane_only_cells
    key = stays, light_casters(lights)
    if previous and previous.cells.key == key:
        return previous.cells
    known = previous.cells if previous and previous.cells.key[0] == stays else None
    if not compiled.has_plane_only_cells:
        none = np.zeros(mask_shape(part), bool)
        return CellMasks(key, none, none, None, {})
    if known and known.sight:
        sight = known.sight
    else:
        solids = compiled.scene.solids
        occupied = listed_cells(lists.camera) if lists else occupied_cells(view, solids(), size, part)
        sight = make_sight(view, compiled.batches.planes, occupied, size, part)
    free = sight.free
    shadows: dict[Caster, Mask] = {}
    for i, light in enumerate(lights):
        caster = light.position, light.radius
        if caster not in shadows:
            shadows[caster] = (
                known.shadows[caster]
                if known and caster in known.shadows
                else _shadows(compiled, view, surfaces, numbers, lists, sight, i)
            )
            free = free & ~shadows[caster]
    empty = sight.empty & free
    return CellMasks(key, free & ~empty if planes else np.zeros_like(free), empty, sight, shadows)


def _shadows(
    compiled: CompiledScene,
    view: View,
    surfaces: SurfaceNumbers,
    numbers: LightNumbers,
    lists: LightLists | None,
    sight: Sight,
    number: int,
) -> Mask:
    """Find the cells of a picture in which a light casts shadows on half-spaces."""
    light = compiled.lights[number]
    touched = numbers.touched[light.position, light.radius]
    same = surfaces.coinciding
    grazed = [] if touched is None else [p for p in compiled.batches.planes if same[p] == same[touched]]

    def occupied() -> Mask:
        if lists:
            return lists.own[number].lists.occupied()
        return occupied_cells_of_light(view, compiled.scene.solids(), light)

    return shadowed_cells(sight, light, view, grazed, occupied)
