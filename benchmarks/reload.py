"""Time from saving a scene file or a shader until the window shows the change.

python -m benchmarks.reload

The benchmark opens the assignment at 1280x720, in a copy of the project and on an Xvfb that it starts. It changes a
number in the scene file, and a number in a shader, which the window has to compile.
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
    """Measure, and print the table."""
    os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"  # so that every change is compiled
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_checkout(folder)
        scene, shader = folder / "assets/scenes/assignment.toml", folder / "shaders/shading/lighting.glsl"
        edits = [
            (scene, "ambient = [1.0,", "ambient = [{:.1f},"),
            (shader, "vec3 I = m.ka * ambient;", "vec3 I = {:.1f} * m.ka * ambient;"),
        ]
        print("| saved | median s | worst s |\n|---|---|---|")
        picture = SIZE[0], SIZE[1] // 2  # the upper half: the overlay covers the lower half
        with window(folder, str(scene), "--samples", "1", size=SIZE, display=SIZE) as view:
            for path, old, new in edits:
                text = path.read_text()
                assert old in text
                times = []
                for k in range(ROUNDS):
                    before = view.grab_picture(picture)
                    path.write_text(text.replace(old, new.format(1.5 + k)))
                    times.append(
                        view.wait_until(lambda b=before: bool((view.grab_picture(picture) != b).any()), "no change")
                    )
                print(f"| {path.name} | {median(times):.2f} | {max(times):.2f} |")


if __name__ == "__main__":
    main()
