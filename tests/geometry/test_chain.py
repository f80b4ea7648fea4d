"""Loose lines and arcs joined to contours."""

from __future__ import annotations

import math
from itertools import pairwise
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import GeometryError
from camtool.geometry.chain import chain
from camtool.geometry.measure import length, path_lengths, signed_area
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, reverse
from tests.strategies import contours, polylines

GAP = 0.01


def _path(*points: tuple[float, ...]) -> Polyline:
    """(x, y) or (x, y, bulge)."""
    return Polyline(np.array([(*p, 0.0)[:3] for p in points]))


def _pieces(path: Polyline) -> list[Polyline]:
    """Each segment of a path by itself."""
    rows = [*path.vertices, path.vertices[0]] if path.closed else list(path.vertices)
    return [Polyline(np.array([a, b])) for a, b in pairwise(rows)]


@given(contours(), st.randoms(use_true_random=False), st.booleans())
def test_a_contour_in_pieces_comes_back_whole(path: Polyline, random: Random, ring: bool) -> None:
    whole = path if ring else Polyline(path.vertices)
    pieces = [reverse(p) if random.random() < 0.5 else p for p in _pieces(whole)]
    random.shuffle(pieces)
    found = chain(Polylines.of(pieces), GAP)
    assert len(found.lines) == 1
    assert bool(found.lines.closed[0]) == ring
    assert sorted(found.members[0]) == list(range(len(pieces)))
    assert length(found.lines[0]) == pytest.approx(length(whole), rel=1e-12)
    assert abs(signed_area(found.lines[0])) == pytest.approx(abs(signed_area(whole)), rel=1e-9)
    assert found.closed_gaps == ()


