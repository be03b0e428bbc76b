"""Where samples lie, without OpenGL."""

import numpy as np

from raytracer import sampling


def test_the_points_are_less_wrong_about_edges_than_those_of_98_of_100_other_scrambles() -> None:
    rng = np.random.default_rng(1)
    angle = rng.uniform(0.0, 2.0 * np.pi, 4000)
    x, y, offset = np.cos(angle), np.sin(angle), rng.uniform(-0.7, 0.7, 4000)
    side = (np.arange(256) + 0.5) / 256 - 0.5
    # The share of the pixel that each edge cuts off, by 65,536 points.
    share = np.array([np.mean(a * side[:, None] + b * side < d) for a, b, d in zip(x, y, offset, strict=True)])

    def badness(scrambles: tuple[int, int]) -> float:
        points = np.array([sampling._sobol(k, *scrambles) for k in range(64)]) * 2.0**-24 - 0.5
        met = np.cumsum(points @ (x, y) < offset, axis=0)
        return sum(np.log(np.mean((met[n - 1] / n - share) ** 2)) for n in (2, 3, 4, 8, 16, 32, 64))

    others = [badness((int(a), int(b))) for a, b in rng.integers(0, 2**32, (100, 2))]
    assert sum(other < badness(sampling._SCRAMBLES) for other in others) <= 2
