"""The Report: the results of a verification as a record, JSON, text, Markdown and HTML.

The keys are stable: keys may be added, but are never renamed (a test has the list). No value is
NaN or infinite: unknown values are null. Numbers are rounded to `DECIMALS` places, far below the
resolution of any machine, so that the same job gives the same bytes on every computer.

    records ─▶ Report ─▶ limits of a pipeline (`Gates`)
                  ├────▶ `summary_lines`, lines for a terminal and for the margin of a picture
                  └────▶ `sheets`, tables of text ─▶ `ReportPage` ─▶ `page_markdown`, `page_html`,
                                                          `page_json`"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import msgspec
from msgspec import Struct
from msgspec.structs import asdict

from camtool.findings import Finding, FindingReport
from camtool.plain import one_line, to_json
from camtool.planning.naming import range_words
from camtool.records import FrozenRecord, replace
from camtool.toolpath.findings import ProgramCode
from camtool.units import UM_PER_MM, clock
from camtool.verification.findings import (
    ABOVE_GATE,
    ABOVE_GATE_ENGAGEMENT,
    ABOVE_GATE_GOUGED,
    ABOVE_GATE_NO_ENGAGEMENT,
    ABOVE_GATE_NO_STOCK,
    ABOVE_GATE_NOT_PROVED,
    ABOVE_GATE_REVERSALS,
    ABOVE_GATE_STOCK,
    ABOVE_GATE_TIME,
    ABOVE_GATE_UNKNOWN,
)

if TYPE_CHECKING:
    from camtool.stock.engagement import OperationEngagement
    from camtool.stock.heights import Bracket

DECIMALS = 6
"""Decimal places of all numbers of the report (mm, µm, s, per cent)."""

# The parts of a report.


class MaxRms(msgspec.Struct, frozen=True):
    """Maximum and root of the mean square; None where nothing was measured."""

    max: float | None = None
    rms: float | None = None


class ErrorFigures(msgspec.Struct, frozen=True):
    """Maximum, root of the mean square, 95th percentile (within 0.5 %), and signed mean: + to the
    left of the direction of travel."""

    max: float | None = None
    rms: float | None = None
    p95: float | None = None
    mean: float | None = None


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

    fit: distance of the drawing from the lines and arcs that replace it, at the size of the part:
    curves, and all that was joined, merged, recognised or left out on reading; None without a
    drawing. rounding: of the moves as the controller rounds them (digits of the dialect, whole
    steps) from the wanted moves. interpolation: of the commanded positions from the rounded moves.
    mechanics: of the slides from the commanded positions. total: of the slides from the wanted
    moves, plus the fit there and what placing by the box of fitted curves may be off, so never
    less than their distance from the drawing; without wanted moves, from the rounded moves. Its
    mean is without the fit. depth_max: difference in height of the slide from the rounded moves,
    while cutting."""

    fit: MaxRms = MaxRms()
    rounding: MaxRms = MaxRms()
    interpolation: InterpolationFigures = InterpolationFigures()
    mechanics: MaxRms = MaxRms()
    total: ErrorFigures = ErrorFigures()
    depth_max: float | None = None


