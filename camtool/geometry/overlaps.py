"""Remove from loose lines and arcs what lies on other ones.

A *loose* path is an open one of a single line, or of arcs on a single circle. The part of it that
lies on another path of its group is removed; the rest stays, in one piece or more. Where two loose
paths overlap, the longer one stays whole.

Everything else stays whole: closed paths, because two contours that share an edge are two parts
that both need cutting, and open paths of several segments, because they were drawn as one stroke.
A path that overlaps itself stays too."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.geometry.boxes import touching_boxes
from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import Polylines, Segments

SAME_LINE_MM = 1e-4
"""Lines and arcs lie on each other if they are nearer than this; the tolerance, if less, replaces
it."""


class Unlapped(Struct, frozen=True, eq=False):
    """The paths without overlaps, the input path that each is or is part of (M,), how many paths
    were shortened or left out, and by what length, mm."""

    lines: Polylines
    source: Ints
    count: int
    length_mm: float


_Spans = list[tuple[float, float]]


def without_overlaps(lines: Polylines, groups: Ints, within_mm: float) -> Unlapped:
    """Return the paths without what lies on another path of the same group, `groups` (M,).

    The rules are at the top of this file. A remainder shorter than `within_mm` is left out with
    the overlap beside it."""
    unchanged = Unlapped(lines, np.arange(len(lines)), 0, 0.0)
    if not _may_be_loose(lines).any():
        return unchanged
    intervals = _intervals(lines, groups, within_mm)
    coverings = covers(intervals, within_mm)
    if not len(coverings.a):
        return unchanged
    remaining = _remaining_spans(intervals, coverings, within_mm)
    if not remaining:
        return unchanged
    touched = np.zeros(len(lines), dtype=np.bool_)
    touched[intervals.path[list(remaining)]] = True
    parts, source = [lines.select(np.flatnonzero(~touched))], [np.flatnonzero(~touched)]
    remaining_mm = 0.0
    for row, spans in remaining.items():
        path = int(intervals.path[row])
        for span in spans:
            parts.append(_span_path(lines, intervals, row, span))
            source.append(np.array([path]))
            remaining_mm += span[1] - span[0]
    origin = np.concatenate(source)
    order = np.argsort(origin, kind="stable")
    removed_mm = float(intervals.length[list(remaining)].sum()) - remaining_mm
    return Unlapped(_join_parts(parts).select(order), origin[order], len(remaining), removed_mm)


def _may_be_loose(lines: Polylines) -> Bools:
    """Return the mask (M,) of the paths that an overlap may shorten: open, and a single line or
    only arcs."""
    counts = np.diff(lines.offsets) - 1
    arcs = np.searchsorted(lines.offsets, np.flatnonzero(lines.vertices[:, 2]), side="right") - 1
    of_arcs = np.bincount(arcs, minlength=len(lines)) == counts
    return np.asarray(~lines.closed & ((counts == 1) | of_arcs))


def _intervals(lines: Polylines, groups: Ints, tolerance: float) -> Intervals:
    """Return an interval for each loose path as a whole, and for each segment of the others."""
    segments = Segments.of(lines)
    counts = np.bincount(segments.path, minlength=len(lines))
    first = np.cumsum(counts) - counts
    loose_line = ~lines.closed & (counts == 1) & ~segments.is_arc[first]
    head = first[segments.path]
    radius = np.where(segments.is_arc, segments.radius, np.nan)
    same_circle = (
        (np.hypot(*(segments.centre - segments.centre[head]).T) <= tolerance)
        & (np.abs(radius - radius[head]) <= tolerance)
        & (segments.bulge * segments.bulge[head] > 0.0)
    )
    loose_arc = ~lines.closed & (
        np.bincount(segments.path[~same_circle], minlength=len(lines)) == 0
    )
    loose_arc &= segments.is_arc[first]
    sweep = np.bincount(segments.path, weights=np.abs(segments.sweep), minlength=len(lines))
    loose_arc &= sweep <= 2.0 * math.pi
    is_head = np.arange(len(segments)) == head
    rows = np.flatnonzero(is_head | ~loose_arc[segments.path])
    path = segments.path[rows]
    chord = (segments.end - segments.start)[rows]
    arc = segments.is_arc[rows]
    length = segment_lengths(segments)[rows]
    width = np.where(loose_arc[path], sweep[path], np.abs(segments.sweep[rows]))
    length = np.where(arc, width * radius[rows], length)
    begins = segments.start_angle[rows] - np.where(segments.bulge[rows] < 0.0, width, 0.0)
    return Intervals(
        path=path,
        group=groups[path],
        loose=(loose_line | loose_arc)[path],
        length=length,
        start=segments.start[rows],
        direction=np.where(arc[:, None], np.nan, chord / np.hypot(*chord.T)[:, None]),
        centre=segments.centre[rows],
        radius=radius[rows],
        low=begins,
    )


def _remaining_spans(items: Intervals, laps: Covers, tolerance: float) -> dict[int, _Spans]:
    """Return the spans, mm along it, that remain of each loose interval after removing what other
    intervals cover; only of those that lose something."""
    rank = _ranks(items, distinct(np.concatenate([laps.a, laps.b])))
    # A loose interval gives way to intervals that are not loose, and to loose ones of a higher
    # rank.
    yields = ~items.loose[laps.b] | (rank[laps.b] < rank[laps.a])
    order = np.argsort(rank[laps.a], kind="stable")
    order = order[yields[order]]
    columns = (laps.a, laps.b, laps.begin, laps.end, laps.shift, laps.sense)
    remaining: dict[int, _Spans] = {}
    for a, b, begin, end, shift, sense in zip(
        *(column[order].tolist() for column in columns), strict=True
    ):
        spans = remaining.get(a, [(0.0, float(items.length[a]))])
        if b in remaining:
            other_spans = [
                sorted((shift + sense * low, shift + sense * high)) for low, high in remaining[b]
            ]
            hidden = [(max(low, begin), min(high, end)) for low, high in other_spans]
        else:
            hidden = [(begin, end)]
        for low, high in hidden:
            spans = _subtract_span(spans, low, high, tolerance)
        remaining[a] = spans
    untouched = {a for a, spans in remaining.items() if spans == [(0.0, float(items.length[a]))]}
    return {a: spans for a, spans in remaining.items() if a not in untouched}


def _ranks(intervals: Intervals, rows: Ints) -> Ints:
    """Return the rank (K,) of each interval: longest first, then by place, so that the order of
    drawing decides nothing."""
    of_line = intervals.start + 0.5 * intervals.length[:, None] * intervals.direction
    middle = np.where(np.isnan(intervals.centre), of_line, intervals.centre)
    low = np.where(np.isnan(intervals.low), 0.0, np.mod(intervals.low, 2.0 * math.pi))
    keys = (low, middle[:, 1], middle[:, 0], -intervals.length)
    order = np.lexsort(tuple(np.round(key[rows], 9) for key in keys))
    rank = np.zeros(len(intervals.path), dtype=np.int64)
    rank[rows[order]] = np.arange(len(rows))
    return rank


def _subtract_span(spans: _Spans, low: float, high: float, tolerance: float) -> _Spans:
    """Return the spans without low … high; remainders no longer than `tolerance` are dropped."""
    if high <= low:
        return spans
    cut: _Spans = []
    for begin, end in spans:
        if high <= begin or low >= end:
            cut.append((begin, end))
            continue
        pieces = [(begin, min(end, low)), (max(begin, high), end)]
        cut.extend(piece for piece in pieces if piece[1] - piece[0] > tolerance)
    return cut


def _span_path(
    lines: Polylines, intervals: Intervals, row: int, span: tuple[float, float]
) -> Polylines:
    """Return a span of a loose interval as a path, in the direction in which the interval was
    drawn."""
    path = lines[int(intervals.path[row])].vertices
    begin, end = span
    if math.isnan(intervals.radius[row]):
        ends = intervals.start[row] + np.outer([begin, end], intervals.direction[row])
        vertices = np.column_stack([ends, np.zeros(2)])
        clockwise = False
    else:
        clockwise = bool(path[0, 2] < 0.0)
        radius, low = float(intervals.radius[row]), float(intervals.low[row])
        parts = 1 if end - begin <= math.pi * radius else 2
        angles = np.linspace(low + begin / radius, low + end / radius, parts + 1)
        bulge = math.tan((end - begin) / radius / parts / 4.0)
        x, y = intervals.centre[row][:, None] + radius * np.array([np.cos(angles), np.sin(angles)])
        vertices = np.column_stack([x, y, np.full(parts + 1, bulge)])
    if clockwise:
        vertices = vertices[::-1] * np.array([1.0, 1.0, -1.0])
    at_low, at_high = begin == 0.0, end == float(intervals.length[row])
    if at_high if clockwise else at_low:
        vertices[0, :2] = path[0, :2]
    if at_low if clockwise else at_high:
        vertices[-1, :2] = path[-1, :2]
    return Polylines(vertices, np.array([0, len(vertices)]), np.zeros(1, dtype=np.bool_))


def _join_parts(parts: list[Polylines]) -> Polylines:
    """Return the paths of all parts, one part after the other."""
    counts = np.concatenate([np.diff(part.offsets) for part in parts])
    return Polylines(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([[0], np.cumsum(counts)]),
        np.concatenate([part.closed for part in parts]),
    )


# Lines and arcs as intervals of a carrier (a whole line or circle), and which cover which.
#
# An interval of a line runs from its start; one of a circle runs CCW from its first angle. Places
# on it are given in mm from there. Intervals that come from one loose path carry its number, so
# that what is left of it can be found later; all others stay as they are.
#
# Two lines lie on each other when they do so within `within_mm` along all they share, two arcs
# when centres and radii agree within that. What they share must be `MIN_SHARED_TOLERANCES` times
# as long, or its direction would not be known well enough to say that they are on one line.

MIN_SHARED_TOLERANCES = 32.0
"""Intervals that share less than this many times their tolerance count as apart."""

BINS = 50
"""Number of bins into which the directions of lines are sorted. Lines that share enough differ in
direction by at most 2/MIN_SHARED_TOLERANCES rad, which is less than one bin."""

MAX_PAIRS = 2_000_000


class Intervals(Struct, frozen=True, eq=False):
    """K intervals: `path` (K,) that each came from, `group` (K,), `loose` (K,), `length` (K,) mm.

    Lines have `start` (K, 2) and the unit `direction` (K, 2); circles `centre` (K, 2), `radius`
    (K,) and the first angle `low` (K,) rad. The others are NaN."""

    path: Ints
    group: Ints
    loose: Bools
    length: Floats
    start: Floats
    direction: Floats
    centre: Floats
    radius: Floats
    low: Floats


class Covers(Struct, frozen=True, eq=False):
    """Pairs of intervals on one carrier: of the interval `a`, `begin` to `end` mm lie on `b`.

    A place s mm along b is at  shift + sense·s  along a."""

    a: Ints
    b: Ints
    begin: Floats
    end: Floats
    shift: Floats
    sense: Floats

    def __getitem__(self, rows: Bools) -> Covers:
        """Return the pairs that a mask selects."""
        return Covers(*(column[rows] for column in astuple(self)))


def covers(all_of: Intervals, within_mm: float) -> Covers:
    """Return every pair of which one interval covers part of a loose one of another path of its
    group."""
    coverings: list[Covers] = []
    count = 0
    for part in chain(_on_lines(all_of, within_mm), _on_circles(all_of, within_mm)):
        coverings.append(part)
        count += len(part.a)
        if count > MAX_PAIRS:
            break
    row, place = np.empty(0, dtype=np.int64), np.empty(0)
    every = [Covers(row, row, place, place, place, place), *coverings]
    return Covers(*map(np.concatenate, zip(*map(astuple, every), strict=True)))


def _on_lines(items: Intervals, within_mm: float) -> Iterator[Covers]:
    """Yield the covers of lines, for one bin of directions after the other, turned level so that
    their boxes are flat."""
    lines = np.flatnonzero(~np.isnan(items.direction[:, 0]))
    angle = np.arctan2(items.direction[lines, 1], items.direction[lines, 0])
    of_bin = np.round(angle / (np.pi / BINS)).astype(np.int64) % BINS
    for number in distinct(of_bin[items.loose[lines]]).tolist():
        rows = lines[(of_bin - number + 1) % BINS <= 2]
        is_searched = items.loose[rows] & (of_bin[(of_bin - number + 1) % BINS <= 2] == number)
        boxes = _level_boxes(items, rows, number * np.pi / BINS, 0.5 * within_mm)
        pairs = touching_boxes(
            boxes, items.group[rows], items.path[rows], is_searched, max_pairs=MAX_PAIRS
        )
        for a, b in (pairs, pairs[::-1]):
            is_loose = is_searched[a]
            yield _shared_line(items, rows[a[is_loose]], rows[b[is_loose]], within_mm)


def _level_boxes(intervals: Intervals, rows: Ints, angle: float, margin: float) -> Floats:
    """Return the boxes (R, 4) of lines turned by −angle, grown by the margin."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    start = intervals.start[rows]
    end = start + intervals.length[rows, None] * intervals.direction[rows]
    start, end = start @ turn, end @ turn
    low, high = np.minimum(start, end) - margin, np.maximum(start, end) + margin
    return np.concatenate([low, high], axis=1)


