"""How long it takes from saving a file until the window shows what is new in it.

python -m benchmarks.reload

On an Xvfb of its own, with a copy of the project, the assignment at 1280x720. What is changed is a
number of the scene, and a number in shade.frag, which has to be compiled.
"""

import os
import tempfile
from pathlib import Path
from statistics import median

from tests.displays import window
from tests.scenes import copy_checkout

SIZE = (1280, 720)
ROUNDS = 10


def main() -> None:
    """Measure and print."""
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"  # or a second run would find the first one's programs
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_checkout(folder)
        scene, shader = folder / "assets/scenes/assignment.toml", folder / "shaders/shading/lighting.glsl"
        edits = [
            (scene, "ambient = [1.0,", "ambient = [{:.1f},"),
            (shader, "vec3 I = m.ka * ambient;", "vec3 I = {:.1f} * m.ka * ambient;"),
        ]
        print("| saved | median s | worst s |\n|---|---|---|")
        picture = SIZE[0], SIZE[1] // 2  # the lower half has text over it
        with window(folder, str(scene), "--samples", "1", size=SIZE, display=SIZE) as view:
            for path, old, new in edits:
                text = path.read_text()
                assert old in text
                times = []
                for k in range(ROUNDS):
                    before = view.shown(picture)
                    path.write_text(text.replace(old, new.format(1.5 + k)))
                    times.append(view.until(lambda b=before: bool((view.shown(picture) != b).any()), "no change"))
                print(f"| {path.name} | {median(times):.2f} | {max(times):.2f} |")


if __name__ == "__main__":
    main()
