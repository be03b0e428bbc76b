"""Summaries of series of measurements: rates of convergence, and differences between shadow models."""

from __future__ import annotations

import math

import numpy as np

from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.measurement import Tradeoffs
from raytracer.analysis.tradeoffs.pareto import fit_slope
from raytracer.scene.sequences import SEQUENCES


def fit_slopes(trade: Tradeoffs, knob: str = "sequence") -> dict[str, tuple[float, float] | None]:
    """Fit error = c n^-p to the resolved errors of each sequence with n > 1 samples.

    Return p and c for each sequence; None for a sequence with fewer than two such errors.
    """
    fits = {}
    for sequence in SEQUENCES:
        series = [
            (result.samples, result.error.rmse)
            for result in trade.results_for_knob(knob)
            if result.configuration.settings.sequence == sequence
            and result.configuration.settings.samples > 1
            and result.resolved
            and result.error
            and result.error.rmse > 0.0
        ]
        fits[sequence] = fit_slope(*zip(*series, strict=True)) if len(series) > 1 else None
    return fits


def shadow_differences(trade: Tradeoffs) -> dict[str, float]:
    """Return the root mean square difference of each shadow model's reference from the reference of soft shadows.

    It is a difference between models, not an error of sampling.
    """
    soft = trade.references.get("soft shadows")
    if soft is None:
        return {}
    apart = {}
    for kind in (MAIN, "off shadows", "diluted shadows"):
        if other := trade.references.get(kind):
            apart[kind] = math.sqrt(float(np.mean((other.radiance - soft.radiance) ** 2)))
    return apart
