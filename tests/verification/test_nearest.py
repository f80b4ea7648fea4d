"""Distances against dense sampling, and the search against comparing everything."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import point_at
from camtool.geometry.polylines import Segments
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.cuts import CutMoves, cut_moves, sample_cuts
from camtool.verification.matching import nearest_at_height
from camtool.verification.nearest import ANY_CONTOUR, MoveIndex
from tests.oracles.dense_moves import cut, dense_distance
from tests.oracles.near_points import near_moves, nearest

pytestmark = pytest.mark.checked

DENSE = 4000


def index_of(segments: Segments, z: np.ndarray | None = None) -> MoveIndex:
    """The segments as moves of one row each, every one a contour of its own; the rows between
    them change the height."""
    rows = np.arange(2 * len(segments))
    path = ToolpathBuilder()
    for begin, end in np.full((len(segments), 2), -1.0) if z is None else z:
        path.rapid(z=begin).rapid(z=end)
    first = np.arange(len(rows) + 1) // 2
    contour = np.where(rows % 2, rows // 2, -1)
    return MoveIndex(CutMoves(path.finish(), segments, rows[1::2], first, contour))


def distance_of(point: tuple[float, float], segments: Segments) -> float:
    """From a point to the nearest of the segments."""
    found = index_of(segments).nearest_of_all(np.array([point]), np.array([-1.0]), 1e-3)
    return float(found.distance[0])


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
    found = distance_of(point, segments)
    dense = dense_distance(np.array(point), cloud_of(segments))
    assert found <= dense + 1e-9
    assert found >= dense - 0.5 * length / DENSE - 1e-9


@given(pair, pair.filter(lambda d: math.hypot(*d) > 0.01), st.floats(-1, 1), pair)
def test_the_share_is_that_of_the_nearest_place(start, way, bulge, point) -> None:
    bulge = bulge if abs(bulge) > 1e-3 else 0.0
    segments, _ = arc_or_line(start, way, bulge)
    points, which = np.array([point]), np.zeros(1, dtype=np.int64)
    share = index_of(segments).shares(points, which)
    assert 0.0 <= share[0] <= 1.0
    place = point_at(segments, which, share)
    found = distance_of(point, segments)
    assert math.dist(place[0], point) == pytest.approx(found, abs=1e-7)


@pytest.mark.parametrize("bulge", [0.0, 0.3, -0.3, 1.0, -1.0, 1e-4])
def test_points_on_a_segment_have_no_distance(bulge: float) -> None:
    segments, _ = arc_or_line((1.0, 2.0), (0.5, -1.5), bulge)
    points = cloud_of(segments)
    found = index_of(segments).nearest_of_all(points, np.full(len(points), -1.0), 1e-3)
    assert found.distance.max() < 1e-10


def test_the_centre_of_an_arc_is_a_radius_away() -> None:
    segments, _ = arc_or_line((1.0, 0.0), (-1.0, 1.0), math.tan(math.pi / 8))
    assert distance_of(tuple(segments.centre[0]), segments) == pytest.approx(1.0)


def drawn(seed: int) -> MoveIndex:
    """Draw dozens of random strokes of lines and arcs, at two depths."""
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


def places_about(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points about the strokes, half of them at a depth of these."""
    rng = np.random.default_rng(seed + 100)
    heights = np.where(rng.random(count) < 0.5, -0.04, rng.uniform(-0.06, 0.02, count))
    return rng.uniform(-1, 6, (count, 2)), heights


