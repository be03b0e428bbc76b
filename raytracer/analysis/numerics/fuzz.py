"""Random valid scenes, with values from all ranges of the ledger at once."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from raytracer.analysis.numerics.findings import Finding, worst_findings
from raytracer.analysis.numerics.pixel_errors import measure_pixel_errors, normalize
from raytracer.analysis.numerics.specimens import KINDS, random_map, specimen
from raytracer.compiler.roth_bounds import roth_loops
from raytracer.core.validation import InputError, Vec3
from raytracer.ground_truth import ray_tracer
from raytracer.rendering.renderer import Renderer
from raytracer.scene.camera import Camera
from raytracer.scene.lights import PointLight
from raytracer.scene.materials.material import Material
from raytracer.scene.options import Precision
from raytracer.scene.scene import Scene
from raytracer.scene.settings import Settings
from raytracer.scene.solids.plane import Plane
from raytracer.scene.solids.solid import Solid
from raytracer.scene.solids.sphere import Sphere

SIZE = (40, 30)
# The number of consecutive seeds whose scenes share one structure, and so one compiled program.
_SEEDS_PER_STRUCTURE = 25
# The share of structures with an orthographic camera.
_ORTHOGRAPHIC = 0.25
# The most attempts at a scene in which something is visible; some structures are empty.
_ATTEMPTS = 8
# The largest condition number of the map of a solid.
_CONDITION = 1000.0
# The most loops of a Roth filter that compiles within a second.
_FEW_LOOPS = 7


def random_scene(seed: int) -> Scene:
    """Random scenes: 1 to 7 primitives in one or two trees, visible if possible. All lengths are log-uniform.

    Scale 1e-6 to 1e6; up to 1e6 scene sizes from the origin; radii over six orders of magnitude;
    the camera 1e-3 to 1e6 radii from the surface of one of the spheres, outside or inside;
    fields of view from 1e-4 to 179.9 degrees; exponents 0 to 1e6; colours 1e-6 to 1e6. Some cameras are orthographic.
    In half of the structures, other solids replace half of the spheres, under maps with condition numbers up to 1e3.
    """
    for attempt in itertools.count():
        try:
            drawn = _random_scene(
                np.random.default_rng((1, seed // _SEEDS_PER_STRUCTURE)), np.random.default_rng((2, seed, attempt))
            )
        except InputError:  # beyond the limits of a scene: lengths above 1e12, radii below 1e-12
            continue
        origins, rays = (
            trace(drawn.camera, (8, 6)).reshape(-1, 3) for trace in (ray_tracer.camera_origins, ray_tracer.camera_rays)
        )
        if attempt == _ATTEMPTS or np.any(ray_tracer.Tracer(drawn).first(origins, rays)[1] >= 0):
            return drawn
    raise AssertionError


def _random_scene(structure: np.random.Generator, rng: np.random.Generator) -> Scene:
    count = int(structure.integers(1, 7))
    scale = _log(rng, -6, 6)
    origin = rng.normal(size=3) * scale * _log(rng, 0, 6)
    models = structure.choice(("phong", "blinn"), 3)
    materials = [
        Material(m, ka=0, kd=_color(rng), ks=_color(rng), h=float(rng.choice((0.0, _log(rng, -2, 6)))))
        for m in models.tolist()
    ]
    # Each ball overlaps the first ball, or almost touches it.
    first = _log(rng, -3, 3) * scale
    spheres = [Sphere(tuple(origin.tolist()), first, materials[0])]
    for _ in range(count - 1):
        radius = first * float(rng.choice((_log(rng, -3, 3), _log(rng, -0.5, 0.5))))
        apart = rng.choice((rng.uniform(0.0, 1.0), 1.0 + _log(rng, -7, -1), 1.0 - _log(rng, -7, -1)))
        center = origin + _direction(rng) * (first + radius * rng.choice((-1.0, 1.0))) * apart
        spheres.append(Sphere(tuple(center.tolist()), radius, materials[int(rng.integers(3))]))
    solids: list[Solid] = list(spheres)
    if structure.random() < 0.5:
        for i, ball in enumerate(spheres):
            if structure.random() < 0.5:
                solid = specimen(KINDS[structure.integers(len(KINDS))], ball.material)
                solids[i] = solid.transform(random_map(rng, _CONDITION)).scale(ball.radius).translate(ball.center)
    if structure.random() < 0.5:  # a half-space whose face cuts the first ball or is near it
        normal = _direction(rng)
        offset = float(normal @ origin) + first * rng.uniform(-1.2, 1.2)
        solids.append(Plane(tuple(normal.tolist()), offset, materials[2]))
    while len(solids) > 2 or (len(solids) == 2 and structure.random() < 0.8):
        i = int(structure.integers(len(solids) - 1))
        a, b = solids[i], solids.pop(i + 1)
        solids[i] = (a | b, a & b, a - b, b - a, ~(~a & ~b), a - ~b)[
            structure.choice(6, p=(0.4, 0.1, 0.2, 0.1, 0.1, 0.1))
        ]

    seen = spheres[int(rng.integers(len(spheres)))]
    height = seen.radius * _log(rng, -3, 6)
    if rng.random() < 0.2:
        height = -seen.radius * min(1.0, _log(rng, -3, 0))
    up = _direction(rng)
    center = np.array(seen.center)
    eye = center + up * (seen.radius + height)
    # Look at the ball's surface, at its outline or beside it, in a picture about as wide as the ball.
    target = center + seen.radius * normalize(up + _log(rng, -1, 1) * _direction(rng))
    fov = math.degrees(math.atan2(seen.radius, abs(height))) * _log(rng, -1, 0.6)
    toward = normalize(up + 1.2 * _direction(rng))
    light = PointLight(tuple((center + toward * seen.radius * _log(rng, -1, 6)).tolist()), (1.0, 0.7, 0.4))
    camera = Camera(
        tuple(eye.tolist()), tuple(target.tolist()), tuple(_direction(rng).tolist()), min(max(fov, 1e-4), 179.9)
    )
    if structure.random() < _ORTHOGRAPHIC:
        camera = camera.replace(projection="orthographic", height=2.0 * seen.radius * _log(rng, -1, 0.6))
    return Scene(solids, [light], camera)


def measure_random_scenes(
    renderer: Renderer, count: int, start: int = 0, progress: Callable[[int], None] | None = None
) -> list[Finding]:
    """Measure the scenes of the seeds from `start` to `start + count`.

    Returns all findings beyond their bounds, then the worst of the others, each with its seed. `progress(k)` is called
    after k scenes.
    """
    findings: list[Finding] = []
    doubts: dict[tuple[Precision, str], list[float]] = {}
    for seed in range(start, start + count):
        drawn = random_scene(seed)
        for settings in _settings(renderer, drawn, seed):
            bits = settings.precision
            errors = measure_pixel_errors(renderer, drawn, SIZE, settings)
            doubts.setdefault((bits, "pixels"), []).append(min(1.0, errors.doubtful))
            doubts.setdefault((bits, "shadows"), []).append(errors.unlit)
            new = [
                Finding("fuzz", f"seed {seed}, {settings.evaluator}", bits, measure, value, bound)
                for measure, value, bound in (
                    ("wrong pixels", errors.wrong, 0),
                    ("wrong shadows", errors.lit, 0),
                    ("NaN, infinite or negative values", errors.bad, 0),
                    ("depth error, share of its bound", errors.depth_share, 1),
                    ("normal error, share of its bound", errors.normal_share, 1),
                    ("radiance error, share of its bound", errors.radiance_share, 1),
                )
            ]
            findings = [f for f in findings if not f.is_within_bound] + worst_findings(
                [*(f for f in findings if f.is_within_bound), *new]
            )
        if progress:
            progress(seed - start + 1)
    for (bits, kind), shares in doubts.items():
        at, measure = f"all {len(shares)} from seed {start}", f"mean share of doubtful {kind}, of those hit"
        # The mean of a few scenes has no bound.
        findings.append(
            Finding("fuzz", at, bits, measure, sum(shares) / len(shares), 0.1 if count >= 100 else math.inf)
        )
    return findings


def _settings(renderer: Renderer, drawn: Scene, seed: int) -> list[Settings]:
    """Return the settings for a scene: always cells in float32, and for some seeds others besides."""
    chosen = [Settings()]
    if seed % 4 == 0 and 64 in renderer.device.limits.precisions:
        chosen.append(Settings(precision=64))
    if seed % 8 == 2:
        chosen.append(Settings(evaluator="walk"))
    if seed % 4 == 1 and roth_loops(drawn) <= _FEW_LOOPS:
        chosen.append(Settings(evaluator="roth"))
    return chosen


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def _color(rng: np.random.Generator) -> Vec3:
    return _log(rng, -6, 6), _log(rng, -6, 6), _log(rng, -6, 6)


def _direction(rng: np.random.Generator) -> np.ndarray:
    return normalize(rng.normal(size=3))
