"""Which moves of a toolpath cut, as lines and arcs, and the contours that they form.

The rule (`cutting_rows`): a row cuts when it is a feed move (LINE, ARC) that moves in XY and
begins or ends below the stock top, z < 0. Air moves and plunges straight down do not cut. A
toolpath without motion in Z (z ≥ 0 throughout, as of a plain drawing program) has no such row;
with `flat_cuts=True` all its feed moves in XY cut.

A contour is what the tool cuts without leaving the stock: consecutive cutting rows, with events,
rows without motion and feeds straight down or up between them (steps from one pass to the next,
the sides of tabs). A rapid, an air move or homing ends it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.rapids import STOCK_TOP_MM

FEWEST_SAMPLES = 4
"""Each line and arc is sampled in at least this many parts, so that short moves are sampled
too."""

MOST_SAMPLES = 200_000
"""Long programs are sampled more coarsely, so that there are about this many points."""


@dataclass(frozen=True, eq=False)
class CutMoves:
    """The cutting moves of `toolpath` (N rows) as K segments, in order.

    Arcs run about the programmed centre with the radius of their start; above 180° they are two
    segments. `segments.path` (K,) is the toolpath row; row r owns segments
    first[r]:first[r+1] (`first` (N+1,)). `contour` (N,) is the number of the row's contour, from
    0, and −1 for rows that do not cut.
    """

    toolpath: Toolpath
    segments: Segments
    first: Ints
    contour: Ints

    def heights(self, which: Ints) -> Floats:
        """(J, 2) mm: the heights of the starts and ends of these segments, between which their
        height changes evenly: the segments of a row are equal parts of it."""
        row = self.segments.path[which]
        begin, end = self.toolpath.starts_of(row)[:, 2], self.toolpath.end[row, 2]
        of = self.first[row + 1] - self.first[row]
        part = which - self.first[row]
        rise = (end - begin)[:, None] * np.column_stack([part, part + 1])
        # Level moves stay level exactly.
        level = (begin == end)[:, None]
        return np.where(level, begin[:, None], begin[:, None] + rise / of[:, None])

    @property
    def ends_z(self) -> Floats:
        """(K, 2) mm: heights of each segment's start and end."""
        return self.heights(np.arange(len(self.segments)))

    @property
    def z(self) -> Floats:
        """(K, 2) mm: lowest and highest point of each segment."""
        return np.sort(self.ends_z, axis=1)

    @property
    def slopes(self) -> Bools:
        """(K,) true where the height changes along a segment."""
        begin, end = self.ends_z.T
        return np.asarray(begin != end)

    @property
    def rows(self) -> Ints:
        """Toolpath rows that cut, ascending."""
        return np.flatnonzero(self.contour >= 0)

    @property
    def is_cut(self) -> Bools:
        """(N,) true where the row cuts."""
        return np.asarray(self.contour >= 0)

    @property
    def contour_count(self) -> int:
        """Number of contours."""
        return int(self.contour.max(initial=-1)) + 1

    def contour_ends(self) -> tuple[Ints, Ints]:
        """First and last row of each contour (C,), (C,)."""
        rows = self.rows
        change = np.flatnonzero(np.diff(self.contour[rows]))
        begin = rows[np.concatenate([[0], change + 1])] if len(rows) else rows
        finish = rows[np.concatenate([change, [len(rows) - 1]])] if len(rows) else rows
        return begin, finish

    def closed(self, gap_mm: float) -> Bools:
        """(C,) true where a contour ends within gap_mm of its start."""
        begin, finish = self.contour_ends()
        gap = self.toolpath.end[finish, :2] - self.toolpath.starts[begin, :2]
        return np.asarray(np.hypot(gap[:, 0], gap[:, 1]) <= gap_mm)


def moved_lengths(toolpath: Toolpath) -> Floats:
    """(N,) mm: length of each row in XY, 0 for events; of an arc, its start radius times its
    sweep."""
    straight = toolpath.end[:, :2] - toolpath.starts[:, :2]
    length = np.where(toolpath.is_motion, np.hypot(straight[:, 0], straight[:, 1]), 0.0)
    arcs = np.flatnonzero(toolpath.is_arc)
    spoke = toolpath.starts_of(arcs)[:, :2] - toolpath.centre[arcs]
    length[arcs] = np.hypot(spoke[:, 0], spoke[:, 1]) * np.abs(toolpath.sweeps()[arcs])
    return length


def is_flat(toolpath: Toolpath) -> bool:
    """True when the toolpath never moves in Z."""
    return bool(np.all(toolpath.end[:, 2] == toolpath.start[2]))


