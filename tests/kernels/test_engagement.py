"""The engagement along moves is bounded from above, and closely, against points of the circle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.kernels.engagement import Cleared
from tests.oracles import open_angles
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


def engaged(moves: Floats, number: int, part: float, way: float, ways: Floats) -> float:
    """The angle of the front half of the circle at a part of a move that nothing before has
    cleared."""
    travel = moves[number, 2:4] - moves[number, :2]
    place = moves[number, :2] + part * travel
    askew = (1.0 - part) * moves[number, 7] + part * moves[number, 8]
    heading = math.atan2(*travel[::-1]) + askew
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
    """Up to a dozen moves in a row, of two tools, at three depths; some head as arcs do for which
    they stand."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    count = draw(st.integers(1, 12))
    points = rng.uniform(0.0, 10.0, (count + 1, 2))
    depth = rng.integers(-2, 1, count).astype(np.float64)
    radius = rng.choice([0.6, 1.0], count)
    askew = rng.uniform(-0.3, 0.3, (count, 2)) * draw(st.booleans())
    return np.column_stack([points[:-1], points[1:], radius, depth, depth, askew])


@examples(80, nightly=2_000)
@given(programs(), st.sampled_from([0.0, 1.0, math.pi]))
def test_no_place_is_engaged_by_more_than_the_bound(moves: Floats, enough: float) -> None:
    """The bound holds whether its stretches were halved or not."""
    box = np.array([-np.inf, -np.inf, WALL, np.inf])
    cleared = Cleared(np.array([[0.0, 0.0], [10.0, 10.0]]), 1.0, box)
    bound = cleared.judge(moves, np.ones(len(moves), dtype=np.bool_), THICK, enough, 0.005)
    length = np.hypot(*(moves[:, 2:4] - moves[:, :2]).T)
    ways = np.cumsum(length)
    slack = 3.0 * math.pi / DIRECTIONS
    for number in range(len(moves)):
        greatest = 0.0
        for part in (np.arange(PLACES) + 0.5) / PLACES:
            way = ways[number] - (1.0 - part) * length[number]
            greatest = max(greatest, engaged(moves, number, part, way, ways))
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


