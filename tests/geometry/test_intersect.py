"""Meetings of lines and arcs: tables, swapped roles, shapely on fine chords, brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from camtool.arrays import Floats
from camtool.geometry.boxes import box_pairs
from camtool.geometry.intersect import Crossings, crossings, meetings, self_crossings
from camtool.geometry.measure import Frames, point_at, segment_boxes
from camtool.geometry.polylines import Polyline, Segments
from tests.oracles.offset import chords, distance

QUARTER = math.tan(math.pi / 8)
EPS = 1e-6

Row = tuple[float, float, float, float, float]


def segment(row: Row) -> Segments:
    x0, y0, x1, y1, bulge = row
    return Segments.between(np.array([[x0, y0]]), np.array([[x1, y1]]), np.array([bulge]))


def path(row: Row) -> Polyline:
    x0, y0, x1, y1, bulge = row
    return Polyline(np.array([[x0, y0, bulge], [x1, y1, 0.0]]))


def meets(first: Row, second: Row) -> tuple[Crossings, Floats]:
    """The meetings of two segments, and the points where they cross."""
    rows = np.array([first, second])
    both = Segments.between(rows[:, :2], rows[:, 2:4], rows[:, 4])
    found, crosses = meetings(both, np.array([0]), np.array([1]))
    return found, found.point[crosses]


FLAT: Row = (0.0, 0.0, 10.0, 0.0, 0.0)
BELOW: Row = (0.0, 0.0, 10.0, 0.0, 1.0)  # half circle about (5, 0), below

LENS = math.sqrt(25.0 - (13.0 / 3.0) ** 2)  # circles of radius 5 and 3, centres 6 apart

# first, second, how many cross, points: the reason
CASES = [
    # line and line
    (FLAT, (5, -1, 5, 1, 0), 1, [(5, 0)]),  # plain crossing
    (FLAT, (5, 0, 5, 1, 0), 0, [(5, 0)]),  # an end on the other
    (FLAT, (10, 0, 12, 5, 0), 0, [(10, 0)]),  # two ends meet
    (FLAT, (5, 0.1, 5, 1, 0), 0, []),  # stops short
    (FLAT, (0, 1, 10, 1, 0), 0, []),  # parallel
    (FLAT, (11, 0, 20, 0, 0), 0, []),  # on one line, apart
    (FLAT, (10, 0, 20, 0, 0), 0, [(10, 0)]),  # on one line, end to end
    (FLAT, (3, 0, 20, 0, 0), 0, [(3, 0), (10, 0)]),  # partly the same
    (FLAT, (7, 0, 2, 0, 0), 0, [(2, 0), (7, 0)]),  # one in the other, opposite
    (FLAT, (0, 0, 10, 0, 0), 0, [(0, 0), (10, 0)]),  # the same
    (FLAT, (5, 0.5e-6, 5, 1, 0), 0, [(5, 0)]),  # within the tolerance of an end
    # line and arc
    (FLAT, (4, -0.5, 6, -0.5, -1), 2, [(5 - 0.75**0.5, 0), (5 + 0.75**0.5, 0)]),
    (FLAT, (4, 0, 6, 0, 1), 0, [(4, 0), (6, 0)]),  # both ends of the arc on the line
    (FLAT, (4, -1, 6, -1, -1), 0, [(5, 0)]),  # tangent
    (FLAT, (4, -1 + 1e-7, 6, -1 + 1e-7, -1), 0, [(5, 0)]),  # tangent but for 1e-7
    (FLAT, (4, -1 - 1e-7, 6, -1 - 1e-7, -1), 0, [(5, 0)]),  # short of it by 1e-7
    (FLAT, (4, -1.01, 6, -1.01, -1), 0, []),  # short of it
    (FLAT, (4, -0.5, 5, 0.5, -QUARTER), 1, [(5 - 0.75**0.5, 0)]),  # the arc ends before
    (FLAT, (10, 0, 12, 2, QUARTER), 0, [(10, 0)]),  # goes on smoothly
    # arc and arc
    (BELOW, (2, -6, 8, -6, -1), 2, [(5 - LENS, -13 / 3), (5 + LENS, -13 / 3)]),
    (BELOW, (2, -6, 5, -3, -QUARTER), 1, [(5 - LENS, -13 / 3)]),  # ends before
    (BELOW, (0, -4, 10, -4, 1), 0, []),  # their circles cross, they do not
    (BELOW, (2, -4, 8, -4, -1), 0, [(2, -4), (8, -4)]),  # both ends on the other
    (BELOW, (4, -7, 6, -7, -1), 0, []),  # apart
    (BELOW, (4, -6, 6, -6, -1), 0, [(5, -5)]),  # tangent from outside
    (BELOW, (4, -4, 6, -4, 1), 0, [(5, -5)]),  # tangent from inside
    (BELOW, (10, 0, 0, 0, 1), 0, [(0, 0), (10, 0)]),  # the other half of one circle
    (BELOW, (5, -5, 10, 0, QUARTER), 0, [(5, -5), (10, 0)]),  # partly the same
    (BELOW, (1, 0, 9, 0, 1), 0, []),  # same centre
]


@pytest.mark.parametrize(("first", "second", "count", "points"), CASES)
@pytest.mark.parametrize("swap", [False, True])
def test_cases(first: Row, second: Row, count: int, points: list[Row], swap: bool) -> None:
    rows = (second, first) if swap else (first, second)
    found, crossing = meets(*rows)
    assert len(crossing) == count
    assert bool(len(found)) == bool(points)
    # Curves that enter each other by 1e-7 meet twice, a little beside where they would touch.
    near = 2e-6 if len(found) == len(points) else 5e-4
    for point in found.point:
        assert min(math.dist(point, wanted) for wanted in points) < near
    for wanted in points:
        assert min(math.dist(point, wanted) for point in found.point) < near
    for row, t in zip(rows, (found.ta, found.tb), strict=True):
        there = point_at(segment(row), np.zeros(len(t), dtype=np.int64), t)
        assert np.allclose(there, found.point, rtol=0.0, atol=2e-6)


def test_tolerance_decides_whether_they_meet() -> None:
    a, b = segment(FLAT), segment((5.0, 0.001, 5.0, 1.0, 0.0))
    assert len(crossings(a, b)) == 0
    assert len(crossings(a, b, position_eps_mm=0.01)) == 1


def test_shallow_arcs_lose_no_digits() -> None:
    # A sagitta of 1e-5 mm on 100 mm: the centre is 125 km away.
    found, crossing = meets((0.0, 0.0, 100.0, 0.0, 2e-7), (25.0, -1.0, 25.0, 1.0, 0.0))
    assert len(crossing) == len(found) == 1
    assert crossing[0, 1] == pytest.approx(-0.75e-5, rel=1e-6)
    assert found.ta[0] == pytest.approx(0.25, abs=1e-12)


@pytest.mark.parametrize("bulge", [0.0, 1e-9, 0.3, -0.3, 1.0, -1.0])
def test_along_is_the_length(bulge: float) -> None:
    row = segment((3.0, 4.0, -2.0, 7.0, bulge))
    frames = Frames.of(row)
    for t in (1e-12, 0.0, 0.2, 0.5, 0.9, 1.0):
        point = point_at(row, np.array([0]), np.array([t]))
        assert frames.along(point)[0] == pytest.approx(t * frames.length[0], abs=1e-12)
    before = row.start - 0.01 * frames.tangent
    assert frames.along(before)[0] == pytest.approx(-0.01, abs=1e-4)
    after = row.end + 0.01 * frames.tangent_at(np.ones(1))
    assert frames.along(after)[0] == pytest.approx(frames.length[0] + 0.01, abs=1e-4)


def random_row(rng: np.random.Generator) -> Row:
    x0, y0, x1, y1 = rng.uniform(-5.0, 5.0, 4)
    bulge = rng.choice([0.0, rng.uniform(-1.0, 1.0), rng.choice([-1.0, 1.0])])
    return (float(x0), float(y0), float(x1), float(y1), float(bulge))


def test_random_pairs_against_shapely() -> None:
    rng = np.random.default_rng(1)
    judged = 0
    for _ in range(600):
        first, second = random_row(rng), random_row(rng)
        fine = [shapely.LineString(chords(path(row), 0.005)) for row in (first, second)]
        wanted = shapely.get_coordinates(fine[0].intersection(fine[1]))
        found = meets(first, second)[0].point
        assert (distance(found, path(first)) < EPS).all()
        assert (distance(found, path(second)) < EPS).all()
        if _is_close(first, second, fine):
            continue
        judged += 1
        assert len(found) == len(wanted)
        for point in found:
            assert np.hypot(*(wanted - point).T).min() < 1e-3
    assert judged > 400


def _is_close(first: Row, second: Row, fine: list[shapely.LineString]) -> bool:
    """True where chords cannot tell: an end near the other curve, or nearly tangent."""
    ends = [(first, second), (second, first)]
    if any(distance(np.reshape(a[:4], (2, 2)), path(b)).min() < 1e-3 for a, b in ends):
        return True
    moved = [shapely.affinity.translate(fine[0], dx, dy) for dx, dy in ((1e-3, 0), (0, 1e-3))]
    moved += [shapely.affinity.translate(fine[0], dx, dy) for dx, dy in ((-1e-3, 0), (0, -1e-3))]
    counts = {len(shapely.get_coordinates(each.intersection(fine[1]))) for each in moved}
    return len(counts) > 1


def random_segments(rng: np.random.Generator, count: int, size: float) -> Segments:
    start = rng.uniform(-10.0, 10.0, (count, 2))
    end = start + rng.uniform(-size, size, (count, 2))
    return Segments.between(start, end, rng.uniform(-1.0, 1.0, count) * (rng.random(count) < 0.7))


def as_rows(found: Crossings) -> Floats:
    table = np.column_stack([found.row_a, found.row_b, found.ta, found.tb, found.point])
    return table[np.lexsort(table.T[2::-1])]


@pytest.mark.parametrize("size", [4.0, 20.0])
def test_crossings_are_those_of_each_pair(size: float) -> None:
    rng = np.random.default_rng(2)
    a, b = random_segments(rng, 30, size), random_segments(rng, 25, size)
    each = []
    for i in range(len(a)):
        for j in range(len(b)):
            one = crossings(a[i : i + 1], b[j : j + 1])
            each += [[i, j, *row] for row in np.column_stack([one.ta, one.tb, one.point])]
    wanted = np.array(each)
    wanted = wanted[np.lexsort(wanted.T[2::-1])]
    assert np.allclose(as_rows(crossings(a, b)), wanted, rtol=0.0, atol=1e-12)
    assert len(wanted) > 5


@pytest.mark.parametrize("size", [0.5, 20.0])
def test_box_pairs_against_all_pairs(size: float) -> None:
    rng = np.random.default_rng(3)
    a = segment_boxes(random_segments(rng, 300, size))
    b = segment_boxes(random_segments(rng, 400, size))
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    wanted = set(zip(*np.nonzero((low <= high + 0.1).all(axis=2)), strict=True))
    found = [pair for i, j in box_pairs(a, b, reach_mm=0.1) for pair in zip(i, j, strict=True)]
    assert len(found) == len(set(found))
    assert set(found) == wanted


def test_no_segments_have_no_crossings() -> None:
    none = random_segments(np.random.default_rng(0), 0, 1.0)
    some = random_segments(np.random.default_rng(0), 5, 1.0)
    assert len(crossings(none, some)) == len(crossings(some, none)) == 0


def closed(*rows: tuple[float, float, float]) -> Segments:
    return Segments.of(Polyline(np.array(rows), closed=True))


def test_self_crossings_leave_out_shared_ends() -> None:
    assert len(self_crossings(closed((0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)))) == 0
    assert len(self_crossings(closed((0, 0, 1), (4, 0, 1)))) == 0
    bow = self_crossings(closed((0, 0, 0), (4, 4, 0), (4, 0, 0), (0, 4, 0)))
    assert len(bow) == 1
    assert bow.point[0] == pytest.approx((2.0, 2.0))


def test_self_crossings_find_a_touching_vertex_and_a_path_turning_back() -> None:
    touching = self_crossings(closed((0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 0, 0), (0, 4, 0)))
    assert touching.point == pytest.approx(np.array([[2.0, 0.0], [2.0, 0.0]]))
    back = Segments.of(Polyline(np.array([[0.0, 0, 0], [4, 0, 0], [1, 0, 0]])))
    assert self_crossings(back).point == pytest.approx(np.array([[1.0, 0.0]]))
