"""The wanted contour and the wanted circle to which each decoded row belongs.

Contours may overlap or share ends, so the move nearest to one point does not decide. A decoded
contour belongs to the wanted contour that is nearest to most of its samples, if all samples lie
within the tolerance of it; otherwise the next by that count is tried, up to `MAX_CONTOUR_TRIES`. A
contour that no single wanted contour covers (a foreign program may cut several without lifting, or
more than wanted) is matched row by row: a row belongs to the contour that is nearest to all of its
inner samples."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.records import replace
from camtool.toolpath.moves import ROWS_AT_ONCE
from camtool.verification.circles import FullCircle
from camtool.verification.cuts import CutMoves, CutSamples
from camtool.verification.nearest import ANY_CONTOUR, MoveIndex, NearestMoves, ranges, run_offsets

MAX_CONTOUR_TRIES = 4

MIN_LIMIT_MM = 1e-6
"""Moves nearer than this are found even when the tolerance is 0."""


class Match(Struct, frozen=True, eq=False):
    """The wanted moves to which each of the N decoded rows belongs.

    `row` (N,) is the wanted row nearest to its middle and `contour` (N,) its contour, −1 for rows
    that do not cut. `only` (N,) is that contour where the slides are compared with it alone, else
    ANY_CONTOUR. `circle` (N,) is the index of the full circle that the row follows, or −1.
    `off_mm` (N,) is the largest distance of the drawing from the wanted rows beside it
    (`DrawnEdges.off_mm`)."""

    row: Indices
    contour: Indices
    only: Indices
    circle: Indices
    off_mm: Floats


class Goal(Struct, frozen=True, eq=False, dict=True):
    """The wanted moves, their full circles, and how far a decoded contour may be from its wanted
    contour in XY and in height, mm."""

    moves: MoveIndex
    circles: list[FullCircle]
    limit_mm: float
    depth_mm: float

    @cached_property
    def circle_of_row(self) -> Indices:
        """(W,) the circle of each wanted row, −1 for none."""
        return _circle_of_row(self.circles, len(self.moves.cuts.contour))

    @cached_property
    def off_mm(self) -> Floats:
        """(W,) mm: the largest distance of the drawing from each wanted row, one 0, seen as many,
        where none is known."""
        toolpath = self.moves.cuts.toolpath
        if toolpath.drawn is None or not toolpath.drawn.off_mm.any():
            return np.broadcast_to(0.0, len(toolpath))
        return toolpath.drawn.off_mm[:, 0]


def own_match(cuts: CutMoves, circles: list[FullCircle]) -> Match:
    """Return the match of a program without wanted moves: each row belongs to itself."""
    count = len(cuts.contour)
    row = np.where(cuts.is_cut, np.arange(count, dtype=np.int32), np.int32(-1))
    circle = _circle_of_row(circles, count)
    return Match(row, cuts.contour, cuts.contour, circle, np.broadcast_to(0.0, count))


def match_through_compensation(match: Match, rows: Ints, goal: Goal) -> Match:
    """Return the match with wanted rows, given a match with the rows of a compensated toolpath;
    `rows` (S,) is the wanted row of each compensated row. Compensation may divide contours and
    circles."""
    is_known = match.row >= 0
    row = np.where(is_known, rows[np.maximum(match.row, 0)], -1) if len(rows) else match.row
    contour = np.where(is_known, goal.moves.cuts.contour[np.maximum(row, 0)], -1)
    circle = goal.circle_of_row
    drawn_off = np.where(is_known, goal.off_mm[np.maximum(row, 0)], 0.0)
    return replace(
        match,
        row=row,
        off_mm=_with_neighbours(drawn_off, contour),
        contour=contour,
        only=np.where(match.only == ANY_CONTOUR, np.int32(ANY_CONTOUR), contour),
        circle=np.where(is_known, circle[np.maximum(row, 0)], -1),
    )


def nearest_at_height(
    samples: CutSamples, choice: Ints | None, moves: MoveIndex, limits_mm: tuple[float, float]
) -> tuple[NearestMoves, Bools]:
    """Return the nearest move to each sample at its own height, and a mask (S,). Where no move is
    near at that height, the nearest one at any height is returned, and the mask is True if that is
    near in XY.

    `choice` (S,): the only contour to compare with, constant along a segment; only its near moves
    are found. None: all contours. `limits_mm`: what is near, in XY and in height."""
    limit_mm, depth_mm = limits_mm
    near_mm = max(limit_mm, MIN_LIMIT_MM)
    points, z = samples.points, samples.z
    nearest = moves.nearest(points, z, choice, (near_mm, depth_mm))
    wrong_depth = np.zeros(len(points), dtype=np.bool_)
    unmatched = np.flatnonzero(np.isinf(nearest.distance))
    if choice is None:
        other = moves.nearest_of_all(points[unmatched], z[unmatched], near_mm)
    else:
        # Without a limit, all moves between a sample and a far contour would be searched.
        other = moves.nearest(
            points[unmatched], z[unmatched], choice[unmatched], (near_mm, math.inf)
        )
    nearest.distance[unmatched], nearest.segment[unmatched] = other.distance, other.segment
    wrong_depth[unmatched] = other.distance <= limit_mm
    return nearest, wrong_depth


def match_contours(cuts: CutMoves, samples: CutSamples, nearest: NearestMoves, goal: Goal) -> Ints:
    """Return (S,) the wanted contour to which the decoded contour of each sample belongs,
    ANY_CONTOUR if none. `nearest` is changed in place: to the nearest moves of that contour."""
    wanted_moves = goal.moves
    contours = cuts.contour[cuts.row[samples.segment]]
    belongs = np.full(len(contours), ANY_CONTOUR, dtype=np.int64)
    if len(contours) == 0 or len(wanted_moves.cuts.segments) == 0:
        return belongs
    begin = run_offsets(contours, len(contours))
    for candidate in _candidates(contours, wanted_moves.contour_of(nearest.segment)):
        open_ = np.flatnonzero((belongs[begin[:-1]] == ANY_CONTOUR) & (candidate >= 0))
        if len(open_) == 0:
            break
        indices = ranges(begin[open_], np.diff(begin)[open_])
        choice = np.repeat(candidate[open_], np.diff(begin)[open_])
        own_nearest, _ = nearest_at_height(
            samples.of(indices), choice, wanted_moves, (goal.limit_mm, goal.depth_mm)
        )
        starts = np.cumsum(np.diff(begin)[open_]) - np.diff(begin)[open_]
        fits = np.maximum.reduceat(own_nearest.distance, starts) <= goal.limit_mm
        fitting = np.repeat(fits, np.diff(begin)[open_])
        fitting_samples = indices[fitting]
        belongs[fitting_samples] = choice[fitting]
        nearest.distance[fitting_samples] = own_nearest.distance[fitting]
        nearest.segment[fitting_samples] = own_nearest.segment[fitting]
    return belongs


def _candidates(contours: Indices, nearest_contours: Indices) -> list[Ints]:
    """Return one array (C,) for each try: the wanted contour nearest to most samples of each
    decoded contour, then the second, and so on; −1 if there are no more.

    `contours` (S,) is the decoded contour of each sample (ascending), `nearest_contours` (S,) the
    wanted one."""
    pairs, votes = np.unique(
        np.column_stack([contours, nearest_contours]), axis=0, return_counts=True
    )
    order = np.lexsort((pairs[:, 1], -votes, pairs[:, 0]))
    contour, choice = pairs[order].T
    offsets = run_offsets(contour, len(contour))
    rank = np.arange(len(contour)) - np.repeat(offsets[:-1], np.diff(offsets))
    tries = []
    for number in range(min(MAX_CONTOUR_TRIES, int(rank.max()) + 1)):
        column = np.full(len(offsets) - 1, -1, dtype=np.int64)
        is_rank = rank == number
        column[np.repeat(np.arange(len(column)), np.diff(offsets))[is_rank]] = choice[is_rank]
        tries.append(column)
    return tries


def empty_match(count: int) -> Match:
    """Return a match of `count` rows that cut nothing, for `match_rows` to fill."""
    return Match(
        row=np.full(count, -1, dtype=np.int32),
        contour=np.full(count, -1, dtype=np.int32),
        only=np.full(count, ANY_CONTOUR, dtype=np.int32),
        circle=np.full(count, -1, dtype=np.int32),
        off_mm=np.zeros(count),
    )


def match_rows(
    match: Match,
    cuts: CutMoves,
    samples: CutSamples,
    belongs: Ints,
    nearest_moves: NearestMoves,
    goal: Goal,
) -> None:
    """Fill `match` in place for the rows of `cuts` that have samples; all samples of such a row
    must be given. `belongs` (S,) and `nearest_moves` are the result of `match_contours`."""
    wanted_moves = goal.moves
    rows = cuts.row[samples.segment]
    if len(rows) == 0 or len(wanted_moves.cuts.segments) == 0:
        return
    offsets = run_offsets(rows, len(rows))
    begin, row = offsets[:-1], rows[offsets[:-1]]
    middle = begin + np.diff(offsets) // 2
    nearest_contours = wanted_moves.contour_of(nearest_moves.segment)
    followed = wanted_moves.cuts.row[nearest_moves.segment]
    match.row[row] = followed[middle]
    is_known = belongs[begin] != ANY_CONTOUR
    match.contour[row] = np.where(is_known, belongs[begin], nearest_contours[middle])
    match.only[row] = np.where(is_known, belongs[begin], _common_values(nearest_contours, offsets))
    match.circle[row] = _common_values(goal.circle_of_row[followed], offsets)
    match.off_mm[row] = np.maximum.reduceat(goal.off_mm[followed], begin)


def with_neighbours(match: Match) -> Match:
    """Return the match with each `off_mm` raised to the largest of the row and its neighbours."""
    return replace(match, off_mm=_with_neighbours(match.off_mm, match.contour))


def _with_neighbours(off_mm: Floats, contour: Indices) -> Floats:
    """Return (N,) the larger of each row's value and those of its neighbours in its contour:
    slides lag behind, and so may still be on the row before."""
    rows = np.flatnonzero(contour >= 0)
    max_off = off_mm.copy()
    for low in range(0, len(rows) - 1, ROWS_AT_ONCE):
        batch = rows[low : low + ROWS_AT_ONCE + 1]
        same_contour = contour[batch[1:]] == contour[batch[:-1]]
        before, after = batch[:-1][same_contour], batch[1:][same_contour]
        max_off[before] = np.maximum(max_off[before], off_mm[after])
        max_off[after] = np.maximum(max_off[after], off_mm[before])
    return max_off


def _common_values(values: Ints | Indices, offsets: Ints) -> Ints:
    """Return (R,) the value that all inner samples of each run share, −1 if they differ. The first
    and last samples are ignored, since there a row touches its neighbours."""
    inner = np.column_stack([offsets[:-1] + 1, offsets[1:] - 1]).ravel()
    low = np.minimum.reduceat(values, inner)[::2]
    high = np.maximum.reduceat(values, inner)[::2]
    return np.where(low == high, low, -1)


def _circle_of_row(circles: list[FullCircle], count: int) -> Indices:
    if not circles:
        return np.broadcast_to(np.int32(-1), count)
    of_row = np.full(count, -1, dtype=np.int32)
    for index, circle in enumerate(circles):
        of_row[circle.first_row : circle.last_row + 1] = index
    return of_row
