"""Distances against very many points, for every pair of kinds, and moved about."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry import distance as distances
from camtool.geometry.distance import approach, approaches, nearest, points_to_segments
from camtool.geometry.polylines import Polyline, Polylines, Segments, begin_at, reverse, rotate
from tests.oracles.geometry import dense_points, line_string, sagitta
from tests.paths import mirrored, moved, scaled
from tests.strategies import coordinates, examples, polylines

N = 64


def _line(*numbers: float) -> Polyline:
    return Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))


def _arc(x: float, y: float, radius: float, begin: float, sweep: float) -> Polyline:
    """Centre, radius, degrees."""
    first, last = math.radians(begin), math.radians(begin + sweep)
    bulge = math.tan(math.radians(sweep) / 4.0)
    return Polyline(
        np.array(
            [
                [x + radius * math.cos(first), y + radius * math.sin(first), bulge],
                [x + radius * math.cos(last), y + radius * math.sin(last), 0.0],
            ]
        )
    )


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), closed=True)


CASES = [
    # Points against half a circle about (0, 0) that lies above: centre, on it, beside, below.
    ((0.0, 0.0), _arc(0, 0, 2, 0, 180), 2.0),
    ((0.0, 2.0), _arc(0, 0, 2, 0, 180), 0.0),
    ((3.0, 4.0), _arc(0, 0, 2, 0, 180), 3.0),
    ((0.0, 1.5), _arc(0, 0, 2, 0, 180), 0.5),
    ((2.0, -1.0), _arc(0, 0, 2, 0, 180), 1.0),
    ((0.0, -1.0), _arc(0, 0, 2, 0, 180), math.sqrt(5.0)),
    # The nearest point of the whole circle is off a quarter: an end is nearest.
    ((-1.0, -1.0), _arc(0, 0, 1, 0, 90), math.sqrt(5.0)),
    ((0.0, 0.0), _line(1, -1, 1, 1), 1.0),
    ((0.0, 3.0), _line(1, -1, 1, 1), math.sqrt(5.0)),
    ((1.0, 0.5), _line(1, -1, 1, 1), 0.0),
]


@pytest.mark.parametrize(("point", "path", "wanted"), CASES)
def test_a_point_and_a_segment(point: tuple[float, float], path: Polyline, wanted: float) -> None:
    for each in (path, reverse(path)):
        distance = points_to_segments(np.array([point]), Segments.of(each))
        assert distance.shape == (1, 1)
        assert distance[0, 0] == pytest.approx(wanted, abs=1e-15)


@pytest.mark.parametrize("bulge", [1e-6, 1e-9, 1e-12, 1e-15])
def test_arcs_that_are_nearly_lines_lose_no_digits(bulge: float) -> None:
    path = Polyline(np.array([[0.0, 0, bulge], [10, 0, 0]]))
    # A positive bulge lies to the right of its chord: its middle is at y = −5·bulge.
    points = np.array([[5.0, 3.0], [5.0, -3.0], [-4.0, 3.0]])
    distance = points_to_segments(points, Segments.of(path))[:, 0]
    assert distance == pytest.approx([3.0 + 5.0 * bulge, 3.0 - 5.0 * bulge, 5.0], abs=1e-14)


@given(polylines(), st.lists(st.tuples(coordinates(), coordinates()), min_size=1, max_size=6))
def test_points_are_as_far_as_the_nearest_of_very_many(
    path: Polyline, points: list[tuple[float, float]]
) -> None:
    where = np.array(points)
    distance = points_to_segments(where, Segments.of(path)).min(axis=1)
    dense = dense_points(path, 256)
    brute = np.hypot(*(where[:, None, :] - dense).transpose(2, 0, 1)).min(axis=1)
    step = np.hypot(*np.diff(dense, axis=0).T).max()
    assert (distance <= brute + 1e-9).all()
    assert (brute - distance <= 0.5 * step + 1e-9).all()


@given(
    polylines(max_points=6),
    st.lists(st.tuples(coordinates(), coordinates()), max_size=40),
    st.integers(1, 50),
)
def test_the_nearest_segment_is_that_of_the_whole_table(
    path: Polyline, points: list[tuple[float, float]], chunk: int
) -> None:
    where = np.array(points).reshape(-1, 2)
    segments = Segments.of(path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(distances, "POINTS_AT_A_TIME", chunk)
        found = nearest(where, segments)
    table = points_to_segments(where, segments)
    assert found.distance.tolist() == table.min(axis=1).tolist()
    rows = np.arange(len(where))
    assert table[rows, found.segment].tolist() == found.distance.tolist()


@given(polylines(max_points=40), st.integers(0, 2**32 - 1))
def test_the_nearest_segment_is_the_first_of_those_that_are_as_near(
    path: Polyline, seed: int
) -> None:
    segments = Segments.of(path)
    again = segments[np.tile(np.arange(len(segments)), 2)]
    rng = np.random.default_rng(seed)
    ends = np.concatenate([segments.start, 0.5 * (segments.start + segments.end)])
    points = np.concatenate([ends, rng.uniform(-30.0, 30.0, (40, 2))])
    table = points_to_segments(points, again)
    found = nearest(points, again)
    assert found.segment.tolist() == table.argmin(axis=1).tolist()
    assert found.distance.tolist() == table.min(axis=1).tolist()


def test_no_segments_have_no_nearest_one() -> None:
    nothing = Segments.of(_line(0, 0, 1, 0))[np.array([], dtype=np.int64)]
    with pytest.raises(ValueError, match="no segments"):
        nearest(np.zeros((1, 2)), nothing)


def path_distance(a: Polyline, b: Polyline) -> float:
    return approach(a, b).distance


PAIRS = [
    # Lines: crossing, touching, side by side, end on.
    (_line(0, 0, 4, 4), _line(0, 4, 4, 0), 0.0),
    (_line(0, 0, 4, 0), _line(2, 0, 2, 5), 0.0),
    (_line(0, 0, 4, 0), _line(1, 2, 9, 2), 2.0),
    (_line(0, 0, 4, 0), _line(7, 4, 9, 8), 5.0),
    (_line(0, 0, 4, 0), _line(2, 0, 9, 0), 0.0),
    # Line and circle: beside, within, tangent, through.
    (_line(-9, 3, 9, 3), _circle(0, 0, 2), 1.0),
    (_line(-1, 0, 0.5, 0), _circle(0, 0, 2), 1.0),
    (_line(-9, 2, 9, 2), _circle(0, 0, 2), 0.0),
    (_line(-9, 1, 9, 1), _circle(0, 0, 2), 0.0),
    # The line would cross the circle, but below the half that is there.
    (_line(-9, -1, 9, -1), _arc(0, 0, 2, 0, 180), 1.0),
    # Circles: apart, one in the other, about one centre, touching without and within, crossing.
    (_circle(0, 0, 1), _circle(5, 0, 2), 2.0),
    (_circle(0, 0, 5), _circle(1, 0, 2), 2.0),
    (_circle(0, 0, 5), _circle(0, 0, 2), 3.0),
    (_circle(0, 0, 1), _circle(3, 0, 2), 0.0),
    (_circle(0, 0, 5), _circle(3, 0, 2), 0.0),
    (_circle(0, 0, 2), _circle(3, 0, 2), 0.0),
    (_circle(0, 0, 2), _circle(0, 0, 2), 0.0),
    # Arcs about one centre: over each other, and end to end.
    (_arc(0, 0, 3, 0, 90), _arc(0, 0, 2, 45, 90), 1.0),
    (_arc(0, 0, 3, 0, 90), _arc(0, 0, 3, 180, 90), 3.0 * math.sqrt(2.0)),
    # Arcs whose circles cross where neither runs: the nearest points lie within both.
    (_arc(0, 0, 3, 135, 90), _arc(4, 0, 3, -45, 90), 4.0 + 6.0 * math.cos(math.pi / 4.0)),
]


@pytest.mark.parametrize(("a", "b", "wanted"), PAIRS)
@pytest.mark.parametrize("turn", [0.0, 0.7, 2.5])
def test_two_paths(a: Polyline, b: Polyline, wanted: float, turn: float) -> None:
    one, other = rotate(a, turn), rotate(b, turn)
    for first in (one, reverse(one)):
        for second in (other, reverse(other)):
            assert path_distance(first, second) == pytest.approx(wanted, abs=1e-7)
            assert path_distance(second, first) == pytest.approx(wanted, abs=1e-7)


def test_paths_that_cross_are_exactly_0_apart() -> None:
    assert path_distance(_circle(0.1, 0.2, 2), _line(-9, 0.3, 9, 0.7)) == 0.0
    assert path_distance(_circle(0.1, 0.2, 2), _circle(1.7, 0.9, 2.2)) == 0.0
    assert path_distance(_line(0.1, 0, 3.3, 4), _line(3, 0.1, 0, 3.9)) == 0.0


def test_near_misses_are_no_crossings() -> None:
    assert path_distance(_circle(0, 0, 2), _line(-9, 2 + 1e-9, 9, 2 + 1e-9)) == pytest.approx(
        1e-9, rel=1e-5
    )
    assert path_distance(_circle(0, 0, 2), _circle(5 + 1e-9, 0, 3)) == pytest.approx(
        1e-9, rel=1e-5
    )


@given(polylines(max_points=5), polylines(max_points=5), coordinates(40.0))
def test_paths_are_as_far_as_very_many_of_their_points(
    a: Polyline, b: Polyline, apart: float
) -> None:
    other = moved(b, apart, 0.0)
    distance = path_distance(a, other)
    brute = line_string(a, N).distance(line_string(other, N))
    assert abs(distance - brute) <= sagitta(a, N) + sagitta(other, N) + 1e-9


@examples(30, 2000)
@given(polylines(max_points=5), polylines(max_points=5), st.floats(-3.0, 3.0), st.integers(0, 4))
def test_the_distance_of_paths_stays_when_both_are_moved_about(
    a: Polyline, b: Polyline, angle: float, start: int
) -> None:
    b = moved(b, 15.0, 0.0)
    wanted = path_distance(a, b)
    assert path_distance(b, a) == pytest.approx(wanted, abs=1e-9)
    assert path_distance(reverse(a), b) == pytest.approx(wanted, abs=1e-9)
    assert path_distance(rotate(a, angle), rotate(b, angle)) == pytest.approx(wanted, abs=1e-7)
    assert path_distance(mirrored(a), mirrored(b)) == pytest.approx(wanted, abs=1e-9)
    assert path_distance(scaled(a, 3.0), scaled(b, 3.0)) == pytest.approx(3 * wanted, abs=1e-7)
    if a.closed:
        assert path_distance(begin_at(a, start), b) == pytest.approx(wanted, abs=1e-12)


@examples(20, 2000)
@given(
    st.lists(polylines(max_points=24), min_size=1, max_size=5),
    coordinates(40.0),
    st.integers(1, 4),
)
def test_paths_measured_together_are_as_far_as_one_by_one(
    paths: list[Polyline], apart: float, at_a_time: int
) -> None:
    lines = Polylines.of(paths)
    others = Polylines.of([*paths, *(moved(path, apart, 5.0) for path in paths)])
    pairs = [(i, j) for i in range(len(lines)) for j in range(len(others))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(distances, "PATHS_AT_A_TIME", at_a_time)
        found = approaches(lines, others, pairs)
    assert found == [approach(lines[i], others[j]) for i, j in pairs]
    assert approaches(lines, others, []) == []


@given(polylines(max_points=6), polylines(max_points=6), coordinates(40.0))
def test_the_place_of_the_approach_lies_on_one_path(
    a: Polyline, b: Polyline, apart: float
) -> None:
    other = moved(b, apart, 5.0)
    near = approach(a, other)
    away = [
        points_to_segments(np.array([near.point]), Segments.of(path)).min() for path in (a, other)
    ]
    assert sorted(away) == pytest.approx([0.0, near.distance], abs=1e-6)


def test_many_segments_are_handled_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 61)[:-1]
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(60)])
    a, b = Polyline(ring, True), moved(Polyline(ring, True), 3.0, 0.0)
    wanted = path_distance(a, b)
    monkeypatch.setattr("camtool.geometry.boxes.PAIRS_AT_A_TIME", 1)
    assert path_distance(a, b) == wanted == pytest.approx(1.0)
