"""The kernels of offsets against literal oracles."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.boxes import IndexedCurves, curve_rows_of
from camtool.geometry.distance import points_to_segments
from camtool.geometry.intersect import Crossings, crossings
from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.offset import (
    NODE_EPS_MM,
    VALIDITY_EPS_MM,
    Offset,
    Slices,
    merge_points,
    raw_offset,
    shape_stages,
    source_arrays,
    trace_loops,
    without_dead_ends,
    without_doubles,
)
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.kernels import offsets
from tests.oracles import offset_stages as oracle
from tests.oracles.contours import RANDOM, gear
from tests.oracles.offset_shapes import kites
from tests.paths import offset
from tests.strategies import examples

pytestmark = pytest.mark.checked

SEEDS = st.integers(0, 2**32 - 1)


def segments(rng: np.random.Generator, count: int, grid: bool = False) -> Segments:
    """Lines and arcs anywhere, or on a grid, where many coincide."""
    start, way = rng.uniform(0.0, 10.0, (count, 2)), rng.normal(size=(count, 2)) * 2.0
    bulge = rng.uniform(-1.0, 1.0, count) * rng.choice([0.0, 0.01, 1.0], count)
    if grid:
        start, way, bulge = np.round(start), np.round(way), rng.choice([0.0, 1.0, -1.0], count)
    apart = np.hypot(*way.T) > 0.0
    return Segments.between(start[apart], (start + way)[apart], bulge[apart])


@given(SEEDS)
def test_rows_are_the_curves(seed: int) -> None:
    rng = np.random.default_rng(seed)
    some = segments(rng, 40)
    rows, boxes = curve_rows_of(some), segment_boxes(some)
    assert np.allclose(rows[:, offsets.LENGTH], segment_lengths(some), rtol=1e-13)
    held = offsets.curve_boxes(rows, 0.0)
    assert (held[:, :2] <= boxes[:, :2] + 1e-12).all()
    assert (held[:, 2:] >= boxes[:, 2:] - 1e-12).all()
    # Not much wider than need be: as the rectangle about chord and arc is.
    chord = np.hypot(*(some.end - some.start).T)
    assert (held[:, 2:] - held[:, :2]).max() <= 2.0 * chord.max()
    for t in (0.0, 0.3, 1.0):
        wanted = point_at(some, np.arange(len(some)), np.full(len(some), t))
        got = [offsets.point_on(rows, i, t) for i in range(len(some))]
        assert np.allclose(got, wanted, atol=1e-13)
        lengths = [offsets.arc_length_at(rows, i, *p) for i, p in enumerate(wanted)]
        assert np.allclose(lengths, t * segment_lengths(some), atol=1e-11)


@given(SEEDS)
def test_distances(seed: int) -> None:
    rng = np.random.default_rng(seed)
    some = segments(rng, int(rng.integers(1, 60)))
    curves = IndexedCurves.of(some)
    points = rng.uniform(-5.0, 15.0, (60, 2))
    every = points_to_segments(points, some)
    got = offsets.nearest_distances(points, curves.rows, curves.tree)
    assert np.allclose(got, every.min(axis=1), atol=1e-13)
    limits = rng.uniform(0.0, 4.0, len(points))
    pairs = offsets.curves_within(points, limits, curves.rows, curves.tree)
    assert (np.diff(pairs[:, 0]) >= 0).all()
    assert sorted(map(tuple, pairs.tolist())) == [
        (int(i), int(j)) for i, j in zip(*np.nonzero(every <= limits[:, None]), strict=True)
    ]
    room, reach = np.empty(64, np.int64), float(rng.uniform(0.5, 4.0))
    stack = np.empty(offsets.DEPTH, np.int64)
    for point, row in zip(points, every, strict=True):
        x, y = float(point[0]), float(point[1])
        count = offsets.gathered(curves.rows, curves.tree, x, y, reach, room, stack)
        assert sorted(room[:count]) == np.flatnonzero(row < reach).tolist()
        if count > 1:
            few = room[: count - 1].copy()
            assert offsets.gathered(curves.rows, curves.tree, x, y, reach, few, stack) == -1


@given(SEEDS, st.booleans())
def test_meetings(seed: int, grid: bool) -> None:
    rng = np.random.default_rng(seed)
    one, other = segments(rng, 30, grid), segments(rng, 20, grid)
    eps = 1e-8
    a, b = IndexedCurves.of(one, margin_mm=eps), IndexedCurves.of(other, margin_mm=eps)
    for wanted, curves, own in (
        (each_once(crossings(one, one, position_eps_mm=eps)), a, True),
        (crossings(one, other, position_eps_mm=eps), b, False),
    ):
        pairs = offsets.pairs_of(a.boxes, a.tree, curves.boxes, curves.tree, own)
        assert len(np.unique(pairs, axis=0)) == len(pairs)
        rows, at = offsets.meetings_of(a.rows, curves.rows, pairs, eps)
        got = np.column_stack([rows, at[:, 2:], at[:, :2]])
        want = np.column_stack([wanted.row_a, wanted.row_b, wanted.ta, wanted.tb, wanted.point])
        # Where curves are tangent, what they share up to eps is one meeting here, and may be two
        # there: they are then up to √(2 eps/k) apart.
        near = 1e-3 if grid else 1e-6
        assert without_partner(got, want, near) == []
        assert without_partner(want, got, near) == []


def each_once(found: Crossings) -> Crossings:
    """The meetings of two different rows, not those of the same two the other way round."""
    return found[found.row_a < found.row_b]


def without_partner(some: np.ndarray, others: np.ndarray, near: float) -> list[list[float]]:
    """Rows of which nothing like them is among the others, to `near` in the place."""
    return [
        row.tolist()
        for row in some
        if not (np.abs(others - row).max(axis=1, initial=0.0) < near).any()
    ]


@given(SEEDS)
def test_merged_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.round(rng.uniform(0.0, 4.0, (60, 2)), 1) + rng.uniform(0.0, 0.02, (60, 2))
    node, nodes = merge_points(points, 0.09)
    wanted = oracle.groups(points, 0.09)
    assert [set(np.flatnonzero(node == k)) for k in range(len(nodes))] == wanted
    assert nodes.tolist() == [points[min(group)].tolist() for group in wanted]


def test_thousands_of_points_in_one_place_are_one_node() -> None:
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(size=(5000, 2)) * 1e-10, rng.uniform(1, 2, (10, 2))])
    node, nodes = merge_points(points, 1e-8)
    assert len(nodes) == 11
    assert (node[:5000] == 0).all()


@examples(12)
@given(SEEDS, st.sampled_from(list(RANDOM)), st.floats(0.01, 0.6), st.booleans())
def test_stages(seed: int, kind: str, share: float, outward: bool) -> None:
    rng = np.random.default_rng(seed)
    drawn = RANDOM[kind](rng)
    if drawn is None or len(drawn[0]) > 40:
        return
    p = Polyline(drawn[0].vertices * (1.0 if not outward else np.array([-1.0, 1.0, -1.0])), True)
    asked = Offset(share * drawn[1])
    stages = shape_stages(Polylines.of([p]), asked)
    elements, least = stages.trimmed.elements, asked.distance_mm - VALIDITY_EPS_MM
    wanted = oracle.valid(stages.slices, elements, Segments.of(p), least)
    assert (stages.valid == wanted).all()
    kept = stages.slices[stages.valid]
    eps = 2.0 * NODE_EPS_MM
    one = without_doubles(kept, elements)
    other = oracle.without_doubles(kept, elements, eps)
    assert one.element.tolist() == other.element.tolist()
    one, other = without_dead_ends(one), oracle.without_dead_ends(other)
    assert (one.t0.tolist(), one.to_node.tolist()) == (other.t0.tolist(), other.to_node.tolist())
    loops, walked = trace_loops(one, elements), oracle.trace_loops(other, elements)
    assert sorted(map(cycle, loops)) == sorted(map(cycle, walked))
    eps = POSITION_EPS_MM
    clean = [oracle.without_slivers(oracle.vertices_of(r, other, elements), eps) for r in walked]
    left = [each for each in clean if each is not None and len(each) > 1]
    found = offset(p, asked.distance_mm)
    if len(found) == len(left):
        lengths = sorted(len(each) for each in left)
        assert sorted(len(each) for each in found) == lengths
    else:
        assert len(found) < len(left)  # some have no width


def cycle(loop: np.ndarray) -> list[int]:
    """The rows of a loop from its least one on."""
    return list(np.roll(loop, -int(loop.argmin())))


@given(SEEDS)
def test_loops_in_any_tangle(seed: int) -> None:
    # Slices between a few nodes, many at each: all that leads on is in exactly one loop or none.
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(0.0, 10.0, (6, 2))
    ends = np.array([rng.choice(6, 2, replace=False) for _ in range(24)])
    elements = Segments.between(nodes[ends[:, 0]], nodes[ends[:, 1]], rng.uniform(-1, 1, 24))
    slices = Slices(
        np.arange(24), np.zeros(24), np.ones(24), ends[:, 0].copy(), ends[:, 1].copy(), nodes
    )
    one, other = without_dead_ends(slices), oracle.without_dead_ends(slices)
    assert one.element.tolist() == other.element.tolist()
    loops, walked = trace_loops(one, elements), oracle.trace_loops(one, elements)
    assert sorted(map(cycle, loops)) == sorted(map(cycle, walked))
    used = np.concatenate([*loops, np.empty(0, dtype=np.int64)])
    assert len(np.unique(used)) == len(used)


@given(SEEDS, st.sampled_from([1.0, 1.3, 2.0, 100.0]))
def test_depth_in_kites(seed: int, limit: float) -> None:
    rng = np.random.default_rng(seed)
    p = gear(int(rng.integers(3, 9)), 6.0, 10.0)
    d = float(rng.uniform(0.1, 3.0))
    raw = raw_offset(Polylines.of([p]), Offset(d, limit))
    wanted = [shapely.Polygon(kite) for kite in kites([p], d, limit)]
    _, _, own, tree = source_arrays(Segments.of(p), raw.kites)
    assert len(own) == len(wanted)
    stack = np.empty(offsets.DEPTH, np.int64)
    for x, y in rng.uniform(-14.0, 14.0, (200, 2)):
        points = [shapely.Point(x, y)] * len(wanted)
        deep = [
            k.exterior.distance(q) for k, q in zip(wanted, points, strict=True) if k.contains(q)
        ]
        got = offsets.deepest(own, tree, x, y, 0.0, math.inf, stack)
        assert math.isclose(got, max(deep, default=0.0), abs_tol=1e-9)
