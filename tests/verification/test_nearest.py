"""Distances against dense sampling, and the search against comparing everything."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import point_at
from camtool.geometry.polylines import Segments
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.cuts import cut_moves, sample_cuts
from camtool.verification.matching import nearest_at_height
from camtool.verification.nearest import ANY_CONTOUR, Groups, MoveIndex, SegmentTable, run_offsets
from tests.oracles.dense_moves import cut, dense_distance

DENSE = 4000


def distance_each(points: np.ndarray, segments: Segments) -> np.ndarray:
    """From each point to the segment of the same row."""
    return SegmentTable(segments).distances(points, np.arange(len(points)))


def arc_or_line(
    start: tuple[float, float], way: tuple[float, float], bulge: float
) -> tuple[Segments, float]:
    begin = np.array([start])
    end = begin + np.array([way])
    segments = Segments.between(begin, end, np.array([bulge]))
    length = math.hypot(*way) * (1.0 + bulge * bulge) * (math.pi if bulge else 1.0)
    return segments, length


def cloud_of(segments: Segments) -> np.ndarray:
    """Dense points of one segment, by turning its start about its centre."""
    t = np.linspace(0.0, 1.0, DENSE + 1)[:, None]
    if not segments.is_arc[0]:
        return segments.start + t * (segments.end - segments.start)
    angle = segments.start_angle + t * segments.sweep
    ray = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    return segments.centre + segments.radius[:, None] * ray


coordinate = st.floats(-3.0, 3.0)
pair = st.tuples(coordinate, coordinate)


@given(pair, pair.filter(lambda d: math.hypot(*d) > 0.01), st.floats(-1, 1), pair)
def test_distance_is_that_of_dense_points(start, way, bulge, point) -> None:
    bulge = bulge if abs(bulge) > 1e-3 else 0.0
    segments, length = arc_or_line(start, way, bulge)
    found = float(distance_each(np.array([point]), segments)[0])
    dense = dense_distance(np.array(point), cloud_of(segments))
    assert found <= dense + 1e-9
    assert found >= dense - 0.5 * length / DENSE - 1e-9


@given(pair, pair.filter(lambda d: math.hypot(*d) > 0.01), st.floats(-1, 1), pair)
def test_the_share_is_that_of_the_nearest_place(start, way, bulge, point) -> None:
    bulge = bulge if abs(bulge) > 1e-3 else 0.0
    segments, _ = arc_or_line(start, way, bulge)
    table, points, which = SegmentTable(segments), np.array([point]), np.zeros(1, dtype=np.int64)
    share = table.shares(points, which)
    assert 0.0 <= share[0] <= 1.0
    place = point_at(segments, which, share)
    found = float(table.distances(points, which)[0])
    assert math.dist(place[0], point) == pytest.approx(found, abs=1e-7)


@pytest.mark.parametrize("bulge", [0.0, 0.3, -0.3, 1.0, -1.0, 1e-4])
def test_points_on_a_segment_have_no_distance(bulge: float) -> None:
    segments, _ = arc_or_line((1.0, 2.0), (0.5, -1.5), bulge)
    points = cloud_of(segments)
    many = segments[np.zeros(len(points), dtype=np.int64)]
    assert distance_each(points, many).max() < 1e-10


def test_the_centre_of_an_arc_is_a_radius_away() -> None:
    segments, _ = arc_or_line((1.0, 0.0), (-1.0, 1.0), math.tan(math.pi / 8))
    assert distance_each(segments.centre, segments)[0] == pytest.approx(1.0)


def drawn(seed: int) -> MoveIndex:
    """Some dozens of random strokes of lines and arcs, at two depths."""
    rng = np.random.default_rng(seed)
    b = ToolpathBuilder()
    for number in range(12):
        cut(b, *rng.uniform(0, 5, 2))
        if number % 3 == 0:
            b.line(z=-0.04, feed=1)
        for _ in range(3):
            x, y = rng.uniform(0, 5, 2)
            if rng.random() < 0.5:
                b.line(x, y, feed=1)
            else:
                here = b.position
                turn = rng.uniform(0.1, 6.2)
                cx, cy = here[0] + rng.uniform(-1, 1), here[1] + rng.uniform(-1, 1)
                arm = complex(here[0] - cx, here[1] - cy) * complex(math.cos(turn), math.sin(turn))
                b.arc(cx + arm.real, cy + arm.imag, centre=(cx, cy), ccw=True, feed=1)
        b.rapid(z=0.2)
    return MoveIndex(cut_moves(b.finish(), flat_cuts=False))


def grouped(count: int, margin: float, size: int = 7) -> Groups:
    offsets = run_offsets(np.zeros(count, dtype=np.int64), size)
    groups = len(offsets) - 1
    return Groups(
        offsets,
        np.full(groups, margin),
        np.full(groups, ANY_CONTOUR),
        np.tile([-np.inf, np.inf], (groups, 1)),
    )


def everything(target: MoveIndex, points: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Distances (P,) by comparing each point with each allowed segment."""
    segments = target.cuts.segments[np.flatnonzero(allowed)]
    best = np.full(len(points), np.inf)
    for index in range(len(segments)):
        same = segments[np.full(len(points), index)]
        best = np.minimum(best, distance_each(points, same))
    return best


