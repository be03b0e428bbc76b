"""A trade as CSV and JSON: one row for each configuration."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import Any

import numpy as np

from raytracer.analysis.tradeoffs.configurations import MAIN
from raytracer.analysis.tradeoffs.measure import Result, Trade
from raytracer.analysis.tradeoffs.pareto import slope
from raytracer.analysis.tradeoffs.targets import RESOLVED
from raytracer.scene.sequences import SEQUENCES
from raytracer.scene.settings_patch import SettingsPatch, fewest, flags

_FIELDS: tuple[str, ...] = (
    "target",
    "configuration",
    "knobs",
    "flags",
    "scale",
    "seconds",
    "fastest",
    "slowest",
    "samples",
    "rays",
    "rmse",
    "largest",
    "relative",
    "over",
    "resolved",
    "front",
    "beaten_by",
    "refused",
)


def row(result: Result, file_settings: SettingsPatch) -> dict[str, Any]:
    """All that is known of a configuration, by the CSV's columns.

    `flags`: what `raytracer render` takes, over the file's [settings].
    """
    configuration, error = result.configuration, result.error
    found: dict[str, Any] = dict.fromkeys(_FIELDS, None)
    found |= {
        "target": configuration.target,
        "configuration": configuration.label,
        "knobs": "; ".join(configuration.knobs),
        "flags": flags(fewest(configuration.settings, file_settings)),
        "scale": configuration.scale,
        "refused": result.refused,
    }
    if error and result.seconds:
        found |= {
            "seconds": result.median,
            "fastest": min(result.seconds),
            "slowest": max(result.seconds),
            "samples": result.samples,
            "rays": result.rays,
            "rmse": error.rmse,
            "largest": error.largest,
            "relative": error.relative,
            "over": error.over,
            "resolved": result.resolved,
            "front": result.beaten_by is None,
            "beaten_by": result.beaten_by or "",
        }
    return found


def as_csv(trade: Trade) -> str:
    """A line for each configuration; empty where nothing was measured."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _FIELDS, lineterminator="\n")
    writer.writeheader()
    for result in trade.results:
        writer.writerow(
            {
                key: f"{value:.6g}" if isinstance(value, float) else value
                for key, value in row(result, trade.plan.file_settings).items()
            }
        )
    return text.getvalue()


def as_json(trade: Trade) -> str:
    """All that was measured, with the time of each round."""
    found = {
        "scene": trade.scene,
        "size": trade.size,
        "rounds": trade.rounds,
        "complete": trade.complete,
        "machine": trade.machine,
        "truths": {
            name: {"kind": truth.kind, "rmse": truth.error, "resolved": RESOLVED * truth.error}
            for name, truth in trade.truths.items()
        },
        "left_out": dict(trade.plan.left_out),
        "slopes": {
            name: {label: fit and {"p": fit[0], "c": fit[1]} for label, fit in slopes(trade, knob).items()}
            for name, knob in (("hard", "sequence"), ("soft", "sequence, soft shadows"))
        },
        "shadows": differences(trade),
        "configurations": [
            {**row(result, trade.plan.file_settings), "rounds": result.seconds} for result in trade.results
        ],
    }
    return json.dumps(found, indent=1, allow_nan=False) + "\n"


def slopes(trade: Trade, knob: str = "sequence") -> dict[str, tuple[float, float] | None]:
    """Of each sequence p and c of error = c n^-p, of what is resolved with more than 1 sample; None of fewer than 2."""
    found = {}
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
        found[sequence] = slope(*zip(*series, strict=True)) if len(series) > 1 else None
    return found


def differences(trade: Trade) -> dict[str, float]:
    """How far the truths of other kinds of shadows are from that of soft ones: a difference of models, not an error."""
    soft = trade.truths.get("soft shadows")
    if soft is None:
        return {}
    found = {}
    for kind in (MAIN, "off shadows", "diluted shadows"):
        if other := trade.truths.get(kind):
            found[kind] = math.sqrt(float(np.mean((other.radiance - soft.radiance) ** 2)))
    return found
