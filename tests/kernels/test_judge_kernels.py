"""The kernels of the judge against plain loops."""

import math
import random
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats, Indices, Ints
from camtool.kernels.judging import (
    ANGLE_BINS,
    WRITTEN,
    Moves,
    bin_directions,
    empty_bins,
    largest,
    new_pen,
    trace_block,
    unwritten,
)
from camtool.kernels.move_tree import FIRST, LAST, LEAF, hilbert_order, move_tree
from camtool.kernels.near import hilbert_places
from tests.oracles import hilbert as oracle
from tests.oracles.kernel_doors import fill_bins_, nearest_errors_, set_errors_, shapes
from tests.oracles.near_moves import Arc, Line, Move, nearest, random_move

pytestmark = pytest.mark.checked

EPS = 1e-12

part_of_an_array = st.integers(0, 140).flatmap(
    lambda size: st.tuples(
        st.lists(st.floats(-1e9, 1e9), min_size=size, max_size=size).map(np.array),
        st.integers(0, size),
        st.integers(0, size),
    )
)


@given(part_of_an_array)
def test_largest_of_parts_of_arrays(drawn: tuple[Floats, int, int]) -> None:
    values, one, other = drawn
    low, high = min(one, other), max(one, other)
    if low < high:
        assert largest(values, low, high) == max(values[low:high].tolist())


@given(st.lists(st.tuples(st.floats(1e2, 1e3), st.floats(0.01, 0.5)), max_size=140))
def test_sums_of_bins_are_nearly_exact(drawn: list[tuple[float, float]]) -> None:
    """n numbers, added one by one, round by at most n·2⁻⁵³ of their sizes. All lie in one bin."""
    x, y = np.array(drawn, dtype=np.float64).reshape(-1, 2).T.copy()
    bins = empty_bins(1)[0]
    fill_bins_(x, y, (0.0, 0.0), bin_directions(), bins)
    assert bins[0, 0] == len(drawn)
    for column, values in ((1, x.tolist()), (2, y.tolist())):
        exact = math.fsum(values)
        assert abs(bins[0, column] - exact) <= len(values) * 2.0**-53 * exact
    squares = [(a * a + b * b) for a, b in drawn]
    if squares:
        assert bins[0, 3] == min(squares)
        assert bins[0, 6] == max(squares)


def test_sums_are_the_same_on_every_processor() -> None:
    """To the last bit what a loop in the same order finds."""
    x = 1e3 + np.sin(np.arange(1.0, 1001.0) ** 2 % 97.0)
    bins, directions = empty_bins(1)[0], bin_directions()
    fill_bins_(x, np.ones(1000), (0.0, 0.0), directions, bins)
    lanes = [0.0] * 32
    for k in range(992):
        lanes[k % 32] += x[k]
    while len(lanes) > 1:
        half = len(lanes) // 2
        lanes = [lanes[k] + lanes[k + half] for k in range(half)]
    for k in range(992, 1000):
        lanes[0] += x[k]
    assert bins[0, 0] == 1000
    assert bins[0, 1] == lanes[0]


def test_errors_are_those_of_a_loop_with_angles() -> None:
    rng = np.random.default_rng(0)
    for _ in range(300):
        move = random_move(rng)
        x, y = rng.uniform(-1.5, 1.5, (2, 37))
        best = np.full(37, np.inf)
        set_errors_(np.array(move.row(), dtype=np.float64), x, y, best)
        wanted = [move.error(*point) for point in zip(x.tolist(), y.tolist(), strict=True)]
        assert np.abs(best) == pytest.approx(np.abs(wanted), abs=EPS)
        side = np.abs(wanted) > EPS
        assert np.array_equal(np.sign(best[side]), np.sign(np.array(wanted)[side]))


