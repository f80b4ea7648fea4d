"""From the pieces that a reader found to a Drawing: clean, join, judge.

Every reader ends here, so that a DXF and an SVG of the same part give the same Drawing:

    pieces → checked numbers → no point or piece twice → chained within their layer → findings

A *piece* is one entity or one subpath, in mm, Y up. A *gap* lies between two open ends.
Tolerances: POSITION_EPS_MM (two points are one), `options.gap_mm` (two ends are joined),
SMALLEST_MM and LARGEST_MM (a size that a wrong unit explains better than a part does).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camtool.errors import DrawingError, GeometryError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.chain import chain
from camtool.geometry.drawing import Drawing, FitError, Gap, Mark, Skipped, Units
from camtool.geometry.facts import drawing_extents
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines
from camtool.importers.marks import cleaned_marks, selected_with_marks
from camtool.importers.options import ReadOptions
from camtool.importers.piece import MAX_COORDINATE_MM, Piece, cleaned

__all__ = ["MAX_COORDINATE_MM", "Piece", "assemble"]

SMALLEST_MM = 0.05
"""A drawing whose longer side is below this was probably read in the wrong unit."""

LARGEST_MM = 2000.0
"""A drawing whose longer side is above this was probably read in the wrong unit."""

MAX_GAP_FINDINGS = 20
"""So many gaps get a finding of their own, largest first; the others are counted in one."""

_SOURCES_NAMED = 3
"""So many members of a chain are named in its source."""


def assemble(
    pieces: list[Piece],
    *,
    file: str,
    units: Units,
    fit: FitError,
    used: dict[str, int],
    skipped: list[Skipped],
    findings: list[Finding],
    options: ReadOptions,
    marks: Sequence[Mark] = (),
) -> Drawing:
    """The Drawing of these pieces, in the order in which their first members came.

    `findings` are those of the reader (units, repairs); gaps, size and one ENTITY_SKIPPED for
    each kind of `skipped` are added here. A drawing of `marks` alone has no paths. Raises
    DrawingError when a number is no position or when nothing is left to draw.
    """
    pieces, marks, unwanted = selected_with_marks(pieces, marks, options.select, file)
    whole, dropped = cleaned(pieces, file)
    points, repeated = cleaned_marks(marks, file)
    dropped = [*unwanted, *dropped, *repeated]
    every_skip = _counted([*skipped, *dropped])
    if not whole and not points:
        raise _nothing(every_skip, file)
    gap_mm = max(options.gap_mm, POSITION_EPS_MM) if options.chain_gaps else POSITION_EPS_MM
    layers = [""] * len(whole) if options.across_layers else [piece.layer for piece in whole]
    chained = chain(_columns(whole, file), gap_mm, layers)
    first = [whole[members[0]] for members in chained.members]
    drawing = Drawing(
        paths=chained.lines,
        layers=tuple(piece.layer for piece in first),
        colours=tuple(piece.colour for piece in first),
        sources=tuple(_source([whole[index] for index in row]) for row in chained.members),
        file=file,
        units=units,
        fit=fit,
        used=dict(used),
        skipped=tuple(every_skip),
        gaps=tuple(chained.open_gaps),
        marks=points,
        closed_gaps=tuple(chained.closed_gaps),
        line_types=tuple(piece.line_type for piece in first),
    )
    told = (
        *findings,
        *_skip_findings(skipped, dropped),
        *_size_findings(drawing),
        *_gap_findings(chained.closed_gaps, gap_mm, closed=True),
        *_gap_findings(chained.open_gaps, gap_mm, closed=False),
    )
    return replace(drawing, findings=told)


def _columns(pieces: Sequence[Piece], file: str) -> Polylines:
    """All pieces as Polylines; a fault is named by its piece."""
    counts = [len(piece.vertices) for piece in pieces]
    if not pieces:
        return Polylines.of([])
    try:
        return Polylines(
            np.concatenate([piece.vertices for piece in pieces]),
            np.concatenate([[0], np.cumsum(counts)]),
            np.array([piece.closed for piece in pieces]),
        )
    except GeometryError as error:
        row = int(str(error.where).removeprefix("path ").partition(",")[0])
        raise DrawingError(error.message, file=file, where=pieces[row].where) from error


def _source(members: Sequence[Piece]) -> str:
    """The sources of a chain's members, the first few by name."""
    names = list(dict.fromkeys(piece.source for piece in members))
    more = len(names) - _SOURCES_NAMED
    head = " + ".join(names[:_SOURCES_NAMED])
    return f"{head} + {more} more" if more > 0 else head


