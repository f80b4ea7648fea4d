"""Which contour holds which, against fine polygons and in every arrangement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import Point

from camtool.geometry.nesting import inside, nesting
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse, rolled, rotated
from tests.oracles.geometry import polygon, sagitta
from tests.paths import mirrored, moved, scaled
from tests.strategies import contours, coordinates, polylines


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), closed=True)


def _box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline(np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]]), True)


def _line(*numbers: float) -> Polyline:
    return Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))


def _nested(paths: list[Polyline]) -> tuple[list[int], list[int]]:
    found = nesting(Polylines.of(paths))
    return found.parent.tolist(), found.depth.tolist()


TABLE = [
    ("nothing", [], [], []),
    ("one", [_circle(0, 0, 1)], [-1], [0]),
    ("a target, from within", [_circle(0, 0, r) for r in (1, 2, 3)], [1, 2, -1], [2, 1, 0]),
    ("side by side", [_circle(0, 0, 1), _circle(3, 0, 1)], [-1, -1], [0, 0]),
    ("touching from without", [_circle(0, 0, 1), _circle(2, 0, 1)], [-1, -1], [0, 0]),
    ("touching from within", [_circle(0, 0, 2), _circle(1, 0, 1)], [-1, 0], [0, 1]),
    ("sharing an edge within", [_box(0, 0, 4, 4), _box(0, 0, 2, 2)], [-1, 0], [0, 1]),
    ("sharing an edge without", [_box(0, 0, 4, 4), _box(4, 0, 6, 2)], [-1, -1], [0, 0]),
    ("crossing", [_circle(0, 0, 2), _circle(2, 0, 1)], [-1, -1], [0, 0]),
    ("in the box, not in the circle", [_circle(0, 0, 5), _circle(4, 4, 0.5)], [-1, -1], [0, 0]),
    (
        "beyond the chord, within the arc",
        [Polyline(np.array([[0.0, 0, 1], [4, 0, 0]]), True), _circle(2, -1, 0.3)],
        [-1, 0],
        [0, 1],
    ),
    (
        "beyond the chord, where the arc has bitten",
        [
            Polyline(np.array([[0.0, 0, -1], [4, 0, 0], [4, 9, 0], [0, 9, 0]]), True),
            _circle(2, 1, 0.3),
        ],
        [-1, -1],
        [0, 0],
    ),
    ("a line within", [_box(0, 0, 4, 4), _line(1, 1, 3, 3)], [-1, 0], [0, 1]),
    ("a line across", [_box(0, 0, 4, 4), _line(1, 1, 9, 3)], [-1, -1], [0, 0]),
    ("a line between two edges", [_box(0, 0, 4, 4), _line(0, 1, 4, 3)], [-1, 0], [0, 1]),
    ("a line on an edge", [_box(0, 0, 4, 4), _line(1, 0, 3, 0)], [-1, -1], [0, 0]),
    ("a line holds nothing", [_line(0, 0, 4, 4), _line(1, 1, 3, 3)], [-1, -1], [0, 0]),
    (
        "doubles count as one",
        [_circle(0, 0, 3), reverse(_circle(0, 0, 3)), _circle(0, 0, 1)],
        [-1, -1, 0],
        [0, 0, 1],
    ),
]


@pytest.mark.parametrize(
    ("paths", "parent", "depth"),
    [row[1:] for row in TABLE],
    ids=[row[0] for row in TABLE],
)
def test_arrangements(paths: list[Polyline], parent: list[int], depth: list[int]) -> None:
    assert _nested(paths) == (parent, depth)
    for other in (
        [reverse(p) for p in paths],
        [moved(p, 1234.5, -77.25) for p in paths],
        [rotated(p, 0.3) for p in paths],
        [mirrored(p) for p in paths],
        [scaled(p, 0.125) for p in paths],
        [rolled(p, 1) if p.closed else p for p in paths],
    ):
        assert _nested(other) == (parent, depth)


def test_the_order_of_the_paths_does_not_matter() -> None:
    paths = [_circle(0, 0, r) for r in (5, 4, 3, 2, 1)]
    for shuffled in ([4, 2, 0, 1, 3], [1, 0, 3, 2, 4]):
        found = nesting(Polylines.of(paths).select(shuffled))
        assert found.depth.tolist() == shuffled


@given(contours(), st.lists(st.tuples(coordinates(), coordinates()), min_size=1, max_size=20))
def test_points_within_are_those_of_a_fine_polygon(
    path: Polyline, points: list[tuple[float, float]]
) -> None:
    fine, slack = polygon(path, 128), sagitta(path, 128)
    clear = [p for p in points if fine.exterior.distance(Point(p)) > slack + 1e-9]
    assume(clear)
    found = inside(np.array(clear), Segments.of(path))
    assert found.tolist() == [bool(fine.contains(Point(p))) for p in clear]


@given(contours(), st.integers(0, 11))
def test_points_level_with_vertices_and_on_chords_count_once(path: Polyline, at: int) -> None:
    # (0, 0) is within by construction; each of these points sees vertices exactly to its right.
    fine, slack = polygon(path, 128), sagitta(path, 128)
    y = path.vertices[at % len(path), 1]
    points = np.array([[x, y] for x in (-30.0, -0.5, 0.0, 0.5, 30.0)])
    chord = 0.5 * (path.vertices[:, :2] + np.roll(path.vertices[:, :2], -1, axis=0))
    points = np.concatenate([points, chord])
    clear = [fine.exterior.distance(Point(p)) > slack + 1e-9 for p in points]
    found = inside(points, Segments.of(path))
    wanted = np.array([fine.contains(Point(p)) for p in points])
    assert found[clear].tolist() == wanted[clear].tolist()


def test_points_on_the_chord_of_an_arc_are_within_the_circle() -> None:
    for path in (_circle(0, 0, 1), rotated(_circle(0, 0, 1), np.pi / 2), _circle(0.3, 7, 2)):
        middle = path.vertices[:, :2].mean(axis=0)
        for each in (path, reverse(path)):
            assert inside(middle[None, :], Segments.of(each)).tolist() == [True]


@given(contours(), st.integers(1, 4))
def test_copies_made_smaller_are_nested(path: Polyline, count: int) -> None:
    paths = [scaled(path, 0.5**k) for k in range(count + 1)]
    found = nesting(Polylines.of(paths))
    assert found.depth.tolist() == list(range(count + 1))
    assert found.parent.tolist() == list(range(-1, count))


@given(st.lists(polylines(max_points=5), max_size=6))
def test_any_paths_give_a_forest(paths: list[Polyline]) -> None:
    found = nesting(Polylines.of(paths))
    for path, (parent, depth) in enumerate(zip(found.parent, found.depth, strict=True)):
        assert (parent == -1) == (depth == 0)
        seen = {path}
        while parent >= 0:
            assert paths[parent].closed
            assert parent not in seen
            seen.add(int(parent))
            parent = found.parent[parent]
