"""Findings: measurements with their bounds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One measurement: its value `measured` must be at most `bound`."""

    row: str  # the row of the ledger
    at: str  # the place in the row's range
    bits: int  # the precision of intersections; 32 if the measurement has no other
    measure: str  # the measured quantity
    measured: float  # the measured value
    bound: float
    note: str = ""

    @property
    def is_within_bound(self) -> bool:
        """Whether the value is within its bound. A NaN is not."""
        return self.measured <= self.bound


def worst_findings(findings: Iterable[Finding]) -> list[Finding]:
    """Return the largest finding for each row, measure and precision. Findings beyond their bounds come first."""
    groups: dict[object, list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.row, finding.measure, finding.bits), []).append(finding)
    return [
        max(group, key=lambda finding: (not finding.is_within_bound, finding.measured)) for group in groups.values()
    ]


@dataclass(frozen=True)
class LedgerRow:
    """A row of the ledger: its description, and its findings."""

    about: str
    findings: list[Finding]
