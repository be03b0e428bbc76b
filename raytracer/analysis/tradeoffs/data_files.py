"""The files trade.csv and trade.json: all measurements, with a row or an entry for each configuration."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

from raytracer.analysis.tradeoffs.measurement import Result, Tradeoffs
from raytracer.analysis.tradeoffs.summaries import fit_slopes, shadow_differences
from raytracer.scene.settings_patch import SettingsPatch, flags, minimal_patch

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


def as_row(result: Result, file_settings: SettingsPatch) -> dict[str, Any]:
    """Return the measurements of a configuration, by the columns of the CSV file.

    The column `flags` has the options with which `raytracer render` draws the picture, on top of the scene file's
    [settings].
    """
    configuration, error = result.configuration, result.error
    row: dict[str, Any] = dict.fromkeys(_FIELDS, None)
    row |= {
        "target": configuration.target,
        "configuration": configuration.label,
        "knobs": "; ".join(configuration.knobs),
        "flags": flags(minimal_patch(configuration.settings, file_settings)),
        "scale": configuration.scale,
        "refused": result.refused,
    }
    if error and result.seconds:
        row |= {
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
    return row


def as_csv(trade: Tradeoffs) -> str:
    """Return trade.csv: a line for each configuration. Cells without a measurement are empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, _FIELDS, lineterminator="\n")
    writer.writeheader()
    for result in trade.results:
        writer.writerow(
            {
                key: f"{value:.6g}" if isinstance(value, float) else value
                for key, value in as_row(result, trade.plan.file_settings).items()
            }
        )
    return text.getvalue()


def as_json(trade: Tradeoffs) -> str:
    """Return trade.json: all measurements, with the time of each round."""
    measurements = {
        "scene": trade.scene,
        "size": trade.size,
        "rounds": trade.rounds,
        "complete": trade.complete,
        "machine": trade.machine,
        "truths": {
            name: {
                "kind": reference.kind,
                "rmse": reference.error,
                "uncertain": reference.is_uncertain,
                "resolved": reference.resolved_from,
            }
            for name, reference in trade.references.items()
        },
        "left_out": dict(trade.plan.left_out),
        "slopes": {
            name: {label: fit and {"p": fit[0], "c": fit[1]} for label, fit in fit_slopes(trade, knob).items()}
            for name, knob in (("hard", "sequence"), ("soft", "sequence, soft shadows"))
        },
        "shadows": shadow_differences(trade),
        "configurations": [
            {**as_row(result, trade.plan.file_settings), "rounds": result.seconds} for result in trade.results
        ],
    }
    return json.dumps(measurements, indent=1, allow_nan=False) + "\n"
