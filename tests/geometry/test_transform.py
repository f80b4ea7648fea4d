"""Transforms against the points of the path, and undone again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.polylines import Polyline, mirrored, moved, reverse, rolled, rotated, scaled
from tests.oracles.geometry import dense_points
from tests.strategies import polylines


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
        (rotated(path, angle), points @ turn),
        (mirrored(path), points * [-1.0, 1.0]),
        (scaled(path, 3.5), 3.5 * points),
    ):
        assert dense_points(other, 8) == pytest.approx(wanted, abs=1e-6)


@given(polylines(closed=True), st.integers(-9, 9))
def test_rolled_begins_at_that_vertex(path: Polyline, start: int) -> None:
    other = rolled(path, start)
    assert np.array_equal(other.start, path.vertices[start % len(path), :2])
    assert np.array_equal(rolled(other, -start).vertices, path.vertices)


def test_an_open_path_cannot_begin_in_its_middle() -> None:
    with pytest.raises(GeometryError):
        rolled(Polyline(np.array([[0.0, 0, 0], [1, 0, 0]])), 1)


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf])
def test_a_scale_that_is_none_is_refused(factor: float) -> None:
    with pytest.raises(GeometryError):
        scaled(Polyline(np.array([[0.0, 0, 0], [1, 0, 0]])), factor)


def test_a_path_scaled_to_a_point_is_refused() -> None:
    with pytest.raises(GeometryError, match="repeated"):
        scaled(Polyline(np.array([[0.0, 0, 0], [1, 0, 0]])), 1e-9)
