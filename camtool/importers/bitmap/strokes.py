"""Points along the stairs of pixels as few lines and arcs, within a limit of all of them.

    points ──greedy──▶ runs, each within the limit of one line or circle (least squares)
           ──ends of neighbours moved to where both leave the least──▶ runs
           ──vertices where neighbours meet──▶ lines and arcs, measured against the points

Least squares over a run averages the stairs out: a straight edge of a drawing comes back straight,
wherever its stairs lie. Two lines, or arcs, meet where they cross, which restores corners that
pixels have cut. Where what comes out is beyond the limit somewhere, a run is divided, at last into
its points.
Nothing here is random, and nothing depends on where the picture lies."""

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
"""Runs are searched within this share of the limit, since moving their ends uses up some of the
rest."""

FLAT_SHARE = 0.35
"""An arc that leaves its chord by less than this part of the limit is a line."""

AS_GOOD = 1.25
"""A line is preferred to an arc if its rms distance is at most this many times that of the arc,
plus `AS_GOOD_PX`."""

AS_GOOD_PX = 0.02
"""See `AS_GOOD`."""

MAX_SWEEP_RAD = 1.5 * math.pi

BACK_PX = 1.5
"""Points may run backwards along their line or arc by at most this, pixels."""

AREA_SHARE = 0.1
"""The area of a contour may differ by at most this share from that which its points enclose."""

HALVINGS = 5
"""The limit is halved at most this many times for a contour whose area differs by more."""

MOVES_BACK, MOVES_ON = 6, 2
"""How many points before and after the end of a greedy run are tried as its end."""

MEETINGS = 24
"""Rounds in which a point is projected onto both neighbours in turn; it converges to the point
where they meet."""

MEETING_PX = 0.35
"""A corner may lie this much beyond the limit from the points that it joins: pixels cut it."""

CORNER_POINTS = 4
"""The sharpest corner is where the path turns most within so many points to either side."""

MIN_SEGMENT_PX = 0.05

MIN_RUN_POINTS = 3
"""Runs have at least this many points where there are so many."""


class _Shape(Struct, frozen=True, eq=False):
    """A line through `place` along the unit vector `direction`, or an arc about `place` with a
    `radius`, which turns by `sweep` (rad, CCW positive); its largest and mean (rms) distance from
    its points."""

    place: Floats
    direction: Floats
    radius: float
    sweep: float
    largest: float
    mean: float

    def nearest(self, place: Floats) -> Floats:
        """Return the point of the line or circle that is nearest to `place`."""
        arm = place - self.place
        if self.radius == 0.0:
            return self.place + float(arm @ self.direction) * self.direction
        return self.place + arm * (self.radius / (math.hypot(*arm) or 1.0))

    def squares(self, points: Floats) -> Floats:
        """Return the squared distances (n,) of points (n, 2) from the line or circle."""
        x, y = (points - self.place).T
        if self.radius > 0.0:
            return np.asarray((np.hypot(x, y) - self.radius) ** 2)
        if not self.direction.any():
            return np.asarray(x * x + y * y)
        return np.asarray((x * self.direction[1] - y * self.direction[0]) ** 2)


class PixelStrokes(Struct, frozen=True, eq=False):
    """Lines and arcs that stand for points.

    `vertices` (n, 3) x, y, bulge; of an open path the last one is its end. `off` (n, 2): the
    largest and the rms distance of the points from the segment that leaves each vertex."""

    vertices: Floats
    off: Floats


