"""Reliefs: the tool's edge reaches the corner of the part, and nothing else is harmed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline, Polylines, begin_at, reverse, rotate
from camtool.planning.reliefs import MIN_RELIEF_MM, add_reliefs
from tests.oracles.arcs import chain_distances
from tests.paths import mirrored, moved, scaled

R = 1.0
ALONE = Polylines.of([])
"""No other lines."""
POCKET = Polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 6, 0], [0, 6, 0.0]]), True)
WITHIN = Polyline(np.array([[1, 1, 0], [9, 1, 0], [9, 5, 0], [1, 5, 0.0]]), True)


def _ring(path: Polyline) -> np.ndarray:
    return np.concatenate([path.vertices, path.vertices[:1]])


def _tips(path: Polyline, plain: Polyline) -> list[tuple[float, float]]:
    """Return the vertices that the path visits and the plain one does not."""
    own = {tuple(place) for place in plain.vertices[:, :2].tolist()}
    return [tuple(place) for place in path.vertices[:, :2].tolist() if tuple(place) not in own]


def triangle(degrees: float) -> tuple[Polyline, Polyline, np.ndarray]:
    """A sharp wedge of this angle at (0, 0), the path of the tool in it, and where that turns.

    The third side is cut off by an arc far away, which gives no corner to think of.
    """
    angle = math.radians(degrees)
    size = 60.0
    far = size * np.array([math.cos(angle), math.sin(angle)])
    wedge = Polyline(np.array([[0, 0, 0], [size, 0, 0.0], [*far, 0]]), True)
    reach = R / math.sin(0.5 * angle)
    turn = reach * np.array([math.cos(0.5 * angle), math.sin(0.5 * angle)])
    ahead = np.array([math.cos(angle), math.sin(angle)])
    path = Polyline(
        np.array([[*(turn + 5.0 * ahead), 0], [*turn, 0], [turn[0] + 5.0, turn[1], 0.0]])
    )
    return wedge, path, turn


@pytest.mark.parametrize("degrees", [20.0, 60.0, 90.0, 120.0, 170.0])
@pytest.mark.parametrize("kind", ["dogbone", "overcut"])
def test_the_edge_reaches_the_corner(degrees: float, kind: str) -> None:
    wedge, path, turn = triangle(degrees)
    done = add_reliefs(path, wedge, R, kind, ALONE)
    (tip,) = _tips(done.path, path)
    assert math.hypot(*tip) == pytest.approx(R)
    half = math.radians(0.5 * degrees)
    long = R * (1.0 / math.sin(half) - 1.0) if kind == "dogbone" else R / math.tan(half)
    assert math.dist(tip, turn) == pytest.approx(long)
    # There and back.
    assert len(done.path) == len(path) + 2
    assert done.path.vertices[1].tolist() == done.path.vertices[3].tolist() == [*turn, 0.0]
    assert len(done.left) == 0


def test_a_dogbone_lies_on_the_bisector_and_an_overcut_along_the_longer_wall() -> None:
    part = add_reliefs(WITHIN, POCKET, R, "dogbone", ALONE).path
    off = math.sqrt(0.5)
    assert sorted(_tips(part, WITHIN)) == [
        pytest.approx((off, off)),
        pytest.approx((off, 6 - off)),
        pytest.approx((10 - off, off)),
        pytest.approx((10 - off, 6 - off)),
    ]
    cut = add_reliefs(WITHIN, POCKET, R, "overcut", ALONE).path
    assert sorted(_tips(cut, WITHIN)) == [
        pytest.approx(place) for place in ((0, 1), (0, 5), (10, 1), (10, 5))
    ]
    high = Polyline(POCKET.vertices[:, [1, 0, 2]], True)
    tall = add_reliefs(
        Polyline(WITHIN.vertices[:, [1, 0, 2]], True), high, R, "overcut", ALONE
    ).path
    assert sorted(_tips(tall, Polyline(WITHIN.vertices[:, [1, 0, 2]], True))) == [
        pytest.approx(place) for place in ((1, 0), (1, 10), (5, 0), (5, 10))
    ]


def test_walls_as_long_are_overcut_along_x() -> None:
    square = Polyline(np.array([[0, 0, 0], [6, 0, 0], [6, 6, 0], [0, 6, 0.0]]), True)
    path = Polyline(np.array([[1, 1, 0], [5, 1, 0], [5, 5, 0], [1, 5, 0.0]]), True)
    for way in (path, reverse(path)):
        assert sorted(_tips(add_reliefs(way, square, R, "overcut", ALONE).path, path)) == [
            pytest.approx(place) for place in ((0, 1), (0, 5), (6, 1), (6, 5))
        ]


@pytest.mark.parametrize("kind", ["dogbone", "overcut"])
@pytest.mark.parametrize(
    "change",
    [
        reverse,
        mirrored,
        lambda p: begin_at(p, 3),
        lambda p: rotate(p, 0.4),
        lambda p: scaled(p, 1.0),
    ],
)
def test_reliefs_turn_with_the_part(kind: str, change) -> None:  # type: ignore[no-untyped-def]
    plain, done = WITHIN, add_reliefs(WITHIN, POCKET, R, kind, ALONE).path
    moved_first = add_reliefs(change(plain), change(POCKET), R, kind, ALONE).path
    wanted = change(Polyline(np.array([[*tip, 0] for tip in _tips(done, plain)]), True))
    found = np.array(sorted(_tips(moved_first, change(plain))))
    assert found == pytest.approx(np.array(sorted(wanted.vertices[:, :2].tolist())), abs=1e-9)


def test_the_path_may_run_against_the_walls() -> None:
    for walls in (POCKET, reverse(POCKET), begin_at(POCKET, 2)):
        assert len(add_reliefs(WITHIN, walls, R, "dogbone", ALONE).path) == 12


def test_rounded_corners_and_outer_ones_get_none() -> None:
    quarter = math.tan(math.pi / 8.0)
    small = 0.2
    rounded = Polyline(
        np.array([[0, 0, 0], [10 - small, 0, quarter], [10, small, 0], [10, 6, 0], [0, 6, 0.0]]),
        True,
    )
    tips = _tips(add_reliefs(WITHIN, rounded, R, "dogbone", ALONE).path, WITHIN)
    assert len(tips) == 3
    assert not any(x > 9 and y < 1 for x, y in tips)
    # Around the outside: corners that the tool reaches anyway, with round and with sharp joins.
    sharp = Polyline(np.array([[-1, -1, 0], [11, -1, 0], [11, 7, 0], [-1, 7, 0.0]]), True)
    assert (
        add_reliefs(sharp, POCKET, R, "dogbone", ALONE).path.vertices.tolist()
        == sharp.vertices.tolist()
    )


def test_a_joint_that_is_smooth_is_no_corner() -> None:
    """A line goes on as an arc so shallow that the tool is as far from both."""
    shallow = Polyline(
        np.array([[0, 0, 0], [10, 0, math.tan(0.25 * 1e-5)], [20, 5e-5, 0], [10, 20, 0.0]]), True
    )
    path = Polyline(np.array([[5, 1, 0], [11, 1, 0], [12, 3, 0.0]]))
    assert len(add_reliefs(path, shallow, R, "dogbone", ALONE).path) == len(path)


def test_corners_with_arcs() -> None:
    """A half disc: the tool turns where line and arc are both r away."""
    part = Polyline(np.array([[-5, 0, 0], [5, 0, 1.0]]), True)
    x = math.sqrt(16.0 - 1.0)
    path = Polyline(
        np.array([[-x, 1, 0], [x, 1, math.tan(0.25 * (math.pi - 2 * math.asin(0.25)))]]), True
    )
    done = add_reliefs(path, part, R, "dogbone", ALONE).path
    tips = _tips(done, path)
    assert len(tips) == 2
    assert (
        sorted(math.dist(tip, (math.copysign(5, tip[0]), 0)) for tip in tips)
        == [pytest.approx(R)] * 2
    )
    for tip in tips:
        at = np.flatnonzero((done.vertices[:, :2] == tip).all(axis=1))[0]
        assert done.vertices[at - 1, :2] == pytest.approx([math.copysign(x, tip[0]), 1])
    # The arc that leaves V still does, after the relief.
    assert np.count_nonzero(done.vertices[:, 2]) == 1
    assert done.vertices[np.flatnonzero(done.vertices[:, 2])[0], :2] == pytest.approx([x, 1])
    over = _tips(add_reliefs(path, part, R, "overcut", ALONE).path, path)
    assert (
        sorted(math.dist(tip, (math.copysign(5, tip[0]), 0)) for tip in over)
        == [pytest.approx(R)] * 2
    )


def test_an_allowance_is_left_in_the_corner_too() -> None:
    path = Polyline(np.array([[1.2, 1.2, 0], [8.8, 1.2, 0], [8.8, 4.8, 0], [1.2, 4.8, 0.0]]), True)
    for kind in ("dogbone", "overcut"):
        tips = _tips(add_reliefs(path, POCKET, R, kind, ALONE).path, path)
        assert len(tips) == 4
        for tip in tips:
            corner = (10.0 * (tip[0] > 5), 6.0 * (tip[1] > 3))
            assert math.dist(tip, corner) == pytest.approx(1.2)


def test_a_point_leaves_nothing_in_a_corner() -> None:
    assert add_reliefs(WITHIN, POCKET, 0.0, "dogbone", ALONE).path is WITHIN


def test_corners_that_are_hardly_missed_get_none() -> None:
    wedge, path, turn = triangle(179.0)
    missed = math.hypot(*turn) - R
    assert 0.0 < missed < MIN_RELIEF_MM
    assert (
        add_reliefs(path, wedge, R, "dogbone", ALONE).path.vertices.tolist()
        == path.vertices.tolist()
    )


def test_a_relief_does_not_cut_into_other_lines() -> None:
    off = math.sqrt(0.5) - R * math.sqrt(0.5)
    # A hole of 0.2 mm beyond the corner at (10, 6): the relief reaches over the corner's sides.
    for gap, left in ((0.0, 1), (0.5, 0)):
        hole = moved(
            scaled(Polyline(np.array([[-1, 0, 1.0], [1, 0, 1.0]]), True), 0.1),
            10.15 + off + gap,
            5.5,
        )
        done = add_reliefs(WITHIN, POCKET, R, "dogbone", Polylines.of([hole, POCKET]))
        assert len(done.left) == left
        if left:
            assert done.left[0].tolist() == [10.0, 6.0]
        assert len(_tips(done.path, WITHIN)) == 4 - left


@given(st.floats(25.0, 150.0), st.floats(25.0, 150.0), st.sampled_from(["dogbone", "overcut"]))
def test_triangles(first: float, second: float, kind: str) -> None:
    """Every corner of a pocket of three sides is reached; the path around it is its incircle's."""
    if first + second > 155.0:
        return
    a, b = math.radians(first), math.radians(second)
    base = 40.0
    high = base * math.sin(a) * math.sin(b) / math.sin(a + b)
    corners = np.array([[0, 0], [base, 0], [high / math.tan(a), high]])
    part = Polyline(np.column_stack([corners, np.zeros(3)]), True)
    inner = []
    for k in range(3):
        to, fro = corners[k - 2] - corners[k], corners[k - 1] - corners[k]
        to, fro = to / math.hypot(*to), fro / math.hypot(*fro)
        way = to + fro
        way /= math.hypot(*way)
        sine = abs(to[0] * way[1] - to[1] * way[0])
        inner.append([*(corners[k] + way * R / sine), 0.0])
    path = Polyline(np.array(inner), True)
    sides = np.hypot(*(corners - np.roll(corners, 1, axis=0)).T)
    radius = 2.0 * 0.5 * base * high / sides.sum()
    if radius < 2.0 * R:
        return
    done = add_reliefs(path, part, R, kind, ALONE)
    reached = chain_distances(corners, _ring(done.path)) - R
    assert reached == pytest.approx(np.zeros(3), abs=1e-5)
    assert len(done.left) == 0
