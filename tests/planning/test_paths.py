"""Places, directions and pieces of a path by the length along it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import length
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines
from camtool.planning.paths import MeasuredPath, MeasuredPaths, reverse_vertices
from camtool.planning.ramps import lift_paths
from tests.oracles import passes
from tests.oracles.arcs import chain_distances, chain_points
from tests.strategies import contours, examples, open_contours, polylines

pytestmark = pytest.mark.checked

# A half circle, a line, and an arc that bends the other way.
MIXED = Polyline(np.array([[0, 0, 1.0], [4, 0, 0.0], [4, 6, -0.5], [0, 6, 0.0]]), True)


def _closed_rows(path: Polyline) -> np.ndarray:
    rows = path.vertices
    return np.concatenate([rows, rows[:1]]) if path.closed else rows


@given(polylines(), st.floats(-1.5, 2.5), st.floats(0.0, 2.0))
def test_a_piece_lies_on_its_path_and_is_as_long(
    path: Polyline, begin: float, size: float
) -> None:
    along = MeasuredPath.of(path)
    if not path.closed:
        begin, size = min(max(begin, 0.0), 0.9), min(size, 1.0)
    low = begin * along.total_mm
    high = low + size * along.total_mm
    if not path.closed:
        high = min(high, along.total_mm)
    if high - low < 10.0 * POSITION_EPS_MM:
        return
    piece = along.piece(low, high)
    assert length(Polyline(piece)) == pytest.approx(high - low, abs=4e-6, rel=1e-9)
    assert chain_distances(chain_points(piece, 5), _closed_rows(path)).max() <= 1e-7
    assert piece[0, :2] == pytest.approx(along.at(np.array([low]))[0], abs=2e-6)
    assert piece[-1, :2] == pytest.approx(along.at(np.array([high]))[0], abs=2e-6)


@given(open_contours(), st.floats(0.1, 0.9))
def test_pieces_joined_are_the_path(path: Polyline, share: float) -> None:
    along = MeasuredPath.of(path)
    cut = share * along.total_mm
    one, two = along.piece(0.0, cut), along.piece(cut, along.total_mm)
    assert one[-1, :2] == pytest.approx(two[0, :2], abs=2e-6)
    assert len(one) + len(two) <= len(path.vertices) + 2
    whole = along.piece(0.0, along.total_mm)
    assert (whole == path.vertices).all()


def test_a_whole_lap_from_anywhere_keeps_every_vertex_exactly() -> None:
    along = MeasuredPath.of(MIXED)
    lap = along.piece(along.reach[2] + 3 * along.total_mm, along.reach[2] + 4 * along.total_mm)
    wanted = np.roll(MIXED.vertices, -2, axis=0)
    assert (lap[:-1] == wanted).all()
    assert (lap[-1, :2] == wanted[0, :2]).all()


@given(contours(), st.floats(-1.0, 1.0), st.floats(0.05, 1.5))
def test_backwards_is_the_same_piece_the_other_way(
    path: Polyline, begin: float, size: float
) -> None:
    along = MeasuredPath.of(path)
    low, high = begin * along.total_mm, (begin + size) * along.total_mm
    back = along.piece(high, low)
    assert (reverse_vertices(back) == along.piece(low, high)).all()
    assert length(Polyline(back)) == pytest.approx(high - low, abs=4e-6)


def test_a_piece_too_short_for_a_vertex_is_still_a_piece() -> None:
    along = MeasuredPath.of(MIXED)
    for middle in (*along.reach.tolist(), 3.3, 8.0):
        piece = along.piece(middle - 2e-7, middle + 2e-7)
        assert piece.shape == (2, 3)
        assert piece[0, :2] == pytest.approx(along.at(np.array([middle]))[0], abs=2e-6)


def test_directions_at_a_vertex_follow_and_arrivals_lead_to_it() -> None:
    along = MeasuredPath.of(MIXED)
    at = along.reach[1:2]
    for off in (-1e-9, 0.0, 1e-9):
        assert along.directions(at + off)[0] == pytest.approx([0.0, 1.0], abs=1e-8)
        assert along.arrivals(at + off)[0] == pytest.approx([0.0, 1.0], abs=1e-8)
    corner = along.reach[2:3]
    half = 2.0 * math.atan(0.5)
    for lap in (0.0, along.total_mm):
        assert along.arrivals(corner + lap)[0] == pytest.approx([0.0, 1.0])
        # The chord of the arc runs along −x; the tangent is turned by half the sweep of −4 atan ½.
        assert along.directions(corner + lap)[0] == pytest.approx(
            [-math.cos(half), -math.sin(half)]
        )
    ends = along.arrivals(np.array([0.0, along.total_mm]))
    assert ends[0] == pytest.approx(ends[1])


def test_turns_are_signed_angles_between_segments() -> None:
    square = Polyline(np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0.0]]), True)
    assert MeasuredPath.of(square).turns == pytest.approx([math.pi / 2] * 4)
    zigzag = Polyline(np.array([[0, 0, 0], [1, 0, 0], [2, -1, 0], [3, 0, 0.0]]))
    assert MeasuredPath.of(zigzag).turns == pytest.approx([0.0, -math.pi / 4, math.pi / 2])


@given(contours(), st.floats(-15.0, 15.0), st.floats(-15.0, 15.0))
def test_nearest_to_is_as_near_as_any_sample(path: Polyline, x: float, y: float) -> None:
    along = MeasuredPath.of(path)
    where = np.array([x, y])
    found = along.at(np.array([along.nearest_to((x, y))]))[0]
    rows = _closed_rows(path)
    least = chain_distances(where[None], rows)[0]
    assert math.dist(found, where) == pytest.approx(least, abs=1e-9)


lengths = st.floats(-1.5, 2.5)


@given(polylines(), lengths, lengths)
def test_a_piece_is_that_of_the_plain_way(path: Polyline, begin: float, end: float) -> None:
    along = MeasuredPath.of(path)
    if not path.closed:
        begin, end = (min(max(each, 0.0), 1.0) for each in (begin, end))
    if begin == end:
        return
    found = along.piece(begin * along.total_mm, end * along.total_mm)
    wanted = passes.piece(path, begin * along.total_mm, end * along.total_mm)
    assert found.shape == wanted.shape
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@examples(30, 2000)
@given(
    st.lists(
        st.tuples(polylines(), st.lists(st.tuples(lengths, st.floats(-3.0, 0.0)), min_size=1)),
        min_size=1,
        max_size=4,
    )
)
def test_many_paths_are_lifted_as_each_by_itself(
    drawn: list[tuple[Polyline, list[tuple[float, float]]]],
) -> None:
    paths = MeasuredPaths(Polylines.of(path for path, _ in drawn))
    profiles = []
    for along, (_, points) in zip(paths, drawn, strict=True):
        shares = [s if along.closed else min(max(s, 0.0), 1.0) for s, _ in points]
        profiles.append(
            [(s * along.total_mm, z) for s, (_, z) in zip(shares, points, strict=True)]
        )
    index = range(len(drawn))
    found = lift_paths(paths, [*index, *index], [*profiles, *(each[::-1] for each in profiles)])
    for k, vertices in enumerate(found):
        path, points = drawn[k % len(drawn)][0], profiles[k % len(drawn)]
        wanted = passes.lifted(path, points if k < len(drawn) else points[::-1])
        assert vertices.shape == wanted.shape
        assert vertices == pytest.approx(wanted, rel=1e-12, abs=1e-11)