@pytest.mark.parametrize("margin", [0.0, 1e-3, 0.3, 100.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_search_finds_the_nearest_whatever_the_margin(seed: int, margin: float) -> None:
    target = drawn(seed)
    points = np.random.default_rng(seed + 100).uniform(-1, 6, (200, 2))
    found = target.nearest(points, grouped(len(points), margin))
    exact = everything(target, points, np.ones(len(target.contour), dtype=bool))
    assert np.allclose(found.distance, exact, rtol=0, atol=1e-12)
    named = target.cuts.segments[found.segment]
    assert np.allclose(distance_each(points, named), found.distance, rtol=0, atol=1e-9)


def test_the_search_can_be_kept_to_a_contour_and_to_a_height() -> None:
    target = drawn(1)
    points = np.random.default_rng(5).uniform(0, 5, (60, 2))
    groups = grouped(len(points), 0.1, 10)
    one = Groups(groups.offsets, groups.margin, np.arange(6), groups.z)
    found = target.nearest(points, one)
    for group in range(6):
        here = slice(10 * group, 10 * group + 10)
        exact = everything(target, points[here], target.contour == group)
        assert np.allclose(found.distance[here], exact, rtol=0, atol=1e-12)
    deep = Groups(groups.offsets, groups.margin, groups.contour, np.tile([-0.05, -0.03], (6, 1)))
    exact = everything(target, points, target.cuts.z[:, 0] < -0.03)
    assert np.allclose(target.nearest(points, deep).distance, exact, rtol=0, atol=1e-12)


def test_on_a_chosen_contour_only_what_is_near_is_found() -> None:
    target, limit = drawn(1), 0.3
    samples = sample_cuts(target.cuts, 0.2)
    choice = (target.contour[samples.segment] + 1) % target.cuts.contour_count
    found, wrong_depth = nearest_at_height(samples, choice, target, (limit, 0.01))
    for contour in range(target.cuts.contour_count):
        here = choice == contour
        exact = everything(target, samples.points[here], target.contour == contour)
        assert (np.isfinite(found.distance[here]) == (exact <= limit)).all()
    assert (found.segment[np.isinf(found.distance)] == -1).all()
    assert wrong_depth.any()
    assert not wrong_depth[np.isinf(found.distance)].any()


def test_where_nothing_may_be_compared_the_distance_is_infinite() -> None:
    target = drawn(2)
    groups = grouped(10, 0.1, 10)
    high = Groups(groups.offsets, groups.margin, groups.contour, np.array([[0.5, 0.6]]))
    found = target.nearest(np.zeros((10, 2)), high)
    assert np.isinf(found.distance).all()
    assert (found.segment == -1).all()
    none = MoveIndex(cut_moves(ToolpathBuilder().finish(), flat_cuts=True))
    assert np.isinf(none.nearest(np.zeros((10, 2)), groups).distance).all()


@pytest.mark.parametrize("size", [1, 16])
def test_the_search_among_long_moves_that_all_cross(size: int) -> None:
    rng = np.random.default_rng(8)
    path = ToolpathBuilder()
    for x, y, to_x, to_y in rng.uniform(0.0, 50.0, (150, 4)):
        path.rapid(x=x, y=y, z=1.0).line(z=-1.0, feed=100.0).line(to_x, to_y, feed=100.0)
        path.rapid(z=1.0)
    target = MoveIndex(cut_moves(path.finish(), flat_cuts=False))
    points = rng.uniform(0.0, 50.0, (400, 2))
    found = target.nearest(points, grouped(len(points), 1e-3, size))
    allowed = np.ones(len(target.boxes), dtype=np.bool_)
    np.testing.assert_allclose(found.distance, everything(target, points, allowed), atol=1e-12)
