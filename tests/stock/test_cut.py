"""The stock after a program: sections, volumes and differences, against closed forms and grids."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.stock.cut import CutStock, difference_of
from camtool.stock.cutters import CutterProfile
from camtool.stock.heights import stock_tree
from camtool.stock.moves import StockMoves
from tests.stock.cuts import BALL, FLAT, moves_of
from tests.stock.test_heights import random_moves
from tests.strategies import examples

RING = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0], [0.0, 0.0]])
LIMIT_MM = 0.01


def stock_of(moves: StockMoves) -> CutStock:
    return CutStock(moves, stock_tree(moves), (-5.0, -5.0, 25.0, 15.0))


def ring(z: float, tool: CutterProfile, shift: tuple[float, float] = (0.0, 0.0)) -> CutStock:
    """A rectangular slot."""
    points = np.column_stack([RING + shift, np.full(len(RING), z)])
    return stock_of(moves_of(points[:-1], points[1:], 0, tool))


MILL = CutterProfile(1.5, 1.5)


def test_the_volume_of_a_slot() -> None:
    wide = 3.0
    wanted = 2.0 * (60.0 * wide - 4.0 * 1.5**2 + math.pi * 1.5**2)
    found = ring(-2.0, MILL).removed_mm3()
    assert found.low <= wanted <= found.high
    assert found.high - found.low <= 0.011 * wanted


def test_a_slot_through_the_stock_ends_at_its_bottom() -> None:
    slot = ring(-2.0, MILL)
    thin = CutStock(slot.moves, slot.tree, slot.box_mm, -1.0)
    assert thin.removed_mm3().high == pytest.approx(0.5 * slot.removed_mm3().high, rel=0.02)


@pytest.mark.parametrize(
    ("other", "more_mm", "less_mm"),
    [
        (ring(-2.0, MILL), 0.0, 0.0),
        (ring(-2.05, MILL), 0.05, 0.0),
        (ring(-1.9, MILL), 0.0, 0.1),
        (ring(-2.0, MILL, (0.02, 0.0)), 0.02, 0.02),
        (ring(-2.0, CutterProfile(1.6, 1.6)), 0.1, 0.0),
        (ring(-2.0, MILL, (0.004, 0.0)), 0.0, 0.0),
    ],
)
def test_how_far_two_slots_differ(other: CutStock, more_mm: float, less_mm: float) -> None:
    found = difference_of(ring(-2.0, MILL), other, LIMIT_MM)
    for one, wanted in ((found.deeper, more_mm), (found.shallower, less_mm)):
        assert one.high <= LIMIT_MM if not wanted else one.low <= wanted + 1e-9 <= one.high + 2e-9
        assert one.high - one.low <= LIMIT_MM
    back = difference_of(other, ring(-2.0, MILL), LIMIT_MM)
    assert (back.deeper.low, back.shallower.low) == (found.shallower.low, found.deeper.low)


def test_the_volume_between_two_slots() -> None:
    deeper = difference_of(ring(-2.0, MILL), ring(-2.5, MILL), LIMIT_MM)
    wanted = 0.5 * (60.0 * 3.0 - 4.0 * 1.5**2 + math.pi * 1.5**2)
    assert deeper.more_mm3.low <= wanted <= deeper.more_mm3.high
    assert deeper.less_mm3.low == 0.0


@examples(10)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 30))
def test_volumes_hold_those_of_a_fine_grid(seed: int, count: int) -> None:
    moves = random_moves(seed, count)
    stock = CutStock(moves, stock_tree(moves), (0.0, 0.0, 10.0, 10.0))
    middles = (np.arange(400) + 0.5) / 40.0
    points = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    grid = float(-stock.heights(points).mean() * 100.0)
    found = stock.removed_mm3()
    assert found.low - 0.01 * grid <= grid <= found.high + 0.01 * grid


def test_a_section_goes_down_the_walls() -> None:
    rows = ring(-2.0, MILL).section("x", 10.0)
    assert (np.diff(rows[:, 0]) > 0.0).all()
    inside = (np.abs(rows[:, 0] - 0.0) < 1.499) | (np.abs(rows[:, 0] - 10.0) < 1.499)
    assert (rows[inside, 1] == -2.0).all()
    outside = (np.abs(rows[:, 0] - 0.0) > 1.501) & (np.abs(rows[:, 0] - 10.0) > 1.501)
    assert (rows[outside, 1] == 0.0).all()
    # Between the last row within a wall and the next one without there is a micrometre.
    walls = np.flatnonzero(np.diff(rows[:, 1]) != 0.0)
    assert (np.diff(rows[:, 0])[walls] <= 1e-3).all()


def test_a_section_of_a_ball_is_round() -> None:
    start, end = [[0.0, 5.0, -1.0]], [[10.0, 5.0, -1.0]]
    moves = moves_of(start, end, BALL)
    rows = CutStock(moves, stock_tree(moves), (0.0, 0.0, 10.0, 10.0)).section("x", 5.0)
    off = rows[:, 0] - 5.0
    cut = rows[:, 1] < 0.0
    wanted = -1.0 + 1.5 - np.sqrt(1.5**2 - off[cut] ** 2)
    assert rows[cut, 1] == pytest.approx(wanted, abs=1e-12)


@examples(20)
@given(seed=st.integers(0, 10_000))
def test_heights_lie_between_their_bounds(seed: int) -> None:
    moves = random_moves(seed, 40)
    beside = 0.02
    rng = np.random.default_rng(seed)
    off = rng.normal(size=(len(moves), 3))
    off *= beside / np.linalg.norm(off, axis=1)[:, None]
    off *= rng.uniform(0.0, 1.0, (len(moves), 1))
    told = StockMoves(
        moves.start, moves.end, moves.row, moves.rapid, moves.tool, moves.cutters, beside
    )
    true = moves_of(moves.start + off, moves.end + off, moves.tool)
    points = rng.uniform(0.0, 10.0, (200, 2))
    low, high = CutStock(told, stock_tree(told), (0.0, 0.0, 10.0, 10.0)).bounds(points).T
    z = CutStock(true, stock_tree(true), (0.0, 0.0, 10.0, 10.0)).heights(points)
    assert (low <= z + 1e-12).all()
    assert (z <= high + 1e-12).all()


def test_rows_say_what_cut_deepest() -> None:
    moves = moves_of(
        [[0.0, 0.0, -1.0], [0.0, 0.0, -2.0]], [[10.0, 0.0, -1.0], [5.0, 0.0, -2.0]], FLAT
    )
    at: Floats = np.array([[2.0, 0.0], [8.0, 0.0], [8.0, 3.0]])
    assert stock_of(moves).rows_at(at).tolist() == [1, 0, -1]
