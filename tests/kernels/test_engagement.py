"""The engagement along moves is bounded from above, and closely, against points of the circle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.kernels.engagement import Cleared
from tests.strategies import examples

pytestmark = pytest.mark.checked

THICK = 0.01
RECENT = 100.0 * THICK
WALL = 9.5
DIRECTIONS = 721
PLACES = 40


def distances(points: Floats, move: Floats) -> Floats:
    along = move[2:4] - move[:2]
    square = float(along @ along)
    part = np.clip((points - move[:2]) @ along / square, 0.0, 1.0)[:, None]
    return np.asarray(np.hypot(*(points - move[:2] - part * along).T))


def engaged(moves: Floats, number: int, place: Floats, way: float, ways: Floats) -> float:
    """The angle of the front half of the circle at a place that nothing before has cleared."""
    heading = math.atan2(*(moves[number, 2:4] - moves[number, :2])[::-1])
    angle = heading + (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS * math.pi - 0.5 * math.pi
    rim = place + moves[number, 4] * np.column_stack([np.cos(angle), np.sin(angle)])
    is_air = rim[:, 0] > WALL - THICK
    for other in range(number):
        if moves[other, 6] <= moves[number, 5] + 1e-6:
            wider = THICK if way - ways[other] >= RECENT else 0.0
            is_air |= distances(rim, moves[other]) < moves[other, 4] + wider
    return float((~is_air).mean()) * math.pi


@st.composite
def programs(draw: st.DrawFn) -> Floats:
    """Up to a dozen moves in a row, of two tools, at three depths."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    count = draw(st.integers(1, 12))
    points = rng.uniform(0.0, 10.0, (count + 1, 2))
    depth = rng.integers(-2, 1, count).astype(np.float64)
    radius = rng.choice([0.6, 1.0], count)
    return np.column_stack(
        [points[:-1], points[1:], radius, depth, depth, 0.0 * depth, 0.0 * depth]
    )


@examples(40, nightly=2_000)
@given(programs())
def test_no_place_is_engaged_by_more_than_the_bound(moves: Floats) -> None:
    box = np.array([-np.inf, -np.inf, WALL, np.inf])
    cleared = Cleared(np.array([[0.0, 0.0], [10.0, 10.0]]), 1.0, box)
    bound = cleared.judge(moves, np.ones(len(moves), dtype=np.bool_), THICK, 0.0, 0.005)
    length = np.hypot(*(moves[:, 2:4] - moves[:, :2]).T)
    ways = np.cumsum(length)
    slack = 3.0 * math.pi / DIRECTIONS
    for number in range(len(moves)):
        greatest = 0.0
        for part in (np.arange(PLACES) + 0.5) / PLACES:
            place = moves[number, :2] + part * (moves[number, 2:4] - moves[number, :2])
            way = ways[number] - (1.0 - part) * length[number]
            greatest = max(greatest, engaged(moves, number, place, way, ways))
        assert greatest <= bound[number] + slack


@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.9])
def test_beside_a_straight_cut_the_angle_is_that_of_its_width(share: float) -> None:
    """A tool of radius 1 that takes the width a is engaged by acos(1 − a)."""
    width = 2.0 * share
    moves = np.array([[0.0, 0.0, 20.0, 0.0], [20.0, width, 0.0, width]])
    rows = np.column_stack([moves, np.ones(2), np.zeros((2, 4))])
    cleared = Cleared(
        np.array([[0.0, 0.0], [20.0, 2.0]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1]
    )
    cleared.add(rows[:1])
    inner = rows[1:].copy()
    inner[0, 0], inner[0, 2] = 15.0, 5.0
    bound = cleared.judge(inner, np.ones(1, dtype=np.bool_), 1e-4, 0.0, 1e-3)
    assert bound[0] == pytest.approx(math.acos(1.0 - width), abs=4e-3)


def test_chips_almost_as_thick_as_what_does_not_count_are_not_taken_for_thick_ones() -> None:
    """Beside a slot, 0.03 wide, with chips of 0.02 that do not count: as a cut 0.01 wide."""
    rows = np.zeros((2, 9))
    rows[:, :4] = [[0.0, 0.0, 20.0, 0.0], [15.0, 0.03, 5.0, 0.03]]
    rows[:, 4] = 1.0
    cleared = Cleared(
        np.array([[0.0, 0.0], [20.0, 2.0]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1]
    )
    cleared.add(rows[:1])
    bound = cleared.judge(rows[1:], np.ones(1, dtype=np.bool_), 0.02, 0.0, 1e-3)
    assert math.acos(1.0 - 0.01) <= bound[0] <= math.acos(1.0 - 0.01 - 0.02 / 16.0) + 1e-3


def test_moves_that_do_not_cut_clear_nothing() -> None:
    cleared = Cleared(np.zeros((2, 2)), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1])
    rows = np.array([[0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]] * 2)
    bound = cleared.judge(rows, np.array([False, True]), 1e-3, 0.0, 1e-3)
    assert bound.tolist() == [0.0, pytest.approx(math.pi)]


@examples(60, nightly=2_000)
@given(programs(), st.floats(0.3, 3.0))
def test_the_greatest_alone_is_as_near_as_the_coarse_bounds(moves: Floats, enough: float) -> None:
    """Bounds that are looked for only where they may be the greatest miss it by no more than the
    coarse angle below the limit, and by no more than the fine one above it."""
    every, coarse, fine = np.ones(len(moves), dtype=np.bool_), 0.05, 0.005

    def greatest(enough_rad: float, fine_rad: float, **options: float) -> float:
        box = np.array([-np.inf, -np.inf, WALL, np.inf])
        cleared = Cleared(np.array([[0.0, 0.0], [10.0, 10.0]]), 1.0, box)
        return float(cleared.judge(moves, every, THICK, enough_rad, fine_rad, **options).max())

    near = greatest(0.0, fine)
    found = greatest(enough, fine, coarse_rad=coarse, known_rad=0.0)
    assert near - fine - 1e-9 <= found <= near + (coarse if found <= enough else fine) + 1e-9
    assert greatest(0.0, coarse, coarse_rad=coarse, known_rad=-1.0) <= near + coarse + 1e-9


@pytest.mark.parametrize(("gap", "share"), [(0.0, 0.0), (1.0, 2.0 / 3.0), (2.5, 1.0)])
def test_straight_down_the_part_of_the_whole_circle_counts(gap: float, share: float) -> None:
    """Beside a disc of its own size the lens takes a third of a circle's rim at one radius."""
    cleared = Cleared(np.array([[0.0, 0.0], [9.0, 9.0]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1])
    disc = [5.0, 5.0, 5.0, 5.0, 1.0, -1.0, -1.0, 0.0, 0.0]
    cleared.add(np.array([disc, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]]))
    down = np.array([[5.0 + gap, 5.0, 5.0 + gap, 5.0, 1.0, -1.0, 1.0, 0.0, 0.0]])
    bound = cleared.judge(down, np.ones(1, dtype=np.bool_), 1e-6, 0.0, 1e-3)
    assert bound[0] == pytest.approx(share * math.tau, abs=1e-2)
