"""Sizes of the part and of its closed contours, wanted and predicted; and how contours close.

Of a contour that is cut in several passes, the last and deepest pass counts, without leads and
ramps: its loop (`camtool.verification.cuts`). The part is all loops and open contours together.
Sizes are those of the cut edges, and nominal sizes are as drawn, where the plan says which edges
are cut (`camtool.toolpath.wanted`). The slides move an edge by as much as they move the bounding
box of the tool centre's path:

    predicted edge = planned edge + (box of the slides − box of the wanted moves)

Where the edges are not known, sizes are those of the tool centre's path.

    error_percent = (predicted − nominal) / nominal · 100

is positive when the part comes out too large. (The thesis's equation 5.5, L2755, takes
real − measured: the same figure with the other sign.)
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.moves import ROWS_AT_ONCE
from camtool.verification.cuts import NO_LOOP, CutMoves, of_loops
from camtool.verification.matching import Match


class Size(Struct, frozen=True):
    """One dimension, such as "part X" or "contour 3 Y", mm. `of_edge`: it is that of the cut
    edge, not of the tool centre's path."""

    name: str
    nominal_mm: float
    predicted_mm: float
    of_edge: bool

    @property
    def error_percent(self) -> float | None:
        """Predicted against nominal, per cent, positive when too large; None for a nominal 0."""
        if self.nominal_mm <= POSITION_EPS_MM:
            return None
        return (self.predicted_mm - self.nominal_mm) / self.nominal_mm * 100.0


class LoopedCuts(Struct, frozen=True, eq=False):
    """Cutting moves and the loops (C, 2) of their contours (`camtool.verification.cuts.loops`)."""

    cuts: CutMoves
    loops: Ints


class SlideExtents:
    """Where the slides are in the rows that determine the sizes, and where they close contours."""

    def __init__(self, start: Floats, decoded: LoopedCuts, goal: LoopedCuts, match: Match) -> None:
        """Of the wanted moves `goal`, the slides at `start` (3,) mm before they move; `match` says
        to which wanted row and contour each decoded row belongs."""
        count, contour = goal.cuts.contour_count, match.contour
        self._counts = np.zeros(len(contour), dtype=np.bool_)
        self._begins = self._counts.copy()
        self._contour = contour
        mine = _counting(decoded, goal, match)
        self._counts[mine] = True
        self._begins[mine[np.flatnonzero(np.diff(contour[mine], prepend=-1))]] = True
        self._least = np.full((count, 2), np.inf)
        self._most = np.full((count, 2), -np.inf)
        self._at = start[:2]
        # The rows before and after which the slides are at the ends of closed contours.
        begin, finish = decoded.loops[decoded.loops[:, 0] != NO_LOOP].T
        self._ends = begin, finish + 1
        self._places = np.full((2, len(begin), 2), np.nan)

    @property
    def known(self) -> bool:
        """Whether any row determines a size."""
        return bool(self._counts.any())

    @property
    def boxes(self) -> Floats:
        """(C, 2, 2) box [[x low, x high], [y low, y high]] of the slides in each wanted contour;
        infinite where no row belongs to it. The position where it begins is part of it."""
        return np.stack([self._least, self._most], axis=2)

    @property
    def closure_mm(self) -> float:
        """Largest distance, mm, between where the slides begin and where they end a closed
        contour; NaN where no contour is closed."""
        gap = self._places[1] - self._places[0]
        return float(np.hypot(gap[:, 0], gap[:, 1]).max()) if len(gap) else math.nan

    def add(self, low: int, box: tuple[Floats, Floats], end: Floats) -> None:
        """The rows from `low` on, which come in order: the slides' lowest and highest positions
        (R, 2), (R, 2) mm, infinite where they did not move, and last ones (R, 2) mm, NaN there."""
        rows = slice(low, low + len(end))
        known = np.isfinite(end[:, 0])
        latest = np.maximum.accumulate(np.where(known, np.arange(1, len(end) + 1), 0))
        places = np.concatenate([self._at[None, :], end])[np.concatenate([[0], latest])]
        self._at = places[-1]
        counts, begins = self._counts[rows], self._begins[rows]
        contour = self._contour[rows]
        for extent, extreme, part in (
            (self._least, np.minimum, box[0]),
            (self._most, np.maximum, box[1]),
        ):
            extreme.at(extent, contour[counts], part[counts])
            extreme.at(extent, contour[begins], places[:-1][begins])
        for ends, found in zip(self._ends, self._places, strict=True):
            # A place behind the last row of a block is that before the first of the next.
            one, other = np.searchsorted(ends, [low, low + len(end) + 1])
            found[one:other] = places[ends[one:other] - low]


def sizes(slides: SlideExtents, goal: LoopedCuts, gap_mm: float) -> Iterator[Size]:
    """X and Y of the whole part, then of each closed contour of the wanted moves (`goal`), by the
    extents of the slides.

    Contours to which no row belongs are left out (a finding names them).
    """
    wanted = goal.cuts
    if not slides.known:
        return
    closed = goal.loops[:, 0] != NO_LOOP
    centre, lowest = _extents(wanted, _wanted_rows(goal))
    slide = slides.boxes
    known = wanted.toolpath.drawn is not None
    nominal, predicted, rough = _edges(wanted, closed, centre, slide)
    seen = np.isfinite(slide[:, 0, 0]) & np.isfinite(centre[:, 0, 0])
    # Contours that the program does not cut still count in the nominal size of the part.
    yield from _pair(
        "part", _whole(nominal), _whole(predicted[_finest(nominal, rough, seen)]), known
    )
    final = _final(centre, lowest, gap_mm)
    for index in np.flatnonzero(closed & final & seen):
        sizes_mm = np.diff(nominal[index])[:, 0], np.diff(predicted[index])[:, 0]
        yield from _pair(f"contour {index + 1}", *sizes_mm, known)


