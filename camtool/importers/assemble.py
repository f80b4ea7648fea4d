"""From the pieces that a reader found to a Drawing: clean, join, judge.

Every reader ends here, so that a DXF and an SVG of the same part give the same Drawing:

    pieces ──select.py──▶ wanted ──clean.py──▶ checked, once ──heal.py──▶ contours
                        └▶ the others, cleaned and healed on their own ──▶ unchosen closed contours
    wanted × contours ──off.py──▶ how far they are apart         contours ──told.py──▶ findings

A *piece* is one entity or one subpath, in mm, Y up. A *gap* lies between two open ends.
Tolerances: POSITION_EPS_MM (two points are one), `options.gap_mm` (two ends are joined), and
those of the modules named above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camtool.errors import DrawingError
from camtool.findings import Finding
from camtool.geometry.drawing import Drawing, Mark, Skipped, Unchosen, Units
from camtool.importers.clean import DRAWN_TWICE, cleaned, is_placed
from camtool.importers.heal import gap_of, healed
from camtool.importers.marks import cleaned_marks, selected_with_marks
from camtool.importers.off import off_drawn
from camtool.importers.options import ReadOptions
from camtool.importers.piece import MAX_COORDINATE_MM, Piece
from camtool.importers.told import (
    counted,
    gap_findings,
    healing_findings,
    size_findings,
    skip_findings,
)

__all__ = ["MAX_COORDINATE_MM", "Piece", "assemble"]

_SOURCES_NAMED = 3
"""So many members of a chain are named in its source."""


def assemble(
    pieces: list[Piece],
    *,
    file: str,
    units: Units,
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
    every = pieces
    pieces, marks, unwanted = selected_with_marks(every, marks, options.select, file)
    clean = cleaned(pieces, file)
    points, repeated = cleaned_marks(marks, file)
    dropped = [*unwanted, *clean.skipped, *repeated]
    every_skip = counted([*skipped, *dropped])
    if not len(clean.lines) and not points:
        raise _nothing(every_skip, file)
    result = healed(pieces, clean, options)
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
        unchosen=_unchosen(every, pieces, file, options),
        off_mm=off_drawn(pieces, result.lines),
        made_for=options.scale,
    )
    # What is drawn twice has a finding of its own.
    once = [item for item in clean.skipped if item.reason != DRAWN_TWICE]
    noticed = [*findings, *skip_findings(skipped, [*unwanted, *once, *repeated])]
    return replace(drawing, findings=(*noticed, *_judged(drawing, options)))


def _unchosen(
    every: Sequence[Piece], chosen: Sequence[Piece], file: str, options: ReadOptions
) -> Unchosen:
    """The closed contours among the pieces that were not chosen.

    They are joined among themselves alone, and nothing is said of them: nobody asked for them.
    Pieces that are no place in a drawing are left out.
    """
    kept = set(chosen)
    others = [piece for piece in every if piece not in kept and is_placed(piece)]
    if not others:
        return Unchosen()
    found = healed(others, cleaned(others, file), options)
    rows = np.flatnonzero(found.lines.closed).tolist()
    first = [others[found.members[row][0]] for row in rows]
    return Unchosen(
        paths=found.lines.select(rows),
        layers=tuple(piece.layer for piece in first),
        sources=tuple(_source([others[k] for k in found.members[row]]) for row in rows),
        line_types=tuple(piece.line_type for piece in first),
    )


def _judged(drawing: Drawing, options: ReadOptions) -> list[Finding]:
    """What the drawing itself shows: its size, its gaps, what was mended."""
    gap_mm = gap_of(options)
    return [
        *size_findings(drawing),
        *gap_findings(drawing.closed_gaps, gap_mm, closed=True),
        *gap_findings(drawing.gaps, gap_mm, closed=False),
        *healing_findings(drawing.healing, options.tolerance_mm),
    ]


def _source(members: Sequence[Piece]) -> str:
    """The sources of a chain's members, the first few by name."""
    if len(members) == 1:
        return members[0].source
    names = list(dict.fromkeys(piece.source for piece in members))
    more = len(names) - _SOURCES_NAMED
    head = " + ".join(names[:_SOURCES_NAMED])
    return f"{head} + {more} more" if more > 0 else head


def _nothing(skipped: Sequence[Skipped], file: str) -> DrawingError:
    """The error for a drawing without geometry, saying what it held instead."""
    held = ", ".join(f"{item.count} {item.kind} ({item.reason})" for item in skipped)
    return DrawingError(
        "holds no lines or curves" + (f", only {held}" if held else ""),
        file=file,
        mend="check what was exported, and that its layers are visible",
    )