class ExtentsMm(msgspec.Struct, frozen=True):
    """[lowest, highest] of the programmed path, mm."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]


class StepCounts(msgspec.Struct, frozen=True):
    """Steps of each axis, and iterations of the interpolator: all, and those while cutting."""

    x: int
    y: int
    z: int
    iterations: int
    iterations_cutting: int


class AxisCounts(msgspec.Struct, frozen=True):
    """A count for each axis."""

    x: int
    y: int
    z: int


class Reversals(msgspec.Struct, frozen=True):
    """Reversals of each axis: all, those while cutting, and the others."""

    x: int
    y: int
    z: int
    cutting: AxisCounts
    air: AxisCounts


class TimeSplit(msgspec.Struct, frozen=True):
    """Parts of the time, s. `compensation` is the part of `cutting` and `air` for steps that the
    controller adds at reversals; `link` is the additional time of the line to the machine."""

    cutting: float
    air: float
    dwell: float
    compensation: float = 0.0
    link: float = 0.0


class DimensionReport(msgspec.Struct, frozen=True):
    """A size of the cut edge, nominally as drawn, or without a drawing of the tool centre's path
    (`of`: "edge", "centre"). error_percent > 0 when it is too large. Of a contour in several
    passes the last and deepest counts, without leads and ramps."""

    name: str
    nominal_mm: float
    predicted_mm: float
    error_percent: float | None
    of: str = "centre"


class CircleReport(msgspec.Struct, frozen=True):
    """A full circle: G, F max and F min as ISO 230-4 defines them; D is the mean of r − R. A
    circle in several passes, or at the end of a helix, is reported once: its deepest level turn.
    `step_um` and `spike_um` at 0°, 90°, 180° and 270°, where X, Y, X and Y reverse, and B, the
    reversal values of X and Y: see `camtool.verification.circles`. All refer to the programmed
    circle; `fit_um`: the largest distance of the drawing from it."""

    centre_mm: tuple[float, float]
    radius_mm: float
    G_um: float | None
    Fmax_um: float | None
    Fmin_um: float | None
    D_um: float | None
    direction: str
    z_mm: float
    step_um: tuple[float | None, ...] = ()
    spike_um: tuple[float | None, ...] = ()
    B_um: tuple[float | None, ...] = ()
    fit_um: float | None = None


class BothWaysReport(msgspec.Struct, frozen=True):
    """A circle that is cut in both directions: bi-directional circular error G(b) and mean
    bi-directional radial error D (ISO 230-4)."""

    centre_mm: tuple[float, float]
    radius_mm: float
    Gb_um: float | None
    D_um: float | None


class ContourReport(msgspec.Struct, frozen=True, gc=False):
    """The total error of one contour, µm, with the place of its maximum, and its largest errors by
    source; `block` from 1, None when no program was read."""

    name: str
    max_um: float
    rms_um: float
    mean_um: float
    at_mm: tuple[float, float]
    block: int | None
    interpolation_um: float
    mechanics_um: float
    fit_um: float | None = None


class WorstReport(msgspec.Struct, frozen=True):
    """A move with a large error: `block` and `move` from 1, and its largest errors by source."""

    block: int | None
    move: int
    at_mm: tuple[float, float]
    total_um: float
    interpolation_um: float | None
    mechanics_um: float | None
    source: str
    fit_um: float | None = None


class UnreachedReport(msgspec.Struct, frozen=True):
    """The number of moves that the controller leaves beside their ends, and the largest
    distance."""

    moves: int
    max_um: float


class ShapeReport(msgspec.Struct, frozen=True):
    """Overcut, removed beside the wanted shape, and undercut, left of it, of a round tool seen
    from above: areas and depths."""

    tool_diameter_mm: float
    overcut_mm2: float
    overcut_um: float
    undercut_mm2: float
    undercut_um: float


class AskedReport(msgspec.Struct, frozen=True):
    """Programmed moves against those that the job asks for: the number of cutting moves, how many
    of them are exactly those that camtool would write, the largest distance of the others from
    what was asked, and the tolerance."""

    moves: int
    alike: int
    off_um: float
    limit_um: float


class FoundTool(msgspec.Struct, frozen=True):
    """A tool whose path keeps to the lines of the drawing: its number (None if the program mounts
    none), its diameter (0 for a path on the lines), and whether that was given by the user."""

    number: int | None
    diameter_mm: float
    given: bool


class FoundReport(msgspec.Struct, frozen=True):
    """The lines of a drawing that a program of unknown origin cuts: how far the drawing was moved
    to lie under it, and whether its place was searched for (`aligned`); the share of the cuts that
    follow the lines, and the length of those that do not; the tools; the number of contours cut on
    each side; and the distance of the program from the lines."""

    shift_mm: tuple[float, float]
    aligned: bool
    followed: float
    beside_mm: float = 0.0
    tools: tuple[FoundTool, ...] = ()
    outside: int = 0
    inside: int = 0
    on_line: int = 0
    drilled: int = 0
    not_cut: int = 0
    off_max_um: float | None = None
    off_rms_um: float | None = None


COVERAGE = 2.0
"""Uncertainties in tables and pictures are expanded by this, to cover some 95 %."""


class ContributionReport(msgspec.Struct, frozen=True):
    """The contribution of an input to the standard uncertainty of a dimension, µm; null if the
    uncertainty of the input is not known. In that case `at_most_um` bounds its effect on the
    dimension within the range that `within` names; null if nothing bounds it."""

    input: str
    um: float | None
    at_most_um: float | None = None
    within: str = ""


class InspectedReport(msgspec.Struct, frozen=True):
    """A dimension of the part with its limits, in mm unless a name says otherwise.

    `places_mm`: two places in the work frame between which a picture shows it. `lower_mm`,
    `upper_mm`: limits of the size, null without any. The predicted sizes are the best fit, and the
    least and the largest local size; one of them decides the verdict. `standard_um`: the known
    part of the standard uncertainty of that one; `unknown_um`: the greatest change that everything
    unknown can make to it; both null if nothing bounds that. `guard_um`: how far inside its limit
    it must be to be surely in. `probability`: that it is within the limits; if something is
    unknown, the value least in favour of the verdict. `verdict`: "in", "out", "undecided", or
    "predicted" without limits. `unknown`: keys of [uncertainty] that matter and are not given;
    `measure`: what to measure next, "" for nothing."""

    name: str
    kind: str
    source: str
    places_mm: tuple[tuple[float, float], tuple[float, float]]
    nominal_mm: float
    limits: str
    lower_mm: float | None
    upper_mm: float | None
    fit_mm: float
    low_mm: float
    high_mm: float
    verdict: str
    standard_um: float | None = None
    unknown_um: float | None = None
    guard_um: float | None = None
    probability: float | None = None
    contributions: tuple[ContributionReport, ...] = ()
    unknown: tuple[str, ...] = ()
    measure: str = ""

    @property
    def asked(self) -> str:
        """The requirement in words: "Ø5 H7", "roundness zone 0.02"."""
        signs = {"diameter": "Ø", "radius": "R", "depth": "depth ", "thickness": "thickness "}
        sign = signs.get(self.kind, "")
        nominal = f"{sign}{self.nominal_mm:g}" if self.nominal_mm else self.kind
        return f"{nominal} {self.limits}".rstrip()

    @property
    def not_known(self) -> tuple[ContributionReport, ...]:
        """The inputs that matter and of which it is not known how well they are."""
        return tuple(each for each in self.contributions if each.um is None)

    @property
    def expanded_um(self) -> float | None:
        """Its uncertainty, expanded by COVERAGE, and all that is not known; None where nothing
        bounds that."""
        if self.standard_um is None:
            return None
        return COVERAGE * self.standard_um + (self.unknown_um or 0.0)


class PlannedOperation(msgspec.Struct, frozen=True):
    """Tool, feeds, depth and passes of an operation; feeds in mm/min.

    `spindle_rpm` is None without a speed; `passes` and the depth of the deepest are None for kinds
    of operation without passes. `coolant`: "off", "mist", "flood" or "both". `tool`: the index of
    its tool; `tool_name`, and the `material` of its preset, are "" if there are none. The feed per
    tooth and the cutting speed are None if the flutes, or the speed, are not known, and so is the
    predicted time. Their limits are those of the tool or its preset, (least, greatest or None),
    None if not given. `leaves_mm`: what stays on the walls for a later cut; `tabs`: the number of
    tabs that it leaves."""

    name: str
    kind: str
    tool: int
    tool_name: str
    tool_diameter_mm: float
    material: str
    chip_load_mm: float | None
    surface_speed_m_min: float | None
    spindle_rpm: float | None
    feed_mm_min: float
    plunge_mm_min: float
    depth_mm: float
    passes: int | None = None
    deepest_pass_mm: float | None = None
    coolant: str = "off"
    time_s: float | None = None
    chip_load_limits_mm: tuple[float, float | None] | None = None
    surface_speed_limits_m_min: tuple[float, float | None] | None = None
    leaves_mm: float = 0.0
    tabs: int = 0


class PlannedTool(msgspec.Struct, frozen=True):
    """A tool, in the order of first use; `words` describe its shape. It must stick out of its
    holder by more than `reach_mm` (the depth of its deepest cut) plus what stands above the stock.
    Its stick-out and the width of its holder are None if the job does not give them."""

    number: int | None
    name: str
    words: str
    reach_mm: float
    cutting_length_mm: float | None = None
    stickout_mm: float | None = None
    holder_diameter_mm: float | None = None


class PlannedStock(msgspec.Struct, frozen=True):
    """The stock in the work frame, its top at Z0: lower left corner and size (None if the job does
    not give them), and the depth, mm, to which cuts may go below it."""

    thickness_mm: float
    corner_mm: tuple[float, float] | None
    size_mm: tuple[float, float] | None
    through_mm: float


class Planned(msgspec.Struct, frozen=True):
    """Figures of planning. The length of rapids in XY, mm: in the program, and as it would be in
    the drawing's order and with its starts. The operations, their tools, and the stock if the job
    gives it.

    `zero`: the place of part zero on the drawing: "drawing" for its own zero, "lower-left" or
    "centre" of what is cut, a point (x, y), mm, or "set-up" if a set-up has turned or moved it.
    `cut_mm`: (left, low, right, high) of what the tools cut; `swept_mm`: the same of what tools
    and holders pass over at any height. `touch_mm`: for each tool that is mounted during the
    program, a place (x, y), mm, where the top of the stock is not cut yet, None if there is none.
    `setup`: text on the set-up that this is; `pins_mm`: its alignment pins; `flip_error_mm`: how
    far its cuts may lie beside those of the other face, None if not known."""

    rapid_drawn_mm: float
    rapid_mm: float
    operations: tuple[PlannedOperation, ...] = ()
    tools: tuple[PlannedTool, ...] = ()
    stock: PlannedStock | None = None
    zero: str | tuple[float, float] = "drawing"
    cut_mm: tuple[float, float, float, float] | None = None
    swept_mm: tuple[float, float, float, float] | None = None
    touch_mm: tuple[tuple[float, float] | None, ...] = ()
    setup: str = ""
    pins_mm: tuple[tuple[float, float], ...] = ()
    flip_error_mm: float | None = None


class BaselineReport(msgspec.Struct, frozen=True):
    """Figures of the same job without `--minimise reversals`, `--approach` and `--compensate`:
    reversals of X and Y, the largest predicted error, the time. Null if that job cannot be posted.
    """

    reversals_cutting: int | None = None
    reversals_air: int | None = None
    total_max_um: float | None = None
    time_s: float | None = None


class EngagementReport(msgspec.Struct, frozen=True):
    """An upper bound of the greatest engagement of an operation, predicted on the slides, outside
    of entries and within 1° of an engagement that occurs; its place, and its block (from 1). Null
    if it is not judged, or nothing is cut. `operation` is "" if only the program is known.
    `limit_deg`: the limit that the operation sets, null for none; `left_mm`: for an operation with
    a limit, the greatest height of material that the program leaves (`MATERIAL_LEFT`), 0 if none
    was found, null if not judged."""

    operation: str
    greatest_deg: float | None
    at_mm: tuple[float, float] | None = None
    block: int | None = None
    limit_deg: float | None = None
    left_mm: float | None = None


# The report.


class Report(msgspec.Struct, frozen=True):
    """The results of a verification. `blocks` and `bytes` are None without a program. `against`:
    "drawing" where errors are distances from the drawing, "program" where there is no drawing and
    they are distances from the moves of the program, or of the program it was converted from.
    `engagement`: None where it is not judged."""

    target: str
    source: str
    moves: int
    blocks: int | None
    bytes: int | None
    extents_mm: ExtentsMm
    time_s: float
    steps: StepCounts
    reversals: Reversals
    error_um: Errors
    closure_um: float | None
    dimensions: tuple[DimensionReport, ...]
    circles: tuple[CircleReport, ...]
    findings: tuple[FindingReport, ...]
    contours: int
    time_split_s: TimeSplit
    interpolator: str
    camtool_version: str
    planned: Planned | None = None
    before: BaselineReport | None = None
    contour_errors: tuple[ContourReport, ...] = ()
    bidirectional: tuple[BothWaysReport, ...] = ()
    unreached: UnreachedReport | None = None
    shape: ShapeReport | None = None
    worst: tuple[WorstReport, ...] = ()
    assumptions: tuple[str, ...] = ()
    asked: AskedReport | None = None
    against: str = "program"
    found: FoundReport | None = None
    inspection: tuple[InspectedReport, ...] = ()
    engagement: tuple[EngagementReport, ...] | None = None

    def to_json(self) -> str:
        """Return indented JSON with keys in the order of the record, and a newline at the end."""
        return to_json(self)

    def to_text(self, *, findings: bool = True) -> str:
        """Return the summary that `camtool post` and `camtool verify` print, without a final
        newline, and with a line for each finding unless `findings=False`."""
        lines = [f"{name:<10} {value}" for name, value in summary_lines(self)]
        lines += [item.to_line() for item in self.findings if findings]
        return "\n".join(map(one_line, lines))

    def worst_text(self) -> str:
        """Return the moves with the largest errors, one per line, µm; "" when nothing is cut."""
        lines = [
            f"{move_name(item.block, item.move):<12} {item.total_um:>9.2f} µm  interpolation"
            f" {um(item.interpolation_um)}, mechanics {um(item.mechanics_um)}"
            f"  near ({item.at_mm[0]:.3f}, {item.at_mm[1]:.3f}) mm"
            + (f"  {one_line(item.source)}" if item.source else "")
            for item in self.worst
        ]
        return "\n".join(lines)

    def to_markdown(self) -> str:
        """Return the report as Markdown, for a pull request or the record of a job."""
        return page_markdown(ReportPage(self.source or self.target, self, self.findings))

    def notes(self) -> tuple[str, ...]:
        """Return two short lines beside a picture: target, time and reversals; the error."""
        total = self.error_um.total
        return (
            f"{self.target}: {duration(self.time_s)}, {self.cutting_reversals} reversals",
            f"predicted error {um(total.max)} µm at most, rms {um(total.rms)} µm{remarks(self)}",
        )

    @property
    def cutting_reversals(self) -> int:
        """Reversals of X and Y while cutting."""
        return self.reversals.cutting.x + self.reversals.cutting.y

    def with_findings(self, findings: Iterable[Finding]) -> Report:
        """Return the report with these findings in place of its own."""
        return replace(self, findings=finding_reports(findings))


def finding_reports(findings: Iterable[Finding]) -> tuple[FindingReport, ...]:
    """Return the findings as records of the report, in order, without repeats."""
    return tuple(
        FindingReport(
            code=finding.code.name,
            severity=finding.severity.name.lower(),
            message=finding.message,
            where=finding.where,
            measured=rounded_or_none(finding.measured),
            limit=rounded_or_none(finding.limit),
            unit=finding.unit,
        )
        for finding in dict.fromkeys(findings)
    )


def rounded_or_none(value: float | None, scale: float = 1.0) -> float | None:
    """Return `value` · scale rounded for the report, with 0 in place of −0; None if it is not
    finite."""
    if value is None or not math.isfinite(value):
        return None
    return round(float(value) * scale, DECIMALS) or 0.0


def rounded(value: float) -> float:
    """Return a finite number rounded for the report, with 0 in place of −0."""
    return round(float(value), DECIMALS) or 0.0


# Limits of a pipeline: exceeding one is a finding, and exit code 1.


@dataclass(frozen=True, repr=False, eq=False)
class Gates(FrozenRecord):
    """The largest allowed total error (mm), number of reversals of X and Y while cutting, time
    (s), gouge and leftover of the stock (mm), and engagement of tools (rad); None: no limit."""

    error_mm: float | None = None
    reversals: int | None = None
    time_s: float | None = None
    gouge_mm: float | None = None
    leftover_mm: float | None = None
    engagement_rad: float | None = None


def gate_findings(
    report: Report, gates: Gates, findings: Iterable[Finding] = ()
) -> Iterator[Finding]:
    """Yield ABOVE_GATE for each limit that a figure of the report, or a gouge among the findings,
    exceeds, or whose figure is not known."""
    if gates.error_mm is not None:
        yield from _error_gate(report.error_um.total.max, gates.error_mm * UM_PER_MM)
        depth = gouged_mm(findings)
        if depth > gates.error_mm:
            yield ABOVE_GATE_GOUGED(
                where="--max-error", measured=depth * UM_PER_MM, limit=gates.error_mm * UM_PER_MM
            )
    count = report.cutting_reversals
    if gates.reversals is not None and count > gates.reversals:
        yield ABOVE_GATE_REVERSALS(where="--max-reversals", measured=count, limit=gates.reversals)
    if gates.time_s is not None and report.time_s > gates.time_s:
        yield ABOVE_GATE_TIME(
            where="--max-time",
            measured=report.time_s,
            limit=gates.time_s,
            takes=clock(report.time_s),
            allowed=clock(gates.time_s),
        )


def stock_gate_findings(
    subject: str, limit_mm: float, bracket: Bracket | None
) -> Iterator[Finding]:
    """Yield ABOVE_GATE if the "gouge" or "leftover" of the stock (`subject`) exceeds its limit, is
    not proved to keep it, or (`bracket` None) is not known."""
    flag, limit_um = f"--max-{subject}", limit_mm * UM_PER_MM
    if bracket is None:
        yield ABOVE_GATE_NO_STOCK(where=flag, limit=limit_um, what=subject)
        return
    high_um = bracket.high * UM_PER_MM if math.isfinite(bracket.high) else None
    if bracket.low > limit_mm:
        yield ABOVE_GATE_STOCK(
            where=flag,
            measured=bracket.low * UM_PER_MM,
            limit=limit_um,
            what=subject,
            x=bracket.at_mm[0],
            y=bracket.at_mm[1],
            most="" if high_um is None else f", and proved to be {high_um:.2f} µm at most",
        )
    elif bracket.high > limit_mm:
        proved = "nothing" if high_um is None else f"only {high_um:.2f} µm"
        yield ABOVE_GATE_NOT_PROVED(
            where=flag, measured=high_um, limit=limit_um, what=subject, proved=proved
        )


def engagement_gate_findings(
    limit_rad: float, rows: Sequence[OperationEngagement], reason: str = ""
) -> Iterator[Finding]:
    """Yield ABOVE_GATE if the greatest engagement exceeds the limit, and for each operation that
    was not judged; `reason`: why none was."""
    limit, flag = math.degrees(limit_rad), "--max-engagement"
    unknown = [f"{each.words}: {each.reason}" for each in rows if each.greatest_rad is None]
    for words in [reason] if reason else unknown:
        yield ABOVE_GATE_NO_ENGAGEMENT(where=flag, limit=limit, reason=words)
    worst = max(rows, key=lambda each: each.greatest_rad or 0.0, default=None)
    if worst is not None and worst.at_mm is not None and (worst.greatest_rad or 0.0) > limit_rad:
        yield ABOVE_GATE_ENGAGEMENT(
            where=flag,
            measured=math.degrees(worst.greatest_rad or 0.0),
            limit=limit,
            operation=worst.words,
            place=f"at X {worst.at_mm[0]:.3f} Y {worst.at_mm[1]:.3f}",
        )


def _error_gate(found_um: float | None, limit_um: float) -> Iterator[Finding]:
    if found_um is None:
        yield ABOVE_GATE_UNKNOWN(where="--max-error", limit=limit_um)
    elif found_um > limit_um:
        yield ABOVE_GATE(where="--max-error", measured=found_um, limit=limit_um)


# The report as lines of text.

MAX_OPERATIONS = 24

COOLANT_WORDS = {"off": "", "mist": ", mist", "flood": ", flood", "both": ", mist and flood"}


def duration(seconds: float) -> str:
    """Return seconds as words, rounded to the second.

    >>> duration(216.0), duration(3725.4), duration(7.2)
    ('3 min 36 s', '1 h 2 min 5 s', '7 s')
    """
    total = round(seconds)
    parts = (total // 3600, "h"), (total // 60 % 60, "min"), (total % 60, "s")
    return " ".join(f"{count} {unit}" for count, unit in parts if count) or "0 s"


def summary_lines(report: Report) -> Iterator[tuple[str, str]]:
    """Yield the lines of the summary as (name, value)."""
    steps, extents = report.steps, report.extents_mm
    method = report.interpolator
    if method in ("dsm", "dda", "stairs"):
        method = f"arcs by {method}"
    elif method == "path":
        method = "followed exactly"
    yield "target", f"{report.target} ({method})"
    if report.dimensions:
        x, y = report.dimensions[:2]
        shown = f"error X {percent(x.error_percent)}, Y {percent(y.error_percent)}"
        subject = "" if x.of == "edge" else " of the tool's centre"
        yield "size", f"{x.nominal_mm:.3f} × {y.nominal_mm:.3f} mm{subject}; predicted {shown}"
    spans = zip("XYZ", (extents.x, extents.y, extents.z), strict=True)
    yield "travel", ", ".join(f"{axis} {mm(low)} to {mm(high)}" for axis, (low, high) in spans)
    program = f"{report.contours} contours, {report.moves} moves"
    if report.blocks is not None:
        program += f", {report.blocks} blocks"
    if report.bytes is not None:
        program += f", {report.bytes} bytes"
    yield "program", program
    split = report.time_split_s
    parts = [f"cutting {clock(split.cutting)}"]
    if split.link:
        parts.append(f"line {clock(split.link)}")
    yield "time", f"{clock(report.time_s)} ({', '.join(parts)})"
    yield "steps", f"X {steps.x}, Y {steps.y}, Z {steps.z}"
    total, cutting = report.reversals, report.reversals.cutting
    yield (
        "reversals",
        f"X {total.x}, Y {total.y}, Z {total.z} (while cutting X {cutting.x}, Y {cutting.y})",
    )
    if report.planned is not None:
        if report.planned.setup:
            yield "set-up", report.planned.setup
        yield from (("cut", line) for line in _operation_words(report.planned.operations))
        distance, drawn = report.planned.rapid_mm, report.planned.rapid_drawn_mm
        yield "rapids", f"{mm(distance)} mm in XY ({mm(drawn)} mm in the order of the drawing)"
    if report.before is not None:
        yield "before", _before_words(report)
    if report.asked is not None:
        yield "as asked", _asked_words(report.asked)
    if report.found is not None:
        yield from (("as found", line) for line in _found_words(report.found))
    error = report.error_um.total
    yield (
        "error",
        f"{um(error.max)} µm at most, rms {um(error.rms)}, p95 {um(error.p95)}{remarks(report)}",
    )
    yield "by source", _error_sources(report)
    if report.error_um.depth_max:
        yield "depth", f"{um(report.error_um.depth_max)} µm off at most"
    if report.closure_um is not None:
        yield "closure", f"{report.closure_um:.2f} µm"
    if report.unreached is not None and report.unreached.moves:
        distance = report.unreached.max_um
        yield "ends", f"{report.unreached.moves} moves end elsewhere, up to {distance:.2f} µm away"
    if report.shape is not None:
        yield "shape", _shape_words(report.shape)
    yield from (("engaged", _engagement_words(each)) for each in report.engagement or ())
    yield from (("dimension", inspected_words(each)) for each in report.inspection)
    bounds = {
        (one.input, one.within): None for each in report.inspection for one in each.not_known
    }
    yield from (
        ("not known", f"{name}: if {condition}") for name, condition in bounds if condition
    )


def _engagement_words(item: EngagementReport) -> str:
    """Return text on the greatest engagement of an operation and its limit."""
    if item.greatest_deg is None:
        return f"{item.operation or 'program'}: not judged"
    words = f"{item.operation or 'program'}: {item.greatest_deg:.2f}° at most"
    if item.at_mm is not None:
        words += f", near {_point_words(item.at_mm)}"
    if item.limit_deg is not None:
        words += f"; limit {item.limit_deg:.2f}°"
    if item.left_mm is not None:
        height = f"{item.left_mm:.4g} mm of material is left"
        words += f"; {height if item.left_mm else 'nothing is left but the scallop'}"
    return words


def inspected_words(item: InspectedReport) -> str:
    """Return one line of text on a dimension: its limits, its predicted sizes, its verdict."""
    words = f"{item.name}: {item.asked}"
    size = f"{item.fit_mm:.4f} mm"
    if item.high_mm > item.low_mm:
        size += f" ({item.low_mm:.4f} to {item.high_mm:.4f})"
    if item.expanded_um is not None:
        size += f" ± {item.expanded_um:.1f} µm"
    words += f"; predicted {size}"
    if item.verdict == "predicted":
        return words
    words += f"; {item.verdict}"
    if item.probability is not None:
        words += f", probability of in {_chance(item.probability)}"
    if item.not_known:
        words += f", not known: {', '.join(map(_unknown_words, item.not_known))}"
    verb = "say" if item.measure in item.unknown else "measure"
    return words + (f"; {verb} {item.measure}" if item.measure else "")


def _unknown_words(item: ContributionReport) -> str:
    if item.at_most_um is None:
        return item.input
    return f"{item.input} (at most {item.at_most_um:.1f} µm)"


def _chance(probability: float) -> str:
    """Return a probability as text in per cent, never as 0 or 100 %."""
    share = 100.0 * probability
    if share > 99.9:
        return "over 99.9 %"
    return "under 0.1 %" if share < 0.1 else f"{share:.1f} %"


def _asked_words(counts: AskedReport) -> str:
    """Return text on how many moves are exactly those that camtool would write."""
    if counts.alike == counts.moves:
        return f"all {counts.moves} cutting moves are those that camtool writes"
    return (
        f"{counts.alike} of {counts.moves} cutting moves are those that camtool writes, the others"
        f" up to {counts.off_um:.2f} µm off ({counts.limit_um:.2f} µm allowed)"
    )


def _found_words(part: FoundReport) -> Iterator[str]:
    """Yield text on the part of the drawing that the program cuts, the tool, and the distance
    between both."""
    if not part.tools and not part.drilled:
        yield "nothing of the drawing"
        return
    sides = {
        "outside": part.outside,
        "inside": part.inside,
        "on the line": part.on_line,
        "drilled": part.drilled,
        "not cut": part.not_cut,
    }
    counts = ", ".join(f"{count} {side}" for side, count in sides.items() if count)
    tools = ", ".join(
        ("tool" if each.number is None else f"tool {each.number}")
        + (f" of {mm(each.diameter_mm)} mm" if each.diameter_mm else " on the lines")
        + (" as given" if each.given else "")
        for each in part.tools
    )
    yield f"contours: {counts or 'none'}{'; ' if tools else ''}{tools}"
    x, y = part.shift_mm
    place = f"drawing at X{x:.3f} Y{y:.3f}" if x or y else "drawing at its own zero"
    beside_text = f", {mm(part.beside_mm)} mm beside it" if part.beside_mm else ""
    yield f"{place}; {part.followed:.1%} of the cuts follow it{beside_text}"
    if part.off_max_um is not None:
        yield f"program off it by {um(part.off_max_um)} µm at most, rms {um(part.off_rms_um)}"


def _operation_words(operations: Sequence[PlannedOperation]) -> Iterator[str]:
    """Yield one line for each operation: tool, spindle, feeds, depth and passes."""
    for each in operations[:MAX_OPERATIONS]:
        name = one_line(each.name or each.kind)
        tool_name = one_line(f" {each.tool_name}") if each.tool_name else ""
        tool = f"tool{tool_name} {each.tool_diameter_mm:g} mm"
        if not each.tool_diameter_mm:
            tool = f"tool{tool_name} of no width" if tool_name else "no tool width"
        speed = "no spindle speed" if each.spindle_rpm is None else f"spindle {each.spindle_rpm:g}"
        chip = ""
        if each.chip_load_mm is not None and each.surface_speed_m_min is not None:
            speed += f" ({each.surface_speed_m_min:.3g} m/min)"
            chip = f" ({each.chip_load_mm:.2g} mm per tooth)"
        preset = f", as in {one_line(each.material)}" if each.material else ""
        passes = "" if each.passes is None else f" in {each.passes} pass"
        if each.passes is not None and each.passes > 1:
            passes += f"es of {each.deepest_pass_mm:.4g} at most"
        plunge, depth = f", plunge {each.plunge_mm_min:g} mm/min", f", {each.depth_mm:.4g} mm deep"
        if not each.depth_mm:  # on a lathe nothing goes down
            plunge = depth = passes = ""
        feed = f"feed {each.feed_mm_min:g} mm/min{chip}{plunge}{preset}"
        yield f"{name}: {tool}, {speed}, {feed}{depth}{passes}{COOLANT_WORDS[each.coolant]}"
    if len(operations) > MAX_OPERATIONS:
        yield f"and {len(operations) - MAX_OPERATIONS} operations more"


def remarks(report: Report) -> str:
    """Return remarks on the largest error: what it refers to, if not the drawing, and gouges,
    which it does not include."""
    words = "" if report.against == "drawing" else "; to the program's moves: no drawing is known"
    gouges = [each for each in report.findings if each.code == ProgramCode.GOUGE.name]
    if gouges:
        depth = gouged_mm(gouges)
        size = f" of {depth:.4g} mm or more" if depth else ""
        words += f"; gouges{size} come on top (see GOUGE)"
    return words


def gouged_mm(findings: Iterable[Finding | FindingReport]) -> float:
    """Return a lower bound of how deep the tool cuts into what must stay, mm, from the GOUGE
    findings (needed minus found distance from a wall); 0 if there are none."""
    return max(
        (
            each.limit - each.measured
            for each in findings
            if each.code in (ProgramCode.GOUGE, ProgramCode.GOUGE.name)
            and each.measured is not None
            and each.limit is not None
        ),
        default=0.0,
    )


def _shape_words(shape: ShapeReport) -> str:
    """Return text on overcut and undercut of a round tool."""
    overcut_text = f"overcut {shape.overcut_um:.2f} µm deep, {shape.overcut_mm2:.4f} mm²"
    under = f"undercut {shape.undercut_um:.2f} µm, {shape.undercut_mm2:.4f} mm²"
    return f"{overcut_text}; {under} (tool {shape.tool_diameter_mm:g} mm)"


def move_name(block: int | None, move: int) -> str:
    """Return the name of a move: its block, or its own number if there are no blocks."""
    return f"block {block}" if block is not None else f"move {move}"


def _before_words(report: Report) -> str:
    """Return text on the figures of the same job without measures against reversals and
    backlash."""
    before = report.before
    if before is None or before.time_s is None:
        return "not known: the job without these measures cannot be cut"
    error, time = f"{um(before.total_max_um)} µm", clock(before.time_s)
    return (
        f"{before.reversals_cutting} reversals while cutting, {before.reversals_air} in the air,"
        f" error {error}, time {time}"
    )


def _error_sources(report: Report) -> str:
    sources = _by_source(report.error_um)
    return ", ".join(f"{name} {um(max_um)}" for name, (max_um, _, _) in sources.items()) + " µm"


_MaxRmsP95 = tuple[float | None, float | None, float | None]


def _by_source(error: Errors) -> dict[str, _MaxRmsP95]:
    """Return (maximum, rms, 95th percentile) of the error of each source, µm, by its name."""
    inside = error.interpolation
    return {
        "fit": (error.fit.max, error.fit.rms, None),
        "rounding": (error.rounding.max, error.rounding.rms, None),
        "interpolation": (inside.max, inside.rms, inside.p95),
        "mechanics": (error.mechanics.max, error.mechanics.rms, None),
    }


def um(value: float | None) -> str:
    """Format micrometres with two decimals, a dash for an unknown value."""
    return "–" if value is None else _fixed_decimals(value, 2)


def mm(value: float) -> str:
    """Format millimetres with three decimals."""
    return _fixed_decimals(value, 3)


def percent(value: float | None) -> str:
    """Format per cent with sign, a dash for an unknown value."""
    if value is None:
        return "–"
    text = _fixed_decimals(value, 2)
    return f"{text} %" if text.startswith("−") else f"+{text} %"


def _fixed_decimals(value: float, places: int) -> str:
    """Return a number as text with `places` decimals and a true minus sign; zero has no sign."""
    text = f"{abs(value):.{places}f}"
    return f"−{text}" if value < 0.0 and float(text) else text


# The contents of a page about a program, for Markdown, HTML and JSON.
#
# A page depends only on its inputs, not on the time, the folder or the order of hashes, so that
# the same job gives the same bytes.

NAME_SHOWN = 200
"""The text of a cell or a finding is shortened to this many characters on a page, not in JSON."""


class ChangedValue(Struct, frozen=True):
    """A value of the machine that `--machine` or `--set` has changed."""

    key: str
    value: str
    was: str


class Setup(Struct, frozen=True):
    """The machine and the settings: digests (SHA-256, hex) of all values of the machine and of the
    program, the values that differ from the target's own, and the flags on the command line."""

    machine: str
    machine_sha256: str
    program_sha256: str | None = None
    changed: tuple[ChangedValue, ...] = ()
    flags: tuple[tuple[str, str], ...] = ()


