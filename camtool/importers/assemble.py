"""From the pieces that a reader found to a Drawing: clean, join, judge.

Every reader ends here, so that a DXF and an SVG of the same part give the same Drawing:

    pieces ──select_pieces──▶ chosen ──clean_pieces──▶ paths, each once ──heal_contours──▶ contours
                           └▶ the others, cleaned and healed alone ──▶ unchosen closed contours
    chosen × contours ──distance_from_drawn──▶ mm between them

A *piece* is one entity or one subpath, in mm, Y up. A *gap* lies between two open ends.
Tolerances: POSITION_EPS_MM (two points are one), `options.gap_mm` (two ends are joined), and
those of `healing`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from msgspec import Struct, field

from camtool.errors import DrawingError
from camtool.findings import Finding, Severity
from camtool.geometry.drawing import (
    Callout,
    Drawing,
    Gap,
    Healing,
    Mark,
    SelfCrossing,
    Skipped,
    Unchosen,
    Units,
)
from camtool.geometry.facts import drawing_extents
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.findings import (
    ARCS_RECOGNISED,
    BRANCHED,
    BRANCHED_MORE,
    DRAWN_TWICE,
    ENTITY_SKIPPED,
    FONT_SUBSTITUTED,
    GAP_CLOSED,
    GAP_CLOSED_MORE,
    GAP_OPEN,
    GAP_OPEN_MORE,
    IMPLAUSIBLE_SIZE,
    SELF_CROSSING,
    SELF_CROSSING_MORE,
    TINY_MERGED,
)
from camtool.importers.healing import (
    IS_DRAWN_TWICE,
    clean_pieces,
    distance_from_drawn,
    gap_of,
    heal_contours,
    is_placed,
)
from camtool.importers.options import ReadOptions, Selection
from camtool.importers.pieces import MAX_COORDINATE_MM, Piece, select_pieces
from camtool.records import replace
from camtool.units import UM_PER_MM

_SOURCES_NAMED = 3


def unit_or_mm(options: ReadOptions, why: str) -> Units:
    """Return the unit that the options ask for, else mm; `why` explains the mm to the user."""
    if options.units is None:
        return Units("mm", 1.0, why)
    return Units(options.units.lower(), options.mm_per(options.units), "as asked")


class Found(Struct, frozen=True, eq=False):
    """The content that a reader found in a file, in mm, from which `assemble` makes a Drawing:
    pieces, marks, callouts, and the unit that the file had."""

    pieces: list[Piece]
    units: Units
    used: dict[str, int] = field(default_factory=dict)
    skipped: list[Skipped] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    marks: Sequence[Mark] = ()
    callouts: Sequence[Callout] = ()


def assemble(
    pieces: list[Piece],
    *,
    file: str,
    units: Units,
    used: dict[str, int],
    options: ReadOptions,
    skipped: Sequence[Skipped] = (),
    findings: Sequence[Finding] = (),
    marks: Sequence[Mark] = (),
    callouts: Sequence[Callout] = (),
) -> Drawing:
    """Return the Drawing of these pieces; contours are in the order in which their first pieces
    came.

    `findings` are those of the reader (units, repairs); gaps, size and one ENTITY_SKIPPED for
    each kind of `skipped` are added here. A drawing of `marks` alone has no paths; `callouts` are
    all kept, whatever is selected. DrawingError when a number is no position or when nothing is
    left to draw."""
    every = pieces
    pieces, marks, unwanted = selected_with_marks(every, marks, options.select, file)
    clean = clean_pieces(pieces, file)
    points, repeated = cleaned_marks(marks, file)
    dropped = [*unwanted, *clean.skipped, *repeated]
    every_skip = sum_skipped([*skipped, *dropped])
    if not len(clean.lines) and not points:
        raise _nothing_drawn_error(every_skip, file)
    result = heal_contours(pieces, clean, options)
    first = [pieces[members[0]] for members in result.members]
    drawing = Drawing(
        paths=result.lines,
        layers=tuple(piece.layer for piece in first),
        colours=tuple(piece.colour for piece in first),
        sources=tuple(_source([pieces[index] for index in row]) for row in result.members),
        file=file,
        units=units,
        used=dict(used),
        skipped=tuple(every_skip),
        gaps=result.open_gaps,
        marks=points,
        closed_gaps=result.closed_gaps,
        healing=result.healing,
        line_types=tuple(piece.line_type for piece in first),
        unchosen=_closed_contours_left_out(every, pieces, file, options),
        off_mm=distance_from_drawn(pieces, result.lines),
        made_for=options.scale,
        callouts=tuple(callouts),
    )
    # The finding DRAWN_TWICE reports these.
    other_skips = [item for item in clean.skipped if item.reason != IS_DRAWN_TWICE]
    all_findings = [*findings, *skip_findings(skipped, [*unwanted, *other_skips, *repeated])]
    return replace(drawing, findings=(*all_findings, *_drawing_findings(drawing, options)))


def _closed_contours_left_out(
    every: Sequence[Piece], chosen_pieces: Sequence[Piece], file: str, options: ReadOptions
) -> Unchosen:
    """Return the closed contours among the pieces that were not chosen.

    They are joined among themselves alone, without findings, because they are not cut. Pieces with
    coordinates that are not finite or too large are left out."""
    chosen_set = set(chosen_pieces)
    unchosen = [piece for piece in every if piece not in chosen_set and is_placed(piece)]
    if not unchosen:
        return Unchosen()
    healed = heal_contours(unchosen, clean_pieces(unchosen, file), options)
    rows = np.flatnonzero(healed.lines.closed).tolist()
    first = [unchosen[healed.members[row][0]] for row in rows]
    return Unchosen(
        paths=healed.lines.select(rows),
        layers=tuple(piece.layer for piece in first),
        sources=tuple(_source([unchosen[k] for k in healed.members[row]]) for row in rows),
        line_types=tuple(piece.line_type for piece in first),
    )


def _drawing_findings(drawing: Drawing, options: ReadOptions) -> list[Finding]:
    """Return the findings about the size of the drawing, its gaps, and the repairs."""
    gap_mm = gap_of(options)
    return [
        *size_findings(drawing),
        *gap_findings(drawing.closed_gaps, gap_mm, closed=True),
        *gap_findings(drawing.gaps, gap_mm, closed=False),
        *healing_findings(drawing.healing, options.tolerance_mm),
    ]


def _source(members: Sequence[Piece]) -> str:
    """Return the sources of the pieces that a contour is made of, the first few by name."""
    if len(members) == 1:
        return members[0].source
    names = list(dict.fromkeys(piece.source for piece in members))
    extra = len(names) - _SOURCES_NAMED
    head = " + ".join(names[:_SOURCES_NAMED])
    return f"{head} + {extra} more" if extra > 0 else head


def _nothing_drawn_error(skipped: Sequence[Skipped], file: str) -> DrawingError:
    """Return the error for a drawing without geometry, saying what it held instead."""
    contents = ", ".join(f"{item.count} {item.kind} ({item.reason})" for item in skipped)
    return DrawingError(
        "holds no lines or curves" + (f", only {contents}" if contents else ""),
        file=file,
        mend="check what was exported, and that its layers are visible",
    )


# Single points of a drawing (drill centres): chosen, checked, and each kept once.


def selected_with_marks(
    pieces: Sequence[Piece], marks: Sequence[Mark], selection: Selection, file: str
) -> tuple[list[Piece], list[Mark], list[Skipped]]:
    """Return the chosen pieces and marks, and the counts of those left out, with the reason.

    Both go through one selection, so that a layer that holds only marks counts as a layer. Raises
    DrawingError as `select_pieces` does."""
    if selection == Selection():
        return list(pieces), list(marks), []
    nowhere = np.zeros((1, 3))
    standing_in = {
        Piece(nowhere, False, mark.layer, mark.colour, mark.source, mark.line_type): mark
        for mark in marks
    }
    selected, skips = select_pieces([*pieces, *standing_in], selection, file)
    lines = [piece for piece in selected if piece not in standing_in]
    return lines, [standing_in[piece] for piece in selected if piece in standing_in], skips


def cleaned_marks(marks: Sequence[Mark], file: str) -> tuple[tuple[Mark, ...], list[Skipped]]:
    """Return each mark once, and the counts of repeated ones; two marks of a layer within
    POSITION_EPS_MM are one.

    DrawingError when a number is not finite or beyond MAX_COORDINATE_MM."""
    unique_marks: list[Mark] = []
    cells: set[tuple[str, int, int]] = set()
    removed: Counter[str] = Counter()
    for mark in marks:
        if not all(math.isfinite(v) and abs(v) <= MAX_COORDINATE_MM for v in mark.at_mm):
            where = f"layer {mark.layer}, {mark.source}"
            raise DrawingError(
                "a point has a number that is not finite or too large", file=file, where=where
            )
        column, row = (round(value / POSITION_EPS_MM) for value in mark.at_mm)
        if (mark.layer, column, row) in cells:
            removed[mark.source.partition(" ")[0]] += 1
            continue
        cells.add((mark.layer, column, row))
        unique_marks.append(mark)
    return tuple(unique_marks), [
        Skipped(kind, count, IS_DRAWN_TWICE) for kind, count in removed.items()
    ]


# Findings of a drawing, each with its place.

MIN_SIZE_MM = 0.05
"""A drawing whose longer side is below this was probably read in the wrong unit."""

MAX_SIZE_MM = 2000.0
"""A drawing whose longer side is above this was probably read in the wrong unit."""

MAX_GAP_FINDINGS = 20
"""At most this many gaps get a finding of their own, the most conspicuous first; one finding
counts the others."""

MAX_PLACES = 20


def sum_skipped(skipped: Sequence[Skipped]) -> list[Skipped]:
    """Sum up skipped entities by kind and reason, in order of first appearance."""
    counts: Counter[tuple[str, str]] = Counter()
    for item in skipped:
        counts[item.kind, item.reason] += item.count
    return [Skipped(kind, count, reason) for (kind, reason), count in counts.items()]


def skip_findings(skipped: Sequence[Skipped], dropped: Sequence[Skipped]) -> list[Finding]:
    """Return warnings for entities that the reader skipped, and remarks for those that were
    `dropped` because they have no length."""
    return [
        ENTITY_SKIPPED(severity=severity, measured=item.count, kind=item.kind, reason=item.reason)
        for severity, items in ((Severity.WARNING, skipped), (Severity.INFO, dropped))
        for item in sum_skipped(items)
    ]


def font_findings(lacking: Counter[str]) -> list[Finding]:
    """Return FONT_SUBSTITUTED for each font that is not installed, and the number of its texts."""
    return [FONT_SUBSTITUTED(measured=count, what=what) for what, count in lacking.items()]


def size_findings(drawing: Drawing) -> list[Finding]:
    """Return IMPLAUSIBLE_SIZE if the longer side is below MIN_SIZE_MM or above MAX_SIZE_MM: the
    unit is probably wrong."""
    units, box = drawing.units, drawing_extents(drawing)
    width, height = (float(side) for side in box[:, 1] - box[:, 0])
    longest = max(width, height)
    if len(drawing.paths) == 0 and len(drawing.marks) < 2:
        return []
    if MIN_SIZE_MM <= longest <= MAX_SIZE_MM:
        return []
    is_small = longest < MIN_SIZE_MM
    return [
        IMPLAUSIBLE_SIZE(
            measured=longest,
            limit=MIN_SIZE_MM if is_small else MAX_SIZE_MM,
            width=width,
            height=height,
            drawn_in=units.name,
            why=units.why,
        )
    ]


def gap_findings(gaps: Sequence[Gap], gap_mm: float, *, closed: bool) -> list[Finding]:
    """Return a finding for each of MAX_GAP_FINDINGS gaps, and one that counts the others.

    Of `closed` gaps the largest come first, of open ones the smallest."""
    ranked = sorted(gaps, key=lambda gap: -gap.size_mm if closed else gap.size_mm)
    findings = [
        (GAP_CLOSED if closed else GAP_OPEN)(
            where=_where(gap.layer, gap.at_mm),
            measured=gap.size_mm,
            limit=gap_mm,
            size_um=gap.size_mm * UM_PER_MM,
        )
        for gap in ranked[:MAX_GAP_FINDINGS]
    ]
    sizes = [gap.size_mm for gap in ranked[MAX_GAP_FINDINGS:]]
    if sizes:
        findings.append(
            (GAP_CLOSED_MORE if closed else GAP_OPEN_MORE)(
                measured=max(sizes),
                limit=gap_mm,
                count=len(sizes),
                least_um=min(sizes) * UM_PER_MM,
                most_um=max(sizes) * UM_PER_MM,
            )
        )
    return findings


def healing_findings(healed: Healing, tolerance_mm: float) -> list[Finding]:
    """Return a finding for each kind of repair; branches and crossings name their places."""
    findings: list[Finding] = []
    if healed.duplicates or healed.overlaps:
        length = healed.duplicates_mm + healed.overlaps_mm
        findings.append(
            DRAWN_TWICE(measured=length, doubles=healed.duplicates, overlaps=healed.overlaps)
        )
    if healed.tiny_merged:
        findings.append(TINY_MERGED(measured=healed.tiny_merged, limit=tolerance_mm))
    if healed.arcs_recognised:
        findings.append(ARCS_RECOGNISED(measured=healed.arcs_recognised, limit=tolerance_mm))
    return [*findings, *_branch_findings(healed), *_crossing_findings(healed.crossings)]


def _branch_findings(healed: Healing) -> list[Finding]:
    """Return a finding for each point where several paths branch, those with the most ends first;
    one finding counts those beyond MAX_PLACES."""
    ranked = sorted(healed.branches, key=lambda branch: -branch.ends)
    findings = [
        BRANCHED(where=_where(branch.layer, branch.at_mm), measured=branch.ends, limit=2.0)
        for branch in ranked[:MAX_PLACES]
    ]
    extra = len(ranked) - MAX_PLACES
    if extra > 0:
        findings.append(BRANCHED_MORE(measured=extra))
    return findings


def _crossing_findings(crossings: Sequence[SelfCrossing]) -> list[Finding]:
    """Return a finding for each path that crosses itself, with its first place; one finding counts
    those beyond MAX_PLACES."""
    times = Counter(crossing.path for crossing in crossings)
    first = {crossing.path: crossing for crossing in reversed(crossings)}
    findings = []
    for path, count in sorted(times.items())[:MAX_PLACES]:
        place = first[path]
        findings.append(
            SELF_CROSSING(where=_where(place.layer, place.at_mm), measured=count, limit=0.0)
        )
    extra = len(times) - MAX_PLACES
    if extra > 0:
        findings.append(SELF_CROSSING_MORE(measured=extra))
    return findings


def _where(layer: str, at_mm: tuple[float, float]) -> str:
    return f"layer {layer}, x {at_mm[0]:.4f} y {at_mm[1]:.4f} mm"
