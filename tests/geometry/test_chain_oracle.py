"""Chaining against its literal oracle, and under changes that must not matter."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.chain import Chained, Kinds, chain
from camtool.geometry.intersect import self_crossings_of
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, reverse, rotate
from camtool.kernels.chaining import nearest_others
from tests.oracles.chaining import chained, nearest_other
from tests.paths import mirrored, moved, scaled

pytestmark = pytest.mark.checked

GAP = 0.01

# Points on a coarse lattice, some a hair or half a gap off, so that ends meet in many ways.
NODES = st.tuples(st.integers(0, 3), st.integers(0, 3))
SHIFTS = st.sampled_from([0.0, 0.0, 0.0, 3e-7, 0.0007, 0.004, 0.009])
BULGES = st.sampled_from([0.0, 0.0, 0.0, 0.5, -1.0])


@st.composite
def networks(draw: st.DrawFn) -> list[Polyline]:
    """Short paths between the nodes of a lattice."""
    paths = []
    for _ in range(draw(st.integers(1, 14))):
        nodes = draw(st.lists(NODES, min_size=2, max_size=3, unique=True))
        rows = [(x + draw(SHIFTS), y + draw(SHIFTS), draw(BULGES)) for x, y in nodes]
        paths.append(Polyline(np.array(rows), draw(st.sampled_from([False, False, False, True]))))
    return paths


@given(networks(), st.randoms(use_true_random=False), st.sampled_from([0.0, GAP, 1.2]))
def test_it_equals_the_twin(paths: list[Polyline], random: Random, gap: float) -> None:
    groups = [random.choice("AAB") for _ in paths]
    styles = [random.choice("xxy") for _ in paths]
    found = chain(Polylines.of(paths), gap, kinds=Kinds(groups, styles))
    wanted = chained(paths, gap, groups, styles)
    assert found.members == tuple(of for of, _ in wanted.paths)
    assert found.lines.closed.tolist() == [path.closed for _, path in wanted.paths]
    for path, (_, other) in zip(found.lines, wanted.paths, strict=True):
        assert path.vertices == pytest.approx(other.vertices, abs=1e-12)
    assert sorted(g.size_mm for g in found.closed_gaps) == pytest.approx(sorted(wanted.gaps))
    # Branches of two groups may stand at one place.
    assert sorted((b.at_mm, b.ends, b.paths) for b in found.branches) == wanted.branches


def shapes(found: Chained) -> list[tuple[bool, float, float]]:
    """Return the contours in a form that does not depend on order, start and direction."""
    rows = zip(
        found.lines.closed.tolist(),
        np.round(path_lengths(found.lines), 6).tolist(),
        np.round(np.abs(signed_areas(found.lines)), 6).tolist(),
        strict=True,
    )
    return sorted(rows)


def branches(found: Chained) -> list[tuple[object, ...]]:
    """Return branches and the contours that they affect, in a form without an order."""
    sizes = np.round(path_lengths(found.lines), 6).tolist()
    return [
        (branch.at_mm, branch.ends, sorted(sizes[path] for path in branch.paths))
        for branch in found.branches
    ]


def grid_lines(draw: Random) -> list[Polyline]:
    """Different edges of a grid: corners, crosses and branches with exact ends."""
    edges = [
        ((x, y), (x + dx, y + dy))
        for x in range(4)
        for y in range(4)
        for dx, dy in ((1, 0), (0, 1))
    ]
    chosen = draw.sample(edges, draw.randint(1, len(edges)))
    return [Polyline(np.array([(*a, 0.0), (*b, 0.0)])) for a, b in chosen]


@given(st.integers(0, 10**6))
def test_order_and_direction_of_drawing_change_nothing(seed: int) -> None:
    random = Random(seed)
    paths = grid_lines(random)
    other = [reverse(p) if random.random() < 0.5 else p for p in paths]
    random.shuffle(other)
    one, two = chain(Polylines.of(paths), GAP), chain(Polylines.of(other), GAP)
    assert shapes(one) == shapes(two)
    assert branches(one) == branches(two)


def fields(random: Random) -> list[Polyline]:
    """The edges of fields of a chessboard, which touch each other at corners only."""
    board = [(x, y) for x in range(4) for y in range(4) if (x + y) % 2 == 0]
    paths = []
    for x, y in random.sample(board, random.randint(1, len(board))):
        corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True):
            paths.append(Polyline(np.array([(*a, 0.0), (*b, 0.0)])))
    random.shuffle(paths)
    return [reverse(p) if random.random() < 0.5 else p for p in paths]


@given(st.integers(0, 10**6))
def test_fields_of_a_chessboard_are_contours_that_do_not_cross(seed: int) -> None:
    paths = fields(Random(seed))
    found = chain(Polylines.of(paths), GAP)
    assert found.lines.closed.all()
    assert self_crossings_of(found.lines, [""] * len(found.lines)) == ()
    assert path_lengths(found.lines).sum() == pytest.approx(len(paths))
    wanted = chained(paths, GAP, [""] * len(paths), [""] * len(paths))
    assert found.members == tuple(of for of, _ in wanted.paths)


CHANGES = {"moved": lambda p: moved(p, 31.5, -7.25), "scaled": lambda p: scaled(p, 4.0)}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@given(seed=st.integers(0, 10**6))
def test_moved_and_scaled_drawings_chain_alike(change, seed: int) -> None:  # type: ignore[no-untyped-def]
    paths = grid_lines(Random(seed))
    one = chain(Polylines.of(paths), GAP)
    two = chain(Polylines.of([change(p) for p in paths]), GAP)
    assert one.members == two.members
    assert one.lines.closed.tolist() == two.lines.closed.tolist()


@given(st.integers(0, 10**6), st.sampled_from([0.5 * math.pi, 1.0]), st.booleans())
def test_turned_and_mirrored_drawings_have_as_much_line(
    seed: int, angle: float, mirror: bool
) -> None:
    # Ties at a branch are broken by place, so contours may differ, but not what is cut.
    paths = grid_lines(Random(seed))
    turned = [rotate(mirrored(p) if mirror else p, angle) for p in paths]
    one, two = chain(Polylines.of(paths), GAP), chain(Polylines.of(turned), GAP)
    assert path_lengths(two.lines).sum() == pytest.approx(path_lengths(one.lines).sum())
    assert sorted(i for of in two.members for i in of) == list(range(len(paths)))
    assert len(one.branches) == len(two.branches)
    assert sorted(b.ends for b in one.branches) == sorted(b.ends for b in two.branches)


def _lines(*rows: tuple[float, float, float, float]) -> Polylines:
    return Polylines.of([Polyline(np.array([(a, b, 0.0), (c, d, 0.0)])) for a, b, c, d in rows])


def test_the_straightest_way_goes_on() -> None:
    cross = _lines((-1, 0, 0, 0), (0, 0, 0, 1), (0, -1, 0, 0), (1, 0, 0, 0))
    found = chain(cross, GAP)
    assert found.members == ((0, 3), (2, 1)) or found.members == ((0, 3), (1, 2))
    assert [(b.at_mm, b.ends) for b in found.branches] == [((0.0, 0.0), 4)]


def test_arcs_go_on_along_their_tangent() -> None:
    quarter = math.tan(math.pi / 8.0)
    arc = Polyline(np.array([[-1.0, 1.0, quarter], [0.0, 0.0, 0.0]]))  # arrives along +x
    paths = [arc, *_lines((0, 0, 1, -0.2), (0, 0, 1, 0.01), (0, 0, 0.5, 1))]
    assert chain(Polylines.of(paths), GAP).members[0] == (0, 2)


def test_one_style_comes_before_a_straight_way() -> None:
    lines = _lines((-1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    found = chain(lines, GAP, kinds=Kinds(styles=["red", "blue", "red"]))
    assert found.members == ((0, 2), (1,))


def test_contours_that_touch_at_a_corner_stay_apart() -> None:
    one = [(0, 0), (-1, 0), (-1, -1), (0, -1)]
    two = [(0, 0), (1, 0), (1, 1), (0, 1)]
    rows = [(*ring[i], *ring[(i + 1) % 4]) for ring in (one, two) for i in range(4)]
    found = chain(_lines(*rows), GAP)
    assert found.lines.closed.tolist() == [True, True]
    assert np.abs(signed_areas(found.lines)).tolist() == [1.0, 1.0]
    assert [b.ends for b in found.branches] == [4]


def test_a_hub_of_very_many_lines_is_joined_in_bounded_time() -> None:
    count = 3000
    angle = np.arange(count) * 2.0 * math.pi / count
    rows = [(0.0, 0.0, 9 * math.cos(a), 9 * math.sin(a)) for a in angle.tolist()]
    found = chain(_lines(*rows), GAP)
    assert len(found.lines) == count // 2
    (branch,) = found.branches
    assert branch.ends == count


def test_lines_of_a_hatch_have_no_gaps_at_their_ends() -> None:
    hatch = _lines(*((0.0, 0.1 * k, 50.0, 0.1 * k) for k in range(20)))
    assert chain(hatch, GAP).open_gaps == ()


def test_of_very_many_strokes_some_are_near_by_chance() -> None:
    rng = np.random.default_rng(1)
    begin = 100.0 * rng.random((2000, 2))
    rows = np.column_stack([begin, begin + rng.normal(scale=30.0, size=begin.shape)])
    assert len(chain(_lines(*rows.tolist()), GAP).open_gaps) < 0.05 * len(rows)


def test_short_strokes_near_each_other_are_meant_so() -> None:
    strokes = _lines((0, 0, 0.3, 0), (0.35, 0, 0.6, 0.1), (0.3, 0.05, 0.3, 0.4))
    assert chain(strokes, GAP).open_gaps == ()


@given(
    st.lists(st.tuples(st.floats(0, 5), st.floats(0, 5)), min_size=1, max_size=40),
    st.floats(0.1, 3.0),
    st.floats(0.05, 4.0),
)
def test_the_nearest_other_point_equals_the_twin(
    rows: list[tuple[float, float]], reach: float, size: float
) -> None:
    points = np.array(rows)
    cells = np.floor(points / size).astype(np.int64)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    nearest, distance = nearest_others(cells[order], points[order], size, POSITION_EPS_MM, reach)
    wanted = nearest_other(points[order], POSITION_EPS_MM, reach)
    assert distance.tolist() == pytest.approx(wanted, rel=1e-12)
    assert ((nearest >= 0) == np.isfinite(distance)).all()