class ReportPage(Struct, frozen=True):
    """A page about a program. `report` is None if the program could not be judged; `findings` then
    say why. `pictures`: (caption, address) of each, a file beside the page or a data URI; `stock`:
    the address of the picture of the stock with part zero, "" without one."""

    title: str
    report: Report | None
    findings: tuple[FindingReport, ...]
    setup: Setup | None = None
    pictures: tuple[tuple[str, str], ...] = ()
    stock: str = ""

    @property
    def verdict(self) -> str:
        """ "error", "warning" or "fine": whether the program may be cut."""
        grave = {finding.severity for finding in self.findings}
        return next((word for word in ("error", "warning") if word in grave), "fine")


def setup_rows(setup: Setup) -> tuple[tuple[str, str], ...]:
    """Return the rows (name, value) on the machine and the settings, in order."""
    digests = [("machine", f"{setup.machine}, digest {setup.machine_sha256}")]
    if setup.program_sha256 is not None:
        digests.append(("program", f"digest {setup.program_sha256}"))
    changed_values = [
        (item.key, f"{item.value} (the target's own: {item.was})") for item in setup.changed
    ]
    return (*digests, *changed_values, *setup.flags)


def shorten(words: str) -> str:
    """Return the text shortened to `NAME_SHOWN` characters."""
    return words if len(words) <= NAME_SHOWN else words[: NAME_SHOWN - 1] + "…"


