"""The kernel of the pursuit against a literal oracle: points on a circle, and their distances."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.kernels.pursuit import Pursuit
from camtool.planning.paths import MeasuredPath
from camtool.planning.pursuing import corners_of, discs_about, pieces_of, stretches
from camtool.planning.strokes import chords
from tests.oracles.contours import CIRCLE, SQUARE
from tests.planning.pocket_cases import region_of
from tests.strategies import examples

RADIUS = 1.0
EXTENTS = np.array([[0.0, 0.0], [10.0, 10.0]])
POINTS = 3600
CELL = 1.0 / 12.0


def pursuit(limit: float = 1.0, cell_mm: float = CELL) -> Pursuit:
    walls = pieces_of(region_of([SQUARE]))
    return Pursuit(walls, 0.0, EXTENTS, RADIUS, limit, 0.0, 0.006, cell_mm)


def away(points: Floats, paths: list[Floats]) -> Floats:
    """The distance of points (P, 2) from paths, arcs as fine chords."""
    least = np.full(len(points), np.inf)
    for path in paths:
        for x0, y0, x1, y1 in chords(path, 1e-7).tolist():
            along = np.array([x1 - x0, y1 - y0])
            arm = points - [x0, y0]
            part = np.clip(arm @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
            least = np.minimum(least, np.hypot(*(arm - part[:, None] * along).T))
    return least


def front(x: float, y: float, heading: float) -> Floats:
    angle = heading + ((np.arange(POINTS) + 0.5) / POINTS - 0.5) * math.pi
    return np.column_stack([x + RADIUS * np.cos(angle), y + RADIUS * np.sin(angle)])


places = st.tuples(st.floats(1.0, 9.0), st.floats(1.0, 9.0))
bulges = st.one_of(st.just(0.0), st.floats(-1.0, 1.0).filter(lambda b: abs(b) > 1e-3))


@st.composite
def paths(draw: st.DrawFn) -> Floats:
    count = draw(st.integers(2, 4))
    corners = draw(st.lists(places, min_size=count, max_size=count))
    rows = np.array([[*place, draw(bulges)] for place in corners])
    assume((np.hypot(*np.diff(rows[:, :2], axis=0).T) > 1e-2).all())
    return rows


@examples(60, nightly=1_000)
@given(st.lists(paths(), min_size=1, max_size=3), places, st.floats(-math.pi, math.pi))
def test_the_engagement_is_that_of_points_on_the_circle(
    cuts: list[Floats], place: tuple[float, float], heading: float
) -> None:
    """It is never less by more than the distance of its places and rounding allow; and more only
    where a piece is near that is nearest to none of the four grid points around."""
    kernel = pursuit()
    for path in cuts:
        kernel.add(path)
    is_stock = away(front(*place, heading), cuts) > RADIUS
    runs = int(np.count_nonzero(np.diff(is_stock.astype(int)))) + 1
    angle = float(is_stock.mean()) * math.pi
    found = kernel.engagement(*place, heading, 0.0)
    step = math.pi / 48
    assert found >= angle - runs * step
    fine = pursuit(cell_mm=CELL / 6.0)
    for path in cuts:
        fine.add(path)
    assert fine.engagement(*place, heading, 0.0) <= angle + runs * step


@pytest.mark.parametrize("degrees", [10.0, 30.0, 60.0, 90.0])
def test_a_straight_cut_beside_another_is_engaged_by_its_step(degrees: float) -> None:
    kernel = pursuit()
    kernel.add(np.array([[0.0, 5.0, 0.0], [10.0, 5.0, 0.0]]))
    step = 1.0 - math.cos(math.radians(degrees))
    found = kernel.engagement(5.0, 5.0 - step, 0.0, 0.0)
    assert math.degrees(found) == pytest.approx(degrees, abs=0.1)


@examples(40, nightly=500)
@given(paths(), st.lists(places, min_size=1, max_size=20))
def test_stock_is_never_taken_to_be_less_than_it_is(
    path: Floats, points: list[tuple[float, float]]
) -> None:
    kernel = pursuit()
    kernel.add(path)
    where = np.array(points)
    is_stock = away(where, [path]) > RADIUS + 1e-6
    assert kernel.stock_at(where[is_stock], 0.0).all()


def beside_stock() -> Pursuit:
    """A pursuit with all cleared above, and stock below, the right of the last cut."""
    kernel = pursuit(math.radians(50.0))
    for y in (9.0, 8.0, 7.0, 6.0, 5.0):
        kernel.add(np.array([[1.0, y, 0.0], [9.0, y, 0.0]]))
    return kernel


def test_a_stroke_is_undone_without_a_trace() -> None:
    kernel = beside_stock()
    grid = np.stack(np.meshgrid(np.arange(0, 10, 0.1), np.arange(0, 10, 0.1)), axis=-1)
    before = kernel.stock_at(grid.reshape(-1, 2), 0.0), kernel.cleared_mm2
    kernel.begin_level(0.5)
    found = kernel.begin(1.0, 5.0)
    assert found is not None
    size = kernel.size
    first, last, _ = kernel.pursue(found[1], 0.9, 0.8, 0.98)
    assert size <= first < last == kernel.size
    assert (kernel.stock_at(grid.reshape(-1, 2), 0.0) != before[0]).any()
    kernel.undo(size)
    assert kernel.size == size
    assert (kernel.stock_at(grid.reshape(-1, 2), 0.0) == before[0]).all()
    assert kernel.cleared_mm2 == before[1]


def test_arcs_are_fitted_tangent_to_each_other_within_their_tolerance() -> None:
    kernel = beside_stock()
    kernel.begin_level(0.5)
    found = kernel.begin(1.0, 5.0)
    assert found is not None
    size = kernel.size
    _, last, _ = kernel.pursue(found[1], 0.9, 0.8, 0.98)
    fine, rough = (kernel.fitted(size, last, share) for share in (1e-9, 1e-3))
    assert len(rough) < len(fine)
    assert away(rough[:, :2], [fine]).max() <= 1.1e-3
    for path in (fine, rough):
        ends = np.diff(path[:, :2], axis=0)
        chord = np.arctan2(ends[:, 1], ends[:, 0])
        half = 2.0 * np.arctan(path[:-1, 2])
        turn = (chord[1:] - half[1:]) - (chord[:-1] + half[:-1])
        assert np.abs(np.remainder(turn + math.pi, math.tau) - math.pi).max() < 2e-3


def test_corners_hold_discs_between_their_walls() -> None:
    """Between the walls of a square corner, and of one that is rounded."""
    corners = corners_of(region_of([SQUARE]), 0.05)
    assert len(corners) == 4
    for corner in corners:
        disc = corner.disc(0.5)
        assert disc is not None
        assert disc.angle == pytest.approx(0.5 * math.pi)
        assert np.abs(disc.centre - 5.0) == pytest.approx([4.5, 4.5])
        smaller = corner.disc(0.4)
        assert smaller is not None
        stroke = corner.stroke(disc, smaller)
        assert length_of(stroke) == pytest.approx(0.2 + 0.2 * math.pi, rel=1e-6)
    assert corners[0].disc(10.5) is None


def length_of(path: Floats) -> float:
    ends = chords(path, 1e-8)
    return float(np.hypot(*(ends[:, 2:] - ends[:, :2]).T).sum())


@examples(30, nightly=500)
@given(st.lists(places, min_size=1, max_size=30), st.floats(0.1, 3.0))
def test_discs_hold_their_points(points: list[tuple[float, float]], wide: float) -> None:
    where = np.array(points)
    discs = discs_about(where, wide)
    gap = np.hypot(*(where[:, None, :] - discs[None, :, :2]).transpose(2, 0, 1)) - discs[:, 2]
    assert (gap.min(axis=1) <= 1e-9).all()
    assert (discs[:, 2] <= wide).all()


@examples(60, nightly=1_000)
@given(st.lists(st.floats(0.0, 39.9), min_size=1, max_size=12), st.floats(0.05, 3.0))
def test_stretches_of_a_wall_hold_all_lengths_between_its_corners(
    lengths: list[float], far_mm: float
) -> None:
    """Along a square of 10 mm: each begins and ends so far from the nearest, or at a corner."""
    wall = MeasuredPath.of(SQUARE)
    found = list(stretches(np.sort(lengths), wall, far_mm))
    for at in lengths:
        assert any(low <= at <= high for low, high in found)
    for low, high in found:
        assert math.floor(low / 10.0 + 1e-12) == math.ceil(high / 10.0 - 1e-12) - 1
        for end in (low, high):
            near = min(abs(end - at) for at in lengths)
            assert near == pytest.approx(far_mm) or (near < far_mm and abs(end % 10.0) < 1e-9)


def test_a_wall_without_corners_is_one_stretch() -> None:
    wall = MeasuredPath.of(CIRCLE)
    assert list(stretches(np.array([1.0, 1.5]), wall, 0.5)) == [(0.5, 2.0)]
