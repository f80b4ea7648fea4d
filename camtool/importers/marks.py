"""Single points of a drawing (drill centres): chosen, checked, and each kept once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.drawing import Mark, Skipped
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.clean import DRAWN_TWICE
from camtool.importers.options import Selection
from camtool.importers.piece import MAX_COORDINATE_MM, Piece
from camtool.importers.select import selected


def selected_with_marks(
    pieces: Sequence[Piece], marks: Sequence[Mark], wanted: Selection, file: str
) -> tuple[list[Piece], list[Mark], list[Skipped]]:
    """The chosen pieces and marks, and what was left out and why.

    Both go through one selection, so that a layer of marks alone is a layer that exists.
    Raises DrawingError as `selected` does.
    """
    if wanted == Selection():
        return list(pieces), list(marks), []
    nowhere = np.zeros((1, 3))
    standing_in = {
        Piece(nowhere, False, mark.layer, mark.colour, mark.source, mark.line_type): mark
        for mark in marks
    }
    kept, gone = selected([*pieces, *standing_in], wanted, file)
    lines = [piece for piece in kept if piece not in standing_in]
    return lines, [standing_in[piece] for piece in kept if piece in standing_in], gone


def cleaned_marks(marks: Sequence[Mark], file: str) -> tuple[tuple[Mark, ...], list[Skipped]]:
    """Each mark once, and the count of what went; two within POSITION_EPS_MM on a layer are one.

    DrawingError when a number is not finite or beyond MAX_COORDINATE_MM.
    """
    kept: list[Mark] = []
    seen: set[tuple[str, int, int]] = set()
    gone: Counter[str] = Counter()
    for mark in marks:
        if not all(math.isfinite(v) and abs(v) <= MAX_COORDINATE_MM for v in mark.at_mm):
            where = f"layer {mark.layer}, {mark.source}"
            raise DrawingError("a point is no place in a drawing", file=file, where=where)
        column, row = (round(value / POSITION_EPS_MM) for value in mark.at_mm)
        if (mark.layer, column, row) in seen:
            gone[mark.source.partition(" ")[0]] += 1
            continue
        seen.add((mark.layer, column, row))
        kept.append(mark)
    return tuple(kept), [Skipped(kind, count, DRAWN_TWICE) for kind, count in gone.items()]