def page_json(page: ReportPage) -> str:
    """Return indented JSON with the report's keys after `title`, `verdict` and `setup`.

    If the program could not be judged, only `findings` follow these."""
    body: dict[str, Any] = {"title": page.title, "verdict": page.verdict}
    body["setup"] = None if page.setup is None else asdict(page.setup)
    if page.report is not None:
        body |= msgspec.to_builtins(page.report)
    body["findings"] = msgspec.to_builtins(page.findings)
    return to_json(body)


# The tables of a Report as rows of text, for Markdown and HTML.


class ReportSheet(Struct, frozen=True):
    """A table of a page: `noun`, the name of its rows; `words`, the number of leading columns with
    text (the others hold numbers). Cells are not escaped."""

    noun: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1


def sheets(report: Report) -> Iterator[ReportSheet]:
    """Yield the tables of a page that are not empty: inspected dimensions, errors by source,
    sizes, circles, contours and worst moves."""
    every = (
        _inspection_sheet(report),
        _error_sheet(report),
        _dimension_sheet(report),
        _circle_sheet(report),
        _both_ways_sheet(report),
        _contour_sheet(report),
        _worst_sheet(report),
    )
    return (sheet for sheet in every if sheet.rows)


def _inspection_sheet(report: Report) -> ReportSheet:
    limits, sizes = ("lower mm", "upper mm"), ("least mm", "fit mm", "largest mm")
    heads = ("inspected", "verdict", "most from", "not known", *limits, *sizes, "± µm", "in")
    rows = tuple(
        (
            item.name,
            item.verdict,
            item.contributions[0].input if item.contributions else "–",
            ", ".join(map(_unknown_words, item.not_known)) or "–",
            "–" if item.lower_mm is None else f"{item.lower_mm:.4f}",
            "–" if item.upper_mm is None else f"{item.upper_mm:.4f}",
            f"{item.low_mm:.4f}",
            f"{item.fit_mm:.4f}",
            f"{item.high_mm:.4f}",
            um(item.expanded_um),
            "–" if item.probability is None else _chance(item.probability),
        )
        for item in report.inspection
    )
    return ReportSheet("dimensions", heads, rows, words=4)