def _counted(skipped: Sequence[Skipped]) -> list[Skipped]:
    """One row for each kind and reason, in order of first appearance."""
    counts: Counter[tuple[str, str]] = Counter()
    for item in skipped:
        counts[item.kind, item.reason] += item.count
    return [Skipped(kind, count, reason) for (kind, reason), count in counts.items()]


def _nothing(skipped: Sequence[Skipped], file: str) -> DrawingError:
    """The error for a drawing without geometry, saying what it held instead."""
    held = ", ".join(f"{item.count} {item.kind} ({item.reason})" for item in skipped)
    return DrawingError(
        "holds no lines or curves" + (f", only {held}" if held else ""),
        file=file,
        mend="check what was exported, and that its layers are visible",
    )


def _skip_findings(skipped: list[Skipped], dropped: list[Skipped]) -> list[Finding]:
    """What was left out: the reader's part as warnings, what has no length as information."""
    return [
        Finding(
            Code.ENTITY_SKIPPED,
            severity,
            f"{item.count} {item.kind} left out: {item.reason}",
            measured=float(item.count),
        )
        for severity, items in ((Severity.WARNING, skipped), (Severity.INFO, dropped))
        for item in _counted(items)
    ]


def _size_findings(drawing: Drawing) -> list[Finding]:
    """IMPLAUSIBLE_SIZE when the longer side fits a wrong unit better than a part."""
    units, box = drawing.units, drawing_extents(drawing)
    width, height = (float(side) for side in box[:, 1] - box[:, 0])
    longest = max(width, height)
    if len(drawing.paths) == 0 and len(drawing.marks) < 2:
        return []
    if SMALLEST_MM <= longest <= LARGEST_MM:
        return []
    small = longest < SMALLEST_MM
    return [
        Finding(
            Code.IMPLAUSIBLE_SIZE,
            Severity.WARNING,
            f"the drawing is {width:.6g} x {height:.6g} mm with unit {units.name} ({units.why}); "
            "if that is wrong, name the unit with --units",
            measured=longest,
            limit=SMALLEST_MM if small else LARGEST_MM,
            unit="mm",
        )
    ]


def _gap_findings(gaps: Sequence[Gap], gap_mm: float, *, closed: bool) -> list[Finding]:
    """A finding for each gap, largest first, and one for all that are more than are read."""
    code, severity = (
        (Code.GAP_CLOSED, Severity.INFO) if closed else (Code.GAP_OPEN, Severity.WARNING)
    )
    ranked = sorted(gaps, key=lambda gap: -gap.size_mm if closed else gap.size_mm)
    found = [
        Finding(
            code,
            severity,
            f"a gap of {gap.size_mm * 1000.0:.4g} µm was closed"
            if closed
            else f"two open ends are {gap.size_mm * 1000.0:.4g} µm apart and stay open",
            where=f"layer {gap.layer}, x {gap.at_mm[0]:.4f} y {gap.at_mm[1]:.4f} mm",
            measured=gap.size_mm,
            limit=gap_mm,
            unit="mm",
        )
        for gap in ranked[:MAX_GAP_FINDINGS]
    ]
    rest = ranked[MAX_GAP_FINDINGS:]
    if rest:
        verb = "were closed" if closed else "stay open"
        found.append(
            Finding(
                code,
                severity,
                f"{len(rest)} more gaps {verb}, of {min(g.size_mm for g in rest) * 1000.0:.4g} to "
                f"{max(g.size_mm for g in rest) * 1000.0:.4g} µm",
                measured=max(gap.size_mm for gap in rest),
                limit=gap_mm,
                unit="mm",
            )
        )
    return found
