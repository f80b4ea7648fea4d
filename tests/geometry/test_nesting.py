"""Which contour holds which, against fine polygons and in every arrangement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import Point

from camtool.errors import GeometryError
from camtool.geometry.measure import signed_areas
from camtool.geometry.nesting import Nesting, inside, oriented, regions
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, Segments, begin_at, reverse, rotate
from tests.oracles.contours import CIRCLE, OBLONG, SQUARE, closed, comb, opened
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
    found = Nesting(Polylines.of(paths)).levels
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
    ("paths", "parent", "depth"), [row[1:] for row in TABLE], ids=[row[0] for row in TABLE]
)
def test_arrangements(paths: list[Polyline], parent: list[int], depth: list[int]) -> None:
    assert _nested(paths) == (parent, depth)
    for other in (
        [reverse(p) for p in paths],
        [moved(p, 1234.5, -77.25) for p in paths],
        [rotate(p, 0.3) for p in paths],
        [mirrored(p) for p in paths],
        [scaled(p, 0.125) for p in paths],
        [begin_at(p, 1) if p.closed else p for p in paths],
    ):
        assert _nested(other) == (parent, depth)


def test_the_order_of_the_paths_does_not_matter() -> None:
    paths = [_circle(0, 0, r) for r in (5, 4, 3, 2, 1)]
    for shuffled in ([4, 2, 0, 1, 3], [1, 0, 3, 2, 4]):
        found = Nesting(Polylines.of(paths).select(shuffled)).levels
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
    for path in (_circle(0, 0, 1), rotate(_circle(0, 0, 1), np.pi / 2), _circle(0.3, 7, 2)):
        middle = path.vertices[:, :2].mean(axis=0)
        for each in (path, reverse(path)):
            assert inside(middle[None, :], Segments.of(each)).tolist() == [True]


@given(contours(), st.integers(1, 4))
def test_copies_made_smaller_are_nested(path: Polyline, count: int) -> None:
    paths = [scaled(path, 0.5**k) for k in range(count + 1)]
    found = Nesting(Polylines.of(paths)).levels
    assert found.depth.tolist() == list(range(count + 1))
    assert found.parent.tolist() == list(range(-1, count))


@given(st.lists(polylines(max_points=5), max_size=6))
def test_any_paths_give_a_forest(paths: list[Polyline]) -> None:
    found = Nesting(Polylines.of(paths)).levels
    for path, (parent, depth) in enumerate(zip(found.parent, found.depth, strict=True)):
        assert (parent == -1) == (depth == 0)
        seen = {path}
        while parent >= 0:
            assert paths[parent].closed
            assert parent not in seen
            seen.add(int(parent))
            parent = found.parent[parent]


@given(st.lists(polylines(max_points=5), min_size=1, max_size=6), st.data())
def test_a_part_nests_as_if_it_stood_alone(paths: list[Polyline], data: st.DataObject) -> None:
    paths += [reverse(path) for path in paths if path.closed][:2]
    paths += [scaled(path, 0.5) for path in paths]
    every = Nesting(Polylines.of(paths))
    mask = np.array(data.draw(st.lists(st.booleans(), min_size=len(paths), max_size=len(paths))))
    rows = np.flatnonzero(mask)
    alone = Nesting(every.lines.select(rows)).levels
    part, holders = every.among(rows).levels, every.levels_by(mask)
    assert part.parent.tolist() == alone.parent.tolist()
    assert part.depth.tolist() == alone.depth.tolist()
    assert holders.depth[rows].tolist() == alone.depth.tolist()
    parent = np.where(alone.parent < 0, -1, np.append(rows, -1)[alone.parent])
    assert holders.parent[rows].tolist() == parent.tolist()
    # The others are held by these alone, too.
    for row in np.flatnonzero(~mask).tolist():
        one = np.flatnonzero(mask | (np.arange(len(paths)) == row))
        if not paths[row].closed:
            levels = Nesting(every.lines.select(one)).levels
            assert holders.depth[row] == levels.depth[one.tolist().index(row)]


# Regions: which path is an outer one, which a hole of it.

RINGS = [scaled(CIRCLE, k) for k in (4.0, 3.0, 2.0, 1.0)]


def regions_of(lines: Polylines) -> list[Polylines]:
    found = regions(Nesting(lines))
    assert [region[0].start.tolist() for _, region in found] == [
        lines[row].start.tolist() for row, _ in found
    ]
    return [region for _, region in found]


def areas_of(found: list[Polylines]) -> list[list[float]]:
    return [signed_areas(each).round(6).tolist() for each in found]


@given(st.permutations(range(4)), st.lists(st.booleans(), min_size=4, max_size=4))
def test_rings_in_any_order_and_sense(order: list[int], turned: list[bool]) -> None:
    paths = [
        reverse(RINGS[k]) if turn else RINGS[k] for k, turn in zip(order, turned, strict=True)
    ]
    lines = oriented(Nesting(Polylines.of(paths)))
    signs = np.sign(signed_areas(lines)).tolist()
    assert signs == [1.0 if k % 2 == 0 else -1.0 for k in order]
    # The order of paths stays, and so does where each begins.
    assert [tuple(p.start) for p in lines] == [tuple(p.start) for p in paths]
    found = areas_of(regions_of(Polylines.of(paths)))
    a, b, c, d = (np.pi * 100.0 * k * k for k in (4, 3, 2, 1))
    wanted = [[a, -b], [c, -d]] if order.index(0) < order.index(2) else [[c, -d], [a, -b]]
    assert found == [np.round(each, 6).tolist() for each in wanted]


def test_holes_go_to_the_smallest_outer_path() -> None:
    frame, far = scaled(SQUARE, 10.0), moved(scaled(SQUARE, 10.0), 200.0, 0.0)
    holes = [moved(SQUARE, 20.0 * k, 50.0) for k in range(3)]
    island = moved(scaled(SQUARE, 0.2), 4.0, 54.0)
    paths = [island, *holes, frame, moved(SQUARE, 250, 50), far]
    found = areas_of(regions_of(Polylines.of(paths)))
    assert found == [[4.0], [10000.0, -100.0, -100.0, -100.0], [10000.0, -100.0]]


def test_what_an_offset_gives_is_oriented_already() -> None:
    lines = oriented(Nesting(Polylines.of([scaled(SQUARE, 10.0), moved(comb(9), 20, 20), OBLONG])))
    for d in (0.4, 0.5, 1.0, 2.0, -0.4, -0.5, -3.0):
        result = offset_shape(lines, d)
        again = oriented(Nesting(result))
        assert np.array_equal(again.vertices, result.vertices)
        assert sum(len(each) for each in regions_of(result)) == len(result)


def test_paths_that_touch() -> None:
    # Two squares at one corner, and a hole that touches the edge of its square.
    corner = [SQUARE, moved(SQUARE, 10.0, 10.0)]
    assert areas_of(regions_of(Polylines.of(corner))) == [[100.0], [100.0]]
    diamond = closed((5, 0), (8, 3), (5, 6), (2, 3))
    for start in range(4):
        found = areas_of(regions_of(Polylines.of([begin_at(diamond, start), SQUARE])))
        assert found == [[100.0, -18.0]]


def test_open_paths_have_no_inside() -> None:
    lines = Polylines.of([SQUARE, opened((0, 0), (1, 1))])
    for function in (oriented, regions):
        with pytest.raises(GeometryError, match="path 1"):
            function(Nesting(lines))


def test_nothing() -> None:
    assert len(oriented(Nesting(Polylines.of([])))) == 0
    assert regions_of(Polylines.of([])) == []


def test_many_vertices() -> None:
    # A ring of many segments in another one: every witness asks a tree, not every segment.
    angle = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    ring = Polyline(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), True)
    found = regions_of(Polylines.of([scaled(ring, 50.0), scaled(ring, 49.99), scaled(ring, 1.0)]))
    assert [len(each) for each in found] == [2, 1]


def test_many_paths_nest_as_their_boxes_do() -> None:
    # More than are looked at together, and than a box index keeps in their order.
    rng = np.random.default_rng(5)
    corners = rng.uniform(0.0, 100.0, (3000, 2))
    sizes = 10.0 ** rng.uniform(-1.0, 1.7, (3000, 2))
    low, high = corners, corners + sizes
    paths = [_box(*a, *b) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    inside = (low[:, None] >= low[None]).all(axis=2) & (high[:, None] <= high[None]).all(axis=2)
    np.fill_diagonal(inside, False)
    areas = np.where(inside, sizes.prod(axis=1), np.inf)
    found = Nesting(Polylines.of(paths)).levels
    assert found.depth.tolist() == inside.sum(axis=1).tolist()
    assert found.parent.tolist() == np.where(inside.any(axis=1), areas.argmin(axis=1), -1).tolist()