def cutting_rows(toolpath: Toolpath, *, flat_cuts: bool) -> Bools:
    """(N,) true for the rows that cut, by the rule of this module; false after the END."""
    running = np.cumsum(toolpath.kind == Kind.END) == 0
    moves = running & toolpath.is_feed & (moved_lengths(toolpath) > POSITION_EPS_MM)
    if flat_cuts and is_flat(toolpath):
        return np.asarray(moves)
    lowest = np.minimum(toolpath.starts[:, 2], toolpath.end[:, 2])
    return np.asarray(moves & (lowest < STOCK_TOP_MM - POSITION_EPS_MM))


def cut_moves(toolpath: Toolpath, *, flat_cuts: bool) -> CutMoves:
    """The cutting moves of a toolpath as segments; `flat_cuts` as the module says."""
    cutting = cutting_rows(toolpath, flat_cuts=flat_cuts)
    rows = np.flatnonzero(cutting)
    sweep = toolpath.sweeps()[rows]
    parts = np.where(np.abs(sweep) > np.pi, 2, 1)
    first = np.zeros(len(toolpath) + 1, dtype=np.int64)
    first[rows + 1] = parts
    segments = _segments(toolpath, rows, sweep, parts)
    contour = _contours(toolpath, cutting)
    return CutMoves(toolpath, segments, np.cumsum(first), contour)


def _segments(toolpath: Toolpath, rows: Ints, sweep: Floats, parts: Ints) -> Segments:
    """One segment per part of each row; the points between parts lie on the start's radius."""
    row = np.repeat(rows, parts)
    part = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    turn = np.repeat(sweep / parts, parts)
    begin, end = toolpath.starts[row, :2], toolpath.end[row, :2]
    centre = toolpath.centre[row]
    is_arc = toolpath.is_arc[row]
    here = np.where((is_arc & (part > 0))[:, None], _turned(begin, centre, part * turn), begin)
    there = np.where(is_arc[:, None], _turned(begin, centre, (part + 1) * turn), end)
    return Segments.between(here, there, np.tan(0.25 * turn), row)


def _turned(points: Floats, centre: Floats, angle: Floats) -> Floats:
    """Points (J, 2) turned about their centres (J, 2) by angles (J,) rad."""
    spoke = points - centre
    cos, sin = np.cos(angle), np.sin(angle)
    x = centre[:, 0] + cos * spoke[:, 0] - sin * spoke[:, 1]
    y = centre[:, 1] + sin * spoke[:, 0] + cos * spoke[:, 1]
    return np.column_stack([x, y])


def _contours(toolpath: Toolpath, cutting: Bools) -> Ints:
    """(N,) contour of each row: a new one begins after the tool has left the stock."""
    starts = toolpath.starts
    rise = np.abs(toolpath.end[:, 2] - starts[:, 2]) if len(toolpath) else np.empty(0)
    flat = moved_lengths(toolpath) > POSITION_EPS_MM
    moves = toolpath.is_motion & (flat | (rise > 0.0))
    homes = (toolpath.kind == Kind.HOME_XY) | (toolpath.kind == Kind.HOME_Z)
    low = np.minimum(starts[:, 2], toolpath.end[:, 2]) < STOCK_TOP_MM - POSITION_EPS_MM
    sinks = toolpath.is_feed & ~flat & low
    breaks = np.cumsum((moves | homes) & ~cutting & ~sinks)
    contour = np.full(len(toolpath), -1, dtype=np.int64)
    contour[cutting] = np.unique(breaks[cutting], return_inverse=True)[1]
    return contour


@dataclass(frozen=True, eq=False)
class Samples:
    """Points (S, 2) mm on the segments `segment` (S,) of CutMoves, ends included, each at the
    part `share` (S,) of the length of its segment, and their heights `z` (S,) mm."""

    points: Floats
    segment: Ints
    z: Floats
    share: Floats

    def of(self, which: Ints) -> Samples:
        """The samples with these indices."""
        return Samples(self.points[which], self.segment[which], self.z[which], self.share[which])


NO_SAMPLES = Samples(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0), np.empty(0))
"""No points at all."""


def sample_cuts(cuts: CutMoves, spacing_mm: float, only: Ints | None = None) -> Samples:
    """Points on the true lines and arcs, about `spacing_mm` apart; with `only`, on those segments
    alone. The spacing is wider where there would be more than `MOST_SAMPLES` points, but each
    segment has at least `FEWEST_SAMPLES` parts."""
    which = np.arange(len(cuts.segments)) if only is None else only
    lengths = segment_lengths(cuts.segments[which])
    spacing = max(spacing_mm, float(lengths.sum()) / MOST_SAMPLES)
    return _samples(cuts, which, _parts(lengths, spacing))