@pytest.mark.parametrize("ends", [(0.3, -0.3), (-0.3, 0.3), (0.3, 0.0)])
@pytest.mark.parametrize("enough", [0.0, math.pi])
def test_the_bound_of_a_move_holds_where_the_tool_heads_into_the_stock(
    ends: tuple[float, float], enough: float
) -> None:
    """A short move for an arc, 0.1 beside a slot: at one end the tool heads away from the slot by
    0.3, and cuts with so much more of its front than in the middle."""
    rows = np.zeros((2, 9))
    rows[:, :4] = [[0.0, 0.0, 20.0, 0.0], [10.0, 0.1, 10.02, 0.1]]
    rows[:, 4], rows[1, 7:] = 1.0, ends
    cleared = Cleared(
        np.array([[0.0, 0.0], [20.0, 2.0]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1]
    )
    cleared.add(rows[:1])
    bound = cleared.judge(rows[1:], np.ones(1, dtype=np.bool_), 1e-3, enough, 1e-3)
    thin, thick = (math.acos(1.0 - wide) + 0.3 for wide in (0.099, 0.1))
    assert thin - 1e-9 <= bound[0] <= (thick + 5e-3 if enough == 0.0 else math.pi)


@pytest.mark.parametrize("ends", [(0.0, 0.0), (0.3, -0.3), (-0.2, 0.1)])
def test_a_slot_in_full_stock_engages_half_of_the_circle_and_never_more(
    ends: tuple[float, float],
) -> None:
    rows = np.array([[10.0, 1.0, 10.02, 1.0, 1.0, 0.0, 0.0, *ends]])
    cleared = Cleared(
        np.array([[0.0, 0.0], [20.0, 2.0]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1]
    )
    bound = cleared.judge(rows, np.ones(1, dtype=np.bool_), 1e-3, 0.0, 1e-3)
    assert bound[0] == math.pi


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


@st.composite
def dense_programs(draw: st.DrawFn) -> Floats:
    """Up to some 60 short moves, as strokes leave them: rows side by side, rings, zigzags and ways
    straight down, of tools of two radii at three depths; turned, mirrored or reversed."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    parts = []
    for _ in range(draw(st.integers(1, 5))):
        kind, count = draw(st.sampled_from(["row", "ring", "zigzag", "down"])), rng.integers(2, 16)
        begin = rng.uniform(0.0, 6.0, 2)
        share = np.linspace(0.0, 1.0, count)[:, None]
        if kind == "row":
            path = begin + share * rng.uniform(-4.0, 4.0, 2)
        elif kind == "ring":
            angle = rng.uniform(1.0, 7.0) * share
            path = begin + rng.uniform(0.02, 3.0) * np.hstack([np.cos(angle), np.sin(angle)])
        elif kind == "zigzag":
            path = begin + np.cumsum(rng.choice([-0.5, 0.0, 0.5], (count, 2)), axis=0)
        else:
            path = np.repeat(begin[None, :], 2, axis=0)
        low = float(rng.choice([-2.0, -1.0, -0.5]))
        rest = [rng.choice([0.6, 1.0]), low, low + rng.choice([0.0, 0.5])]
        flat = np.broadcast_to([*rest, *rng.uniform(-0.3, 0.3, 2)], (len(path) - 1, 5))
        parts.append(np.column_stack([path[:-1], path[1:], flat]))
        if draw(st.booleans()):
            beside = parts[-1].copy()
            beside[:, [1, 3]] += rng.uniform(0.0, 0.5)
            parts.append(beside)
    moves = np.concatenate(parts)
    if draw(st.booleans()):
        c, s = np.cos(1.0), np.sin(1.0)
        for ends in (slice(0, 2), slice(2, 4)):
            moves[:, ends] = moves[:, ends] @ np.array([[c, s], [-s, c]])
    if draw(st.booleans()):
        moves[:, [0, 2, 7, 8]] *= -1.0
    if draw(st.booleans()):
        moves = moves[::-1, [2, 3, 0, 1, 4, 5, 6, 8, 7]] * [1, 1, 1, 1, 1, 1, 1, -1, -1]
    return np.ascontiguousarray(moves)


def pair_of(draw: st.DataObject, moves: Floats) -> tuple[Cleared, open_angles.Cleared]:
    """The kernel and the literal one, with extents that may be smaller than what is cut."""
    ends = np.concatenate([moves[:, :2], moves[:, 2:4]])
    extents = np.stack([ends.min(axis=0), ends.max(axis=0)])
    if draw.draw(st.booleans(), label="small extents"):
        extents[1] = extents[0] + 0.3 * (extents[1] - extents[0])
    box = np.array([-np.inf, -np.inf, WALL, np.inf])
    from_right = draw.draw(st.booleans(), label="from right")
    return (
        Cleared(extents, 1.0, box, from_right=from_right),
        open_angles.Cleared.like(extents, 1.0, box, from_right=from_right),
    )


@examples(100, nightly=10_000)
@given(dense_programs(), st.data())
def test_bounds_are_to_the_bit_those_of_the_literal_loops(
    moves: Floats, data: st.DataObject
) -> None:
    kernel, literal = pair_of(data, moves)
    cuts = np.arange(len(moves)) % 7 != 3
    enough, fine = data.draw(st.sampled_from([(0.0, 0.05), (1.0, math.inf), (0.6, 0.01)]))
    options = data.draw(
        st.sampled_from([{}, {"coarse_rad": 0.05, "known_rad": 0.0}, {"adds": False}])
    )
    first = len(moves) // 3
    for each in (kernel, literal):
        each.add(moves[:first])
    found, wanted = (
        each.judge(moves[first:], cuts[first:], 0.02, enough, fine, **options)
        for each in (kernel, literal)
    )
    assert found.tolist() == wanted.tolist()


@examples(60, nightly=5_000)
@given(dense_programs(), st.floats(0.2, 2.5), st.data())
def test_moves_are_tried_up_to_the_first_place_above_the_limit_and_forgotten(
    moves: Floats, limit: float, data: st.DataObject
) -> None:
    kernel, literal = pair_of(data, moves)
    thick, first, every = 0.02, len(moves) // 3, np.ones(len(moves), dtype=np.bool_)
    for each in (kernel, literal):
        each.add(moves[:first])
    rest = moves[first:]
    found = kernel.try_moves(rest, thick, limit)
    near = kernel.try_moves(rest, thick, limit, coarse_rad=0.05)
    assert found == literal.try_moves(rest, thick, limit)
    assert near == literal.try_moves(rest, thick, limit, coarse_rad=0.05)
    assert near[1:] == found[1:]
    assert near[0] <= found[0] + 1e-12
    bounds = [each.judge(rest, every[first:], thick, 0.0, 0.05) for each in (kernel, literal)]
    assert bounds[0].tolist() == bounds[1].tolist()


def test_the_first_place_above_a_limit_is_where_a_cut_leaves_a_slot() -> None:
    """A tool of radius 1 takes 0.4 beside a slot, by acos(1 − 0.4), and more behind its end: there
    only a disc about (10, 0) is air on its right."""
    rows = np.zeros((4, 9))
    rows[:, :4] = [[0, 0, 10, 0], [1, 0.4, 4, 0.4], [4, 0.4, 9, 0.4], [9, 0.4, 20, 0.4]]
    rows[:, 4] = 1.0
    kernel = Cleared(np.array([[0.0, 0.0], [20, 1]]), 1.0, np.full(4, np.inf) * [-1, -1, 1, 1])
    kernel.add(rows[:1])
    limit = math.radians(60.0)
    kept, number, share = kernel.try_moves(rows[1:3], 1e-4, limit, coarse_rad=1e-3)
    assert (number, share) == (2, 0.0)
    assert kept == pytest.approx(math.acos(1.0 - 0.4), abs=2e-3)
    greatest, number, share = kernel.try_moves(rows[1:], 1e-4, limit)
    assert (greatest > limit, number) == (True, 2)
    beyond = 9.0 + 11.0 * share - 10.0
    air = math.acos(0.5 * math.hypot(beyond, 0.4)) + math.atan2(-0.4, -beyond)
    assert 0.5 * math.pi - air == pytest.approx(limit, abs=1e-3)