@pytest.mark.parametrize("sweep", [math.pi / 2, math.pi, 1.5 * math.pi, 2 * math.pi])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_every_place_about_an_arc_on_a_lattice(sweep: float, sense: float) -> None:
    """Points on the centre, the arc, its ends, the edges of its wedge and beyond them."""
    move = Arc((0.0, 0.0), 2.0, 0.0, sense * sweep)
    points = [(float(x), float(y)) for x in range(-4, 5) for y in range(-4, 5)]
    x, y = np.array(points).T.copy()
    best = np.full(len(points), np.inf)
    set_errors_(np.array(move.row()), x, y, best)
    ends = (math.dist(p, move.place(0.0)) for p in points)
    others = (math.dist(p, move.place(1.0)) for p in points)
    for point, error, one, other in zip(points, best.tolist(), ends, others, strict=True):
        choices = [abs(move.error(*point)), one, other]
        # On the edge of the wedge the angle is told by rounding; the distance there is that of
        # the end either way.
        assert min(abs(abs(error) - choice) for choice in choices) < 1e-9
        assert abs(error) <= min(one, other) + 1e-9


@pytest.mark.parametrize("sweep", [2.0, 2 * math.pi])
def test_errors_of_circles_hang_on_the_point_alone(sweep: float) -> None:
    """Near the circle by the series, elsewhere by the root: to rounding, whatever the block."""
    rng = np.random.default_rng(7)
    move = np.array(Arc((1.0, 2.0), 20.0, 0.0, sweep).row(), dtype=np.float64)
    for limit in (1e-6, 0.99 * 2.0**-9, 1.1 * 2.0**-9, 0.3):
        angle = rng.uniform(0.01, sweep - 0.01, 400)
        radius = 20.0 * (1.0 + limit * rng.uniform(-1.0, 1.0, 400))
        x, y = 1.0 + radius * np.cos(angle), 2.0 + radius * np.sin(angle)
        block, alone = np.empty(400), np.empty(400)
        set_errors_(move, x, y, block)
        for k in range(400):
            set_errors_(move, x[k : k + 1], y[k : k + 1], alone[k : k + 1])
        assert np.array_equal(block, alone)
        exact = 20 - np.hypot(x.astype(np.longdouble) - 1, y.astype(np.longdouble) - 2)
        assert np.abs(block - exact).max() < 3 * 2.0**-53 * 20.0