def samples_by_parts(
    cuts: CutMoves, spacing_mm: float, rows: Bools, at_once: int = MOST_SAMPLES
) -> Iterator[Samples]:
    """The samples of `sample_cuts` on the rows (N,) that are true, in parts of whole rows with
    about `at_once` samples each, so that memory does not grow with the program. The spacing is
    that of all cuts."""
    lengths = segment_lengths(cuts.segments)
    parts = _parts(lengths, max(spacing_mm, float(lengths.sum()) / MOST_SAMPLES))
    taken = np.flatnonzero(rows[cuts.segments.path])
    many = np.cumsum(parts[taken] + 1) // at_once
    # A row ends where its last segment does.
    path = cuts.segments.path[taken]
    last_of_row = np.append(np.diff(path) != 0, True)[: len(path)]
    part = many[np.flatnonzero(last_of_row)][np.cumsum(last_of_row) - last_of_row]
    for which in np.split(taken, np.flatnonzero(np.diff(part)) + 1):
        if len(which):
            yield _samples(cuts, which, parts[which])


def _parts(lengths: Floats, spacing_mm: float) -> Ints:
    """(K,) in how many parts each segment is sampled."""
    return np.maximum(np.ceil(lengths / spacing_mm).astype(np.int64), FEWEST_SAMPLES)


def _samples(cuts: CutMoves, which: Ints, parts: Ints) -> Samples:
    """The ends of the equal parts of the segments `which`."""
    owner = np.repeat(np.arange(len(parts)), parts + 1)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)
    share, segment = within / parts[owner], which[owner]
    begin, end = cuts.heights(which)[owner].T
    # Level moves stay level exactly: rounding must not turn them into slopes.
    z = np.where(begin == end, begin, begin + share * (end - begin))
    return Samples(point_at(cuts.segments, segment, share), segment, z, share)


# The loop of each contour: its closed part, on which sizes and closure are measured.
#
# During one contour the tool may enter on a lead or down a ramp, go round in several passes,
# overlap its start and leave on a lead. The loop of the contour is the last of its longest closed
# parts: the final pass of a profile, the outermost ring of a pocket. A level contour that ends
# where it starts is its own loop. A path there and back encloses no area and is not a loop.

AS_LONG = 0.98
"""A later loop replaces the longest one so far if it has at least this part of its length."""

NO_LOOP = -1
"""First and last row of a contour without a loop."""


def loops(cuts: CutMoves, gap_mm: float) -> Ints:
    """(C, 2) first and last row of the loop of each contour, NO_LOOP where it has none. Points
    within `gap_mm` of each other count as one."""
    begin, finish = cuts.contour_ends()
    found = np.full((len(begin), 2), NO_LOOP, dtype=np.int64)
    whole = cuts.closed(gap_mm) & _level(cuts)
    found[whole] = np.column_stack([begin, finish])[whole]
    rest = np.flatnonzero(~whole)
    rows = cuts.rows[np.isin(cuts.contour[cuts.rows], rest)]
    if len(rows):
        search = _LoopSearch(cuts)
        places, run = _places(cuts.toolpath, rows, cuts.contour[rows])
        latest = latest_before(places, run, gap_mm)
        # Most contours without a loop are lines that come back nowhere.
        offsets = np.searchsorted(run, np.arange(len(begin) + 1))
        for contour in np.unique(run[latest >= 0]).tolist():
            low, high = offsets[contour], offsets[contour + 1]
            first = np.searchsorted(cuts.contour[rows], contour)
            mine = rows[first : first + high - low - 1]
            found[contour] = search.longest_loop(
                mine, places[low:high], np.maximum(latest[low:high] - low, -1), gap_mm
            )
    return found


def _places(toolpath: Toolpath, rows: Ints, contour: Ints) -> tuple[Floats, Ints]:
    """(P, 2) mm: where each contour begins, and the ends of its rows; (P,) the contour of each."""
    begins = np.flatnonzero(np.diff(contour, prepend=-1))
    ends, starts = toolpath.end[rows, :2], toolpath.starts[rows[begins], :2]
    return np.insert(ends, begins, starts, axis=0), np.insert(contour, begins, contour[begins])


def of_loops(cuts: CutMoves, found: Ints) -> Bools:
    """(N,) true for the cutting rows that belong to the loop of their contour."""
    rows = np.arange(len(cuts.contour))
    first, last = np.append(found, [[NO_LOOP, NO_LOOP]], axis=0)[cuts.contour].T
    return np.asarray(cuts.is_cut & (first >= 0) & (rows >= first) & (rows <= last))


def _level(cuts: CutMoves) -> Bools:
    """(C,) true for contours at one height."""
    contour = cuts.contour[cuts.segments.path]
    low, high = np.full(cuts.contour_count, np.inf), np.full(cuts.contour_count, -np.inf)
    np.minimum.at(low, contour, cuts.z[:, 0])
    np.maximum.at(high, contour, cuts.z[:, 1])
    return np.asarray(low == high)