def _shared_line(intervals: Intervals, a: Ints, b: Ints, tolerance: float) -> Covers:
    """Return the stretch that each line of `a` has in common with the line of `b` in the same
    place.

    The distance of the lines is linear along them, so that it is largest at the ends of the
    stretch."""
    along, length_b = intervals.direction[a], intervals.length[b]
    from_a = intervals.start[b] - intervals.start[a]
    shift = (from_a * along).sum(axis=1)
    sense = (intervals.direction[b] * along).sum(axis=1)
    offset = along[:, 0] * from_a[:, 1] - along[:, 1] * from_a[:, 0]
    rise = along[:, 0] * intervals.direction[b, 1] - along[:, 1] * intervals.direction[b, 0]
    far_end = shift + sense * length_b
    begin = np.maximum(np.minimum(shift, far_end), 0.0)
    end = np.minimum(np.maximum(shift, far_end), intervals.length[a])
    slope = rise / np.where(sense == 0.0, np.inf, sense)
    distance = np.maximum(
        np.abs(offset + slope * (begin - shift)), np.abs(offset + slope * (end - shift))
    )
    is_shared = (end - begin >= MIN_SHARED_TOLERANCES * tolerance) & (distance <= tolerance)
    return Covers(a, b, begin, end, shift, np.where(sense < 0.0, -1.0, 1.0))[is_shared]