def walk(rng: np.random.Generator, count: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Points that follow each other, with jumps."""
    steps = rng.normal(0.0, size, (count, 2))
    steps[rng.integers(0, count, 3)] += rng.normal(0.0, 0.7, (3, 2))
    path = np.cumsum(steps, axis=0)
    return np.ascontiguousarray(path[:, 0]), np.ascontiguousarray(path[:, 1])


def tree_of(boxes: Floats, group: Ints | None = None) -> tuple[Floats, Indices]:
    """The tree over boxes (K, 4) that are there."""
    return move_tree(len(boxes), boxes.__getitem__, group)


@pytest.mark.parametrize("size", [0.0, 1e-4, 0.01, 0.3])
@pytest.mark.parametrize("count", [1, 2, 60, 400])
def test_the_nearest_of_many_is_that_of_a_loop(size: float, count: int) -> None:
    rng = np.random.default_rng(count)
    moves: list[Move] = [random_move(rng) for _ in range(count)]
    moves[-1] = moves[0]  # twice the same
    table = np.array([move.row() for move in moves], dtype=np.float64)
    boxes = np.array([move.box() for move in moves], dtype=np.float64)
    tree = tree_of(boxes, np.sort(rng.integers(0, count, count)) if size else None)
    low = rng.uniform(-1.0, 0.0, count)
    heights = np.column_stack([low, low + rng.uniform(0.0, 0.3, count)])
    for _ in range(25):
        first, last = sorted(rng.integers(0, count + 1, 2).tolist())
        window = sorted(rng.uniform(-1.2, 0.5, 2).tolist())
        x, y = walk(rng, 40, size)
        out = np.empty(40)
        own = int(rng.integers(-1, count))
        only = (first, last, *window)
        known, _ = nearest_errors_(x, y, own, only, Moves(shapes(table), heights, *tree), out)
        high = [
            k
            for k in range(first, last)
            if heights[k, 0] <= window[1] and heights[k, 1] >= window[0]
        ]
        some = [moves[k] for k in (high or range(first, last))]
        assert known == bool(some)
        wanted = [nearest(some, *point) for point in zip(x.tolist(), y.tolist(), strict=True)]
        assert np.abs(out) == pytest.approx(np.abs(wanted), abs=EPS)


ends = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
chords = st.tuples(ends, ends).filter(lambda chord: math.dist(*chord) > 1e-3)


@given(
    st.lists(chords, min_size=1, max_size=30),
    st.lists(st.tuples(chords, st.integers(1, 40), st.floats(0.0, 3.0)), max_size=3),
    st.integers(1, 200),
    st.randoms(use_true_random=False),
)
def test_points_along_lines_that_cross(
    lines: list[tuple[tuple[float, float], tuple[float, float]]],
    others: list[tuple[tuple[tuple[float, float], tuple[float, float]], int, float]],
    count: int,
    chance: random.Random,
) -> None:
    """Points near one of the lines, in its direction or against it, with others side by side; in
    some rows they lie on it."""
    moves = [Line(a, b) for a, b in lines]
    for ((ax, ay), (bx, by)), many, apart in others:
        moves += [Line((ax + n * apart, ay), (bx + n * apart, by)) for n in range(many)]
    own = chance.randrange(len(moves))
    (ax, ay), (bx, by) = moves[own].a, moves[own].b
    share = np.linspace(0.0, 1.0, count)[:: chance.choice([1, -1])]
    off = chance.choice([0.0, 1e-6, 0.1, 5.0])
    run = chance.choice([1, 3, 7, 200])
    offs = np.repeat([off * chance.choice([0.0, 1.0]) for _ in range(count)], run)[:count].tolist()
    each = list(zip(share.tolist(), offs, strict=False))
    x = np.array([ax + t * (bx - ax) + chance.uniform(-one, one) for t, one in each])
    y = np.array([ay + t * (by - ay) + chance.uniform(-one, one) for t, one in each])
    table = np.array([move.row() for move in moves], dtype=np.float64)
    tree = tree_of(np.array([move.box() for move in moves], dtype=np.float64))
    out = np.empty(count)
    expected = chance.choice([own, -1, chance.randrange(len(moves))])
    whole = (0, len(moves), 0.0, 0.0)
    nearest_errors_(
        x, y, expected, whole, Moves(shapes(table), np.zeros((len(moves), 2)), *tree), out
    )
    wanted = [abs(nearest(moves, *point)) for point in zip(x.tolist(), y.tolist(), strict=True)]
    assert np.abs(out) == pytest.approx(np.array(wanted), abs=1e-9)


@given(
    st.lists(st.floats(0.2, 10.0), min_size=3, max_size=12),
    st.booleans(),
    st.lists(ends, min_size=1, max_size=40),
    st.integers(-1, 11),
)
def test_the_side_at_a_corner_is_inside_or_outside(
    spokes: list[float], ccw: bool, points: list[tuple[float, float]], own: int
) -> None:
    """Of a polygon with sharp corners: left of its moves, which go round it, is inside."""
    turn = np.arange(len(spokes)) * (2.0 * np.pi / len(spokes)) * (1.0 if ccw else -1.0)
    star = np.column_stack([spokes * np.cos(turn), spokes * np.sin(turn)])
    ring = [tuple(one) for one in star.tolist()]
    moves = [Line(a, b) for a, b in pairwise([*ring, ring[0]])]
    # Points anywhere, and beyond each corner along the moves that meet there.
    beyond = [
        (bx + 0.1 * (bx - ax), by + 0.1 * (by - ay)) for (ax, ay), (bx, by) in pairwise(ring)
    ]
    x, y = np.array([*points, *beyond]).T.copy()
    table = np.array([move.row() for move in moves], dtype=np.float64)
    tree = tree_of(np.array([move.box() for move in moves], dtype=np.float64))
    out, whole = np.empty(len(x)), (0, len(moves), 0.0, 0.0)
    own = min(own, len(moves) - 1)
    nearest_errors_(x, y, own, whole, Moves(shapes(table), np.zeros((len(moves), 2)), *tree), out)
    inside = shapely.contains_xy(shapely.Polygon(star), x, y)
    sure = np.abs(out) > 1e-6
    assert ((out > 0.0) == (inside == ccw))[sure].all()


def test_of_equally_near_moves_the_own_one_gives_the_side() -> None:
    """There and back on one line: what is to the left of one is to the right of the other."""
    moves = [Line((0.0, 0.0), (9.0, 0.0)), Line((9.0, 0.0), (0.0, 0.0))]
    table = np.array([move.row() for move in moves], dtype=np.float64)
    tree = tree_of(np.array([move.box() for move in moves], dtype=np.float64))
    x, y, out = np.array([2.0, 3.0]), np.array([0.5, 0.5]), np.empty(2)
    for own, error in ((0, 0.5), (1, -0.5)):
        whole = (0, 2, 0.0, 0.0)
        nearest_errors_(x, y, own, whole, Moves(shapes(table), np.zeros((2, 2)), *tree), out)
        assert out.tolist() == [error, error]


def test_the_curve_fills_a_square_by_steps_of_one() -> None:
    rng = np.random.default_rng(4)
    square = rng.permutation(np.argwhere(np.ones((16, 16))).astype(np.float64))
    along = square[hilbert_order(square, square)]
    assert np.abs(np.diff(along, axis=0)).sum(axis=1).tolist() == [1.0] * 255


@pytest.mark.parametrize("levels", [1, 2, 7, 16])
def test_the_curve_is_that_of_its_quarters(levels: int) -> None:
    points = np.random.default_rng(levels).uniform(0.0, 1.0, (500, 2))
    points[:4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    expected = oracle.hilbert_places(points, levels)
    assert hilbert_places(points, levels).tolist() == expected.tolist()


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("count", [0, 1, 4, 5, 61])
def test_nodes_know_what_is_below_them(count: int, together: bool) -> None:
    rng = np.random.default_rng(count)
    low = rng.uniform(-9.0, 9.0, (count, 2))
    boxes = np.column_stack([low, low + rng.uniform(0.0, 2.0, (count, 2))])
    group = np.sort(rng.integers(0, count // 3 + 1, count))
    nodes, order = tree_of(boxes, group if together else None)
    assert not together or np.array_equal(group[order], group)
    leaves = len(nodes) // 2
    assert sorted(order.tolist()) == list(range(count))
    for node in range(1, 2 * leaves):
        leaf, last = node, node
        while leaf < leaves:
            leaf, last = 2 * leaf, 2 * last + 1
        rows = order[(leaf - leaves) * LEAF : (last + 1 - leaves) * LEAF]
        if len(rows) == 0:
            assert nodes[node, FIRST] == np.inf
            continue
        assert nodes[node, :2].tolist() == boxes[rows, :2].min(axis=0).tolist()
        assert nodes[node, 2:4].tolist() == boxes[rows, 2:].max(axis=0).tolist()
        assert (nodes[node, FIRST], nodes[node, LAST]) == (rows.min(), rows.max() + 1)


def test_a_search_in_a_spiral_looks_at_few_of_its_turns() -> None:
    """In the order of the path each turn is a box about the point, and all would be looked at."""
    turn = np.arange(8001) * (2.0 * math.pi / 40.0)
    places = np.column_stack([turn * np.cos(turn), turn * np.sin(turn)]).tolist()
    lines = [Line(tuple(a), tuple(b)) for a, b in pairwise(places)]
    table = np.array([line.row() for line in lines], dtype=np.float64)
    heights, out = np.zeros((len(lines), 2)), np.empty(1)
    boxes = np.array([line.box() for line in lines])
    moves = Moves(shapes(table), heights, *tree_of(boxes))
    looked = []
    for k in range(100, 8000, 700):
        at, whole = np.array([[places[k][0]], [places[k][1]]]), (0, len(lines), 0.0, 0.0)
        looked.append(nearest_errors_(at[0], at[1], -1, whole, moves, out)[1])
        assert abs(out[0]) < EPS
    assert max(looked) < 300


def test_a_search_in_one_scribble_of_many_looks_at_no_others() -> None:
    places = np.random.default_rng(6).uniform(0.0, 100.0, (2001, 2)).tolist()
    lines = [Line(tuple(a), tuple(b)) for a, b in pairwise(places)]
    table = np.array([line.row() for line in lines], dtype=np.float64)
    heights, out = np.zeros((len(lines), 2)), np.empty(1)
    scribble, boxes = np.arange(2000) // 40, np.array([line.box() for line in lines])
    looked = []
    for group in (None, scribble):
        moves = Moves(shapes(table), heights, *tree_of(boxes, group))
        for k in range(0, 2000, 97):
            x, y = np.array([lines[k].a]).T + 1e-6  # beside the line
            only = (40 * int(scribble[k]), 40 * int(scribble[k]) + 40, 0.0, 0.0)
            _, last = nearest_errors_(x, y, -1, only, moves, out)
            assert abs(out[0]) < 2e-6
        looked.append(last)
    assert looked[0] > 300
    assert looked[1] < 150


def test_points_of_a_row_look_at_their_surroundings_alone() -> None:
    """A row of a hatch with a little error: of 20,000 lines few are looked at, for all points."""
    lines = [Line((0.0, 0.1 * k), (50.0, 0.1 * k)) for k in range(20_000)]
    table = np.array([line.row() for line in lines], dtype=np.float64)
    moves = Moves(
        shapes(table),
        np.zeros((len(lines), 2)),
        *tree_of(np.array([line.box() for line in lines])),
    )
    x, y, out = np.linspace(0.0, 50.0, 700), np.full(700, 1000.001), np.empty(700)
    _, looked = nearest_errors_(x, y, 10_000, (0, len(lines), 0.0, 0.0), moves, out)
    assert out == pytest.approx(0.001, abs=1e-9)
    assert looked < 150


def test_the_bins_of_a_circle_are_those_of_a_loop() -> None:
    rng = np.random.default_rng(1)
    directions = bin_directions()
    for size in (0.5, 0.01):
        bins, wanted = empty_bins(1)[0], empty_bins(1)[0]
        for _ in range(30):
            turn = np.cumsum(rng.normal(0.0, size, 50)) + rng.uniform(0.0, 6.28)
            radius = rng.uniform(0.5, 1.5, 50)
            x, y = 2.0 + radius * np.cos(turn), -1.0 + radius * np.sin(turn)
            fill_bins_(x, y, np.array([2.0, -1.0]), directions, bins)
            for px, py in zip(x - 2.0, y + 1.0, strict=True):
                which = int(math.atan2(py, px) % (2.0 * math.pi) / (2.0 * math.pi) * ANGLE_BINS)
                one, square = wanted[which], px * px + py * py
                one[:3] += 1.0, px, py
                if square < one[3]:
                    one[3:6] = square, px, py
                if square > one[6]:
                    one[6:9] = square, px, py
        seen = wanted[:, 0] > 0
        assert np.array_equal(bins[:, 0], wanted[:, 0])
        assert bins[seen] == pytest.approx(wanted[seen], abs=1e-12)


def thinned(rows: list[list[tuple[float, float, float]]], stride: int) -> list[tuple[float, ...]]:
    """Of `stride` points (x, y, error) of a row the largest (first of equals), and the last."""
    kept = []
    for number, row in enumerate(rows):
        which = set()
        for low in range(0, len(row), stride):
            run = range(low, min(low + stride, len(row)))
            which.add(max(run, key=lambda k: (row[k][2], -k)))
        if row:
            which.add(len(row) - 1)
        kept += [(*row[k], float(number)) for k in sorted(which)]
    return kept


@pytest.mark.parametrize("stride", [1, 2, 3, 7, 100])
def test_the_trace_is_that_of_a_loop(stride: int) -> None:
    rng = np.random.default_rng(stride)
    for _ in range(30):
        rows = [rng.integers(0, 4, (int(rng.integers(0, 30)), 3)) / 8.0 for _ in range(6)]
        pen, trace = new_pen(stride, 1000), np.empty((1200, 4))
        for number, row in enumerate(rows):
            if number == 2:
                row[:, 2] = 0.0  # nothing is cut
            for part in np.array_split(row, 4):
                if len(part):
                    x, y, error = (np.ascontiguousarray(column) for column in part.T)
                    largest = float(error.max())
                    trace_block(number, x, y, error, largest, pen, trace)
        got = np.concatenate([trace[: int(pen[WRITTEN])], unwritten(pen)])
        wanted = thinned([[tuple(point) for point in row.tolist()] for row in rows], stride)
        assert got.tolist() == [list(point) for point in wanted]


def test_a_full_trace_keeps_the_ends_of_rows() -> None:
    pen, trace = new_pen(1, 3), np.empty((20, 4))
    for number in range(4):
        x = np.arange(3.0)
        trace_block(number, x, x, x + 1.0, 3.0, pen, trace)
    got = np.concatenate([trace[: int(pen[WRITTEN])], unwritten(pen)])
    assert got[:, 3].tolist() == [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]
    assert got[3:, 0].tolist() == [2.0, 2.0, 2.0]
