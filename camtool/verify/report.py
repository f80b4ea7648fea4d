"""The Report: what `camtool verify` says, as a record, JSON, text and Markdown.

The keys are stable: they may grow, they are never renamed (a test holds the list). No value is
NaN or infinite: what is not known is null. Numbers are rounded to `DECIMALS` places, far below
anything that a machine shows, so that the same job gives the same bytes on every computer.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec

from camtool.findings import Finding
from camtool.plain import to_json
from camtool.verify import records as record
from camtool.verify.records import Before, FindingReport, Planned

DECIMALS = 6
"""Decimal places of all numbers of the report (mm, µm, s, per cent)."""


class Report(msgspec.Struct, frozen=True):
    """Everything that a verification found. `blocks`, `bytes` None when no program was given.
    `against`: "drawing" where errors are those to what was drawn, "program" where no drawing is
    known, and they are those to the program's own moves, or to another program's."""

    target: str
    source: str
    moves: int
    blocks: int | None
    bytes: int | None
    extents_mm: record.ExtentsMm
    time_s: float
    steps: record.Steps
    reversals: record.Reversals
    error_um: record.Errors
    closure_um: float | None
    dimensions: tuple[record.Dimension, ...]
    circles: tuple[record.CircleReport, ...]
    findings: tuple[FindingReport, ...]
    contours: int
    time_split_s: record.TimeSplit
    interpolator: str
    camtool_version: str
    planned: Planned | None = None
    before: Before | None = None
    contour_errors: tuple[record.ContourReport, ...] = ()
    bidirectional: tuple[record.BothWaysReport, ...] = ()
    unreached: record.UnreachedReport | None = None
    shape: record.ShapeReport | None = None
    worst: tuple[record.WorstReport, ...] = ()
    assumptions: tuple[str, ...] = ()
    asked: record.AskedReport | None = None
    against: str = "program"

    def to_json(self) -> str:
        """Indented JSON with keys in the order of the record, and a newline at the end."""
        return to_json(self)

    def to_text(self, *, findings: bool = True) -> str:
        """A summary of a few lines for a terminal; `findings=False` leaves these out."""
        from camtool.verify.wording import text

        return text(self, findings=findings)

    def worst_text(self) -> str:
        """The moves with the largest errors, one to a line, "" when nothing is cut."""
        from camtool.verify.wording import worst

        return worst(self)

    def to_markdown(self) -> str:
        """The report as Markdown, for a pull request or a job's record."""
        from camtool.verify.markdown import markdown
        from camtool.verify.page import page_of

        return markdown(page_of(self))

    def notes(self) -> tuple[str, ...]:
        """Two or three short lines to set beside a picture."""
        from camtool.verify.wording import notes

        return notes(self)

    def with_findings(self, findings: Iterable[Finding]) -> Report:
        """The same report with these findings."""
        return msgspec.structs.replace(self, findings=reported(findings))


def reported(findings: Iterable[Finding]) -> tuple[FindingReport, ...]:
    """Findings for the report, in their order, each once."""
    return tuple(
        FindingReport(
            code=finding.code.name,
            severity=finding.severity.name.lower(),
            message=finding.message,
            where=finding.where,
            measured=number(finding.measured),
            limit=number(finding.limit),
            unit=finding.unit,
        )
        for finding in dict.fromkeys(findings)
    )


def number(value: float | None, scale: float = 1.0) -> float | None:
    """`value` · scale rounded for the report; None for what is not finite. No −0."""
    if value is None or not math.isfinite(value):
        return None
    return round(float(value) * scale, DECIMALS) + 0.0


def certain(value: float) -> float:
    """A number that is always known, rounded for the report."""
    return round(float(value), DECIMALS) + 0.0