def _on_circles(intervals: Intervals, within_mm: float) -> Iterator[Covers]:
    """Yield the covers of arcs on one circle.

    Circles of a grid of holes have equal centres in x, or in y, and equal radii: only along a
    slanted line are their centres apart, so that boxes are laid along one."""
    arcs = np.flatnonzero(~np.isnan(intervals.radius))
    is_searched = intervals.loose[arcs]
    if not is_searched.any():
        return
    slanted = intervals.centre[arcs] @ np.array([np.cos(1.0), np.sin(1.0)])
    place = np.column_stack([slanted, intervals.radius[arcs]])
    boxes = np.concatenate([place - 0.5 * within_mm, place + 0.5 * within_mm], axis=1)
    pairs = touching_boxes(
        boxes, intervals.group[arcs], intervals.path[arcs], is_searched, max_pairs=MAX_PAIRS
    )
    for one, other in (pairs, pairs[::-1]):
        a, b = arcs[one[is_searched[one]]], arcs[other[is_searched[one]]]
        distances = np.hypot(*(intervals.centre[a] - intervals.centre[b]).T)
        same_circle = (distances <= within_mm) & (
            np.abs(intervals.radius[a] - intervals.radius[b]) <= within_mm
        )
        yield from _shared_circle(intervals, a[same_circle], b[same_circle], within_mm)


def _shared_circle(intervals: Intervals, a: Ints, b: Ints, tolerance: float) -> Iterator[Covers]:
    """Yield the stretches that each arc of `a` has in common with the arc of `b` in the same
    place.

    There are two yields, since b may cover both the begin and the end of a."""
    radius, turn = intervals.radius[a], 2.0 * np.pi
    lead_angle = np.mod(intervals.low[b] - intervals.low[a], turn)
    for shift in (lead_angle * radius, (lead_angle - turn) * radius):
        begin = np.maximum(shift, 0.0)
        end = np.minimum(shift + intervals.length[b], intervals.length[a])
        is_shared = end - begin >= MIN_SHARED_TOLERANCES * tolerance
        yield Covers(a, b, begin, end, shift, np.ones(len(a)))[is_shared]
