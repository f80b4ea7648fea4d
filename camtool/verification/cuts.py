"""The cutting moves of a toolpath as lines and arcs, and the contours that they form.

The rule (`cutting_rows`): a row cuts when it is a feed move (LINE, ARC) that moves in XY and
begins or ends below the stock top, z < 0. Air moves and plunges straight down do not cut. A
toolpath without motion in Z (z ≥ 0 throughout, as of a plain drawing program) has no such row;
with `flat_cuts=True` all its feed moves in XY cut.

A contour is what the tool cuts without leaving the stock: consecutive cutting rows, with events,
rows without motion and feeds straight down or up between them (steps from one pass to the next,
the sides of tabs). A rapid, an air move or homing ends it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.kernels.chaining import latest_near
from camtool.toolpath.moves import ROWS_AT_ONCE, Kind, Toolpath, are_arcs, feeds_below_top

MIN_PARTS = 4
"""Each line and arc is sampled in at least this many parts, so that short moves are sampled
too."""

MAX_SAMPLES = 200_000
"""Long programs are sampled more coarsely, so that there are about this many points."""


class CutMoves(Struct, frozen=True, eq=False):
    """The cutting moves of `toolpath` (N rows) as K segments, in order.

    Arcs run about the programmed centre with the radius of their start; above 180° they are two
    segments. `row` (K,) is the toolpath row of each; row r owns segments
    first[r]:first[r+1] (`first` (N+1,)). `contour` (N,) is the number of the row's contour, from
    0, and −1 for rows that do not cut."""

    toolpath: Toolpath
    segments: Segments
    row: Indices
    first: Indices
    contour: Indices

    def heights(self, indices: Ints | Indices) -> Floats:
        """Return (J, 2) mm: the heights at the start and the end of these segments. The height
        changes evenly in between: the segments of a row are equal parts of it."""
        row = self.row[indices]
        begin, end = self.toolpath.starts_of(row)[:, 2], self.toolpath.end[row, 2]
        part_counts = self.first[row + 1] - self.first[row]
        part = indices - self.first[row]
        rise = (end - begin)[:, None] * np.column_stack([part, part + 1])
        # Level moves stay level exactly.
        level = (begin == end)[:, None]
        return np.where(level, begin[:, None], begin[:, None] + rise / part_counts[:, None])

    @property
    def ends_z(self) -> Floats:
        """(K, 2) mm: heights of each segment's start and end; one row, seen as many, where all are
        at one height."""
        heights_mm = np.empty((len(self.segments), 2))
        for low in range(0, len(heights_mm), ROWS_AT_ONCE):
            batch = np.arange(low, min(low + ROWS_AT_ONCE, len(heights_mm)))
            heights_mm[batch] = self.heights(batch)
        level = len(heights_mm) and (heights_mm == heights_mm[0, 0]).all()
        return np.broadcast_to(heights_mm[:1].copy(), heights_mm.shape) if level else heights_mm

    @property
    def z(self) -> Floats:
        """(K, 2) mm: lowest and highest point of each segment."""
        return np.sort(self.ends_z, axis=1)

    def slopes(self, indices: Ints) -> Bools:
        """Return the mask (J,) of segments along which the height changes."""
        begin, end = self.heights(indices).T
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
        """Return the first and the last row (C,), (C,) of each contour."""
        rows = self.rows
        change = np.flatnonzero(np.diff(self.contour[rows]))
        begin = rows[np.concatenate([[0], change + 1])] if len(rows) else rows
        finish = rows[np.concatenate([change, [len(rows) - 1]])] if len(rows) else rows
        return begin, finish

    def is_closed(self, gap_mm: float) -> Bools:
        """Return the mask (C,) of contours that end within `gap_mm` of their start."""
        begin, finish = self.contour_ends()
        gap = self.toolpath.end[finish, :2] - self.toolpath.starts_of(begin)[:, :2]
        return np.asarray(np.hypot(gap[:, 0], gap[:, 1]) <= gap_mm)


def row_lengths(toolpath: Toolpath) -> Floats:
    """Return (N,) mm: the length of each row in XY, 0 for events; for an arc, its start radius
    times its sweep."""
    return toolpath.by_parts(_lengths)


def _lengths(toolpath: Toolpath) -> Floats:
    straight = toolpath.end[:, :2] - toolpath.starts[:, :2]
    length = np.where(toolpath.is_motion, np.hypot(straight[:, 0], straight[:, 1]), 0.0)
    arcs = np.flatnonzero(toolpath.is_arc)
    spoke = toolpath.starts_of(arcs)[:, :2] - toolpath.centre[arcs]
    length[arcs] = np.hypot(spoke[:, 0], spoke[:, 1]) * np.abs(toolpath.sweeps_of(arcs))
    return length


def rapid_length_mm(toolpath: Toolpath) -> float:
    """Return the length of all rapids of a toolpath in XY, mm."""
    return float(row_lengths(toolpath)[toolpath.kind == Kind.RAPID].sum())


def is_flat(toolpath: Toolpath) -> bool:
    """Return True when the toolpath never moves in Z."""
    return bool(np.all(toolpath.end[:, 2] == toolpath.start[2]))


def cutting_rows(toolpath: Toolpath, *, flat_cuts: bool, across: Bools | None = None) -> Bools:
    """Return the mask (N,) of rows that cut, by the rule of this module; False after END. `across`
    (N,): the mask of rows that move in XY, if already known."""
    across = moves_across(toolpath) if across is None else across
    is_drawn_flat = flat_cuts and is_flat(toolpath)
    cutting = across & (toolpath.is_feed if is_drawn_flat else feeds_below_top(toolpath))
    cutting[toolpath.executed_rows :] = False
    return cutting


def moves_across(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of rows that move in XY."""
    return np.asarray(toolpath.by_parts(_lengths) > POSITION_EPS_MM)


