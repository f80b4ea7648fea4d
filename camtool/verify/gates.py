"""Limits that a pipeline sets on a report: what exceeds one is a finding, and exit code 1."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from camtool.findings import Code, Finding, Severity
from camtool.units import UM_PER_MM
from camtool.verify.report import Report
from camtool.verify.wording import clock


@dataclass(frozen=True)
class Gates:
    """The largest total error (mm), reversals of X and Y while cutting, and time (s) that are
    allowed; None: any."""

    error_mm: float | None = None
    reversals: int | None = None
    time_s: float | None = None


def gate_findings(report: Report, gates: Gates) -> Iterator[Finding]:
    """An ABOVE_GATE for each limit that the report exceeds, or that it cannot be held against."""
    if gates.error_mm is not None:
        yield from _error(report.error_um.total.max, gates.error_mm * UM_PER_MM)
    count = report.reversals.cutting.x + report.reversals.cutting.y
    if gates.reversals is not None and count > gates.reversals:
        words = f"X and Y reverse {count} times while cutting; {gates.reversals} are allowed"
        yield _above(words, "--max-reversals", float(count), float(gates.reversals), "reversals")
    if gates.time_s is not None and report.time_s > gates.time_s:
        words = f"the program takes {clock(report.time_s)}; {clock(gates.time_s)} is allowed"
        yield _above(words, "--max-time", report.time_s, gates.time_s, "s")


def _error(found_um: float | None, limit_um: float) -> Iterator[Finding]:
    if found_um is None:
        words = "no error is known, since nothing was compared: the limit cannot be kept"
        yield _above(words, "--max-error", None, limit_um, "um")
    elif found_um > limit_um:
        words = f"the predicted error is {found_um:.2f} µm at most; {limit_um:.2f} µm is allowed"
        yield _above(words, "--max-error", found_um, limit_um, "um")


def _above(words: str, flag: str, measured: float | None, limit: float, unit: str) -> Finding:
    return Finding(Code.ABOVE_GATE, Severity.ERROR, words, flag, measured, limit, unit)
