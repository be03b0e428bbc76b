"""Differences between the GPU's pictures and the float64 reference, the first table of docs/accuracy.md.

python -m benchmarks.agreement
"""

import platform

import numpy as np
from rich.progress import track

import raytracer as rt
from raytracer.analysis.pixel_doubt import find_pixel_doubt
from raytracer.gpu.device import shared_device
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.settings import Settings
from tests import scenes

SIZE = (1280, 720)


def differences(renderer: Renderer, scene: rt.Scene, size: tuple[int, int]) -> tuple[float, float, float, int, int]:
    """Compare a picture with the reference at its pixels that are not doubtful.

    Return the largest relative error of the depth, the largest errors of depth and normal as shares of their bounds,
    and the numbers of wrong and of doubtful pixels.
    """
    image, truth = renderer.render(scene, size, Settings()), ray_tracer.trace(scene, size, Settings(shadows="off"))
    assert image.depth is not None and image.normal is not None
    assert truth.depth is not None and truth.normal is not None
    doubt = find_pixel_doubt(scene, size)
    is_right = image.material == truth.material
    sure = ~doubt.doubtful & is_right & np.isfinite(truth.depth)
    depth = np.abs(image.depth[sure] - truth.depth[sure])
    normal = np.linalg.norm(image.normal[sure] - truth.normal[sure], axis=1)
    shares = (depth / doubt.depth[sure]).max(initial=0), (normal / doubt.normal[sure]).max(initial=0)
    relative = (depth / truth.depth[sure]).max(initial=0)
    return float(relative), *shares, int((~is_right & ~doubt.doubtful).sum()), int(doubt.doubtful.sum())


def _worst(rows: list[tuple[float, float, float, int, int]]) -> str:
    relative, depth, normal, wrong, doubtful = zip(*rows, strict=True)
    shares = f"{max(depth):.2f} and {max(normal):.2f} of their bounds"
    return f"depth {max(relative):.1e}, depth and normal {shares}, wrong {sum(wrong)}, doubtful {sum(doubtful)}"


def main() -> None:
    """Measure the differences, and print them."""
    renderer = Renderer(shared_device())
    print(f"{renderer.device.limits.driver}, {renderer.device.context.info['GL_VERSION']}, {platform.machine()}\n")
    assignment = scenes.assignment()

    rows = [differences(renderer, assignment, SIZE)]
    print(f"assignment, 1280x720: {_worst(rows)}")
    rows = [
        differences(renderer, scenes.random_scene(seed), (128, 72)) for seed in track(range(200), "200 random scenes")
    ]
    print(f"200 random scenes, 128x72: {_worst(rows)}")

    settings = Settings(samples=16)
    picture = renderer.render(assignment, SIZE, settings).srgb8().astype(int)
    off = np.abs(picture - ray_tracer.trace(assignment, SIZE, settings).srgb8())
    print(f"assignment's picture, 16 samples, 1280x720: at most {off.max()} of 255, {(off > 2).sum()} values above 2")


if __name__ == "__main__":
    main()
