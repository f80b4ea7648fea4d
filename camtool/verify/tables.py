"""Cutting moves as the columns that the compiled judge reads: one move for each row that cuts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import Floats, Ints
from camtool.verify.compare import ANY_CONTOUR
from camtool.verify.cuts import CutMoves


@dataclass(frozen=True, eq=False)
class MoveTable:
    """The J rows of a toolpath that cut: `moves` (J, 16) of `camtool.kernels.move_errors`,
    `boxes` (J, 4), `heights` (J, 2) mm, `contour` (J,) ascending, `of_row` (N,) the index of each
    row or −1."""

    moves: Floats
    boxes: Floats
    heights: Floats
    contour: Ints
    of_row: Ints

    def ranges(self, only: Ints) -> Ints:
        """(R, 2) first and last (not included) index of the contours `only` (R,), or of all."""
        low = np.searchsorted(self.contour, only, side="left")
        high = np.searchsorted(self.contour, only, side="right")
        every = only == ANY_CONTOUR
        low, high = np.where(every, 0, low), np.where(every, len(self.contour), high)
        return np.ascontiguousarray(np.column_stack([low, high]))


def move_table(cuts: CutMoves) -> MoveTable:
    """The columns of the moves that cut."""
    from camtool.kernels import move_errors as at

    rows, segments = cuts.rows, cuts.segments
    first, last = cuts.first[rows], cuts.first[rows + 1] - 1
    start, end = segments.start[first], segments.end[last]
    is_arc, centre = segments.is_arc[first], segments.centre[first]
    sweep = np.abs(segments.sweep[first]) * (last - first + 1)
    turn = np.where(segments.bulge[first] < 0.0, -1.0, 1.0)
    way = end - start
    square = (way**2).sum(axis=1)
    toolpath = cuts.toolpath
    closed = (toolpath.starts[rows, :2] == toolpath.end[rows, :2]).all(axis=1)
    moves = np.zeros((len(rows), at.COLUMNS))
    moves[:, [at.AX, at.AY]], moves[:, [at.BX, at.BY]] = start, end
    moves[:, [at.DX, at.DY]] = way
    moves[:, at.OVER] = 1.0 / np.where(square > 0.0, square, 1.0)
    moves[:, at.TURN] = turn
    arcs = np.flatnonzero(is_arc)
    moves[arcs, at.RADIUS] = segments.radius[first[arcs]]
    spokes = centre, turn[:, None] * (start - centre), turn[:, None] * (end - centre)
    for x, y, place in zip((at.CX, at.UX, at.VX), (at.CY, at.UY, at.VY), spokes, strict=True):
        moves[arcs, x], moves[arcs, y] = place[arcs].T
    moves[arcs, at.WIDE] = np.where(closed, at.FULL, (sweep > np.pi).astype(float))[arcs]
    boxes = segment_boxes(segments)
    low = np.minimum(boxes[first, :2], boxes[last, :2])
    high = np.maximum(boxes[first, 2:], boxes[last, 2:])
    z = cuts.z
    heights = np.column_stack(
        [np.minimum(z[first, 0], z[last, 0]), np.maximum(z[first, 1], z[last, 1])]
    )
    of_row = np.full(len(cuts.contour), -1, dtype=np.int64)
    of_row[rows] = np.arange(len(rows))
    return MoveTable(
        moves, np.concatenate([low, high], axis=1), heights, cuts.contour[rows], of_row
    )
