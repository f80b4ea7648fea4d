"""Parts that are monotone in x and y, and the turns between them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import length, sample
from camtool.geometry.polylines import Polyline, Segments
from camtool.planning.reversing import parts_of, reversals_along
from tests.oracles.reversals import dense, turns
from tests.planning.reversal_parts import circle, gear, reversals_of, run_of, square
from tests.strategies import contours, polylines

LEAST_MM = 7.3e-4


@given(polylines())
def test_parts_are_monotone_and_follow_the_path(path: Polyline) -> None:
    parts = parts_of(path)
    for index in range(len(parts)):
        points = dense(parts.subpath(index, index + 1))
        step = np.diff(points, axis=0)
        # Rounding, and what an arc strays beyond an extreme that lies at its end.
        forward, backward = step.max(axis=0), step.min(axis=0)
        assert (np.minimum(forward, -backward) < 1e-9).all()
    assert points_to_segments(parts.places, Segments.of(path)).min(axis=1).max() < 1e-9


@given(polylines(), st.data())
def test_stretches_join_to_the_path_again(path: Polyline, data: st.DataObject) -> None:
    parts = parts_of(path)
    cut = data.draw(st.integers(1, len(parts)))
    pieces = [parts.subpath(0, cut)] + (
        [parts.subpath(cut, len(parts))] if cut < len(parts) else []
    )
    assert sum(map(length, pieces)) == pytest.approx(length(path), rel=1e-12)
    assert (pieces[0].start == path.start).all()
    assert (pieces[-1].end == path.end).all()
    # A whole segment stays as it was, to the last bit.
    whole = parts.subpath(0, len(parts))
    assert (whole.vertices[: len(path)] == path.vertices[: len(path)]).all()


@given(contours(), st.integers(0, 40))
def test_a_stretch_may_go_on_round_a_closed_path(path: Polyline, turn: int) -> None:
    parts = parts_of(path)
    first = turn % len(parts)
    once = parts.subpath(first, first + len(parts))
    assert (once.start == once.end).all()
    assert length(once) == pytest.approx(length(path), rel=1e-12)
    assert points_to_segments(sample(once, 0.5), Segments.of(path)).min(axis=1).max() < 1e-9


@given(polylines())
def test_reversals_are_those_of_the_dense_way(path: Polyline) -> None:
    points = dense(path)
    parts = parts_of(path)
    found = [reversals_along(parts.places[:, axis], path.closed, LEAST_MM) for axis in (0, 1)]
    inner = [((each.first > 0) & (each.last < len(parts))).sum() for each in found]
    assert inner == [turns(points[:, axis].tolist(), LEAST_MM) for axis in (0, 1)]


@pytest.mark.parametrize(
    ("path", "expected", "why"),
    [
        (square(), (1, 1), "it starts at a corner: one turn of each axis is left"),
        (circle(), (1, 2), "it starts where x turns"),
        (circle(start_rad=0.3), (2, 2), "it starts where nothing turns"),
        (Polyline(np.array([[0, 0, 0], [3, 1, 0], [5, 1, 0.0]])), (0, 0), "one way"),
        (Polyline(np.array([[0, 0, 0], [3, 1, 0], [5, 0, 0.0]])), (0, 1), "y turns at the top"),
        (Polyline(np.array([[0, 0, 0], [3, 1, 0], [5, 1, 0], [6, 0, 0.0]])), (0, 1), "on a line"),
        (Polyline(np.array([[0, 0, -1.0], [2, 0, 0.0]])), (0, 1), "a half circle over the top"),
        (Polyline(np.array([[0, 0, 0], [1, 1, 0], [2, 1 - 1e-7, 0], [3, 2, 0]])), (0, 0), "less"),
    ],
)
def test_reversals_of_known_paths(path: Polyline, expected: tuple[int, int], why: str) -> None:
    assert reversals_of(path) == expected, why
    assert reversals_of(run_of(path)) == expected, why


@given(contours())
def test_a_closed_path_turns_as_often_there_as_back(path: Polyline) -> None:
    parts = parts_of(path)
    for axis in (0, 1):
        found = reversals_along(parts.places[:, axis], True, LEAST_MM)
        assert len(found) % 2 == 0
        assert len(found) >= 2
        # Each stretch lies on the extreme, and next to it the axis moves away.
        for first, last in zip(found.first.tolist(), found.last.tolist(), strict=True):
            values = np.tile(parts.places[:-1, axis], 3)
            at = values[first : last + 1]
            assert np.ptp(at) < 2 * LEAST_MM
            beside = values[[(first - 1) % len(parts), last + 1]]
            assert ((beside > at.max()).all()) or ((beside < at.min()).all())


def test_closed_paths_get_vertices_where_asked() -> None:
    path = gear(7)
    parts = parts_of(path)
    at = np.flatnonzero(parts.begin > 0.0)
    assert len(at)
    made, which = parts.with_vertices(at)
    assert np.allclose(made.vertices[which, :2], parts.places[at], atol=0.0)
    assert len(made) == len(path) + len(at)
    assert length(made) == pytest.approx(length(path), rel=1e-12)
    assert points_to_segments(sample(made, 0.01), Segments.of(path)).min(axis=1).max() < 1e-12


def test_arcs_are_split_at_their_quadrant_points() -> None:
    parts = parts_of(circle(2.0, 0.3))
    quadrants = np.array([[0.0, 2.0], [-2.0, 0.0], [0.0, -2.0], [2.0, 0.0]])
    apart = np.hypot(*(parts.places[:-1, None] - quadrants[None]).transpose(2, 0, 1))
    assert apart.min(axis=0) == pytest.approx(0.0, abs=1e-15)
    assert len(parts) == 6
    assert math.isclose(float(np.abs(parts.segments.sweep).sum()), 2.0 * math.pi)


def test_a_path_that_never_moves_along_an_axis_has_no_turns() -> None:
    line = Polyline(np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]]))
    assert len(reversals_along(parts_of(line).places[:, 0], False, LEAST_MM)) == 0
    back = Polyline(line.vertices, True)
    assert len(reversals_along(parts_of(back).places[:, 1], True, LEAST_MM)) == 2
    assert len(reversals_along(parts_of(back).places[:, 0], True, LEAST_MM)) == 0
