"""Findings: measurements with their bounds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One measurement: the number `found` is to be at most `bound`."""

    what: str  # the row of the ledger
    at: str  # the place in the row's range
    bits: int  # of the intersections' precision; 32 if there is only that
    measure: str
    found: float
    bound: float
    note: str = ""

    @property
    def kept(self) -> bool:
        return self.found <= self.bound  # so not a NaN


def worst(findings: Iterable[Finding]) -> list[Finding]:
    """The largest finding of each measure of each row at each precision; if some are beyond their bounds, of these."""
    groups: dict[object, list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.what, finding.measure, finding.bits), []).append(finding)
    return [max(group, key=lambda finding: (not finding.kept, finding.found)) for group in groups.values()]


@dataclass(frozen=True)
class LedgerRow:
    """A row of the ledger: a text about it, and its findings."""

    about: str
    findings: list[Finding]
