"""Lines and arcs as stretches of a carrier (a whole line or circle), and which cover which.

A stretch of a line runs from its start; one of a circle runs CCW from its first angle. Places on
it are told in mm from there. Stretches that come from one loose path carry its number, so that
what is left of it can be told later; all others stay as they are.

Two lines lie on each other when they do so within `within_mm` along all they share, two arcs when
centres and radii agree within that. What they share must be `SHORTEST_SHARES` times as long, or
its direction would not be known well enough to say that they are on one line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from camtool.geometry.boxes import touching_boxes
from camtool.geometry.polylines import Bools, Floats, Ints

SHORTEST_SHARES = 32.0
"""Stretches share so many times their tolerance at least, or they count as apart."""

BINS = 50
"""Directions of lines are sorted into so many bins; 2/SHORTEST_SHARES rad is less than one."""

MOST_PAIRS = 2_000_000
"""No more pairs of stretches on each other than this are looked at."""


@dataclass(frozen=True, eq=False)
class Stretches:
    """K stretches: `path` (K,) that each came from, `group` (K,), `loose` (K,), `length` (K,) mm.

    Lines have `start` (K, 2) and the unit `direction` (K, 2); circles `centre` (K, 2), `radius`
    (K,) and the first angle `low` (K,) rad. The others are NaN.
    """

    path: Ints
    group: Ints
    loose: Bools
    length: Floats
    start: Floats
    direction: Floats
    centre: Floats
    radius: Floats
    low: Floats


@dataclass(frozen=True, eq=False)
class Covers:
    """Pairs of stretches on one carrier: of the stretch `a`, `begin` to `end` mm lie on `b`.

    A place s mm along b is at  shift + sense·s  along a.
    """

    a: Ints
    b: Ints
    begin: Floats
    end: Floats
    shift: Floats
    sense: Floats

    def __getitem__(self, rows: Bools) -> Covers:
        """The chosen rows."""
        return Covers(**{name: column[rows] for name, column in vars(self).items()})


def covers(all_of: Stretches, within_mm: float) -> Covers:
    """Every stretch that covers part of a loose one of another path of its group."""
    found: list[Covers] = []
    count = 0
    for part in chain(_on_lines(all_of, within_mm), _on_circles(all_of, within_mm)):
        found.append(part)
        count += len(part.a)
        if count > MOST_PAIRS:
            break
    row, place = np.empty(0, dtype=np.int64), np.empty(0)
    every = [Covers(row, row, place, place, place, place), *found]
    return Covers(
        **{name: np.concatenate([vars(part)[name] for part in every]) for name in vars(every[0])}
    )


def _on_lines(of: Stretches, within_mm: float) -> Iterator[Covers]:
    """Bin by bin: lines of nearly one direction, turned level so that their boxes are flat."""
    lines = np.flatnonzero(~np.isnan(of.direction[:, 0]))
    angle = np.arctan2(of.direction[lines, 1], of.direction[lines, 0])
    of_bin = np.round(angle / (np.pi / BINS)).astype(np.int64) % BINS
    for number in np.unique(of_bin[of.loose[lines]]).tolist():
        near = lines[(of_bin - number + 1) % BINS <= 2]
        asked = of.loose[near] & (of_bin[(of_bin - number + 1) % BINS <= 2] == number)
        boxes = _level_boxes(of, near, number * np.pi / BINS, 0.5 * within_mm)
        pairs = touching_boxes(boxes, of.group[near], of.path[near], asked, most=MOST_PAIRS)
        for a, b in (pairs, pairs[::-1]):
            wanted = asked[a]
            yield _shared_line(of, near[a[wanted]], near[b[wanted]], within_mm)


def _level_boxes(of: Stretches, rows: Ints, angle: float, margin: float) -> Floats:
    """(R, 4) boxes of lines turned by −angle, grown by the margin."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    start = of.start[rows]
    end = start + of.length[rows, None] * of.direction[rows]
    start, end = start @ turn, end @ turn
    low, high = np.minimum(start, end) - margin, np.maximum(start, end) + margin
    return np.concatenate([low, high], axis=1)


def _shared_line(of: Stretches, a: Ints, b: Ints, within: float) -> Covers:
    """What the lines a lie on the lines b, pair by pair.

    Along a, the distance of b's line is linear: it is largest at the ends of what they share.
    """
    along, length_b = of.direction[a], of.length[b]
    from_a = of.start[b] - of.start[a]
    shift = (from_a * along).sum(axis=1)
    sense = (of.direction[b] * along).sum(axis=1)
    aside = along[:, 0] * from_a[:, 1] - along[:, 1] * from_a[:, 0]
    rise = along[:, 0] * of.direction[b, 1] - along[:, 1] * of.direction[b, 0]
    far = shift + sense * length_b
    begin = np.maximum(np.minimum(shift, far), 0.0)
    end = np.minimum(np.maximum(shift, far), of.length[a])
    slope = rise / np.where(sense == 0.0, np.inf, sense)
    off = np.maximum(
        np.abs(aside + slope * (begin - shift)), np.abs(aside + slope * (end - shift))
    )
    good = (end - begin >= SHORTEST_SHARES * within) & (off <= within)
    return Covers(a, b, begin, end, shift, np.where(sense < 0.0, -1.0, 1.0))[good]


def _on_circles(of: Stretches, within_mm: float) -> Iterator[Covers]:
    """Arcs on one circle. Circles of a grid of holes have equal centres in x, or in y, and equal
    radii: on a slanted line their centres are apart."""
    arcs = np.flatnonzero(~np.isnan(of.radius))
    asked = of.loose[arcs]
    if not asked.any():
        return
    slanted = of.centre[arcs] @ np.array([np.cos(1.0), np.sin(1.0)])
    place = np.column_stack([slanted, of.radius[arcs]])
    boxes = np.concatenate([place - 0.5 * within_mm, place + 0.5 * within_mm], axis=1)
    pairs = touching_boxes(boxes, of.group[arcs], of.path[arcs], asked, most=MOST_PAIRS)
    for one, other in (pairs, pairs[::-1]):
        a, b = arcs[one[asked[one]]], arcs[other[asked[one]]]
        apart = np.hypot(*(of.centre[a] - of.centre[b]).T)
        same = (apart <= within_mm) & (np.abs(of.radius[a] - of.radius[b]) <= within_mm)
        yield from _shared_circle(of, a[same], b[same], within_mm)


def _shared_circle(of: Stretches, a: Ints, b: Ints, within: float) -> Iterator[Covers]:
    """What arcs a lie on arcs b: b may cover a's beginning and its end, from two turns."""
    radius, turn = of.radius[a], 2.0 * np.pi
    ahead = np.mod(of.low[b] - of.low[a], turn)
    for shift in (ahead * radius, (ahead - turn) * radius):
        begin = np.maximum(shift, 0.0)
        end = np.minimum(shift + of.length[b], of.length[a])
        good = end - begin >= SHORTEST_SHARES * within
        yield Covers(a, b, begin, end, shift, np.ones(len(a)))[good]