def _edges(
    wanted: CutMoves, closed: Bools, centre: Floats, slide: Floats
) -> tuple[Floats, Floats, Floats]:
    """Nominal and predicted boxes (C, 2, 2) of the edges that the contours cut, and the distance
    (C,) mm that each is planned to keep from its nominal edge. `centre` and `slide` are the boxes
    of the wanted moves and of the slides; they are returned where a contour cuts no edge."""
    drawn, rows = wanted.toolpath.drawn, wanted.rows
    nominal, predicted, rough = centre.copy(), slide.copy(), np.zeros(len(centre))
    if drawn is not None:
        edge = np.full(len(centre), -1, dtype=np.int64)
        np.maximum.at(edge, wanted.contour[rows], drawn.edge[rows])
        has = np.flatnonzero(closed & (edge >= 0))
        of = edge[has]
        nominal[has] = drawn.nominal[of]
        predicted[has] = drawn.planned[of] + slide[has] - centre[has]
        rough[has] = np.abs(drawn.planned[of] - drawn.nominal[of]).max(axis=(1, 2))
    return nominal, predicted, rough


def _finest(nominal: Floats, rough: Floats, seen: Bools) -> Ints:
    """The contours that decide a size, of those (C,) that are `seen`: where several cut one edge,
    as in roughing and finishing, those that come nearest to it."""
    rows = np.flatnonzero(seen)
    _, line = np.unique(nominal[rows].reshape(len(rows), 4), axis=0, return_inverse=True)
    least = np.full(len(rows), np.inf)
    np.minimum.at(least, line.reshape(-1), rough[rows])
    return rows[rough[rows] <= least[line.reshape(-1)]]


def _whole(boxes: Floats) -> Floats:
    """(2,) size in X and Y of all boxes (C, 2, 2) together, without those that are infinite."""
    known = boxes[np.isfinite(boxes[:, 0, 0])]
    return np.asarray(known[:, :, 1].max(axis=0) - known[:, :, 0].min(axis=0))


def _final(boxes: Floats, lowest: Floats, gap_mm: float) -> Bools:
    """(C,) true for contours below which no contour of the same box is cut: passes between which
    the tool leaves the stock are contours of their own. `boxes` (C, 2, 2) and `lowest` (C,) as
    `_extents` gives them."""
    whole = boxes.transpose(0, 2, 1).reshape(-1, 4)
    known = np.isfinite(whole[:, 0])
    keys = np.full(whole.shape, np.iinfo(np.int64).min)
    keys[known] = np.rint(whole[known] / gap_mm).astype(np.int64)
    _, same = np.unique(keys, axis=0, return_inverse=True)
    deepest = np.full(same.max(initial=-1) + 1, np.inf)
    np.minimum.at(deepest, same.reshape(-1), lowest)
    return np.asarray(lowest == deepest[same.reshape(-1)])


def _wanted_rows(goal: LoopedCuts) -> Bools:
    """(W,) the wanted rows that determine sizes: those of loops, and of contours without one."""
    wanted, closed = goal.cuts, goal.loops[:, 0] != NO_LOOP
    in_loop = of_loops(wanted, goal.loops)
    return np.asarray(wanted.is_cut & (in_loop | ~np.append(closed, False)[wanted.contour]))


def _counting(decoded: LoopedCuts, goal: LoopedCuts, match: Match) -> Ints:
    """The decoded rows that determine the sizes: for closed wanted contours the rows of their
    decoded loops, where there are any; otherwise the rows that follow a wanted row that does."""
    if len(decoded.cuts.rows) == 0 or len(goal.cuts.rows) == 0:
        return np.empty(0, dtype=np.int64)
    of, closed = match.contour, goal.loops[:, 0] != NO_LOOP
    follow = _wanted_rows(goal)[match.row] & (of >= 0)
    looped = of_loops(decoded.cuts, decoded.loops) & (of >= 0) & np.append(closed, False)[of]
    with_loop = np.zeros(len(closed) + 1, dtype=np.bool_)
    with_loop[of[looped]] = True
    return np.flatnonzero(looped | (follow & ~with_loop[of]))


def _extents(cuts: CutMoves, counts: Bools) -> tuple[Floats, Floats]:
    """(C, 2, 2) mm: box [[x low, x high], [y low, y high]] of the rows of each contour that count,
    `counts` (N,), and (C,) mm: the lowest height of their ends; infinite for a contour without
    any."""
    least = np.full((cuts.contour_count, 2), np.inf)
    most = np.full((cuts.contour_count, 2), -np.inf)
    lowest = np.full(cuts.contour_count, np.inf)
    for low in range(0, len(cuts.segments), ROWS_AT_ONCE):
        row = cuts.row[low : low + ROWS_AT_ONCE]
        counted = np.flatnonzero(counts[row])
        row, contour = row[counted], cuts.contour[row[counted]]
        boxes = segment_boxes(cuts.segments[low + counted])
        np.minimum.at(least, contour, boxes[:, :2])
        np.maximum.at(most, contour, boxes[:, 2:])
        begin, end = cuts.toolpath.starts_of(row), cuts.toolpath.end[row]
        np.minimum.at(lowest, contour, np.minimum(begin[:, 2], end[:, 2]))
    return np.stack([least, most], axis=2), lowest


def _pair(name: str, nominal: Floats, predicted: Floats, of_edge: bool) -> Iterator[Size]:
    for axis, nominal_mm, predicted_mm in zip("XY", nominal, predicted, strict=True):
        yield Size(f"{name} {axis}", float(nominal_mm), float(predicted_mm), of_edge)
