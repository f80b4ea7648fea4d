"""The closed loop that each contour comes down to: what sizes and closure are measured on.

A contour is a stay of the tool in the stock: it may come in on a lead or down a ramp, go round in
several passes, overlap its start, and leave on a lead again. Its loop is the last of its longest
closed parts: the final pass of a profile, the outermost way of a pocket. A level contour that ends
where it starts is its own loop. There-and-back is none: a loop holds an area.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.verify.cuts import CutMoves, moved_lengths

AS_LONG = 0.98
"""A loop of at least this part of the longest one's length is as good, if it comes later."""

NO_LOOP = -1
"""First and last row of a contour without a loop."""


def loops(cuts: CutMoves, gap_mm: float) -> Ints:
    """(C, 2) first and last row of the loop of each contour, NO_LOOP where it has none; ends
    within `gap_mm` of each other are one."""
    begin, finish = cuts.contour_ends()
    found = np.full((len(begin), 2), NO_LOOP, dtype=np.int64)
    whole = cuts.closed(gap_mm) & _level(cuts)
    found[whole] = np.column_stack([begin, finish])[whole]
    rest = np.flatnonzero(~whole)
    if len(rest):
        way = _Way(cuts)
        rows = cuts.rows
        offsets = np.searchsorted(cuts.contour[rows], np.arange(len(begin) + 1))
        for contour in rest.tolist():
            mine = rows[offsets[contour] : offsets[contour + 1]]
            found[contour] = way.longest_loop(mine, gap_mm)
    return found


def of_loops(cuts: CutMoves, found: Ints) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(N,) true for the cutting rows that belong to the loop of their contour."""
    rows = np.arange(len(cuts.contour))
    first, last = np.append(found, [[NO_LOOP, NO_LOOP]], axis=0)[cuts.contour].T
    return np.asarray(cuts.is_cut & (first >= 0) & (rows >= first) & (rows <= last))


def _level(cuts: CutMoves) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(C,) true for contours at one height."""
    contour = cuts.contour[cuts.segments.path]
    low, high = np.full(cuts.contour_count, np.inf), np.full(cuts.contour_count, -np.inf)
    np.minimum.at(low, contour, cuts.z[:, 0])
    np.maximum.at(high, contour, cuts.z[:, 1])
    return np.asarray(low == high)


class _Way:
    """The moves of a toolpath one after the other: how long, and what area lies beside them."""

    def __init__(self, cuts: CutMoves) -> None:
        toolpath = cuts.toolpath
        self._begin, self._end = toolpath.starts[:, :2], toolpath.end[:, :2]
        self._length = np.where(cuts.is_cut, moved_lengths(toolpath), 0.0)
        # Green: the area beside a move is half the cross product of its ends, and for an arc
        # (r²/2)(t − sin t) of its segment on top.
        (ax, ay), (bx, by) = self._begin.T, self._end.T
        sweep = toolpath.sweeps()
        spoke = self._begin - toolpath.centre
        square = np.where(toolpath.is_arc, (spoke**2).sum(axis=1), 0.0)
        self._area = 0.5 * (ax * by - ay * bx) + 0.5 * square * (sweep - np.sin(sweep))

    def longest_loop(self, rows: Ints, gap_mm: float) -> tuple[int, int]:
        """First and last of the cutting rows (R,) of one contour that make its loop."""
        places = np.concatenate([self._begin[rows[:1]], self._end[rows]])
        length = np.concatenate([[0.0], np.cumsum(self._length[rows])]).tolist()
        area = np.concatenate([[0.0], np.cumsum(self._area[rows])]).tolist()
        best, most = (NO_LOOP, NO_LOOP), 0.0
        for low, high in _returns(places, gap_mm):
            long = length[high] - length[low]
            (ax, ay), (bx, by) = places[high], places[low]
            around = area[high] - area[low] + 0.5 * (ax * by - ay * bx)
            if long >= AS_LONG * most and abs(around) > gap_mm * gap_mm:
                best = (int(rows[low]), int(rows[high - 1]))
                most = max(most, long)
        return best


def _returns(places: Floats, gap_mm: float) -> Iterator[tuple[int, int]]:
    """Pairs (earlier, later) of places (P, 2) that are one, each with the latest before it.

    Places lie in square cells as wide as the gap. The latest place before another one in each of
    the nine cells about it is looked at, and what lies before that only where it is too far away:
    a thousand passes over one place are not compared each with each.
    """
    count = len(places)
    cell = np.floor(places / gap_mm).astype(np.int64)
    cell -= cell.min(axis=0) - 1
    wide = int(cell[:, 1].max()) + 2
    known, rank = np.unique(cell[:, 0] * wide + cell[:, 1], return_inverse=True)
    # Sorted by cells, and within a cell by number.
    sorted_ = np.sort(rank.reshape(-1) * count + np.arange(count))
    latest = np.full(count, -1, dtype=np.int64)
    for beside in (-wide, 0, wide):
        for above in (-1, 0, 1):
            wanted = known[rank.reshape(-1)] + beside + above
            there = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
            rows = np.flatnonzero(known[there] == wanted)
            at = np.searchsorted(sorted_, there[rows] * count + rows) - 1
            while len(rows):
                near_cell, before = np.divmod(sorted_[at], count)
                inside = (at >= 0) & (near_cell == there[rows]) & (before > latest[rows])
                rows, at, before = rows[inside], at[inside], before[inside]
                off = places[before] - places[rows]
                near = np.hypot(off[:, 0], off[:, 1]) <= gap_mm
                latest[rows[near]] = before[near]
                rows, at = rows[~near], at[~near] - 1
    later = np.flatnonzero(latest >= 0)
    yield from zip(latest[later].tolist(), later.tolist(), strict=True)
