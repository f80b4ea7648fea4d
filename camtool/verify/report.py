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

DECIMALS = 6
"""Decimal places of all numbers of the report (mm, µm, s, per cent)."""


class MaxRms(msgspec.Struct, frozen=True):
    """Maximum and root of the mean square; None where nothing was measured."""

    max: float | None = None
    rms: float | None = None


class ErrorFigures(msgspec.Struct, frozen=True):
    """Maximum, root of the mean square, 95th percentile (within 0.5 %)."""

    max: float | None = None
    rms: float | None = None
    p95: float | None = None


class InterpolationFigures(msgspec.Struct, frozen=True):
    """µm; `lines_steps` and `arcs_steps` are the maxima over the finer coded step of X and Y."""

    max: float | None = None
    rms: float | None = None
    p95: float | None = None
    lines_max: float | None = None
    arcs_max: float | None = None
    lines_steps: float | None = None
    arcs_steps: float | None = None


class Errors(msgspec.Struct, frozen=True):
    """Predicted errors by source, µm.

    fit: drawn curves to the arcs that stand for them. rounding: moves as the controller holds
    them (the dialect's digits and whole steps) to the wanted ones. interpolation: commanded
    positions to the moves as held. mechanics: slides to commanded positions. total: slides to the
    wanted moves (to those as held where nothing was wanted).
    """

    fit: MaxRms = MaxRms()
    rounding: MaxRms = MaxRms()
    interpolation: InterpolationFigures = InterpolationFigures()
    mechanics: MaxRms = MaxRms()
    total: ErrorFigures = ErrorFigures()


class ExtentsMm(msgspec.Struct, frozen=True):
    """[lowest, highest] of the programmed path, mm."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]


class Steps(msgspec.Struct, frozen=True):
    """Steps of each axis, and iterations of the interpolator."""

    x: int
    y: int
    z: int
    iterations: int


class AxisCounts(msgspec.Struct, frozen=True):
    """One count per axis."""

    x: int
    y: int
    z: int


class Reversals(msgspec.Struct, frozen=True):
    """Reversals of each axis in all, and of these while cutting and otherwise."""

    x: int
    y: int
    z: int
    cutting: AxisCounts
    air: AxisCounts


class TimeSplit(msgspec.Struct, frozen=True):
    """Where the time goes, s."""

    cutting: float
    air: float
    dwell: float


class Dimension(msgspec.Struct, frozen=True):
    """A size of the tool centre's path; error_percent > 0 when it comes out too large. Of a
    contour in several passes the deepest and last one counts, without leads and ramps."""

    name: str
    nominal_mm: float
    predicted_mm: float
    error_percent: float | None


class CircleReport(msgspec.Struct, frozen=True):
    """A full circle: G, F max and F min as ISO 230-4 defines them; D is the mean of r − R. A
    circle in several passes, or at the end of a helix, is reported once: its deepest level turn.
    """

    centre_mm: tuple[float, float]
    radius_mm: float
    G_um: float | None
    Fmax_um: float | None
    Fmin_um: float | None
    D_um: float | None
    direction: str
    z_mm: float


class FindingReport(msgspec.Struct, frozen=True):
    """A finding, by the names of its code and severity."""

    code: str
    severity: str
    message: str
    where: str
    measured: float | None = None
    limit: float | None = None
    unit: str = ""


class Planned(msgspec.Struct, frozen=True):
    """What planning gained: how far rapids go in XY, mm, with everything in the order and from
    the starts in which it was drawn, and as it was put into order."""

    rapid_drawn_mm: float
    rapid_mm: float


class Before(msgspec.Struct, frozen=True):
    """The same job without `--minimise reversals`, `--approach` and `--compensate`: reversals of
    X and Y, the largest predicted error, the time. Null where that job could not be made."""

    reversals_cutting: int | None = None
    reversals_air: int | None = None
    total_max_um: float | None = None
    time_s: float | None = None


class Report(msgspec.Struct, frozen=True):
    """Everything that a verification found. `blocks`, `bytes` None when no program was given."""

    target: str
    source: str
    moves: int
    blocks: int | None
    bytes: int | None
    extents_mm: ExtentsMm
    time_s: float
    steps: Steps
    reversals: Reversals
    error_um: Errors
    closure_um: float | None
    dimensions: tuple[Dimension, ...]
    circles: tuple[CircleReport, ...]
    findings: tuple[FindingReport, ...]
    contours: int
    time_split_s: TimeSplit
    interpolator: str
    camtool_version: str
    planned: Planned | None = None
    before: Before | None = None

    def to_json(self) -> str:
        """Indented JSON with keys in the order of the record, and a newline at the end."""
        return msgspec.json.format(msgspec.json.encode(self), indent=2).decode() + "\n"

    def to_text(self, *, findings: bool = True) -> str:
        """A summary of a few lines for a terminal; `findings=False` leaves these out."""
        from camtool.verify.wording import text

        return text(self, findings=findings)

    def to_markdown(self) -> str:
        """The report as Markdown, for a pull request or a job's record."""
        from camtool.verify.wording import markdown

        return markdown(self)

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
    return round(value * scale, DECIMALS) + 0.0


def certain(value: float) -> float:
    """A number that is always known, rounded for the report."""
    return round(float(value), DECIMALS) + 0.0