class _LoopSearch:
    """Finds loops by the length of each move and the signed area between it and the origin."""

    def __init__(self, cuts: CutMoves) -> None:
        toolpath = cuts.toolpath
        self._begin, self._end = toolpath.starts[:, :2], toolpath.end[:, :2]
        self._length = np.where(cuts.is_cut, moved_lengths(toolpath), 0.0)
        # Green's theorem: half the cross product of the ends of a move, and for an arc of sweep t
        # the area (r²/2)(t − sin t) of its circular segment on top.
        (ax, ay), (bx, by) = self._begin.T, self._end.T
        sweep = toolpath.sweeps()
        spoke = self._begin - toolpath.centre
        square = np.where(toolpath.is_arc, (spoke**2).sum(axis=1), 0.0)
        self._area = 0.5 * (ax * by - ay * bx) + 0.5 * square * (sweep - np.sin(sweep))

    def longest_loop(
        self, rows: Ints, places: Floats, latest: Ints, gap_mm: float
    ) -> tuple[int, int]:
        """First and last row of the loop of one contour, whose cutting rows are `rows` (R,), and
        whose begin and ends of rows are `places` (R + 1, 2); `latest` (R + 1,) the latest of these
        before each that is the same place, below 0 for none."""
        length = np.concatenate([[0.0], np.cumsum(self._length[rows])]).tolist()
        area = np.concatenate([[0.0], np.cumsum(self._area[rows])]).tolist()
        best, most = (NO_LOOP, NO_LOOP), 0.0
        again = np.flatnonzero(latest >= 0)
        for low, high in zip(latest[again].tolist(), again.tolist(), strict=True):
            long = length[high] - length[low]
            (ax, ay), (bx, by) = places[high], places[low]
            around = area[high] - area[low] + 0.5 * (ax * by - ay * bx)
            if long >= AS_LONG * most and abs(around) > gap_mm * gap_mm:
                best = (int(rows[low]), int(rows[high - 1]))
                most = max(most, long)
        return best


def latest_before(places: Floats, run: Ints, gap_mm: float) -> Ints:
    """(P,) for each of the points (P, 2) the latest one before it in its run (P,) within `gap_mm`,
    −1 for none. Most are so far from all others in X alone that there is none."""
    found, order = np.full(len(places), -1, dtype=np.int64), np.lexsort((places[:, 0], run))
    apart = (np.diff(places[order, 0]) > gap_mm) | (np.diff(run[order]) != 0)
    alone = np.append(apart, True) & np.append(True, apart)
    some = np.sort(order[~alone])
    if len(some):
        latest = _latest_before(places[some], run[some], gap_mm)
        found[some] = np.where(latest >= 0, some[latest], -1)
    return found


def _latest_before(places: Floats, run: Ints, gap_mm: float) -> Ints:
    """The same, of points that may be near others.

    They lie in square cells as wide as the gap. In each of the nine cells around a point the
    latest earlier point of its run is tried first, and points before it only where it is too far
    away, so that a thousand passes over one point are not compared pair by pair.
    """
    count = len(places)
    cell = np.floor(places / gap_mm).astype(np.int64)
    cell -= cell.min(axis=0) - 1
    wide = int(cell[:, 1].max()) + 2
    known, code = np.unique(cell[:, 0] * wide + cell[:, 1], return_inverse=True)
    code = code.reshape(-1)
    # Cells of each run, and the points sorted by these, and within one by number.
    mine, rank = np.unique(run * len(known) + code, return_inverse=True)
    sorted_ = np.sort(rank.reshape(-1) * count + np.arange(count))
    latest = np.full(count, -1, dtype=np.int64)
    for beside in (-wide, 0, wide):
        for above in (-1, 0, 1):
            wanted = known[code] + beside + above
            there = np.minimum(np.searchsorted(known, wanted), len(known) - 1)
            rows = np.flatnonzero(known[there] == wanted)
            wanted = run[rows] * len(known) + there[rows]
            there = np.minimum(np.searchsorted(mine, wanted), len(mine) - 1)
            rows, there = rows[mine[there] == wanted], there[mine[there] == wanted]
            at = np.searchsorted(sorted_, there * count + rows) - 1
            while len(rows):
                near_cell, before = np.divmod(sorted_[at], count)
                inside = (at >= 0) & (near_cell == there) & (before > latest[rows])
                rows, at, before, there = rows[inside], at[inside], before[inside], there[inside]
                off = places[before] - places[rows]
                near = np.hypot(off[:, 0], off[:, 1]) <= gap_mm
                latest[rows[near]] = before[near]
                rows, at, there = rows[~near], at[~near] - 1, there[~near]
    return latest