def strokes(points: Floats, limit: float, *, closed: bool) -> PixelStrokes:
    """Return lines and arcs within `limit` pixels of the points (n, 2).

    An open path keeps its ends, a closed one its area to a share of AREA_SHARE: for thin shapes
    the limit is halved until it does."""
    if not closed:
        return _chain_of_shapes(points, _runs(points, limit), limit, closed=False)
    circle = _circle(points)
    if circle is not None and circle.off[0, 0] <= limit:
        return circle
    ring, area = np.roll(points, -_sharpest(points), axis=0), enclosed_area(points)
    for _ in range(HALVINGS):
        chain = _chain_of_shapes(
            *_begin_at_best_division(ring, _runs(ring, limit), limit), limit, closed=True
        )
        if len(chain.vertices) > 1:
            chain_area = signed_area(Polyline(chain.vertices, closed=True))
            if abs(chain_area - area) <= AREA_SHARE * abs(area):
                return chain
        limit *= 0.5
    return PixelStrokes(np.column_stack([ring, np.zeros(len(ring))]), np.zeros((len(ring), 2)))


def _begin_at_best_division(
    ring: Floats, ends: list[int], limit: float
) -> tuple[Floats, list[int]]:
    """Return a closed path and its runs, rotated so that it begins where the squared distances
    from its last and first run are least."""
    if len(ends) < 3:
        return ring, [0, len(ring) // 2, len(ring)]
    before, after = len(ring) - ends[-2], ends[1]
    joined = np.concatenate([ring[ends[-2] :], ring[: ends[1]]])
    shift = _division_index(joined, before, limit) - before
    shift = min(max(shift, 1 - before), after - 1)
    inner = [end - shift for end in ends[1:-1]]
    return np.roll(ring, -shift, axis=0), [0, *inner, len(ring)]


def _sharpest(points: Floats) -> int:
    """Return the index of the point at which a closed path turns most."""
    arm = max(min(CORNER_POINTS, len(points) // 4), 1)
    before, after = (points - np.roll(points, arm * k, axis=0) for k in (1, -1))
    lengths = np.hypot(*before.T) * np.hypot(*after.T)
    straight = -(before * after).sum(axis=1) / np.where(lengths > 0.0, lengths, 1.0)
    return int(straight.argmin())


def _circle(points: Floats) -> PixelStrokes | None:
    """Return the circle through all points, as two half circles, with its distances from them;
    None for points on a line."""
    circle = _centre(points)
    if circle is None:
        return None
    centre, radius = circle
    deviations = np.abs(np.hypot(*(points - centre).T) - radius)
    turn = 1.0 if enclosed_area(points) > 0.0 else -1.0
    vertices = np.array([[radius, 0.0, turn], [-radius, 0.0, turn]])
    vertices[:, :2] += centre
    return PixelStrokes(
        vertices, np.tile([deviations.max(), math.sqrt((deviations**2).mean())], (2, 1))
    )


def _centre(points: Floats) -> tuple[Floats, float] | None:
    """Return centre and radius of the circle that fits the points best by least squares (Kåsa's
    method); None for points on a line."""
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
    """Return the line that fits the points best by least squares, in their direction."""
    middle = points.sum(axis=0) / len(points)
    if len(points) == 1:
        return _Shape(middle, np.zeros(2), 0.0, 0.0, 0.0, 0.0)
    x, y = (points - middle).T
    angle = 0.5 * math.atan2(2.0 * float(x @ y), float(x @ x) - float(y @ y))
    direction = np.array([math.cos(angle), math.sin(angle)])
    if float((points[-1] - points[0]) @ direction) < 0.0:
        direction = -direction
    deviations = x * direction[1] - y * direction[0]
    return _Shape(
        middle,
        direction,
        0.0,
        0.0,
        float(np.abs(deviations).max()),
        math.sqrt(float(deviations @ deviations) / len(deviations)),
    )


def _arc(points: Floats) -> _Shape | None:
    """Return the arc that fits the points best by least squares; None if they do not run along
    one."""
    circle = _centre(points) if len(points) > MIN_RUN_POINTS else None
    if circle is None:
        return None
    centre, radius = circle
    arms = points - centre
    angles = np.arctan2(arms[:, 1], arms[:, 0])
    turns = angles[1:] - angles[:-1]
    turns = np.mod(turns + math.pi, 2.0 * math.pi) - math.pi
    along = np.concatenate([[0.0], np.cumsum(turns)])
    sweep = float(along[-1])
    progress = along if sweep >= 0.0 else -along
    backtrack = float((np.maximum.accumulate(progress) - progress).max()) * radius
    if abs(sweep) > MAX_SWEEP_RAD or backtrack > BACK_PX:
        return None
    deviations = np.hypot(*arms.T) - radius
    mean = math.sqrt(float(deviations @ deviations) / len(deviations))
    return _Shape(centre, np.zeros(2), radius, sweep, float(np.abs(deviations).max()), mean)


def _best(points: Floats, limit: float) -> _Shape | None:
    """Return the line that fits the points within `limit`, else the arc that does, else None.

    An arc is preferred where it fits clearly better and is not nearly straight."""
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
    """Return True if the points turn back along the line by more than BACK_PX."""
    along = points @ line.direction
    return bool((np.maximum.accumulate(along) - along).max() > BACK_PX)


def _runs(points: Floats, limit: float) -> list[int]:
    """Return the indices at which runs begin, and the number of points at the end.

    A run is as long as one line or arc can follow; then the division between neighbours moves to
    where the squared distances from both are least."""
    tolerance, ends = SEARCH_SHARE * limit, [0]
    while ends[-1] < len(points):
        ends.append(_reach(points, ends[-1], tolerance))
    for k in range(1, len(ends) - 1):
        low, high = ends[k - 1], ends[k + 1]
        ends[k] = low + _division_index(points[low:high], ends[k] - low, tolerance)
    return ends


def _division_index(points: Floats, index: int, limit: float) -> int:
    """Return the index near `index` at which to divide the points into two runs, so that the sum
    of squares of the distances from their shapes is least."""
    one, other = (_best(part, limit) or _line(part) for part in (points[:index], points[index:]))
    low, high = max(index - MOVES_BACK, 1), min(index + MOVES_ON, len(points) - 1)
    moving_points = points[low:high]
    first, second = (shape.squares(moving_points) for shape in (one, other))
    prices = np.append(0.0, np.cumsum(first)) + np.append(np.cumsum(second[::-1])[::-1], 0.0)
    best = low + int(prices.argmin())
    fit = all(_best(part, limit) is not None for part in (points[:best], points[best:]))
    return best if fit else index


def _reach(points: Floats, first: int, limit: float) -> int:
    """Return the end of the longest run from `first` on that one line or arc follows within
    `limit`, found by doubling and then bisection."""
    last = len(points)
    reached, step = min(first + MIN_RUN_POINTS, last), MIN_RUN_POINTS
    too_long = last + 1
    while reached < last:
        end = min(reached + step, last)
        if _best(points[first:end], limit) is None:
            too_long = end
            break
        reached, step = end, 2 * step
    while too_long - reached > 1 and too_long <= last:
        middle = (reached + too_long) // 2
        if _best(points[first:middle], limit) is None:
            too_long = middle
        else:
            reached = middle
    return reached


def _chain_of_shapes(
    points: Floats, ends: list[int], limit: float, *, closed: bool
) -> PixelStrokes:
    """Return the chain of the lines and arcs of these runs, which meet where neighbours intersect.

    Where a shape does not follow its points between these intersections, it begins and ends at the
    points between the runs instead."""
    runs = [
        _Run(part := points[low:high], _best(part, limit) or _line(part))
        for low, high in pairwise(ends)
    ]
    fixed_ends = [0.5 * (points[end - 1] + points[end % len(points)]) for end in ends]
    if not closed:
        fixed_ends[0], fixed_ends[-1] = points[0], points[-1]
    places = list(fixed_ends)
    for k in range(0 if closed else 1, len(runs)):
        places[k] = _meeting_point(runs[k - 1].shape, runs[k].shape, fixed_ends[k], limit)
    if closed:
        places[-1] = places[0]
    waiting = list(range(len(runs)))
    while waiting:
        k = waiting.pop()
        if runs[k].suits(places[k], places[k + 1], limit):
            continue
        for end in (k, k + 1):
            if places[end] is fixed_ends[end]:
                continue
            joints = {end, *((0, len(runs)) if closed and end in (0, len(runs)) else ())}
            for each in joints:
                places[each] = fixed_ends[each]
            waiting += [(end - 1) % len(runs), end % len(runs)]
    rows: list[list[float]] = []
    errors: list[list[float]] = []
    for run, (begin, end) in zip(runs, pairwise(places), strict=True):
        part_rows, part_errors = run.segments(begin, end, limit)
        rows += part_rows
        errors += part_errors
    if not closed:
        rows.append([*places[-1], 0.0])
        errors.append([0.0, 0.0])
    return PixelStrokes(np.array(rows), np.array(errors))


def _meeting_point(one: _Shape, other: _Shape, place: Floats, limit: float) -> Floats:
    """Return the point near `place` where two neighbouring shapes meet, or come nearest; at most
    `limit` + MEETING_PX from `place`."""
    meeting = place
    for _ in range(MEETINGS):
        meeting = other.nearest(one.nearest(meeting))
    step = 0.5 * (one.nearest(meeting) + other.nearest(meeting)) - place
    distance = math.hypot(*step)
    return np.asarray(place + step * min((limit + MEETING_PX) / (distance or 1.0), 1.0))


class _Run(Struct, frozen=True, eq=False):
    """Successive points, `part` (n, 2), and the one line or arc that stands for them."""

    part: Floats
    shape: _Shape

    def rows(self, begin: Floats, end: Floats) -> Floats:
        """Return vertices (n, 3) of the shape between two points, the end included."""
        shape, bulge = self.shape, 0.0
        if shape.radius > 0.0:
            one, last = begin - shape.place, end - shape.place
            turn = math.atan2(one[0] * last[1] - one[1] * last[0], float(one @ last))
            turn += 2.0 * math.pi * round((shape.sweep - turn) / (2.0 * math.pi))
            bulge = math.tan(0.25 * turn) if turn * shape.sweep > 0.0 else 0.0
        return split_bulges(np.array([[*begin, bulge], [*end, 0.0]]), closed=False)

    def far(self, begin: Floats, end: Floats) -> float:
        """Return the largest distance, pixels, of the points from the shape between these ends."""
        return float(furthest_off(np.ascontiguousarray(self.part), self.rows(begin, end)))

    def suits(self, begin: Floats, end: Floats, limit: float) -> bool:
        """Return True if all points lie within `limit` of the shape between these ends, and it
        runs in their direction."""
        if abs(self.shape.sweep) < 0.5 * math.pi:
            chord = self.part[-1] - self.part[0]
            if float((end - begin) @ chord) < 0.0:
                return False
        return self.far(begin, end) <= limit

    def segments(
        self, begin: Floats, end: Floats, limit: float
    ) -> tuple[list[list[float]], list[list[float]]]:
        """Return the vertices between these ends, without the end, and for each its largest and
        rms distance from the points.

        Where the shape is too far from its points the run is halved, if need be down to single
        points. A segment shorter than MIN_SEGMENT_PX gives no vertex."""
        if math.hypot(*(end - begin)) <= MIN_SEGMENT_PX:
            return [], []
        half = len(self.part) // 2
        if half == 0 or self.suits(begin, end, limit):
            rows, error = self.rows(begin, end)[:-1].tolist(), self.far(begin, end)
            return rows, [[error, min(self.shape.mean, error)]] * len(rows)
        middle = 0.5 * (self.part[half - 1] + self.part[half])
        all_rows: list[list[float]] = []
        all_errors: list[list[float]] = []
        for part, low, high in (
            (self.part[:half], begin, middle),
            (self.part[half:], middle, end),
        ):
            run = _Run(part, _best(part, limit) or _line(part))
            rows, errors = run.segments(low, high, limit)
            all_rows, all_errors = all_rows + rows, all_errors + errors
        return all_rows, all_errors
