"""Exact heights of the stock and proved brackets, against slow twins and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.stock.cut import CutStock
from camtool.stock.cutters import CutterProfile
from camtool.stock.heights import divided, greatest_value, stock_tree
from camtool.stock.moves import StockMoves
from tests.oracles import stock_heights as slow
from tests.stock.cuts import BALL, BULL, CUTTERS, FLAT, V_BIT, moves_of
from tests.strategies import examples

pytestmark = pytest.mark.checked

BOX = (0.0, 0.0, 10.0, 10.0)


def random_moves(seed: int, count: int, size: float = 10.0) -> StockMoves:
    """Moves of all tools: level, sloping, steep, straight down and of no length."""
    rng = np.random.default_rng(seed)
    start = np.column_stack([rng.uniform(0.0, size, (count, 2)), rng.uniform(-3.0, 0.5, count)])
    end = start + rng.normal(0.0, 2.0, (count, 3)) * [1.0, 1.0, 0.4]
    end[::5] = start[::5] - [0.0, 0.0, 1.0]
    end[1::5, 2] = start[1::5, 2]
    end[2::15] = start[2::15]
    return moves_of(start, end, rng.integers(0, len(CUTTERS), count))


@examples(12)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 40))
def test_heights_are_those_of_the_slow_twin(seed: int, count: int) -> None:
    moves = random_moves(seed, count)
    points = np.random.default_rng(seed).uniform(-1.0, 11.0, (25, 2))
    found, which = stock_tree(moves).heights(points)
    wanted = slow.heights(moves, points)
    # Near the lip of a round corner its slope has no bound: thirds end with some nanometres left.
    assert found == pytest.approx(wanted, abs=2e-8)
    for place, row, z in zip(points.tolist(), which.tolist(), found.tolist(), strict=True):
        assert z == 0.0 if row < 0 else slow.height(moves, row, *place) == pytest.approx(z, 1e-7)


@examples(20)
@given(seed=st.integers(0, 10_000))
def test_heights_turn_with_the_program(seed: int) -> None:
    moves = random_moves(seed, 60)
    points = np.random.default_rng(seed).uniform(0.0, 10.0, (200, 2))
    angle = np.random.default_rng(seed).uniform(0.0, math.tau)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def turned(rows: Floats) -> Floats:
        return np.column_stack([rows[:, :2] @ turn.T, rows[:, 2:]])

    other = moves_of(turned(moves.end), turned(moves.start), moves.tool)
    found, _ = stock_tree(moves).heights(points)
    again, _ = stock_tree(other).heights(points @ turn.T)
    # A point on the very edge of a flat tool may fall on the other side.
    assert np.median(np.abs(found - again)) < 1e-12
    assert (np.abs(found - again) < 1e-6).mean() > 0.99


@examples(20)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 200))
def test_only_moves_before_count(seed: int, count: int) -> None:
    moves = random_moves(seed, count)
    rng = np.random.default_rng(seed)
    points, before = rng.uniform(0.0, 10.0, (50, 2)), rng.integers(0, count + 1, 50)
    tree = stock_tree(moves)
    found, which = tree.heights(points, before)
    assert (which < before).all()
    for point, until, z in zip(points, before.tolist(), found.tolist(), strict=True):
        part, _ = stock_tree(moves.select(slice(until))).heights(point[None])
        assert part[0] == z


@examples(30)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 200), size=st.floats(1e-4, 2.0))
def test_bounds_hold_everywhere_in_a_square(seed: int, count: int, size: float) -> None:
    tree = stock_tree(random_moves(seed, count))
    rng = np.random.default_rng(seed)
    squares = np.column_stack([rng.uniform(0.0, 10.0, (40, 2)), np.full(40, size)])
    tilt = rng.normal(0.0, 1.0, (40, 2))
    low, high, over = (
        tree.min_heights(squares),
        tree.max_heights(squares),
        tree.max_heights(squares, tilt),
    )
    for _ in range(60):
        off = rng.uniform(-1.0, 1.0, (40, 2)) * size
        if rng.random() < 0.3:
            off = np.sign(off) * size
        z, _ = tree.heights(squares[:, :2] + off)
        assert (low <= z + 1e-12).all()
        assert (z <= high + 1e-12).all()
        assert (z - (tilt * off).sum(axis=1) <= over + 1e-12).all()


@examples(20)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 100), size=st.floats(1e-3, 1.0))
def test_means_lie_between_their_bounds(seed: int, count: int, size: float) -> None:
    tree = stock_tree(random_moves(seed, count))
    rng = np.random.default_rng(seed)
    squares = np.column_stack([rng.uniform(0.0, 10.0, (30, 2)), np.full(30, size)])
    bottom = float(rng.choice([-1.0, -math.inf]))
    low, high = tree.quarter_means(squares, bottom)
    squares, size = divided(squares), 0.5 * size
    places = (np.arange(40) + 0.5) / 20.0 - 1.0
    grid = np.stack(np.meshgrid(places, places), axis=-1).reshape(-1, 2)
    for square, least, most in zip(squares, low.tolist(), high.tolist(), strict=True):
        z = np.maximum(tree.heights(square[:2] + grid * size)[0], bottom)
        # The mean of a grid is off by a cell of its border at walls, and by its bend elsewhere.
        slack = 0.05 * float(np.ptp(z)) + 1e-12
        assert least - slack <= z.mean() <= most + slack
    # No mean lies beyond the extremes.
    assert (low >= np.maximum(tree.min_heights(squares), bottom) - 1e-12).all()
    assert (high <= np.maximum(tree.max_heights(squares), bottom) + 1e-12).all()


@examples(5, 300)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 60), size=st.floats(1e-3, 2.0))
def test_means_agree_with_those_of_small_squares(seed: int, count: int, size: float) -> None:
    """Without any slack: extremes over 32 × 32 squares hold the mean of the whole one. Some lie on
    the very axis of a move, where a cone bends."""
    moves = random_moves(seed, count)
    tree, rng = stock_tree(moves), np.random.default_rng(seed)
    places = np.concatenate(
        [
            rng.uniform(0.0, 10.0, (25, 2)),
            0.5 * (moves.start + moves.end)[:10, :2],
            moves.start[:10, :2],
        ]
    )
    squares = np.column_stack([places, np.full(len(places), size)])
    bottom = float(rng.choice([-1.0, -6.0, -math.inf]))
    low, high = tree.quarter_means(squares, bottom)
    squares, size = divided(squares), 0.5 * size
    off = (np.arange(32) + 0.5) / 16.0 - 1.0
    grid = np.stack(np.meshgrid(off, off), axis=-1).reshape(-1, 2) * size
    for square, least, most in zip(squares, low.tolist(), high.tolist(), strict=True):
        small = np.column_stack([square[:2] + grid, np.full(len(grid), size / 32.0)])
        assert least <= np.maximum(tree.max_heights(small), bottom).mean() + 1e-9
        assert most >= np.maximum(tree.min_heights(small), bottom).mean() - 1e-9


@examples(20)
@given(seed=st.integers(0, 10_000), grow=st.floats(-0.05, 0.05))
def test_a_grown_profile_holds_moves_that_lie_beside(seed: int, grow: float) -> None:
    moves = random_moves(seed, 50)
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 10.0, (100, 2))
    angle = rng.uniform(0.0, math.tau, 100)
    off = points + abs(grow) * np.column_stack([np.cos(angle), np.sin(angle)])
    tree = stock_tree(moves)
    grown, _ = tree.heights(points, None, grow)
    z, _ = tree.heights(off)
    assert (grown <= z + 1e-12).all() if grow >= 0.0 else (grown >= z - 1e-12).all()


def test_the_scallop_between_passes_of_a_ball() -> None:
    r, step = 3.0, 0.4
    rows = np.arange(12) * step
    start = np.column_stack([np.zeros(12), rows, np.full(12, -1.0)])
    tree = stock_tree(
        moves_of(start, start + np.array([10.0, 0.0, 0.0]), BALL, CutterProfile(r, 0.0, r))
    )
    box = (1.0, rows[1], 9.0, rows[-2])
    found = greatest_value(lambda at: tree.heights(at)[0], tree.max_heights, box, 1e-6)
    assert found.low <= -1.0 + r - math.sqrt(r**2 - step**2 / 4.0) <= found.high
    assert found.margin <= 0.5e-6


def test_a_cone_straight_down_and_a_slot() -> None:
    down = moves_of([[5.0, 5.0, 1.0]], [[5.0, 5.0, -1.0]], V_BIT)
    z, _ = stock_tree(down).heights(np.array([[5.0, 5.0], [5.05, 5.0], [5.5, 5.0]]))
    cutter = CUTTERS[V_BIT]
    rise = cutter.rise
    assert z == pytest.approx([-1.0, -1.0, -1.0 + rise * (0.5 - cutter.flat_mm)])
    slot = moves_of([[2.0, 5.0, -1.0]], [[8.0, 5.0, -2.0]], FLAT)
    z, _ = stock_tree(slot).heights(np.array([[5.0, 5.0], [5.0, 5.0 + 1.499], [5.0, 6.6]]))
    # A flat end cuts deepest where its rear edge still covers the point.
    off = math.sqrt(1.5**2 - 1.499**2)
    assert z == pytest.approx([-1.5 - 1.5 / 6.0, -1.5 - off / 6.0, 0.0])


@pytest.mark.parametrize("tool", [FLAT, BALL, BULL])
def test_a_planted_gouge_is_bracketed_to_a_nanometre(tool: int) -> None:
    count = 20_000
    x, y = np.tile(np.arange(200) * 0.5, 100), np.repeat(np.arange(100) * 0.9, 200)
    start = np.column_stack([x, y, np.full(count, -1.0)])
    end = start + np.array([0.5, 0.0, 0.0])
    start[10_101, 2] -= 0.003
    end[10_101] = start[10_101] + [0.2, 0.0, 0.0]
    tree = stock_tree(moves_of(start, end, tool))
    found = greatest_value(
        lambda at: -1.0 - tree.heights(at)[0],
        lambda squares: -1.0 - tree.min_heights(squares),
        (0.0, 0.0, 100.0, 90.0),
        1e-6,
        floor=0.0,
    )
    assert found.low <= 0.003 + 1e-12
    assert found.high >= 0.003 - 1e-12
    assert found.high - found.low <= 1e-6
    at = np.array([found.at_mm])
    assert slow.height(moves_of(start, end, tool), 10_101, *at[0]) == pytest.approx(
        -1.0 - found.low, abs=1e-9
    )


def test_nothing_is_cut_without_moves_or_by_a_point() -> None:
    point = moves_of([[0.0, 0.0, -1.0]], [[5.0, 0.0, -1.0]], 0, CutterProfile(0.0, 0.0))
    for tree in (stock_tree(random_moves(1, 5).select(slice(0))), stock_tree(point)):
        z, which = tree.heights(np.array([[1.0, 0.0]]))
        assert (z[0], which[0]) == (0.0, -1)
        assert tree.max_heights(np.array([[1.0, 0.0, 0.5]]))[0] == 0.0
        assert tree.min_heights(np.array([[1.0, 0.0, 0.5]]))[0] == 0.0


def test_a_search_that_may_not_look_on_says_so() -> None:
    tree = stock_tree(random_moves(3, 50))
    short = greatest_value(
        lambda at: -tree.heights(at)[0],
        lambda at: -tree.min_heights(at),
        BOX,
        1e-9,
        max_squares=20,
    )
    full = greatest_value(
        lambda at: -tree.heights(at)[0], lambda at: -tree.min_heights(at), BOX, 1e-3
    )
    assert short.low <= full.high
    assert full.low <= short.high
    assert short.margin > 1e-9


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_squares_at_walls_converge_with_the_square_of_their_size(angle: float) -> None:
    """A slot whose walls lie across the squares: its volume is told to 1 in 10,000 with squares
    that are a thousand times as large as the area between the bounds."""
    along = np.array([math.cos(angle), math.sin(angle), 0.0])
    start = np.array([[0.0, 0.0, -1.0]])
    moves = moves_of(start, start + 6.0 * along, 0, CutterProfile(1.5, 1.5))
    tree = stock_tree(moves)
    stock = CutStock(moves, tree, (-3.0, -3.0, 9.0, 9.0), -6.0)
    found = stock.removed_mm3(1e-4)
    exact = 2.0 * 1.5 * 6.0 + math.pi * 1.5**2
    assert found.low <= exact <= found.high
    assert found.high - found.low <= 1e-4 * found.high
    assert found.squares < 12_000