def _error_sheet(report: Report) -> ReportSheet:
    total = report.error_um.total
    figures = {**_by_source(report.error_um), "total": (total.max, total.rms, total.p95)}
    rows = tuple((name, *map(um, figures_um)) for name, figures_um in figures.items())
    return ReportSheet("sources", ("error by source", "max µm", "rms µm", "p95 µm"), rows)


def _dimension_sheet(report: Report) -> ReportSheet:
    heads = ("dimension", "nominal mm", "predicted mm", "error")
    rows = tuple(
        (
            item.name,
            f"{item.nominal_mm:.4f}",
            f"{item.predicted_mm:.4f}",
            percent(item.error_percent),
        )
        for item in report.dimensions
    )
    return ReportSheet("dimensions", heads, rows)


def _circle_sheet(report: Report) -> ReportSheet:
    heads = ("circle at mm", "way", "radius mm", "G µm", "Fmax µm", "Fmin µm", "D µm", "fit µm")
    rows = tuple(
        (
            _point_words(item.centre_mm),
            item.direction,
            f"{item.radius_mm:.4f}",
            *map(um, (item.G_um, item.Fmax_um, item.Fmin_um, item.D_um, item.fit_um)),
        )
        for item in report.circles
    )
    return ReportSheet("circles", heads, rows, words=2)