def cut_moves(toolpath: Toolpath, *, flat_cuts: bool) -> CutMoves:
    """Return the cutting moves of a toolpath as segments; `flat_cuts` as described in the
    module."""
    cutting = cutting_rows(toolpath, flat_cuts=flat_cuts)
    arcs = np.flatnonzero(toolpath.is_arc & cutting)
    sweep = toolpath.sweeps_of(arcs)
    parts = cutting.astype(np.int8)
    parts[arcs[np.abs(sweep) > np.pi]] = 2
    first = np.zeros(len(toolpath) + 1, dtype=np.int32)
    np.cumsum(parts, out=first[1:])
    row = np.repeat(np.arange(len(toolpath), dtype=np.int32), parts)
    segments = _segments(toolpath, row, first, (arcs, sweep))
    return CutMoves(toolpath, segments, row, first, _contours(toolpath, cutting))


def _segments(
    toolpath: Toolpath, row: Indices, first: Indices, arcs: tuple[Ints, Floats]
) -> Segments:
    """Return one segment for each part of each row: segment k belongs to row `row[k]` (K,), and
    row r owns segments first[r]:first[r+1]. `arcs`: the rows (J,) that are arcs, and their sweeps
    (J,), rad. Points between the parts of an arc lie at the radius of its start."""
    bulge = np.broadcast_to(np.zeros(1), len(row))
    path = np.broadcast_to(np.int64(0), len(row))  # the segments of a toolpath are all of one
    if not len(arcs[0]) and len(row) and row[0] > 0 and (np.diff(row) == 1).all():
        low, high = row[0], row[-1] + 1  # the toolpath's own points
        ends = toolpath.end[low - 1 : high - 1, :2], toolpath.end[low:high, :2]
        return Segments(*ends, bulge, path)
    start, end = toolpath.end[row - 1, :2], toolpath.end[row, :2]
    start[row == 0] = toolpath.start[:2]
    if len(arcs[0]):
        bulge = np.zeros(len(row))
        bent = np.flatnonzero(toolpath.is_arc[row])
        rows_bent, begin, centre = row[bent], start[bent], toolpath.centre[row[bent]]
        turn: Floats = arcs[1][np.searchsorted(arcs[0], rows_bent)] / (
            first[rows_bent + 1] - first[rows_bent]
        )
        part = bent - first[rows_bent]
        inner = np.flatnonzero(part)
        start[bent[inner]] = _rotate(begin, centre, part * turn)[inner]
        end[bent] = _rotate(begin, centre, (part + 1) * turn)
        bulge[bent] = np.tan(0.25 * turn)
    if len(row) and (start[1:] == end[:-1]).all():  # one path, whose points are stored once
        points = np.concatenate([start[:1], end])
        start, end = points[:-1], points[1:]
    return Segments(start, end, bulge, path)


