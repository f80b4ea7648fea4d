"""Closed paths that cross themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.boxes import touching_boxes
from camtool.geometry.intersect import meetings, self_crossings_of
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import Polyline, Polylines, Segments, begin_at, reverse, rotate
from tests.paths import mirrored
from tests.strategies import contours, polylines


def path(*points: tuple[float, ...], closed: bool = True) -> Polyline:
    return Polyline(np.array([(*p, 0.0)[:3] for p in points], dtype=np.float64), closed)


def places(*paths: Polyline) -> list[tuple[float, float, int]]:
    found = self_crossings_of(Polylines.of(paths), [""] * len(paths))
    return [(round(c.at_mm[0], 6), round(c.at_mm[1], 6), c.path) for c in found]


CASES = {
    "a bow tie": (path((0, 0), (1, 1), (1, 0), (0, 1)), 1),
    "a square": (path((0, 0), (1, 0), (1, 1), (0, 1)), 0),
    "crossing at a vertex of both passages": (
        path((0, 0), (1, 1), (2, 2), (2, 0), (1, 1), (0, 2)),
        1,
    ),
    "touching at a vertex of both passages": (
        path((0, 0), (1, 1), (2, 0), (2, 2), (1, 1), (0, 2)),
        0,
    ),
    "crossing at a vertex of one passage": (path((0, 0), (2, 2), (2, 0), (1, 1), (0, 2)), 1),
    "touching at a vertex of one passage": (path((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)), 0),
    "a keyhole": (path((0, 0), (4, 0), (4, 4), (0, 4), (0, 2), (1, 2), (1, 1), (1, 2), (0, 2)), 0),
    "a line through both arcs' bulges": (path((0, 0, 1), (2, 0, 0), (2, -0.5), (0, -0.5)), 2),
    "an arc that touches a line": (path((0, 0, 1), (2, 0, 0), (2, -1), (0, -1)), 0),
    "an arc back onto the line before it": (path((0, 0), (2, 0, 0.9), (1, 0), (1, 1)), 0),
    "an arc back through the line before it": (path((0, 0), (2, 0, -0.9), (1, 0), (1, 1)), 1),
    "an open bow tie": (path((0, 0), (1, 1), (1, 0), (0, 1), closed=False), 0),
}


@pytest.mark.parametrize(("shape", "count"), CASES.values(), ids=CASES)
def test_cases(shape: Polyline, count: int) -> None:
    assert len(places(shape)) == count
    assert len(places(reverse(shape))) == count
    assert len(places(rotate(mirrored(shape), 0.7))) == count
    if shape.closed:
        assert all(len(places(begin_at(shape, k))) == count for k in range(len(shape)))


def test_the_place_and_the_path_are_told() -> None:
    square, tie = CASES["a square"][0], CASES["a bow tie"][0]
    assert places(square, tie) == [(0.5, 0.5, 1)]


def test_two_paths_may_cross_each_other() -> None:
    one, two = path((0, 0), (2, 0), (2, 2), (0, 2)), path((1, 1), (3, 1), (3, 3), (1, 3))
    assert places(one, two) == []


def inner_crossings(shape: Polyline) -> set[tuple[float, float]]:
    """Crossings within two segments, of all pairs."""
    segments = Segments.of(shape)
    found, crosses = meetings(segments, *np.triu_indices(len(segments), 1))
    return {(round(x, 5), round(y, 5)) for x, y in found.point[crosses].tolist()}


@given(polylines(closed=True, max_points=7))
def test_crossings_within_segments_equal_brute_force(shape: Polyline) -> None:
    # At vertices only this code looks: leave those out.
    corners = shape.vertices[:, :2]
    found = {
        (round(x, 5), round(y, 5))
        for x, y, _ in places(shape)
        if np.hypot(*(corners - (x, y)).T).min() > 1e-3
    }
    wanted = {
        point for point in inner_crossings(shape) if np.hypot(*(corners - point).T).min() > 1e-3
    }
    for point in found ^ wanted:
        # The same crossing may be rounded to either side.
        others = wanted if point in found else found
        assert any(math.dist(point, other) < 1e-4 for other in others)


@given(contours())
def test_a_simple_contour_never_crosses_itself(shape: Polyline) -> None:
    assert places(shape) == []


@given(st.lists(polylines(max_points=5), min_size=1, max_size=5), st.booleans(), st.booleans())
def test_boxes_that_touch_equal_brute_force(
    paths: list[Polyline], flat: bool, within: bool
) -> None:
    segments = Segments.of(Polylines.of(paths))
    boxes = segment_boxes(segments) * np.array([1.0, 0.01, 1.0, 0.01] if flat else [1.0] * 4)
    rows = np.arange(len(boxes))
    same = segments.path if within else np.zeros_like(rows)
    asked = rows % 3 > 0
    one, other = touching_boxes(boxes, same, rows, asked, max_pairs=10**6)
    wanted = {
        (i, j)
        for i in rows.tolist()
        for j in range(i + 1, len(rows))
        if same[i] == same[j]
        and (asked[i] or asked[j])
        and (boxes[i, :2] <= boxes[j, 2:]).all()
        and (boxes[j, :2] <= boxes[i, 2:]).all()
    }
    assert set(zip(one.tolist(), other.tolist(), strict=True)) == wanted
    assert len(one) == len(wanted)


def test_no_more_pairs_than_wanted() -> None:
    boxes = np.zeros((50, 4))
    rows = np.arange(50)
    one, _ = touching_boxes(boxes, np.zeros_like(rows), rows, rows >= 0, max_pairs=100)
    assert len(one) == 100