def _both_ways_sheet(report: Report) -> ReportSheet:
    heads = ("circle both ways round, at mm", "radius mm", "G(b) µm", "D µm")
    rows = tuple(
        (_point_words(item.centre_mm), f"{item.radius_mm:.4f}", um(item.Gb_um), um(item.D_um))
        for item in report.bidirectional
    )
    return ReportSheet("circles", heads, rows)


def _contour_sheet(report: Report) -> ReportSheet:
    """Return the table of contours, the largest error first."""
    heads = (
        "contour",
        "where",
        "max µm",
        "rms µm",
        "mean µm",
        "fit µm",
        "interpolation µm",
        "mechanics µm",
    )
    rows = tuple(
        (
            item.name,
            _point_words(item.at_mm),
            um(item.max_um),
            um(item.rms_um),
            um(item.mean_um),
            um(item.fit_um),
            um(item.interpolation_um),
            um(item.mechanics_um),
        )
        for item in sorted(report.contour_errors, key=lambda item: -item.max_um)
    )
    return ReportSheet("contours", heads, rows, words=2)


def _worst_sheet(report: Report) -> ReportSheet:
    heads = (
        "worst moves",
        "where",
        "drawn as",
        "error µm",
        "fit µm",
        "interpolation µm",
        "mechanics µm",
    )
    rows = tuple(
        (
            move_name(item.block, item.move),
            _point_words(item.at_mm),
            item.source,
            um(item.total_um),
            um(item.fit_um),
            um(item.interpolation_um),
            um(item.mechanics_um),
        )
        for item in report.worst
    )
    return ReportSheet("moves", heads, rows, words=3)


def _point_words(at_mm: tuple[float, float]) -> str:
    return f"({at_mm[0]:.3f}, {at_mm[1]:.3f})"


# What to take to the machine: the stock and its zero, tools, operations, warnings.

SETUP = "At the machine"

_GRAVEST_FIRST = {"error": 0, "warning": 1}

SETUP_FINDINGS = 6


def mounting_lines(report: Report) -> Iterator[tuple[str, str]]:
    """Yield (name, value) lines for mounting the stock: its place, the extents of the program,
    time and tools."""
    plan, extents = report.planned, report.extents_mm
    if plan is not None and plan.setup:
        yield "set-up", plan.setup
    stock = None if plan is None else plan.stock
    if stock is not None:
        yield "stock", _stock_words(stock)
    if plan is not None and plan.cut_mm:
        left_x, low, right, top = plan.cut_mm
        ends = f"X {mm(left_x)} to {mm(right)}, Y {mm(low)} to {mm(top)}"
        size = f"{mm(right - left_x)} × {mm(top - low)} mm"
        yield "blank", f"at least {size}, for the tools cut {ends}"
    yield "zero", _zero_words(stock, "drawing" if plan is None else plan.zero)
    if plan is not None and len(plan.tools) > 1:
        rows = [key for key, _ in groupby(each.tool for each in plan.operations)]
        mounted = ", then ".join(_tool_called(plan, row) for row in rows)
        yield "mounted", mounted + _touch_words(plan.touch_mm)
    if plan is not None and plan.swept_mm is not None:
        yield "clamps", _clamp_words(plan, plan.swept_mm)
    if by_hand := "; ".join(_by_hand(report)):
        yield "by hand", by_hand
    axes = zip("XYZ", (extents.x, extents.y, extents.z), strict=True)
    yield "travel", ", ".join(f"{axis} {mm(low)} to {mm(high)}" for axis, (low, high) in axes)
    yield "time", clock(report.time_s)


def _stock_words(stock: PlannedStock) -> str:
    thick = f"{stock.thickness_mm:g} mm thick"
    if stock.size_mm is not None:
        wide, high = stock.size_mm
        thick = f"{wide:g} × {high:g} × {stock.thickness_mm:g} mm"
    return f"{thick}; on a board that may be cut {stock.through_mm:g} mm deep"


def _zero_words(stock: PlannedStock | None, zero: str | tuple[float, float] = "drawing") -> str:
    """Return text on where X0 Y0 and Z0 lie on the stock and on the drawing."""
    places = {
        "drawing": "is the drawing's own zero",
        "lower-left": "is the lower left corner of the contours that are cut",
        "centre": "is the centre of the contours that are cut",
        "set-up": "is where it was before the part was turned over",
    }
    if isinstance(zero, str):
        drawn = places[zero]
    else:
        drawn = f"is at X{zero[0]:g} Y{zero[1]:g} of the drawing"
    if stock is None or stock.corner_mm is None:
        return f"X0 Y0 {drawn}; Z0 is the top of the stock"
    x, y = (-place + 0.0 for place in stock.corner_mm)
    suffix = "" if zero in ("drawing", "set-up") else f", and {drawn}"
    corner = "lower left corner"
    if zero == "set-up" and stock.size_mm is not None:
        # The corner that is nearest to zero is where it is touched off.
        wide, high = stock.size_mm
        right, upper = 2.0 * x > wide, 2.0 * y > high
        corner = f"{'upper' if upper else 'lower'} {'right' if right else 'left'} corner"
        x, y = x - wide * right, y - high * upper
    if round(x, 6) == round(y, 6) == 0.0:
        return f"X0 Y0 is the {corner} of the stock{suffix}; Z0 is its top"
    across = f"{abs(x):g} mm {'right' if x >= 0.0 else 'left'} of"
    along = f"{abs(y):g} mm {'above' if y >= 0.0 else 'below'}"
    return f"X0 Y0 is {across} and {along} the {corner} of the stock{suffix}; Z0 is its top"


def setup_sheets(plan: Planned) -> Iterator[ReportSheet]:
    """Yield the table of tools in the order of use, and the table of operations."""
    rows = tuple(
        (
            _tool_called(plan, row),
            tool.words,
            f"{tool.reach_mm:.4g}",
            "–" if tool.stickout_mm is None else f"{tool.stickout_mm:g}",
            "–" if tool.cutting_length_mm is None else f"{tool.cutting_length_mm:g}",
        )
        for row, tool in enumerate(plan.tools)
    )
    heads = ("tool", "shape", "must stick out more than mm", "sticks out mm", "edges mm")
    yield ReportSheet("tools", heads, rows, words=2)
    yield ReportSheet("operations", *_setup_operations(plan), words=3)


