"""What is checked when a polyline is made, and the working form of its segments."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.polylines import (
    BULGE_EPS,
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    begin_at,
    reverse,
    rotate,
    without_repeats,
)
from tests.oracles.geometry import dense_points
from tests.paths import mirrored, moved, scaled
from tests.strategies import polylines

TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.5], [4.0, 3.0, 0.0]])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_numbers_that_are_not_finite_are_refused(bad: float, column: int) -> None:
    vertices = TRIANGLE.copy()
    vertices[1, column] = bad
    with pytest.raises(GeometryError, match="not finite") as caught:
        Polyline(vertices, closed=True)
    assert caught.value.where == "path 0, vertex 1"


@pytest.mark.parametrize("bulge", [1.0 + 1e-9, -1.5, 2.0])
def test_more_than_half_a_circle_is_refused(bulge: float) -> None:
    with pytest.raises(GeometryError, match="split the arc"):
        Polyline(np.array([[0.0, 0.0, bulge], [1.0, 0.0, 0.0]]))


def test_half_a_circle_may_exceed_by_rounding_and_is_then_set_right() -> None:
    path = Polyline(np.array([[0.0, 0.0, -1.0 - 0.5 * BULGE_EPS], [1.0, 0.0, 0.0]]))
    assert path.vertices[0, 2] == -1.0


@pytest.mark.parametrize("closed", [False, True])
def test_repeated_points_are_refused(closed: bool) -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0.5 * POSITION_EPS_MM, 0], [2, 1, 0]])
    with pytest.raises(GeometryError, match="repeated") as caught:
        Polyline(vertices, closed)
    assert caught.value.where == "path 0, vertex 1"


def test_the_last_point_of_a_closed_path_may_not_repeat_the_first() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]])
    assert len(Polyline(vertices, closed=False)) == 3
    with pytest.raises(GeometryError, match="repeated") as caught:
        Polyline(vertices, closed=True)
    assert caught.value.where == "path 0, vertex 3"


def test_points_a_little_more_than_the_limit_apart_are_kept() -> None:
    assert len(Polyline(np.array([[0.0, 0, 0], [1.01 * POSITION_EPS_MM, 0, 0]]))) == 1


def test_faults_name_path_and_vertex_of_that_path() -> None:
    good = Polyline(TRIANGLE)
    vertices = np.concatenate([good.vertices, TRIANGLE])
    vertices[4, 0] = math.nan
    with pytest.raises(GeometryError) as caught:
        Polylines(vertices, np.array([0, 3, 6]), np.array([False, True]))
    assert caught.value.where == "path 1, vertex 1"


@pytest.mark.parametrize(
    ("offsets", "closed"),
    [
        ([0, 2], [True]),  # a vertex is left over
        ([1, 3], [True]),  # begins late
        ([0, 3], [True, False]),  # one path too few
        ([0, 2, 4], [True, False]),  # reaches beyond the vertices
    ],
)
def test_offsets_that_do_not_fit_are_refused(offsets: list[int], closed: list[bool]) -> None:
    with pytest.raises(GeometryError, match="offsets"):
        Polylines(TRIANGLE, np.array(offsets), np.array(closed))


@pytest.mark.parametrize("offsets", [[0, 1, 3], [0, 3, 3], [0, 4, 3]])
def test_a_path_needs_two_points(offsets: list[int]) -> None:
    with pytest.raises(GeometryError, match="two points"):
        Polylines(TRIANGLE, np.array(offsets), np.array([False, False]))


@pytest.mark.parametrize("shape", [(3,), (3, 2), (2, 3, 1)])
def test_vertices_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(GeometryError, match="shape"):
        Polyline(np.zeros(shape))


def test_arrays_are_read_only_copies() -> None:
    mine = TRIANGLE.copy()
    paths = Polylines.of([Polyline(mine, closed=True)])
    mine[0] = 7.0
    assert paths.vertices[0, 0] == 0.0
    for array in (paths.vertices, paths.offsets, paths.closed, paths[0].vertices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_the_bulge_behind_the_last_point_of_an_open_path_is_dropped() -> None:
    vertices = np.array([[0.0, 0, 0.25], [1, 0, 0.75]])
    assert Polyline(vertices).vertices[1, 2] == 0.0
    assert Polyline(vertices, closed=True).vertices[1, 2] == 0.75


def test_nothing_is_a_fine_set_of_paths() -> None:
    nothing = Polylines.of([])
    assert len(nothing) == 0
    assert list(nothing) == []
    assert len(Segments.of(nothing)) == 0


def test_paths_are_found_by_index_and_selected_in_order() -> None:
    a, b = Polyline(TRIANGLE), Polyline(2.0 * TRIANGLE[:2], closed=True)
    paths = Polylines.of([a, b])
    assert np.array_equal(paths[-1].vertices, b.vertices)
    assert paths.select([1, 0]).closed.tolist() == [True, False]
    with pytest.raises(IndexError):
        paths[2]


def test_columns_must_fit_a_toolmaker_s_eye() -> None:
    quarter = Segments.of(Polyline(np.array([[1.0, 0, math.tan(math.pi / 8)], [0, 1, 0]])))
    assert quarter.centre[0] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert quarter.radius[0] == pytest.approx(1.0)
    assert quarter.sweep[0] == pytest.approx(0.5 * math.pi)
    assert quarter.start_angle[0] == pytest.approx(0.0, abs=1e-15)


@given(polylines())
def test_segments_follow_each_other_and_arcs_end_where_they_should(path: Polyline) -> None:
    segments = Segments.of(path)
    assert len(segments) == len(path)
    assert np.array_equal(segments.end[:-1], segments.start[1:])
    assert np.array_equal(segments.end[-1], path.end)
    arcs = segments[segments.is_arc]
    angle = arcs.start_angle + arcs.sweep
    reached = arcs.centre + arcs.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    # A far centre costs digits: those of the radius.
    assert (np.abs(reached - arcs.end) <= 1e-13 * (1.0 + arcs.radius)[:, None] * 10).all()


# Transforms against the points of the path, and undone again.


@given(polylines())
def test_reversed_runs_through_the_same_points_backwards(path: Polyline) -> None:
    there, back = dense_points(path, 16), dense_points(reverse(path), 16)
    assert back[::-1] == pytest.approx(there, abs=1e-7)
    again = reverse(reverse(path))
    assert np.array_equal(again.vertices, path.vertices)


def test_a_closed_path_reversed_begins_at_its_first_vertex() -> None:
    path = Polyline(np.array([[0.0, 0, 0.5], [1, 0, 0], [1, 1, -0.25]]), closed=True)
    assert reverse(path).vertices.tolist() == [[0, 0, 0.25], [1, 1, 0], [1, 0, -0.5]]


@given(polylines(), st.floats(-100, 100), st.floats(-100, 100), st.floats(-7, 7))
def test_points_are_moved_turned_mirrored_and_scaled(
    path: Polyline, dx: float, dy: float, angle: float
) -> None:
    points = dense_points(path, 8)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    for other, wanted in (
        (moved(path, dx, dy), points + np.array([dx, dy])),
        (rotate(path, angle), points @ turn),
        (mirrored(path), points * [-1.0, 1.0]),
        (scaled(path, 3.5), 3.5 * points),
    ):
        assert dense_points(other, 8) == pytest.approx(wanted, abs=1e-6)


@given(polylines(closed=True), st.integers(-9, 9))
def test_rolled_begins_at_that_vertex(path: Polyline, start: int) -> None:
    other = begin_at(path, start)
    assert np.array_equal(other.start, path.vertices[start % len(path), :2])
    assert np.array_equal(begin_at(other, -start).vertices, path.vertices)


def test_an_open_path_cannot_begin_in_its_middle() -> None:
    with pytest.raises(GeometryError):
        begin_at(Polyline(np.array([[0.0, 0, 0], [1, 0, 0]])), 1)


@given(
    st.lists(st.integers(0, 6), min_size=1, max_size=12),
    st.lists(st.integers(0, 3), min_size=1, max_size=12),
    st.booleans(),
)
def test_points_on_the_last_one_that_is_kept_are_left_out(
    steps: list[int], others: list[int], back: bool
) -> None:
    """A chain of points, each near the one before, leaves out those near its first one alone; the
    bulge of the last of them leaves with it. Against the loop over all points, written out."""
    paths = []
    for number, row in enumerate((steps, others)):
        ways = np.array(row) * (0.4 * POSITION_EPS_MM) * np.where(np.arange(len(row)) % 3, 1, -1)
        at = np.cumsum(ways if back else np.abs(ways)) + 5.0 * number
        paths.append(np.column_stack([at, np.zeros_like(at), np.arange(len(at)) / 20.0]))
    vertices, kept = np.concatenate(paths), list[bool]()
    bulges = vertices[:, 2].copy()
    for first, path in zip((0, len(steps)), paths, strict=True):
        last = -1
        for row, (x, y, bulge) in enumerate(path.tolist(), start=first):
            fresh = last < 0 or math.dist((x, y), vertices[last, :2]) > POSITION_EPS_MM
            last = row if fresh else last
            kept.append(fresh)
            bulges[last] = bulge
    counts = np.array([len(steps), len(others)])
    keep, repeated = without_repeats(vertices, counts, np.zeros(2, dtype=bool))
    assert keep.tolist() == kept
    assert vertices[keep, 2].tolist() == bulges[keep].tolist()
    assert repeated.tolist() == [kept[: len(steps)].count(False), kept[len(steps) :].count(False)]