def _rotate(points: Floats, centre: Floats, angle: Floats) -> Floats:
    """Return points (J, 2) rotated about their centres (J, 2) by angles (J,), rad."""
    spoke = points - centre
    cos, sin = np.cos(angle), np.sin(angle)
    x = centre[:, 0] + cos * spoke[:, 0] - sin * spoke[:, 1]
    y = centre[:, 1] + sin * spoke[:, 0] + cos * spoke[:, 1]
    return np.column_stack([x, y])


def _contours(toolpath: Toolpath, cutting: Bools) -> Indices:
    """Return (N,) the contour of each row, −1 for rows that do not cut; a new contour begins after
    the tool has left the stock."""
    breaks = np.cumsum(toolpath.by_parts(_leaves_stock) & ~cutting, dtype=np.int32)[cutting]
    contour = np.full(len(toolpath), -1, dtype=np.int32)
    contour[cutting] = np.cumsum(np.diff(breaks, prepend=breaks[:1]) != 0, dtype=np.int32)
    return contour


def _leaves_stock(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of rows in which the tool may leave the stock: homing and all moves,
    except feeds straight down or up within the stock."""
    rises = toolpath.end[:, 2] != toolpath.starts[:, 2]
    flat = _lengths(toolpath) > POSITION_EPS_MM
    moves = toolpath.is_motion & (flat | rises)
    homes = (toolpath.kind == Kind.HOME_XY) | (toolpath.kind == Kind.HOME_Z)
    sinks = ~flat & feeds_below_top(toolpath)
    return np.asarray((moves | homes) & ~sinks)


class CutSamples(Struct, frozen=True, eq=False):
    """Points (S, 2) mm on the segments `segment` (S,) of CutMoves, ends included, each at the
    part `share` (S,) of the length of its segment, and their heights `z` (S,) mm."""

    points: Floats
    segment: Ints
    z: Floats
    share: Floats

    def of(self, indices: Ints) -> CutSamples:
        """Return the samples at these indices."""
        return CutSamples(
            self.points[indices], self.segment[indices], self.z[indices], self.share[indices]
        )


def sample_cuts(cuts: CutMoves, spacing_mm: float, only: Ints | None = None) -> CutSamples:
    """Return points on the true lines and arcs, about `spacing_mm` apart; with `only`, just on
    these segments. The spacing is wider if there would be more than `MAX_SAMPLES` points, but each
    segment has at least `MIN_PARTS` parts."""
    indices = np.arange(len(cuts.segments)) if only is None else only
    lengths = segment_lengths(cuts.segments[indices])
    spacing = max(spacing_mm, float(lengths.sum()) / MAX_SAMPLES)
    return _samples(cuts, indices, _parts(lengths, spacing))


def samples_by_parts(
    cuts: CutMoves,
    spacing_mm: float,
    rows: Bools,
    at_once: int = MAX_SAMPLES,
    group: Indices | None = None,
) -> Iterator[CutSamples]:
    """Yield the samples of `sample_cuts` on the rows in the mask `rows` (N,), about `at_once` at a
    time, so that memory does not grow with the program. Each batch holds whole rows, or all rows
    (N,) with one number in `group`. The spacing is that for all cuts."""
    segments, parts, ends = _sample_batches(cuts, spacing_mm, rows, at_once, group)
    for low, high in pairwise([0, *ends, len(segments)]):
        if low < high:
            yield _samples(cuts, segments[low:high], parts[low:high].astype(np.int64))


def _sample_batches(
    cuts: CutMoves, spacing_mm: float, rows: Bools, at_once: int, group: Indices | None
) -> tuple[Ints, Indices, list[int]]:
    """Return for `samples_by_parts`: the segments (T,), the number of parts of each (T,), and the
    indices at which all batches except the last end."""
    lengths = segment_lengths(cuts.segments)
    spacing = max(spacing_mm, float(lengths.sum()) / MAX_SAMPLES)
    segments = np.flatnonzero(rows[cuts.row])
    parts = _parts(lengths[segments], spacing).astype(np.int32)
    del lengths
    # A row, or a group of rows, ends with its last segment.
    rows_of_segments = cuts.row[segments]
    last = np.append(
        np.diff(rows_of_segments if group is None else group[rows_of_segments]) != 0, True
    )[: len(rows_of_segments)]
    number = np.cumsum(parts + 1, dtype=np.int64)[last] // at_once
    return (segments, parts, (np.flatnonzero(last)[np.flatnonzero(np.diff(number))] + 1).tolist())


def _parts(lengths: Floats, spacing_mm: float) -> Ints:
    """Return (K,) the number of equal parts into which each segment is divided by samples."""
    return np.maximum(np.ceil(lengths / spacing_mm).astype(np.int64), MIN_PARTS)


def _samples(cuts: CutMoves, indices: Ints, parts: Ints) -> CutSamples:
    """Return samples at the ends of the equal parts of the segments `indices`."""
    owner = np.repeat(np.arange(len(parts)), parts + 1)
    steps = np.arange(len(owner)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)
    share, segment = steps / parts[owner], indices[owner]
    begin, end = cuts.heights(indices)[owner].T
    # Level moves stay level exactly: rounding must not turn them into slopes.
    z = np.where(begin == end, begin, begin + share * (end - begin))
    return CutSamples(point_at(cuts.segments, segment, share), segment, z, share)


# The loop of each contour: its closed part, on which sizes and closure are measured.
#
# During one contour the tool may enter on a lead or down a ramp, go round in several passes,
# overlap its start and leave on a lead. The loop of the contour is the last of its longest closed
# parts: the final pass of a profile, the outermost ring of a pocket. A level contour that ends
# where it starts is its own loop. A path there and back encloses no area and is not a loop.

MIN_LOOP_SHARE = 0.98
"""A later loop replaces the longest one so far if it has at least this part of its length."""

NO_LOOP = -1
"""First and last row of a contour without a loop."""


def loops(cuts: CutMoves, gap_mm: float) -> Ints:
    """Return (C, 2) the first and the last row of the loop of each contour: its longest closed
    part with an area. NO_LOOP if it has none. Points within `gap_mm` of each other count as one.
    """
    begin, finish = cuts.contour_ends()
    contour_loops = np.full((len(begin), 2), NO_LOOP, dtype=np.int64)
    is_whole = cuts.is_closed(gap_mm) & _is_level(cuts)
    contour_loops[is_whole] = np.column_stack([begin, finish])[is_whole]
    rows = np.flatnonzero(cuts.is_cut & ~np.append(is_whole, True)[cuts.contour]).astype(np.int32)
    begins = np.flatnonzero(np.diff(cuts.contour[rows], prepend=-1))
    toolpath = cuts.toolpath
    # Places of each contour: its begin and the ends of its rows. Sums belong to the latter.
    offsets = np.append(begins, len(rows)) + np.arange(len(begins) + 1)
    places, sums = np.empty((offsets[-1], 2)), np.zeros((offsets[-1], 2))
    places[offsets[:-1]] = toolpath.starts_of(rows[begins])[:, :2]
    for low in range(0, len(rows), ROWS_AT_ONCE):
        batch = np.arange(low, min(low + ROWS_AT_ONCE, len(rows)))
        end_rows = batch + np.searchsorted(begins, batch, side="right")
        places[end_rows] = toolpath.end[rows[batch], :2]
        sums[end_rows] = _lengths_and_areas(toolpath, rows[batch])
    latest = latest_near(places, offsets, gap_mm)
    # Most contours without a loop never come back to an earlier place.
    for run in np.flatnonzero(np.maximum.reduceat(latest, offsets[:-1]) >= 0).tolist():
        low, high = offsets[run], offsets[run + 1]
        np.cumsum(sums[low:high], axis=0, out=sums[low:high])
        loop = _longest_loop(sums[low:high], places[low:high], latest[low:high] - low, gap_mm)
        if loop is not None:
            contour_rows = rows[low - run : high - run - 1]
            contour_loops[cuts.contour[contour_rows[0]]] = (
                contour_rows[loop[0]],
                contour_rows[loop[1]],
            )
    return contour_loops


def is_in_loop(cuts: CutMoves, contour_loops: Ints) -> Bools:
    """Return the mask (N,) of cutting rows that belong to the loop of their contour."""
    first, last = contour_loops[contour_loops[:, 0] != NO_LOOP].T
    inside = np.zeros(len(cuts.contour) + 1, dtype=np.int8)
    inside[first] += 1
    inside[last + 1] -= 1
    return np.asarray(cuts.is_cut & (np.cumsum(inside, dtype=np.int8)[:-1] > 0))


def _is_level(cuts: CutMoves) -> Bools:
    """Return the mask (C,) of contours that stay at one height."""
    low, high = np.full(cuts.contour_count, np.inf), np.full(cuts.contour_count, -np.inf)
    for begin in range(0, len(cuts.segments), ROWS_AT_ONCE):
        batch = np.arange(begin, min(begin + ROWS_AT_ONCE, len(cuts.segments)))
        contour, z = cuts.contour[cuts.row[batch]], cuts.heights(batch)
        np.minimum.at(low, contour, z.min(axis=1))
        np.maximum.at(high, contour, z.max(axis=1))
    return np.asarray(low == high)


def _lengths_and_areas(toolpath: Toolpath, rows: Indices) -> Floats:
    """Return (R, 2): the length of each of these moves (R,), mm, and the signed area between it
    and the origin, mm².

    Green's theorem: half the cross product of the ends of a move, and for an arc of sweep t the
    area (r²/2)(t − sin t) of its circular segment on top."""
    begin, end = toolpath.starts_of(rows)[:, :2], toolpath.end[rows, :2]
    length = np.hypot(*(end - begin).T)
    area = 0.5 * (begin[:, 0] * end[:, 1] - begin[:, 1] * end[:, 0])
    arcs = np.flatnonzero(are_arcs(toolpath.kind[rows]))
    spoke, sweep = begin[arcs] - toolpath.centre[rows[arcs]], toolpath.sweeps_of(rows[arcs])
    length[arcs] = np.hypot(*spoke.T) * np.abs(sweep)
    area[arcs] += 0.5 * (spoke**2).sum(axis=1) * (sweep - np.sin(sweep))
    return np.column_stack([length, area])


def _longest_loop(
    sums: Floats, places: Floats, latest: Indices, gap_mm: float
) -> tuple[int, int] | None:
    """Return the first and the last row (from 0) of the loop of one contour, None if it has none.
    `places` (R + 1, 2): the start of the contour and the ends of its rows; `sums` (R + 1, 2):
    cumulative sums of `_lengths_and_areas` up to each place; `latest` (R + 1,): the latest earlier
    place at the same point, negative if there is none."""
    best, max_length = None, 0.0
    for first in range(0, len(places), ROWS_AT_ONCE):
        high = first + np.flatnonzero(latest[first : first + ROWS_AT_ONCE] >= 0)
        low = latest[high]
        (ax, ay), (bx, by) = places[high].T, places[low].T
        long, area = (sums[high] - sums[low]).T
        has_area = np.abs(area + 0.5 * (ax * by - ay * bx)) > gap_mm * gap_mm
        for begin, end, length in zip(
            low[has_area].tolist(), high[has_area].tolist(), long[has_area].tolist(), strict=True
        ):
            if length >= MIN_LOOP_SHARE * max_length:
                best, max_length = (begin, end - 1), max(max_length, length)
    return best