MIN_CLAMP_MM = 3.0
"""A strip of the stock that is narrower is no place for a clamp."""


def _clamp_words(plan: Planned, swept_mm: tuple[float, float, float, float]) -> str:
    """Return text on where clamps may go: the strips at the edges of the stock over which neither
    tool nor holder passes; if the stock is not known, the box that they stay within."""
    lacks_holder = [tool.holder_diameter_mm is None for tool in plan.tools]
    subject = (
        "no tool or holder passes"
        if not any(lacks_holder)
        else "no tool passes (holders are not known)"
    )
    left_x, low, right, top = swept_mm
    stock = plan.stock
    if stock is None or stock.corner_mm is None or stock.size_mm is None:
        return f"{subject} outside X {mm(left_x)} to {mm(right)}, Y {mm(low)} to {mm(top)}"
    (x, y), (wide, high) = stock.corner_mm, stock.size_mm
    strips = ("X", x, left_x), ("X", right, x + wide), ("Y", y, low), ("Y", top, y + high)
    free_strips = [
        f"{axis} {mm(begin)} to {mm(end)}"
        for axis, begin, end in strips
        if end - begin >= MIN_CLAMP_MM
    ]
    if not free_strips:
        return f"no edge of the stock has {MIN_CLAMP_MM:g} mm over which {subject}"
    return f"on the stock at {', '.join(free_strips)}: {subject} there"


def _touch_words(places: tuple[tuple[float, float] | None, ...]) -> str:
    """Return text on where each tool that is mounted later touches the stock, to set Z0 again."""
    words = ["where it is whole" if at is None else f"at X{at[0]:.4g} Y{at[1]:.4g}"
             for at in places]  # fmt: skip
    where = words[:1] if len(set(words)) == 1 else words
    return f"; touch off on the stock {', then '.join(where)}" if where else ""


def _by_hand(report: Report) -> Iterator[str]:
    """Yield lines on what is done by hand: tabs to cut, by operation and tool, and loose pieces to
    take out."""
    plan = report.planned
    for each in () if plan is None else plan.operations:
        if plan is not None and each.tabs:
            tabs = f"{each.tabs} tab{'s' * (each.tabs > 1)}"
            tool = _tool_called(plan, each.tool).strip("()")
            yield f"cut {tabs} of {each.name or each.kind} ({tool})"
    loose = [one for one in report.findings if one.code == ProgramCode.LOOSE_PIECE.name]
    if loose:
        places = ", ".join(one.where for one in loose if one.where)
        yield f"take out what comes loose: {places}" if places else "take out what comes loose"


def _tool_called(plan: Planned, row: int) -> str:
    """Return a name of a tool such as `1 mill`, or its place in the order if it has neither number
    nor name."""
    tool = plan.tools[row]
    number = "" if tool.number is None else f"T{tool.number}"
    return f"{number} {tool.name}".strip() or f"({row + 1})"


def _setup_operations(plan: Planned) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    general = ("operation", "kind", "tool", "coolant", "depth mm", "passes", "leaves mm")
    speeds = ("rev/min", "m/min", "feed mm/min", "mm per tooth", "plunge mm/min")
    rows = tuple(
        (
            each.name or each.kind,
            each.kind,
            _tool_called(plan, each.tool),
            each.coolant,
            f"{each.depth_mm:.4g}",
            "–" if each.passes is None else str(each.passes),
            f"{each.leaves_mm:.4g}".replace("-", "−") if each.leaves_mm else "–",
            "off" if each.spindle_rpm is None else f"{each.spindle_rpm:g}",
            _within_words(each.surface_speed_m_min, 3, each.surface_speed_limits_m_min),
            f"{each.feed_mm_min:g}",
            _within_words(each.chip_load_mm, 2, each.chip_load_limits_mm),
            f"{each.plunge_mm_min:g}",
            "–" if each.time_s is None else clock(each.time_s),
        )
        for each in plan.operations
    )
    heads = (*general, *speeds, "time")
    # A column of dashes says nothing, nor one of coolant that is off.
    says = [
        set(column) - ({"off"} if head == "coolant" else {"–"})
        for head, column in zip(heads, zip(*rows, strict=True), strict=True)
    ]
    columns = [k for k, words in enumerate(says) if words]
    return tuple(heads[k] for k in columns), tuple(tuple(row[k] for k in columns) for row in rows)


def _within_words(
    value: float | None, digits: int, limits: tuple[float, float | None] | None
) -> str:
    """Return a number and its limits as text, such as `0.04 (0.02 to 0.06)`; a dash for an unknown
    number."""
    if value is None:
        return "–"
    shown = f"{value:.{digits}g}"
    if limits is None:
        return shown
    min_value, max_value = limits
    return f"{shown} ({range_words((min_value, math.inf if max_value is None else max_value))})"


def gravest_findings(page: ReportPage) -> tuple[FindingReport, ...]:
    """Return the findings that the operator must know at the machine, errors first."""
    grave = [each for each in page.findings if each.severity in _GRAVEST_FIRST]
    return tuple(sorted(grave, key=lambda item: _GRAVEST_FIRST[item.severity]))


# A page as Markdown, for the summary of a pipeline's job or a comment on a pull request.
#
# Names come from drawings: whatever they contain, they are shown as text, never as mark-up, a
# link, a picture, a mention or a formula.

MARKDOWN_ROWS = 12

MARKDOWN_FINDINGS = 50

PAGE_BYTES = 65_000
"""The longest page: a comment on GitHub may have 65,536 characters, and the summary of a job 1
MiB, so that sixteen pages fit into it."""

_MARKS = frozenset("\\`*_[]<>|#~$&!")
_BROKEN = {"@": "@<!-- -->", "://": ":<!-- -->//", "www.": "www<!-- -->."}


def page_markdown(page: ReportPage) -> str:
    """Return the page as Markdown of at most PAGE_BYTES; if something is left out, its last line
    says so."""
    lines: list[str] = []
    room = PAGE_BYTES
    for line in _markdown_lines(page):
        room -= len(line.encode(errors="replace")) + 1
        if room < 0:
            lines += ["", "*The rest is left out: the page would be too long.*"]
            break
        lines.append(line)
    return "\n".join(lines).rstrip() + "\n"


def markdown_words(words: str) -> str:
    """Return the text shortened and escaped, as one line of Markdown."""
    line = shorten(one_line(words))
    escaped = "".join("\\" + sign if sign in _MARKS else sign for sign in line)
    for mark, broken in _BROKEN.items():
        escaped = escaped.replace(mark, broken)
    return escaped


def _markdown_lines(page: ReportPage) -> Iterator[str]:
    yield f"# {markdown_words(page.title)}"
    yield ""
    if page.report is not None:
        yield from (
            f"- **{name}:** {markdown_words(value)}" for name, value in summary_lines(page.report)
        )
        yield ""
        yield from _markdown_setup(page, page.report)
    for caption, address in page.pictures:
        yield f"![{markdown_words(caption)}]({quote(address, errors='surrogateescape')})"
        yield ""
    yield from _markdown_findings(page)
    if page.report is not None:
        for sheet in sheets(page.report):
            yield from _markdown_table(sheet)
    if page.setup is not None:
        yield "| machine and settings | |"
        yield "|---|---|"
        yield from (
            f"| {markdown_words(name)} | {markdown_words(value)} |"
            for name, value in setup_rows(page.setup)
        )
        yield ""
    if page.report is not None:
        yield from (f"- assumed: {markdown_words(words)}" for words in page.report.assumptions)


def _markdown_setup(page: ReportPage, report: Report) -> Iterator[str]:
    if report.planned is None:
        return
    yield f"## {SETUP}"
    yield ""
    yield from (f"- **{name}:** {markdown_words(value)}" for name, value in mounting_lines(report))
    yield ""
    for sheet in setup_sheets(report.planned):
        yield from _markdown_table(sheet)


