"""In which order contours are cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.nest import nesting
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.order import order, ordered
from tests.strategies import coordinates, polylines


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), closed=True)


def _box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline(np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]]), True)


def _line(*numbers: float) -> Polyline:
    return Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))


def test_the_nearest_comes_first() -> None:
    paths = Polylines.of([_circle(30, 0, 1), _circle(10, 0, 1), _circle(20, 0, 1)])
    assert order(paths).path.tolist() == [1, 2, 0]
    assert order(paths, (40.0, 0.0)).path.tolist() == [0, 2, 1]


def test_what_lies_within_comes_before_what_holds_it() -> None:
    # The frame's corner is where the tool stands, yet it is the last to be cut.
    paths = [_box(0, 0, 50, 50), _circle(20, 20, 8), _circle(20, 20, 1), _line(40, 40, 45, 40)]
    way = order(Polylines.of(paths)).path.tolist()
    assert way == [2, 1, 3, 0]


def test_open_paths_are_travelled_from_the_nearer_end() -> None:
    paths = Polylines.of([_line(9, 0, 1, 0), _line(9, 1, 1, 1)])
    first, second = ordered(paths, order(paths))
    assert (first.start.tolist(), first.end.tolist()) == ([1, 0], [9, 0])
    assert (second.start.tolist(), second.end.tolist()) == ([9, 1], [1, 1])


def test_closed_paths_begin_at_their_nearest_vertex() -> None:
    paths = Polylines.of([_box(-9, -9, -1, -1)])
    (path,) = ordered(paths, order(paths))
    assert path.start.tolist() == [-1, -1]


def test_no_path_begins_within_an_arc_that_was_split() -> None:
    # A slot whose right cap is two quarters; the vertex between them is nearest to the tool.
    quarter = np.tan(np.pi / 8)
    slot = Polyline(
        np.array([[-5.0, -1, 0], [-2, -1, quarter], [-1, 0, quarter], [-2, 1, 0], [-5, 1, 1]]),
        True,
    )
    (path,) = ordered(Polylines.of([slot]), order(Polylines.of([slot])))
    assert path.start.tolist() == [-2, -1]


@given(st.lists(polylines(max_points=5), max_size=8), coordinates(), coordinates())
def test_every_path_comes_once_and_holders_after_what_they_hold(
    paths: list[Polyline], x: float, y: float
) -> None:
    lines = Polylines.of(paths)
    way = order(lines, (x, y))
    assert sorted(way.path.tolist()) == list(range(len(paths)))
    rank = np.argsort(way.path)
    for path, parent in enumerate(nesting(lines).parent):
        assert parent < 0 or rank[path] < rank[parent]


@given(st.lists(polylines(max_points=5, closed=False), min_size=1, max_size=8))
def test_each_step_is_the_shortest_there_is(paths: list[Polyline]) -> None:
    lines = Polylines.of(paths)
    way = order(lines)
    at, left = np.zeros(2), set(range(len(paths)))
    for index, path in zip(way.path.tolist(), ordered(lines, way), strict=True):
        ends = [end for i in left for end in (paths[i].start, paths[i].end)]
        nearest = min(np.hypot(*(end - at)) for end in ends)
        assert np.hypot(*(path.start - at)) == pytest.approx(nearest, abs=1e-12)
        at = path.end
        left.remove(index)
