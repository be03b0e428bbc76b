"""Numbers that sum up a series of measurements: slopes of errors, differences of kinds of shadows."""

from __future__ import annotations

import math

import numpy as np

from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.measurement import Tradeoffs
from raytracer.analysis.tradeoffs.pareto import slope
from raytracer.scene.sequences import SEQUENCES


def slopes(trade: Tradeoffs, knob: str = "sequence") -> dict[str, tuple[float, float] | None]:
    """p and c of error = c n^-p for each sequence, by its resolved errors with n > 1; None for fewer than 2 errors."""
    fits = {}
    for sequence in SEQUENCES:
        series = [
            (result.samples, result.error.rmse)
            for result in trade.of_knob(knob)
            if result.configuration.settings.sequence == sequence
            and result.configuration.settings.samples > 1
            and result.resolved
            and result.error
            and result.error.rmse > 0.0
        ]
        fits[sequence] = slope(*zip(*series, strict=True)) if len(series) > 1 else None
    return fits


def shadow_differences(trade: Tradeoffs) -> dict[str, float]:
    """The differences of the references of other kinds of shadows from that of soft ones: of models, not errors."""
    soft = trade.references.get("soft shadows")
    if soft is None:
        return {}
    apart = {}
    for kind in (MAIN, "off shadows", "diluted shadows"):
        if other := trade.references.get(kind):
            apart[kind] = math.sqrt(float(np.mean((other.radiance - soft.radiance) ** 2)))
    return apart