def _markdown_findings(page: ReportPage) -> Iterator[str]:
    ordered = sorted(page.findings, key=lambda item: _GRAVEST_FIRST.get(item.severity, 2))
    for item in ordered[:MARKDOWN_FINDINGS]:
        place = f" ({markdown_words(item.where)})" if item.where else ""
        yield f"- {item.severity} `{item.code}`{place}: {markdown_words(item.message)}"
    if len(ordered) > MARKDOWN_FINDINGS:
        yield f"- and {len(ordered) - MARKDOWN_FINDINGS} more findings in the JSON report"
    if ordered:
        yield ""


def _markdown_table(sheet: ReportSheet) -> Iterator[str]:
    numbers = len(sheet.heads) - sheet.words
    yield f"| {' | '.join(sheet.heads)} |"
    yield "|" + "---|" * sheet.words + "---:|" * numbers
    for row in sheet.rows[:MARKDOWN_ROWS]:
        yield f"| {' | '.join(map(markdown_words, row))} |"
    if len(sheet.rows) > MARKDOWN_ROWS:
        yield ""
        yield f"and {len(sheet.rows) - MARKDOWN_ROWS} more {sheet.noun} in the JSON report"
    yield ""


# A page as one HTML file without scripts that loads nothing.
#
# Its pictures are data addresses, so that nothing in an SVG can run or load anything; its policy
# forbids both as well.

HTML_ROWS = 500
"""A page of HTML has at most this many rows of each table and as many findings; JSON has them
all."""

POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

_STYLE = """
:root { color-scheme: light dark; font: 15px/1.5 system-ui, sans-serif; }
body { margin: 2rem auto; max-width: 62rem; padding: 0 1rem; overflow-wrap: anywhere; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid #8886; padding: .2rem .7rem; text-align: left;
  vertical-align: top; }
td.number, th.number { text-align: right; }
th, td { overflow-wrap: break-word; max-width: 40rem; }
.wide { overflow-x: auto; } .pairs td { overflow-wrap: anywhere; }
img { max-width: 100%; height: auto; background: #fff; }
figure { margin: 1rem 0; } figcaption { opacity: .7; }
.setup .rows :is(th, td) { padding: .2rem .45rem; }
.error { color: #c5221f; } .warning { color: #a56300; } .fine { color: #2c7a32; }
@media (prefers-color-scheme: dark) {
  .error { color: #ff8a80; } .warning { color: #ffc266; } .fine { color: #8fd694; } }
@media screen and (max-width: 40rem) {
  body { margin-top: 1rem; padding: 0 .7rem; } th, td { padding: .2rem .4rem; }
  .setup thead { display: none; } .setup .rows, .setup .rows tbody { display: block; }
  .setup .rows tr { display: block; padding: .4rem 0; border-bottom: 1px solid #8886; }
  .setup .rows td { display: flex; justify-content: space-between; gap: 1rem; border: 0;
    padding: .1rem 0; text-align: right; }
  .setup .rows td::before { content: attr(data-head); opacity: .7; text-align: left; }
  .setup .rows td:first-child { font-weight: bold; } }
@media print {
  @page { size: A4; margin: 12mm; }
  :root { font-size: 11px; } body { margin: 0; max-width: none; padding: 0; }
  .wide { overflow: visible; } .setup { break-after: page; } .setup img { max-height: 70mm; }
  table { margin: .5rem 0; } .setup .rows :is(th, td) { padding: .15rem .35rem; } }
"""


def page_html(page: ReportPage) -> str:
    """Return the page as an HTML document."""
    return "\n".join(_html_lines(page)) + "\n"


def _escape(text: str) -> str:
    return _attribute(shorten(one_line(text)))


def _attribute(text: str) -> str:
    """Return a text escaped for an attribute, or between tags, of HTML."""
    from html import escape  # other reports need none of it

    return escape(text, quote=True)


def _html_lines(page: ReportPage) -> Iterator[str]:
    title = _escape(page.title)
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{title}</title>\n<style>{_STYLE}</style>\n</head>\n<body>"
    yield f'<h1>{title} <small class="{page.verdict}">{page.verdict}</small></h1>'
    if page.report is not None:
        yield from _html_setup(page, page.report)
        yield from _html_pairs(tuple(summary_lines(page.report)))
    for caption, address in page.pictures:
        yield f'<figure><img src="{_attribute(address)}" alt="{_escape(caption)}">'
        yield f"<figcaption>{_escape(caption)}</figcaption></figure>"
    yield from _html_findings(page)
    if page.report is not None:
        for sheet in sheets(page.report):
            yield from _html_table(sheet)
    if page.setup is not None:
        yield "<h2>Machine and settings</h2>"
        yield from _html_pairs(setup_rows(page.setup))
    if page.report is not None and page.report.assumptions:
        yield "<h2>Assumptions</h2>\n<ul>"
        yield from (f"<li>{_escape(words)}</li>" for words in page.report.assumptions)
        yield "</ul>"
    yield "</body>\n</html>"


def _html_setup(page: ReportPage, report: Report) -> Iterator[str]:
    """Yield the HTML of the setup sheet for the machine; printed, it fills the first page."""
    if report.planned is None:
        return
    yield f'<section class="setup"><h2>{SETUP}</h2>'
    machine = () if page.setup is None else (("machine", page.setup.machine),)
    yield from _html_pairs((*machine, *mounting_lines(report)))
    if page.stock:
        yield f'<img src="{_attribute(page.stock)}" alt="the stock and part zero">'
    for sheet in setup_sheets(report.planned):
        yield from _html_table(sheet, with_heads=True)
    grave = gravest_findings(page)
    if grave:
        yield "<ul>"
        for item in grave[:SETUP_FINDINGS]:
            place = f" ({_escape(item.where)})" if item.where else ""
            yield f'<li><span class="{item.severity}">{item.severity}</span>'
            yield f"{place}: {_escape(item.message)}</li>"
        if len(grave) > SETUP_FINDINGS:
            yield f"<li>and {len(grave) - SETUP_FINDINGS} more, below</li>"
        yield "</ul>"
    yield "</section>"


def _html_pairs(rows: tuple[tuple[str, str], ...]) -> Iterator[str]:
    yield '<table class="pairs">'
    for name, value in rows:
        yield f'<tr><th scope="row">{_escape(name)}</th><td>{_escape(value)}</td></tr>'
    yield "</table>"


def _html_findings(page: ReportPage) -> Iterator[str]:
    if not page.findings:
        return
    yield "<h2>Findings</h2>\n<ul>"
    for item in page.findings[:HTML_ROWS]:
        place = f" ({_escape(item.where)})" if item.where else ""
        head = f'<span class="{_escape(item.severity)}">{_escape(item.severity)}</span>'
        yield f"<li>{head} <code>{_escape(item.code)}</code>{place}: {_escape(item.message)}</li>"
    yield "</ul>"
    yield from _html_more(len(page.findings), "findings")


def _html_table(sheet: ReportSheet, *, with_heads: bool = False) -> Iterator[str]:
    """Yield the HTML of a table. `with_heads`: each cell repeats its column heading, for windows
    too narrow for columns."""
    kinds = ["" if n < sheet.words else ' class="number"' for n in range(len(sheet.heads))]
    heads = zip(kinds, sheet.heads, strict=True)
    yield '<div class="wide"><table class="rows">\n<thead><tr>'
    yield "".join(f'<th scope="col"{kind}>{_escape(head)}</th>' for kind, head in heads)
    yield "</tr></thead>\n<tbody>"
    if with_heads:
        kinds = [
            f'{kind} data-head="{_escape(head)}"'
            for kind, head in zip(kinds, sheet.heads, strict=True)
        ]
    for row in sheet.rows[:HTML_ROWS]:
        cells = zip(kinds, row, strict=True)
        yield f"<tr>{''.join(f'<td{kind}>{_escape(cell)}</td>' for kind, cell in cells)}</tr>"
    yield "</tbody>\n</table></div>"
    yield from _html_more(len(sheet.rows), sheet.noun)


def _html_more(count: int, noun: str) -> Iterator[str]:
    if count > HTML_ROWS:
        yield f"<p>and {count - HTML_ROWS} more {noun} in the JSON report</p>"
