"""Points along the stairs of pixels as few lines and arcs, within a limit of all of them.

    points ──greedy──▶ runs, each within the limit of one line or circle (least squares)
           ──ends of neighbours moved to where both leave the least──▶ runs
           ──vertices where neighbours meet──▶ lines and arcs, measured against the points

Least squares over a run averages the stairs out: a straight edge of a drawing comes back straight,
wherever its stairs lie. Two lines, or arcs, meet where they cross, which restores corners that
pixels have cut. Where what comes out is beyond the limit somewhere, a run is divided, at last into
its points.
Nothing here is random, and nothing depends on where the picture lies.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.geometry.fit import split_bulges
from camtool.geometry.measure import signed_area
from camtool.geometry.polylines import Polyline
from camtool.importers.bitmap.outline import enclosed_area
from camtool.kernels.fits import furthest_off

SEARCH_SHARE = 0.9
"""Runs are searched within this part of the limit: moving their ends takes a part of the rest."""

FLAT_SHARE = 0.35
"""An arc that leaves its chord by less than this part of the limit is a line."""

AS_GOOD = 1.25
"""A line is taken in place of an arc where its mean deviation is at most so many times that of the
arc, plus `AS_GOOD_PX`."""

AS_GOOD_PX = 0.02
"""See `AS_GOOD`."""

MAX_SWEEP_RAD = 1.5 * math.pi
"""The arc of a run turns by no more than this."""

BACK_PX = 1.5
"""Along a line or an arc, points may go back by no more than this."""

AREA_SHARE = 0.1
"""A contour encloses what its points enclose, but for this part."""

HALVINGS = 5
"""The limit is halved at most this many times for a contour whose area differs by more."""

MOVES_BACK, MOVES_ON = 6, 2
"""Points before and behind the end of a greedy run that are tried as its end."""

MEETINGS = 24
"""Rounds in which a point is projected onto both neighbours in turn; it converges to the point
where they meet."""

MEETING_PX = 0.35
"""A corner may lie this much beyond the limit from the points that it joins: pixels cut it."""

CORNER_POINTS = 4
"""The sharpest corner is where the path turns most within so many points to either side."""

MIN_SEGMENT_PX = 0.05
"""Segments that are shorter are left out."""

MIN_RUN_POINTS = 3
"""Points of a run that is more than a chord."""


class _Shape(Struct, frozen=True, eq=False):
    """A line through `at` along the unit vector `way`, or an arc about `at` with a `radius`, which
    turns by `sweep` (rad, CCW positive); its largest and mean (rms) distance from its points."""

    at: Floats
    way: Floats
    radius: float
    sweep: float
    largest: float
    mean: float

    def nearest(self, place: Floats) -> Floats:
        """Its place nearest to another one."""
        arm = place - self.at
        if self.radius == 0.0:
            return self.at + float(arm @ self.way) * self.way
        return self.at + arm * (self.radius / (math.hypot(*arm) or 1.0))

    def squares(self, points: Floats) -> Floats:
        """(n,) the squares of the distances of points from it."""
        x, y = (points - self.at).T
        if self.radius > 0.0:
            return np.asarray((np.hypot(x, y) - self.radius) ** 2)
        if not self.way.any():
            return np.asarray(x * x + y * y)
        return np.asarray((x * self.way[1] - y * self.way[0]) ** 2)


class PixelStrokes(Struct, frozen=True, eq=False):
    """`vertices` (n, 3) x, y, bulge; of an open path the last one is its end. `off` (n, 2): the
    largest and the rms distance of the points from the segment that leaves each vertex."""

    vertices: Floats
    off: Floats


def strokes(points: Floats, limit: float, *, closed: bool) -> PixelStrokes:
    """Lines and arcs within `limit` of the points (n, 2); an open path keeps its ends, a closed
    one about its area: the limit is less for thinner shapes."""
    if not closed:
        return _chain_of_shapes(points, _runs(points, limit), limit, closed=False)
    circle = _circle(points)
    if circle is not None and circle.off[0, 0] <= limit:
        return circle
    ring, area = np.roll(points, -_sharpest(points), axis=0), enclosed_area(points)
    for _ in range(HALVINGS):
        made = _chain_of_shapes(
            *_begin_at_best_division(ring, _runs(ring, limit), limit), limit, closed=True
        )
        if len(made.vertices) > 1:
            found = signed_area(Polyline(made.vertices, closed=True))
            if abs(found - area) <= AREA_SHARE * abs(area):
                return made
        limit *= 0.5
    return PixelStrokes(np.column_stack([ring, np.zeros(len(ring))]), np.zeros((len(ring), 2)))


def _begin_at_best_division(
    ring: Floats, ends: list[int], limit: float
) -> tuple[Floats, list[int]]:
    """A closed path and its runs, begun where the last run and the first leave the least."""
    if len(ends) < 3:
        return ring, [0, len(ring) // 2, len(ring)]
    before, behind = len(ring) - ends[-2], ends[1]
    both = np.concatenate([ring[ends[-2] :], ring[: ends[1]]])
    moved = _division_index(both, before, limit) - before
    moved = min(max(moved, 1 - before), behind - 1)
    inner = [end - moved for end in ends[1:-1]]
    return np.roll(ring, -moved, axis=0), [0, *inner, len(ring)]


def _sharpest(points: Floats) -> int:
    """The point at which a closed path turns most."""
    arm = max(min(CORNER_POINTS, len(points) // 4), 1)
    before, behind = (points - np.roll(points, arm * k, axis=0) for k in (1, -1))
    lengths = np.hypot(*before.T) * np.hypot(*behind.T)
    straight = -(before * behind).sum(axis=1) / np.where(lengths > 0.0, lengths, 1.0)
    return int(straight.argmin())


def _circle(points: Floats) -> PixelStrokes | None:
    """All points as a circle of two halves."""
    found = _centre(points)
    if found is None:
        return None
    centre, radius = found
    off = np.abs(np.hypot(*(points - centre).T) - radius)
    turn = 1.0 if enclosed_area(points) > 0.0 else -1.0
    vertices = np.array([[radius, 0.0, turn], [-radius, 0.0, turn]])
    vertices[:, :2] += centre
    return PixelStrokes(vertices, np.tile([off.max(), math.sqrt((off**2).mean())], (2, 1)))


def _centre(points: Floats) -> tuple[Floats, float] | None:
    """Centre and radius of the circle through points, least squares (Kåsa's); None for points on a
    line."""
    middle = points.sum(axis=0) / len(points)
    x, y = (points - middle).T
    square = x * x + y * y
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    determinant = xx * yy - xy * xy
    if determinant <= 1e-9 * (xx + yy) ** 2:
        return None
    a, b = 0.5 * float(square @ x), 0.5 * float(square @ y)
    u, v = (a * yy - b * xy) / determinant, (b * xx - a * xy) / determinant
    radius = math.sqrt(u * u + v * v + (xx + yy) / len(points))
    return middle + np.array([u, v]), radius


def _line(points: Floats) -> _Shape:
    """The line of least squares through points, in their direction."""
    middle = points.sum(axis=0) / len(points)
    if len(points) == 1:
        return _Shape(middle, np.zeros(2), 0.0, 0.0, 0.0, 0.0)
    x, y = (points - middle).T
    angle = 0.5 * math.atan2(2.0 * float(x @ y), float(x @ x) - float(y @ y))
    way = np.array([math.cos(angle), math.sin(angle)])
    if float((points[-1] - points[0]) @ way) < 0.0:
        way = -way
    off = x * way[1] - y * way[0]
    return _Shape(
        middle, way, 0.0, 0.0, float(np.abs(off).max()), math.sqrt(float(off @ off) / len(off))
    )


def _arc(points: Floats) -> _Shape | None:
    """The arc of least squares along points; None where they run along none."""
    found = _centre(points) if len(points) > MIN_RUN_POINTS else None
    if found is None:
        return None
    centre, radius = found
    arms = points - centre
    angles = np.arctan2(arms[:, 1], arms[:, 0])
    turns = angles[1:] - angles[:-1]
    turns = np.mod(turns + math.pi, 2.0 * math.pi) - math.pi
    along = np.concatenate([[0.0], np.cumsum(turns)])
    sweep = float(along[-1])
    ahead = along if sweep >= 0.0 else -along
    back = float((np.maximum.accumulate(ahead) - ahead).max()) * radius
    if abs(sweep) > MAX_SWEEP_RAD or back > BACK_PX:
        return None
    off = np.hypot(*arms.T) - radius
    mean = math.sqrt(float(off @ off) / len(off))
    return _Shape(centre, np.zeros(2), radius, sweep, float(np.abs(off).max()), mean)


def _best(points: Floats, limit: float) -> _Shape | None:
    """The line, or else the arc, along points within the limit."""
    line = _line(points)
    if line.largest <= FLAT_SHARE * limit:
        return line
    arc = _arc(points)
    if arc is not None and arc.radius * (1.0 - math.cos(0.5 * arc.sweep)) < FLAT_SHARE * limit:
        arc = None
    if arc is not None and arc.largest > limit:
        arc = None
    if line.largest > limit or _goes_back(points, line):
        return arc
    if arc is None or line.mean <= AS_GOOD * arc.mean + AS_GOOD_PX:
        return line
    return arc


def _goes_back(points: Floats, line: _Shape) -> bool:
    """True if the points turn back along the line by more than BACK_PX."""
    along = points @ line.way
    return bool((np.maximum.accumulate(along) - along).max() > BACK_PX)


def _runs(points: Floats, limit: float) -> list[int]:
    """First points of runs, and the number of points: each run is as long as a line or an arc
    reaches, then ends where it and the next one leave the least."""
    within, ends = SEARCH_SHARE * limit, [0]
    while ends[-1] < len(points):
        ends.append(_reach(points, ends[-1], within))
    for k in range(1, len(ends) - 1):
        low, high = ends[k - 1], ends[k + 1]
        ends[k] = low + _division_index(points[low:high], ends[k] - low, within)
    return ends


def _division_index(points: Floats, here: int, limit: float) -> int:
    """Return the index near `here` at which to divide the points into two runs, so that the sum of
    squares of the distances from their shapes is least."""
    one, other = (_best(part, limit) or _line(part) for part in (points[:here], points[here:]))
    low, high = max(here - MOVES_BACK, 1), min(here + MOVES_ON, len(points) - 1)
    between = points[low:high]
    first, second = (shape.squares(between) for shape in (one, other))
    prices = np.append(0.0, np.cumsum(first)) + np.append(np.cumsum(second[::-1])[::-1], 0.0)
    found = low + int(prices.argmin())
    fit = all(_best(part, limit) is not None for part in (points[:found], points[found:]))
    return found if fit else here


def _reach(points: Floats, first: int, limit: float) -> int:
    """The end of the longest run from `first` on: by doubling, then by halving."""
    last = len(points)
    good, step = min(first + MIN_RUN_POINTS, last), MIN_RUN_POINTS
    bad = last + 1
    while good < last:
        ahead = min(good + step, last)
        if _best(points[first:ahead], limit) is None:
            bad = ahead
            break
        good, step = ahead, 2 * step
    while bad - good > 1 and bad <= last:
        middle = (good + bad) // 2
        if _best(points[first:middle], limit) is None:
            bad = middle
        else:
            good = middle
    return good


def _chain_of_shapes(
    points: Floats, ends: list[int], limit: float, *, closed: bool
) -> PixelStrokes:
    """The chain of the shapes of these runs. Where one of them does not suit its points from
    meeting to meeting, it begins and ends where they do."""
    runs = [
        _Run(part := points[low:high], _best(part, limit) or _line(part))
        for low, high in pairwise(ends)
    ]
    still = [0.5 * (points[end - 1] + points[end % len(points)]) for end in ends]
    if not closed:
        still[0], still[-1] = points[0], points[-1]
    places = list(still)
    for k in range(0 if closed else 1, len(runs)):
        places[k] = _meeting_point(runs[k - 1].shape, runs[k].shape, still[k], limit)
    if closed:
        places[-1] = places[0]
    waiting = list(range(len(runs)))
    while waiting:
        k = waiting.pop()
        if runs[k].suits(places[k], places[k + 1], limit):
            continue
        for end in (k, k + 1):
            if places[end] is still[end]:
                continue
            same = {end, *((0, len(runs)) if closed and end in (0, len(runs)) else ())}
            for each in same:
                places[each] = still[each]
            waiting += [(end - 1) % len(runs), end % len(runs)]
    rows: list[list[float]] = []
    off: list[list[float]] = []
    for run, (begin, end) in zip(runs, pairwise(places), strict=True):
        made, apart = run.segments(begin, end, limit)
        rows += made
        off += apart
    if not closed:
        rows.append([*places[-1], 0.0])
        off.append([0.0, 0.0])
    return PixelStrokes(np.array(rows), np.array(off))


def _meeting_point(one: _Shape, other: _Shape, place: Floats, limit: float) -> Floats:
    """Return the point near `place` where two neighbouring shapes meet, or come nearest; at most
    `limit` + MEETING_PX from `place`."""
    met = place
    for _ in range(MEETINGS):
        met = other.nearest(one.nearest(met))
    way = 0.5 * (one.nearest(met) + other.nearest(met)) - place
    far = math.hypot(*way)
    return np.asarray(place + way * min((limit + MEETING_PX) / (far or 1.0), 1.0))


class _Run(Struct, frozen=True, eq=False):
    """Points that one line or arc stands for."""

    part: Floats
    shape: _Shape

    def rows(self, begin: Floats, end: Floats) -> Floats:
        """Its vertices (n, 3) between two places, that of the end last."""
        shape, bulge = self.shape, 0.0
        if shape.radius > 0.0:
            one, two = begin - shape.at, end - shape.at
            turn = math.atan2(one[0] * two[1] - one[1] * two[0], float(one @ two))
            turn += 2.0 * math.pi * round((shape.sweep - turn) / (2.0 * math.pi))
            bulge = math.tan(0.25 * turn) if turn * shape.sweep > 0.0 else 0.0
        return split_bulges(np.array([[*begin, bulge], [*end, 0.0]]), closed=False)

    def far(self, begin: Floats, end: Floats) -> float:
        """Return the largest distance of the points from the shape between these ends."""
        return float(furthest_off(np.ascontiguousarray(self.part), self.rows(begin, end)))

    def suits(self, begin: Floats, end: Floats, limit: float) -> bool:
        """True if the points lie within the limit of the shape, which runs in their direction."""
        if abs(self.shape.sweep) < 0.5 * math.pi:
            way = self.part[-1] - self.part[0]
            if float((end - begin) @ way) < 0.0:
                return False
        return self.far(begin, end) <= limit

    def segments(
        self, begin: Floats, end: Floats, limit: float
    ) -> tuple[list[list[float]], list[list[float]]]:
        """The rows without the end, none where that is the begin, and how far points are from
        each; those of its halves, at last its points, where they are too far."""
        if math.hypot(*(end - begin)) <= MIN_SEGMENT_PX:
            return [], []
        half = len(self.part) // 2
        if half == 0 or self.suits(begin, end, limit):
            rows, far = self.rows(begin, end)[:-1].tolist(), self.far(begin, end)
            return rows, [[far, min(self.shape.mean, far)]] * len(rows)
        middle = 0.5 * (self.part[half - 1] + self.part[half])
        made: list[list[float]] = []
        apart: list[list[float]] = []
        for part, low, high in (
            (self.part[:half], begin, middle),
            (self.part[half:], middle, end),
        ):
            run = _Run(part, _best(part, limit) or _line(part))
            rows, off = run.segments(low, high, limit)
            made, apart = made + rows, apart + off
        return made, apart
