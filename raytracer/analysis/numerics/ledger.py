"""Ledger of extremes: a list of rows, each for the ends of one value range, and the measurement of all rows.

A row is a function that renders or intersects at the ends of a range, compares with float64, and yields `Finding`s.
Its docstring is the row's description in the ledger.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator

from raytracer.analysis.numerics import (
    bodies,
    coincidence,
    fuzz,
    light,
    random_solids,
    rays,
    solid_shadows,
    solids,
    views,
)
from raytracer.analysis.numerics.findings import Finding, LedgerRow
from raytracer.core.progress import Progress
from raytracer.rendering.renderer import Renderer

# The rows in the order of the ledger. Their second argument selects the shorter form.
ROWS: tuple[Callable[[Renderer, bool], Iterator[Finding]], ...] = (
    views.scene_scale,
    views.distance_from_origin,
    views.far_sphere,
    views.beside_a_huge_sphere,
    views.on_a_huge_sphere,
    views.camera_on_a_surface,
    rays.tangents,
    solids.shells,
    light.self_shadow,
    solids.coincident_faces,
    solids.deep_trees,
    solids.camera_inside,
    views.field_of_view,
    light.highlight,
    light.shadow_end,
    light.light_on_a_surface,
    light.valid_scenes,
    random_solids.random_solids,
    bodies.solids_scale,
    bodies.solids_distance,
    bodies.camera_at_solids,
    bodies.solids_tangents,
    coincidence.coincident_solids,
    bodies.slivers,
    solid_shadows.solids_self_shadow,
)
# The work of a row, in random scenes, for the progress bar.
_ROW = 60


def measure_ledger(
    renderer: Renderer,
    *,
    short: bool,
    scenes: int,
    progress: Progress | None = None,
    step: Callable[[str], None] = lambda title: None,
) -> list[LedgerRow]:
    """Measure all rows, in their shorter form if `short`, and `scenes` random scenes.

    `step(title)` is called before each row, progress(done, total) after it.
    """
    total = _ROW * len(ROWS) + scenes
    rows: list[LedgerRow] = []
    for i, row in enumerate(ROWS):
        if progress:
            progress(_ROW * i, total)
        step(f"measuring {row.__name__.replace('_', ' ')}")
        rows.append(LedgerRow(_description(row), list(row(renderer, short))))
    if scenes:
        done = _ROW * len(ROWS)
        step(f"measuring {scenes} random scenes")
        findings = fuzz.measure_random_scenes(
            renderer, scenes, progress=(lambda k: progress(done + k, total)) if progress else None
        )
        rows.append(LedgerRow(_description(fuzz.random_scene), findings))
    return rows


def _description(row: Callable[..., object]) -> str:
    return inspect.cleandoc(row.__doc__ or "")
