"""Times of the first picture of a new scene, of later pictures, and of the command line.

python -m benchmarks.first_picture [--rounds N]

Scenes have 1, 1,000 and 10,000 objects. Pictures have 1 sample a pixel and no geometry. The floor of a first picture is
the time of rendering the picture again. The floor of a command is a bare process that clears an empty picture.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median

import msgspec

import raytracer as rt
from benchmarks import scenes
from benchmarks.speed_rows import BARE_PROCESS, SCRIPT, process_seconds
from raytracer.scene.solids.solid import postfix
from raytracer.scene.solids.sphere import Sphere

_COUNTS = 1, 1_000, 10_000
_SIZE = 1280, 720


def seconds(work: Callable[[], object]) -> float:
    """Return the seconds that `work` takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def medians(rounds: int, works: Mapping[str, Callable[[], float]]) -> dict[str, float]:
    """Return the median of the seconds that each function returns, by its name. The functions take turns."""
    for work in works.values():  # compiles, and fills the caches of the driver and the disk
        work()
    times = [{name: work() for name, work in works.items()} for _ in range(rounds)]
    return {name: median(values[name] for values in times) for name in works}


def scene_text(scene: rt.Scene) -> str:
    """Format a scene of spheres and half-spaces as a scene file, with numbers of 7 digits."""
    camera, materials = scene.camera, {material: f"m{i}" for i, material in enumerate(scene.materials)}
    lines = [f"[camera]\nposition = {_list(camera.position)}\nlook_at = {_list(camera.look_at)}"]
    lines += [f"[[lights]]\nposition = {_list(light.position)}" for light in scene.lights]
    lines += [f"[materials.{name}]\nka = {_list(m.ka)}\nkd = {_list(m.kd)}" for m, name in materials.items()]
    shapes, objects = ["[shapes]"], ["[objects]"]
    for i, solid in enumerate(scene.solids()):
        terms: list[str] = []
        for node in postfix(solid):
            if node.operands:
                *rest, a, b = terms
                terms = [*rest, f"({a} {node.symbol} {b})"]
                continue
            name = f"s{len(shapes)}"
            if isinstance(node, Sphere):
                text = f"sphere = {{ center = {_list(node.center)}, radius = {node.radius:.7g} }}"
            else:
                assert isinstance(node, rt.Plane)
                text = f"plane = {{ normal = {_list(node.normal)}, offset = {node.offset:.7g} }}"
            shapes.append(f'{name} = {{ {text}, material = "{materials[node.material]}" }}')
            terms.append(name)
        objects.append(f'o{i} = "{terms[0]}"')
    return "\n".join((*lines, *shapes, *objects, ""))


def _list(values: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{value:.7g}' for value in values)}]"


def in_process(scene: rt.Scene, rounds: int) -> dict[str, float]:
    """Measure within this process: making a scene, and the first, a moved and a repeated picture.

    Return the medians.
    """

    def make_scene() -> rt.Scene:
        # A list, because rt.Scene would share the prepared objects of the other scene, and prepare nothing.
        return rt.Scene(list(scene.objects), scene.lights, scene.camera)

    def time_picture(scene: rt.Scene) -> float:
        return seconds(lambda: rt.render(scene, _SIZE, geometry=False))

    def move_camera(scene: rt.Scene) -> rt.Scene:
        x, y, z = scene.camera.position
        return msgspec.structs.replace(scene, camera=rt.Camera((x + 0.01, y, z), scene.camera.look_at))

    kept, other = make_scene(), scenes.many(2)

    def time_first_picture() -> float:
        # A picture of another scene first: the renderer keeps the last scene, also for a new scene of equal solids.
        rt.render(other, _SIZE, geometry=False)
        return time_picture(make_scene())

    return medians(
        rounds,
        {
            "scene": lambda: seconds(make_scene),
            "first": time_first_picture,
            "camera": lambda: time_picture(move_camera(kept)),
            "again": lambda: time_picture(kept),
        },
    )


def in_processes(scene: rt.Scene, rounds: int) -> dict[str, float]:
    """Measure loading a scene file, `raytracer render` in a new process, and a bare process. Return the medians."""
    with tempfile.TemporaryDirectory() as folder:
        file, output = Path(folder, "scene.toml"), Path(folder, "picture.png")
        file.write_text(scene_text(scene))
        size = f"{_SIZE[0]}x{_SIZE[1]}"
        command = ("-c", SCRIPT, "render", str(file), "-o", str(output), "--size", size)
        cache = {"MESA_SHADER_CACHE_DIR": f"{folder}/cache"}
        return medians(
            rounds,
            {
                "file": lambda: seconds(lambda: rt.load(file)),
                "command": lambda: process_seconds(*command, variables=cache),
                "bare": lambda: process_seconds("-c", BARE_PROCESS, variables=cache),
            },
        )


def main() -> int:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.first_picture", description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, metavar="N", help="rounds of all measurements (default: 9)")
    rounds = parser.parse_args().rounds
    print("| objects | work | time | floor | times the floor |\n|---|---|---|---|---|")
    for count in _COUNTS:
        scene = scenes.many(count)
        own, processes = in_process(scene, rounds), in_processes(scene, rounds)
        again, bare = own["again"], processes["bare"]
        for work, took, floor in (
            ("the scene, of its solids", own["scene"], None),
            ("the first picture of a new scene", own["first"], ("the same again", again)),
            ("the picture of a moved camera", own["camera"], ("the same again", again)),
            ("the same again", again, None),
            ("a scene file", processes["file"], None),
            ("`raytracer render` of the file", processes["command"], ("a bare process", bare)),
        ):
            row = f"| {count:,} | {work} | {1e3 * took:.1f} ms |"
            print(f"{row} {floor[0]} {1e3 * floor[1]:.1f} ms | {took / floor[1]:.2f} |" if floor else f"{row} | |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