@pytest.mark.parametrize("limit", [0.0, 1e-3, 0.3, 100.0])
@pytest.mark.parametrize("seed", range(4))
def test_the_search_finds_what_a_plain_loop_finds(seed: int, limit: float) -> None:
    target = drawn(seed)
    points, heights = places_about(seed, 120)
    for window in (0.0, 0.01, math.inf):
        limits = limit, window
        found = target.nearest(points, heights, None, limits)
        point, move, distance = target.pairs_within(points, heights, limits)
        listed = []
        for k in range(len(points)):
            near = near_moves(target.cuts, points[k], heights[k], limits)
            least, segment = nearest(near)
            assert found.distance[k] == pytest.approx(least, abs=1e-12)
            assert found.segment[k] == segment
            listed += [(k, which, away) for which, away in near]
        assert list(zip(point.tolist(), move.tolist(), strict=True)) == [p[:2] for p in listed]
        assert distance == pytest.approx(np.array([p[2] for p in listed]), abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_without_a_limit_the_nearest_of_all_is_found(seed: int) -> None:
    target = drawn(seed)
    points, heights = places_about(seed, 120)
    for start in (1e-3, 1.0, 50.0):
        found = target.nearest_of_all(points, heights, start)
        for k in range(len(points)):
            every = near_moves(target.cuts, points[k], heights[k], (math.inf, math.inf))
            least, segment = nearest(every)
            assert found.distance[k] == pytest.approx(least, abs=1e-12)
            assert found.segment[k] == segment


def test_the_search_can_be_kept_to_a_contour() -> None:
    target, limits = drawn(1), (2.0, math.inf)
    points, heights = places_about(5, 60)
    choice = np.repeat([3, ANY_CONTOUR, 0, 11, 4, 5], 10)
    found = target.nearest(points, heights, choice, limits)
    for k in range(60):
        near = near_moves(target.cuts, points[k], heights[k], limits)
        allowed = [p for p in near if choice[k] in (ANY_CONTOUR, target.contour_of(p[0]))]
        least, segment = nearest(allowed)
        assert found.distance[k] == pytest.approx(least, abs=1e-12)
        assert found.segment[k] == segment


def test_on_a_chosen_contour_only_what_is_near_is_found() -> None:
    target, limit = drawn(1), 0.3
    samples = sample_cuts(target.cuts, 0.2)
    choice = (target.contour_of(samples.segment) + 1) % target.cuts.contour_count
    found, wrong_depth = nearest_at_height(samples, choice, target, (limit, 0.01))
    for contour in range(target.cuts.contour_count):
        here = choice == contour
        exact = [
            any(
                target.contour_of(np.array([k]))[0] == contour
                for k, _ in near_moves(target.cuts, point, 0.0, (limit, math.inf))
            )
            for point in samples.points[here]
        ]
        assert np.isfinite(found.distance[here]).tolist() == exact
    assert (found.segment[np.isinf(found.distance)] == -1).all()
    assert wrong_depth.any()
    assert not wrong_depth[np.isinf(found.distance)].any()


def test_where_nothing_may_be_compared_the_distance_is_infinite() -> None:
    points, heights = np.zeros((10, 2)), np.full(10, 0.5)
    none = MoveIndex(cut_moves(ToolpathBuilder().finish(), flat_cuts=True))
    for found in (
        drawn(2).nearest(points, heights, None, (100.0, 0.1)),
        none.nearest(points, heights, None, (100.0, 0.1)),
        none.nearest_of_all(points, heights, 0.1),
    ):
        assert np.isinf(found.distance).all()
        assert (found.segment == -1).all()
    assert none.pairs_within(points, heights, (1.0, 1.0))[0].tolist() == []


def crossing(rng: np.random.Generator, count: int) -> tuple[Segments, np.ndarray]:
    """Lines and arcs between random places of a plate of 50 mm, at twenty heights, every tenth
    sloping: everything crosses everything."""
    ends = rng.uniform(0.0, 50.0, (2, count, 2))
    bulge = np.where(rng.random(count) < 0.5, 0.0, rng.uniform(-1.0, 1.0, count))
    z = np.repeat(rng.integers(0, 20, (count, 1)).astype(float), 2, axis=1)
    z[::10, 1] += rng.uniform(0.0, 5.0, len(z[::10]))
    return Segments.between(ends[0], ends[1], bulge, np.arange(count)), z


@given(st.integers(0, 1000), st.integers(1, 90), st.sampled_from([1e-9, 0.05, 2.0, 20.0]))
def test_the_search_among_long_moves_that_all_cross(seed: int, count: int, limit: float) -> None:
    """Whatever the order of the points, and wherever the part lies."""
    rng = np.random.default_rng(seed)
    segments, z = crossing(rng, count)
    target = index_of(segments, z)
    which = rng.integers(0, count, 40)
    points = point_at(segments, which, rng.random(40)) + rng.normal(0.0, 0.02, (40, 2))
    points[rng.integers(0, 40, 5)] = points[0]
    heights = z[which, 0] + rng.normal(0.0, 0.1, 40)
    found = target.nearest(points, heights, None, (limit, 0.3))
    for k in range(40):
        near = near_moves(target.cuts, points[k], heights[k], (limit, 0.3))
        least, segment = nearest(near)
        assert found.distance[k] == pytest.approx(least, abs=1e-9)
        assert found.segment[k] == segment
    order = rng.permutation(40)
    again = target.nearest(points[order], heights[order], None, (limit, 0.3))
    assert np.array_equal(again.distance, found.distance[order])
    assert np.array_equal(again.segment, found.segment[order])
    away = np.array([-64.0, 128.0])
    elsewhere = Segments.between(segments.start + away, segments.end + away, segments.bulge)
    moved = index_of(elsewhere, z).nearest(points + away, heights, None, (limit, 0.3))
    assert moved.distance == pytest.approx(found.distance, abs=1e-9)
