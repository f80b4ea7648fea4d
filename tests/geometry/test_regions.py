"""Regions: which path is an outer one, which a hole of it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.measure import signed_areas
from camtool.geometry.nesting import oriented, regions
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, reverse, rolled
from tests.oracles.contours import CIRCLE, OBLONG, SQUARE, closed, comb, opened
from tests.paths import moved, scaled

RINGS = [scaled(CIRCLE, k) for k in (4.0, 3.0, 2.0, 1.0)]


def areas_of(found: list[Polylines]) -> list[list[float]]:
    return [signed_areas(each).round(6).tolist() for each in found]


@given(st.permutations(range(4)), st.lists(st.booleans(), min_size=4, max_size=4))
def test_rings_in_any_order_and_sense(order: list[int], turned: list[bool]) -> None:
    paths = [
        reverse(RINGS[k]) if turn else RINGS[k] for k, turn in zip(order, turned, strict=True)
    ]
    lines = oriented(Polylines.of(paths))
    signs = np.sign(signed_areas(lines)).tolist()
    assert signs == [1.0 if k % 2 == 0 else -1.0 for k in order]
    # The order of paths stays, and so does where each begins.
    assert [tuple(p.start) for p in lines] == [tuple(p.start) for p in paths]
    found = areas_of(regions(Polylines.of(paths)))
    a, b, c, d = (np.pi * 100.0 * k * k for k in (4, 3, 2, 1))
    wanted = [[a, -b], [c, -d]] if order.index(0) < order.index(2) else [[c, -d], [a, -b]]
    assert found == [np.round(each, 6).tolist() for each in wanted]


def test_holes_go_to_the_smallest_outer_path() -> None:
    frame, far = scaled(SQUARE, 10.0), moved(scaled(SQUARE, 10.0), 200.0, 0.0)
    holes = [moved(SQUARE, 20.0 * k, 50.0) for k in range(3)]
    island = moved(scaled(SQUARE, 0.2), 4.0, 54.0)
    found = areas_of(regions(Polylines.of([island, *holes, frame, moved(SQUARE, 250, 50), far])))
    assert found == [[4.0], [10000.0, -100.0, -100.0, -100.0], [10000.0, -100.0]]


def test_what_an_offset_gives_is_oriented_already() -> None:
    lines = oriented(Polylines.of([scaled(SQUARE, 10.0), moved(comb(9), 20, 20), OBLONG]))
    for d in (0.4, 0.5, 1.0, 2.0, -0.4, -0.5, -3.0):
        result = offset_shape(lines, d)
        again = oriented(result)
        assert np.array_equal(again.vertices, result.vertices)
        assert sum(len(each) for each in regions(result)) == len(result)


def test_paths_that_touch() -> None:
    # Two squares at one corner, and a hole that touches the edge of its square.
    corner = [SQUARE, moved(SQUARE, 10.0, 10.0)]
    assert areas_of(regions(Polylines.of(corner))) == [[100.0], [100.0]]
    diamond = closed((5, 0), (8, 3), (5, 6), (2, 3))
    for start in range(4):
        found = areas_of(regions(Polylines.of([rolled(diamond, start), SQUARE])))
        assert found == [[100.0, -18.0]]


def test_open_paths_have_no_inside() -> None:
    lines = Polylines.of([SQUARE, opened((0, 0), (1, 1))])
    for function in (oriented, regions):
        with pytest.raises(GeometryError, match="path 1"):
            function(lines)


def test_nothing() -> None:
    assert len(oriented(Polylines.of([]))) == 0
    assert regions(Polylines.of([])) == []


def test_many_vertices() -> None:
    # A ring of many segments in another one: every witness asks a tree, not every segment.
    angle = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    ring = Polyline(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), True)
    found = regions(Polylines.of([scaled(ring, 50.0), scaled(ring, 49.99), scaled(ring, 1.0)]))
    assert [len(each) for each in found] == [2, 1]