def test_a_chain_runs_as_its_first_path_is_drawn() -> None:
    paths = [_path((1, 0), (2, 0)), _path((3, 0), (2, 0)), _path((1, 0), (0, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert found.members == ((2, 0, 1),)
    assert found.lines[0].vertices[:, 0].tolist() == [0, 1, 2, 3]


def test_two_lines_meet_in_the_middle_of_their_gap() -> None:
    paths = [_path((0, 0), (1, 0)), _path((1.004, 0), (2, 1))]
    found = chain(Polylines.of(paths), GAP)
    assert found.lines[0].vertices[1].tolist() == pytest.approx([1.002, 0, 0])
    (gap,) = found.closed_gaps
    assert gap.size_mm == pytest.approx(0.004)
    assert gap.at_mm == pytest.approx((1.002, 0.0))


@pytest.mark.parametrize("arc_first", [True, False])
def test_a_line_moves_to_the_end_of_an_arc(arc_first: bool) -> None:
    arc = _path((0, 0, 0.5), (1, 0))
    line = _path((1, 0.004), (5, 0.004))
    paths = [arc, line] if arc_first else [reverse(line), reverse(arc)]
    path = chain(Polylines.of(paths), GAP).lines[0]
    path = path if arc_first else reverse(path)
    assert path.vertices.tolist() == [[0, 0, 0.5], [1, 0, 0], [5, 0.004, 0]]


def test_two_arcs_keep_their_shape_and_get_a_short_line_between() -> None:
    paths = [_path((0, 0, 0.5), (1, 0)), _path((1, 0.004, -0.25), (2, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert found.lines[0].vertices.tolist() == [
        [0, 0, 0.5],
        [1, 0, 0],
        [1, 0.004, -0.25],
        [2, 0, 0],
    ]
    assert [gap.size_mm for gap in found.closed_gaps] == [pytest.approx(0.004)]


def test_an_arc_and_its_chord_close_with_a_gap_at_each_end() -> None:
    paths = [_path((0, 0.003, 1.0), (2, 0.003)), _path((0, 0), (2, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert found.lines.closed.tolist() == [True]
    assert found.lines[0].vertices.tolist() == [[0, 0.003, 1], [2, 0.003, 0]]
    assert len(found.closed_gaps) == 2


def test_two_half_circles_make_a_circle() -> None:
    paths = [_path((0, 0, 1), (2, 0)), _path((0, 0, -1), (2, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert found.lines.closed.tolist() == [True]
    assert signed_area(found.lines[0]) == pytest.approx(math.pi)


def test_a_path_whose_own_ends_meet_becomes_closed() -> None:
    path = _path((0, 0), (1, 0), (1, 1), (0, 1), (0.002, 0.002))
    found = chain(Polylines.of([path]), GAP)
    assert found.lines.closed.tolist() == [True]
    assert found.lines[0].vertices[0] == pytest.approx([0.001, 0.001, 0.0])
    assert len(found.lines[0]) == 4


@pytest.mark.parametrize(
    "double",
    [
        [_path((0, 0), (3, 0)), _path((0, 0), (3, 0))],
        [_path((0, 0), (3, 0)), _path((3, 0), (0, 0))],
        [_path((0, 0, 0.5), (3, 0)), _path((0, 0, 0.5), (3, 0))],
        [_path((0, 0), (0.004, 0))],
        [_path((0, 0), (3, 0), (0, 0))],
    ],
)
def test_no_ring_is_closed_around_nothing(double: list[Polyline]) -> None:
    found = chain(Polylines.of(double), GAP)
    assert not found.lines.closed.any()
    assert path_lengths(found.lines).sum() == pytest.approx(sum(length(p) for p in double))


def test_nearest_ends_are_joined_first() -> None:
    paths = [_path((0, 0), (1, 0)), _path((1.009, 0), (2, 5)), _path((1.001, 0), (2, -5))]
    found = chain(Polylines.of(paths), GAP)
    assert found.members == ((0, 2), (1,))


def test_ends_farther_than_the_gap_stay_open_and_are_reported() -> None:
    paths = [_path((0, 0), (1, 0)), _path((1.02, 0), (2, 0)), _path((50, 0), (60, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert len(found.lines) == 3
    (gap,) = found.open_gaps
    assert gap.size_mm == pytest.approx(0.02)
    assert gap.at_mm == pytest.approx((1.01, 0.0))


def test_the_own_other_end_counts_as_a_gap_too() -> None:
    nearly = _path((0, 0), (5, 0), (5, 5), (0, 5), (0, 0.5))
    (gap,) = chain(Polylines.of([nearly]), GAP).open_gaps
    assert gap.size_mm == pytest.approx(0.5)
    assert chain(Polylines.of([_path((0, 0), (0.5, 0))]), GAP).open_gaps == ()


def test_layers_are_not_mixed() -> None:
    paths = Polylines.of([_path((0, 0), (1, 0)), _path((1, 0), (2, 0))])
    assert len(chain(paths, GAP, ["A", "B"]).lines) == 2
    assert len(chain(paths, GAP, ["A", "A"]).lines) == 1
    near = Polylines.of([_path((0, 0), (1, 0)), _path((1.02, 0), (2, 0))])
    gaps = chain(near, GAP, ["A", "A"])
    assert [gap.layer for gap in gaps.open_gaps] == ["A"]


def test_closed_paths_stay_and_results_keep_the_order_of_drawing() -> None:
    ring = Polyline(np.array([[0.0, 0, 1], [1, 0, 1]]), closed=True)
    paths = [_path((5, 0), (6, 0)), ring, _path((6, 0), (7, 0)), _path((9, 9), (10, 10))]
    found = chain(Polylines.of(paths), GAP)
    assert found.members == ((0, 2), (1,), (3,))
    assert np.array_equal(found.lines[1].vertices, ring.vertices)


def test_no_gap_joins_equal_ends_only() -> None:
    paths = Polylines.of(
        [_path((0, 0), (1, 0)), _path((1, 0.5e-6), (2, 0)), _path((2, 2e-6), (3, 0))]
    )
    found = chain(paths, 0.0)
    assert found.members == ((0, 1), (2,))
    assert found.closed_gaps == ()


def test_lines_shorter_than_the_gap_vanish_in_it() -> None:
    paths = [_path((0, 0), (1, 0)), _path((1.005, 0), (1.008, 0)), _path((1.012, 0), (2, 0))]
    found = chain(Polylines.of(paths), GAP)
    assert found.members == ((0, 1, 2),)
    assert length(found.lines[0]) == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("gap", [-1.0, math.nan, math.inf])
def test_a_gap_that_is_none_is_refused(gap: float) -> None:
    with pytest.raises(GeometryError):
        chain(Polylines.of([]), gap)


def test_groups_must_fit() -> None:
    with pytest.raises(GeometryError, match="groups"):
        chain(Polylines.of([_path((0, 0), (1, 0))]), GAP, [])


def test_nothing_chains_to_nothing() -> None:
    found = chain(Polylines.of([]), GAP)
    assert (len(found.lines), found.members, found.open_gaps) == (0, (), ())


@given(st.lists(polylines(max_points=4, reach_mm=0.02), max_size=8))
def test_every_path_is_in_one_chain_whatever_is_drawn(paths: list[Polyline]) -> None:
    # Everything lies within a few gaps here, so that anything may be joined with anything.
    found = chain(Polylines.of(paths), GAP)
    assert sorted(i for of in found.members for i in of) == list(range(len(paths)))
    # Two ways to round the same distance may differ in the last digit.
    assert all(gap.size_mm <= GAP * (1.0 + 1e-12) for gap in found.closed_gaps)
    assert all(gap.size_mm > POSITION_EPS_MM for gap in found.closed_gaps)
