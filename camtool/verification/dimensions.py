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
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.verification.cuts import NO_LOOP, CutMoves, of_loops
from camtool.verification.matching import Match


@dataclass(frozen=True)
class Size:
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


@dataclass(frozen=True, eq=False)
class RowSlides:
    """Positions of the slides in each of N rows, XY mm: `low` and `high` (N, 2), infinite where
    they did not move; `places` (N+1, 2): their position before each row and after the last."""

    low: Floats
    high: Floats
    places: Floats


def places_between(start: Floats, row_end: Floats) -> Floats:
    """(N+1, 2) mm: the position of the slides before each row and after the last. `row_end`
    (N, 2) is the position at the end of each row, NaN for rows without motion."""
    known = np.isfinite(row_end[:, 0])
    latest = np.maximum.accumulate(np.where(known, np.arange(1, len(row_end) + 1), 0))
    places = np.concatenate([start[None, :2], row_end])
    return np.asarray(places[np.concatenate([[0], latest])])


def closure_mm(loops: Ints, slides: RowSlides) -> float:
    """Largest distance, mm, between where the slides begin and where they end a closed contour;
    NaN where no contour is closed. `loops` (C, 2) are those of `camtool.verification.cuts`."""
    begin, finish = loops[loops[:, 0] != NO_LOOP].T
    if len(begin) == 0:
        return math.nan
    gap = slides.places[finish + 1] - slides.places[begin]
    return float(np.hypot(gap[:, 0], gap[:, 1]).max())


@dataclass(frozen=True, eq=False)
class LoopedCuts:
    """Cutting moves and the loops (C, 2) of their contours (`camtool.verification.cuts.loops`)."""

    cuts: CutMoves
    loops: Ints


def sizes(
    decoded: LoopedCuts, slides: RowSlides, goal: LoopedCuts, match: Match, gap_mm: float
) -> Iterator[Size]:
    """X and Y of the whole part, then of each closed contour of the wanted moves (`goal`).

    `match` says to which wanted row and contour each decoded row belongs. Contours to which no
    row belongs are left out (a finding names them).
    """
    cuts, wanted = decoded.cuts, goal.cuts
    if len(cuts.rows) == 0 or len(wanted.rows) == 0:
        return
    closed = goal.loops[:, 0] != NO_LOOP
    in_loop = of_loops(wanted, goal.loops)
    counts = wanted.is_cut & (in_loop | ~np.append(closed, False)[wanted.contour])
    mine = _counting(decoded, match, counts, closed)
    if len(mine) == 0:
        return
    low, high = _predicted(cuts, slides, mine, match.contour)
    segments = wanted.segments[np.flatnonzero(counts[wanted.segments.path])]
    boxes = segment_boxes(segments)
    centre = _extents(wanted.contour[segments.path], boxes[:, :2], boxes[:, 2:], wanted)
    slide = _extents(match.contour[mine], low[mine], high[mine], wanted)
    known = wanted.toolpath.drawn is not None
    nominal, predicted, rough = _edges(wanted, closed, centre, slide)
    seen = np.isfinite(slide[:, 0, 0]) & np.isfinite(centre[:, 0, 0])
    # Contours that the program does not cut still count in the nominal size of the part.
    yield from _pair(
        "part", _whole(nominal), _whole(predicted[_finest(nominal, rough, seen)]), known
    )
    final = _final(segments, boxes, wanted, gap_mm)
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


def _final(segments: Segments, boxes: Floats, wanted: CutMoves, gap_mm: float) -> Bools:
    """(C,) true for contours below which no contour of the same box is cut: passes between which
    the tool leaves the stock are contours of their own."""
    contour = wanted.contour[segments.path]
    least = np.full((wanted.contour_count, 2), np.inf)
    most = np.full((wanted.contour_count, 2), -np.inf)
    np.minimum.at(least, contour, boxes[:, :2])
    np.maximum.at(most, contour, boxes[:, 2:])
    whole = np.concatenate([least, most], axis=1)
    lowest = np.full(wanted.contour_count, np.inf)
    toolpath = wanted.toolpath
    z = np.minimum(toolpath.starts[segments.path, 2], toolpath.end[segments.path, 2])
    np.minimum.at(lowest, contour, z)
    known = np.isfinite(whole[:, 0])
    keys = np.full((wanted.contour_count, 4), np.iinfo(np.int64).min)
    keys[known] = np.rint(whole[known] / gap_mm).astype(np.int64)
    _, same = np.unique(keys, axis=0, return_inverse=True)
    deepest = np.full(same.max(initial=-1) + 1, np.inf)
    np.minimum.at(deepest, same.reshape(-1), lowest)
    return np.asarray(lowest == deepest[same.reshape(-1)])


def _counting(decoded: LoopedCuts, match: Match, counts: Bools, closed: Bools) -> Ints:
    """The decoded rows that determine the sizes: for the `closed` (C,) wanted contours the rows
    of their decoded loops, where there are any; otherwise the rows that follow a wanted row (W,)
    that `counts`."""
    of = match.contour
    follow = counts[match.row] & (of >= 0)
    looped = of_loops(decoded.cuts, decoded.loops) & (of >= 0) & np.append(closed, False)[of]
    with_loop = np.zeros(len(closed) + 1, dtype=np.bool_)
    with_loop[of[looped]] = True
    return np.flatnonzero(looped | (follow & ~with_loop[of]))


def _predicted(
    cuts: CutMoves, slides: RowSlides, mine: Ints, contour: Ints
) -> tuple[Floats, Floats]:
    """Extents (N, 2), (N, 2) of the slides in each row. For the rows `mine`, those of the first
    row of each contour (N,) include the position where it begins."""
    begin = mine[np.flatnonzero(np.diff(contour[mine], prepend=-1))]
    low, high = slides.low.copy(), slides.high.copy()
    low[begin] = np.minimum(low[begin], slides.places[begin])
    high[begin] = np.maximum(high[begin], slides.places[begin])
    return low, high


def _extents(contour: Ints, low: Floats, high: Floats, wanted: CutMoves) -> Floats:
    """(C, 2, 2) box [[x low, x high], [y low, y high]] of the items of each contour; infinite
    for a contour without items."""
    least = np.full((wanted.contour_count, 2), np.inf)
    most = np.full((wanted.contour_count, 2), -np.inf)
    np.minimum.at(least, contour, low)
    np.maximum.at(most, contour, high)
    return np.stack([least, most], axis=2)


def _pair(name: str, nominal: Floats, predicted: Floats, of_edge: bool) -> Iterator[Size]:
    for axis, nominal_mm, predicted_mm in zip("XY", nominal, predicted, strict=True):
        yield Size(f"{name} {axis}", float(nominal_mm), float(predicted_mm), of_edge)
