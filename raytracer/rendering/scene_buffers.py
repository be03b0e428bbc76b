"""A scene's numbers on the GPU: in buffer textures; lights, and doubles, in uniform blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from raytracer.compiler import candidate_lists, view_space
from raytracer.compiler.batches import groups
from raytracer.compiler.culling import Mask, Met
from raytracer.compiler.direction_cells import CELL
from raytracer.compiler.glsl import reflectance
from raytracer.compiler.glsl.shaders import (
    has_mirrors,
    is_listed,
    material_layout,
    most_rounds,
    rounds_of_ray,
    shaded_materials,
)
from raytracer.compiler.meshes import cells_under
from raytracer.compiler.program_rows import check_listed
from raytracer.compiler.rounds import OF_ENTRY
from raytracer.compiler.surfaces import table
from raytracer.core.validation import InputError
from raytracer.gpu.gl import BufferTexture, set_sampler, volume_texture
from raytracer.gpu.texture_units import SCENE_UNITS
from raytracer.scene.scene import PointLight, Scene
from raytracer.scene.settings import Settings

if TYPE_CHECKING:
    from raytracer.scene.materials.merl import Measured

# Binding points of uniform blocks.
_BLOCKS = {"Surfaces": 0, "CameraTerms": 1, "Lights": 2}
# Cells of a side of a cube's face around a light: in a picture of many objects, one of the first covers about a
# quarter of a cell. The coarse ones are for large lights.
GRIDS = (256, 128, 64, 32, 16, 8, 4, 2, 1)
# Cells are larger where the lists of all lights would have more of them than that, or more pairs of a cell and an
# object of a kind, or of a cell and a primitive of another object. They take 24, 40 and 150 bytes.
_MAX_CELLS, _MAX_ITEMS, _MAX_LISTED = 2**23, 2**24, 2**22
# Entries of the list of everything up to which rays to a light from beyond its reach go through that list: eight times
# the primitives of which `walk` makes the same bits. A longer list takes too long for pixels at a horizon, and more
# rounds than llvmpipe computes (cut_short.glsl). There the list of the cell has to do, which may then miss an object
# that the ray only grazes, to within the ray's own rounding.
_MOST_FROM_AFAR = 4096
# Spheres times lights: to find in which cells each is seen takes 0.7 microseconds, and up to 2.6 where the cells have
# to be made larger several times: 20 seconds.
_MAX_SEEN = 2**23


class Numbers:
    """Holds the numbers of one scene at a time, until closed."""

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._blocks: dict[str, moderngl.Buffer] = {}
        self._textures: dict[str, BufferTexture] = {}
        self._of_materials: object = None  # of which scene those are
        self._measured: moderngl.Texture3D | None = None
        self._measured_tables: list[Measured] = []
        self._of: object = None  # which scene, but for its lights
        self._lister: candidate_lists.Lister | None = None
        self._of_camera: candidate_lists.Lists | None = None
        self._of_lights: candidate_lists.Lists | None = None
        self._everything = np.zeros(0, np.int32)  # the list of all objects
        self._lit: object = None  # the lights' places of these, and their radii
        self._first = 0  # where the camera's lists begin
        self.rectangles = np.zeros((0, 8), np.int32)  # of candidate_lists.py
        self.everything = 0, 0  # where the list of all objects begins and ends
        self.farthest = 1.0  # than any distance to what is in them
        self.grid = GRIDS[0]  # cells of a side of a cube's face around a light
        self._shape = 0, 0  # rows and columns of cells
        # The most rounds of loops that a pixel's rays may take, or a few more: see cut_short.glsl.
        self.rounds = 0

    def load(self, scene: Scene, settings: Settings, size: tuple[int, int]) -> None:
        """Take the numbers of `scene` for a picture of `size`."""
        listed = is_listed(scene, settings)
        self._write("Lights", view_space.lights_block(scene, settings))
        # Lights move, and then all else is as it was. Equal tuples of the same things are quickly compared.
        of = scene.objects, scene.camera, scene.materials, settings.compile_options, size
        new, self._of = of != self._of, None  # until all is there
        if new:
            self._lister, self._of_camera = candidate_lists.Lister(scene) if listed else None, None
            self._load_materials(scene, settings)
            if settings.precision == 64:
                self._write("Surfaces", view_space.surfaces_block(scene))
                self._write("CameraTerms", view_space.camera_terms_block(scene, size))
            else:
                numbers = view_space.numbers_texture(scene, size)
                self._texture("numbers", numbers)
                if self._lister:
                    self._texture("items", self._lister.items_texture(numbers))
        if self._lister:
            self._load_lists(self._lister, scene, settings, size)
        else:
            each = rounds_of_ray(scene, settings)
            self.rounds = most_rounds(scene, settings, each, each)
        self._of = of

    def _load_materials(self, scene: Scene, settings: Settings) -> None:
        # Directions are in the camera's axes, and all else stays when that moves.
        turned = material_layout(scene, settings).turned
        of = scene.objects, scene.materials, settings.shading, scene.camera if turned else None
        if of == self._of_materials:
            return
        self._of_materials = None
        self._texture("materials", view_space.materials_texture(scene, settings))
        self._load_measured(reflectance.measured(shaded_materials(scene, settings).values()))
        self._of_materials = of

    def _load_measured(self, tables: list[Measured]) -> None:
        """Bring the tables of measured materials to the GPU, one on another."""
        if tables == self._measured_tables:
            return
        if self._measured:
            self._measured.release()
            self._measured, self._measured_tables = None, []
        if tables:
            most = self._context.info["GL_MAX_3D_TEXTURE_SIZE"] // len(tables[0].values)
            if len(tables) > most:
                raise InputError(
                    f"expected at most {most} measured ones on this driver, got {len(tables)}", "materials"
                )
            self._measured = volume_texture(self._context, np.concatenate([table.values for table in tables]))
        self._measured_tables = tables

    def _load_lists(
        self, lister: candidate_lists.Lister, scene: Scene, settings: Settings, size: tuple[int, int]
    ) -> None:
        if self._of_camera is None:
            self._of_camera = lister.of_camera(scene, size)
            self.rectangles, self.farthest = lister.rectangles(scene, size)
            self._texture("objects", self.rectangles.reshape(-1, 4))
            self._shape = -(-size[1] // CELL), -(-size[0] // CELL)
            self._everything = lister.of_everything()
            self._of_lights, self._lit = None, None
        lights = [settings.cast(light) for light in scene.lights if settings.shadows != "off"]
        lit = len(scene.lights), tuple((light.position, light.radius) for light in lights)
        if lit == self._lit:
            return
        self._lit = None
        self._of_lights = self._lists_of_lights(lister, scene, lights)
        # All in one texture, the camera's last; and where the list of each cell of a light begins and ends. Behind
        # these, each light's reach.
        is_short = len(self._everything) <= _MOST_FROM_AFAR
        everything = self._everything if is_short or has_mirrors(scene, settings) else self._everything[:0]
        entries = [self._of_lights.entries, everything, self._of_camera.entries]
        first = np.cumsum([0, *map(len, entries)])
        self.everything = int(first[1]), int(first[2])
        self._first = int(first[2])
        self._texture("lists", np.concatenate(entries))
        reach = [lister.reach(scene, light) if is_short else np.inf for light in lights]
        reaches = np.column_stack((reach, np.zeros(len(lights)))).astype(np.float32)
        self._texture("ends", np.concatenate((self._of_lights.ends, reaches.view(np.int32))))
        self.rounds = self._most_rounds(scene, settings)
        self._lit = lit

    def _most_rounds(self, scene: Scene, settings: Settings) -> int:
        """Rounds of loops for all rays of a pixel, by the longest lists: a program takes as many for each root of its
        surfaces as it has codes. But of a list of everything, rays are taken to pass all objects of kinds.
        """
        assert self._of_camera and self._of_lights
        camera, light = (int(np.diff(lists.ends).max(initial=0)) for lists in (self._of_camera, self._of_lights))
        programs = groups(scene).bigs
        trees = any(not big.pruner.is_chain for big in programs)

        def rounds(codes: int) -> int:
            return codes * max(2 * codes if trees else 0, OF_ENTRY)

        ray = rounds(camera)
        if has_mirrors(scene, settings):
            everything = self.everything[1] - self.everything[0]
            ray = max(ray, rounds(everything) if programs else everything)
        return most_rounds(scene, settings, ray, rounds(light))

    def _lists_of_lights(
        self, lister: candidate_lists.Lister, scene: Scene, lights: list[PointLight]
    ) -> candidate_lists.Lists:
        """The lists for cubes around lights, of as many cells as there is room for, and use.

        Raises InputError if even with one cell for each face they take too much.
        """
        spheres = len(table(scene).radii)
        if spheres * len(lights) > _MAX_SEEN:
            raise InputError(
                f"expected at most {_MAX_SEEN} spheres times lights, got {spheres} x {len(lights)}, whose "
                f"lists take about {spheres * len(lights) * 2e-6:.2g} s; remedies are fewer lights, fewer spheres and "
                "no shadows",
                "objects",
            )
        most = min(BufferTexture.most(self._context), _MAX_CELLS)
        finest = min((lister.finest_grid(scene, light) for light in lights), default=GRIDS[0])
        for grid in GRIDS:
            last = grid == GRIDS[-1]
            if not last and (grid > finest or (6 * grid**2 + 1) * len(lights) > most):
                continue
            of_kinds, others = lister.pairs(scene, lights, grid)
            if last:
                check_listed(others)
            elif of_kinds > _MAX_ITEMS or others > _MAX_LISTED:
                continue
            self.grid = grid
            try:
                return lister.of_lights(scene, lights, grid)
            except InputError:  # there are more pairs than they seemed to be
                if last:
                    raise
        raise AssertionError

    def camera_lists(self) -> NDArray[np.int32] | None:
        """(cells, 2): where the list of each cell of the picture begins and ends; None in a scene without lists."""
        return None if self._of_camera is None else self._of_camera.ends + np.int32(self._first)

    def met(self) -> Met | None:
        """In which cells there are lists."""
        if self._of_camera is None:
            return None
        seen = _are_listed(self._of_camera) | cells_under(self.rectangles, self._shape, CELL).ravel()
        lights = _are_listed(self._of_lights).reshape(-1, 6 * self.grid * self.grid) if self._of_lights else []
        return Met(seen, list(lights))

    def attach(self, program: moderngl.Program) -> None:
        """Say where `program` finds them."""
        for name in self._blocks:
            if name in program:
                program[name].binding = _BLOCKS[name]  # pyright: ignore[reportAttributeAccessIssue]
        for name, unit in SCENE_UNITS.items():
            if name in program:
                set_sampler(self._context, program, name, unit)

    def bind(self) -> None:
        """Make them those of the next draws."""
        for name, buffer in self._blocks.items():
            buffer.bind_to_uniform_block(_BLOCKS[name])
        for name, texture in self._textures.items():
            texture.use(SCENE_UNITS[name])
        if self._measured:
            self._measured.use(SCENE_UNITS["measured"])

    def _write(self, name: str, data: bytes) -> None:
        """Bring a uniform block to the GPU, into the buffer that is there if that has the size."""
        buffer = self._blocks.get(name)
        if buffer and buffer.size == len(data):
            buffer.write(data)
            return
        if buffer:
            self._blocks.pop(name).release()
        if data:
            self._blocks[name] = self._context.buffer(data, dynamic=True)

    def _texture(self, name: str, data: NDArray[Any]) -> None:
        """Bring texels to the GPU: (N, 4) float32 or int32, (N, 2) or (N,) int32."""
        most = BufferTexture.most(self._context)
        if len(data) > most:
            what = "entries in the lists of all cells" if name == "lists" else f"texels of {name}"
            limit = f"{most} {what} (this driver's buffer textures)"
            raise InputError(f"expected at most {limit}, got {len(data)}", "objects")
        if name not in self._textures:
            self._textures[name] = BufferTexture(self._context)
        self._textures[name].write(data)

    def close(self) -> None:
        """Give back everything on the GPU."""
        for thing in (*self._blocks.values(), *self._textures.values(), self._measured):
            if thing:
                thing.release()


def _are_listed(found: candidate_lists.Lists) -> Mask:
    """In which cells there is anything."""
    return found.ends[:, 1] > found.ends[:, 0]
