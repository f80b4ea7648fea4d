"""Where an axis turns round on the way along a path.

    path ──parts_of──▶ parts, each of one direction in x and one in y ──turns_of──▶ turns

A part is a line, or an arc within one quadrant: arcs are split where their tangent lies along an
axis. Along each axis the way then is a list of values, and it turns at its highest and lowest
ones. What comes back by less than a least way is no turn: the controller may never see it.

A turn is not a point but a stretch: a line across the axis lies on the extreme as a whole, and
whether it belongs to the way up or to the way down is free.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Floats,
    Ints,
    Polyline,
    Segments,
)


@dataclass(frozen=True, eq=False)
class Parts:
    """A path as A parts in its order: part i goes from place i to place i + 1 of `places`
    (A+1, 2) mm (the last is the first when closed), and is the share `begin` to `end` (A,) of the
    segment `row` (A,) of the path."""

    path: Polyline
    row: Ints
    begin: Floats
    end: Floats
    places: Floats

    def __len__(self) -> int:
        return len(self.row)

    @cached_property
    def segments(self) -> Segments:
        """The parts as lines and arcs, A rows."""
        sweep = Segments.of(self.path).sweep[self.row]
        bulge = np.tan(0.25 * sweep * (self.end - self.begin))
        return Segments.between(self.places[:-1], self.places[1:], bulge)

    def stretch(self, first: int, last: int) -> Polyline:
        """The open path from place `first` to place `last`; beyond A a closed path goes on.

        Parts of one segment are one segment again.
        """
        index = np.arange(first, last) % len(self)
        row, count = self.row[index], len(index)
        fresh = np.ones(count, dtype=np.bool_)
        fresh[1:] = (row[1:] != row[:-1]) | (self.begin[index[1:]] != self.end[index[:-1]])
        head = np.flatnonzero(fresh)
        tail = np.append(head[1:], count) - 1
        share = self.end[index[tail]] - self.begin[index[head]]
        bulge = np.append(_bulges(self.path, row[head], share), 0.0)
        places = self.places[np.append(index[head], index[-1] + 1)]
        return Polyline(np.column_stack([places, bulge]))

    def with_vertices(self, at: Ints) -> tuple[Polyline, Ints]:
        """The closed path with vertices at these places, and which of its vertices they are."""
        keep = np.union1d(np.flatnonzero(self.begin == 0.0), at)
        last = np.append(keep[1:], len(self)) - 1
        bulge = _bulges(self.path, self.row[keep], self.end[last] - self.begin[keep])
        path = Polyline(np.column_stack([self.places[keep], bulge]), closed=True)
        return path, np.searchsorted(keep, at)


def _bulges(path: Polyline, row: Ints, share: Floats) -> Floats:
    """Bulges of these shares of segments; a whole one keeps its own to the last bit."""
    bulge = path.vertices[row, 2]
    return np.asarray(np.where(share == 1.0, bulge, np.tan(np.arctan(bulge) * share)))


def parts_of(path: Polyline) -> Parts:
    """The path with its arcs split where their tangents lie along an axis.

    The tangent of an arc turns from  chord direction − sweep/2  to  chord direction + sweep/2;
    it lies along an axis at the multiples of 90° between, of which |sweep| ≤ 180° has three at
    most. No part is shorter than `POSITION_EPS_MM`.
    """
    segments = Segments.of(path)
    quarter = 0.5 * np.pi
    chord, sweep = segments.end - segments.start, segments.sweep
    first = np.arctan2(chord[:, 1], chord[:, 0]) - 0.5 * sweep
    lowest = np.ceil(np.minimum(first, first + sweep) / quarter)
    tangents = (lowest[:, None] + np.arange(3.0)) * quarter
    whole = np.where(segments.is_arc, sweep, 1.0)
    share = (tangents - first[:, None]) / whole[:, None]
    short = (POSITION_EPS_MM / segment_lengths(segments))[:, None]
    inner = segments.is_arc[:, None] & (share > short) & (share < 1.0 - short)
    arc, which = np.nonzero(inner)
    row = np.concatenate([np.arange(len(segments)), arc])
    begin = np.concatenate([np.zeros(len(segments)), share[arc, which]])
    order = np.lexsort([begin, row])
    row, begin = row[order], begin[order]
    at_end = np.append(row[1:] != row[:-1], True)
    end = np.where(at_end, 1.0, np.append(begin[1:], 1.0))
    places = np.where((begin == 0.0)[:, None], segments.start[row], point_at(segments, row, begin))
    return Parts(path, row, begin, end, np.concatenate([places, path.end[None, :]]))


@dataclass(frozen=True, eq=False)
class Turns:
    """Turns of one axis along A parts.

    `sense` (A,): the direction ±1 in which the axis is driven on each part; 0 on the stretches of
    turns, before the first motion and after the last one. `first`, `last` (T,): the places at the
    two ends of each turn's stretch; `last` goes on beyond A where the stretch of a closed path
    holds its first place. `moves`: the places between which the axis of an open path moves at
    all; None for a closed one, and where it never moves.
    """

    sense: Ints
    first: Ints
    last: Ints
    moves: tuple[int, int] | None = None

    def __len__(self) -> int:
        return len(self.first)


def no_turns(count: int) -> Turns:
    """The turns of an axis that never moves, or does not matter, along `count` parts."""
    none = np.empty(0, dtype=np.int64)
    return Turns(np.zeros(count, dtype=np.int64), none, none)


def turns_of(values: Floats, closed: bool, least_mm: float) -> Turns:
    """Where `values` (A+1,), the way along one axis in mm, come back by `least_mm` or more."""
    count = len(values) - 1
    # A closed way is begun at its highest value, which is a turn if there are any.
    begin = int(values[:-1].argmax()) if closed else 0
    way = np.append(np.roll(values[:-1], -begin), values[begin]) if closed else values
    values_mm = way.tolist()
    knots = _knots(values_mm, least_mm)
    if not knots:
        return no_turns(count)
    if closed:
        knots[0], knots[-1] = 0, count
    sense = np.zeros(count, dtype=np.int64)
    for one, other in pairwise(knots):
        sense[one:other] = 1 if way[other] > way[one] else -1
    flats = [_flat(values_mm, knot, closed, least_mm) for knot in knots]
    for low, high in flats:
        sense[np.arange(low, high) % count] = 0
    turning = np.array(flats[1:] if closed else flats[1:-1], dtype=np.int64).reshape(-1, 2)
    if not closed:
        return Turns(sense, turning[:, 0], turning[:, 1], (flats[0][1], flats[-1][0]))
    turning += begin
    turning -= np.where(turning[:, :1] >= count, count, 0)
    return Turns(np.roll(sense, begin), turning[:, 0], turning[:, 1])


def _knots(values: list[float], least_mm: float) -> list[int]:
    """The places where the way begins, turns, and is furthest at last; [] when it is shorter than
    `least_mm` throughout."""
    low = high = far = way = 0
    knots: list[int] = []
    for place, value in enumerate(values):
        if way == 0:
            low = place if value < values[low] else low
            high = place if value > values[high] else high
            if values[high] - values[low] >= least_mm:
                knots, far = [min(low, high)], place
                way = 1 if place == high else -1
        elif (value - values[far]) * way > 0.0:
            far = place
        elif (values[far] - value) * way >= least_mm:
            knots.append(far)
            far, way = place, -way
    return [*knots, far] if knots else []


def _flat(values: list[float], knot: int, closed: bool, least_mm: float) -> tuple[int, int]:
    """The places before and after `knot` up to which the way stays within `least_mm` of it; those
    of a closed way go on before 0 and beyond its end."""
    count = len(values) - 1
    low = high = knot
    while (closed or low > 0) and abs(values[(low - 1) % count] - values[knot]) < least_mm:
        low -= 1
    while (closed or high < count) and abs(
        values[(high + 1) % count if closed else high + 1] - values[knot]
    ) < least_mm:
        high += 1
    return low, high
