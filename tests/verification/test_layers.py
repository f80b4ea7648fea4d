"""Boxes of the pieces of long moves: they hold all of the move, and little else."""

import numpy as np
import pytest

from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import Segments
from camtool.verification.nearest import (
    MORE_PIECES,
    HeightLayers,
    boxes_of_pieces,
    gap_mm,
    levels_of,
)

ROUNDING_MM = 1e-9


def crossing(count: int, *, bulges: float) -> Segments:
    """Lines and arcs between random places on a plate of 100 mm: everything crosses everything."""
    rng = np.random.default_rng(5)
    ends = rng.uniform(0.0, 100.0, (2, count, 2))
    return Segments.between(ends[0], ends[1], rng.uniform(-bulges, bulges, count))


@pytest.mark.parametrize("bulges", [0.0, 1.0])
def test_the_boxes_hold_all_of_each_move(bulges: float) -> None:
    moves = crossing(200, bulges=bulges)
    boxes, whose = boxes_of_pieces(moves, gap_mm(moves, segment_boxes(moves)))
    assert len(boxes) > 5 * len(moves)
    assert set(whose.tolist()) == set(range(len(moves)))
    for row in range(len(moves)):
        shares = np.linspace(0.0, 1.0, 200)
        points = point_at(moves, np.full(200, row), shares)[:, None]
        mine = boxes[whose == row]
        inside = (points >= mine[:, :2] - ROUNDING_MM) & (points <= mine[:, 2:] + ROUNDING_MM)
        assert inside.all(axis=2).any(axis=1).all()


@pytest.mark.parametrize("bulges", [0.0, 1.0])
def test_few_of_them_lie_over_a_point_where_whole_boxes_are_many(bulges: float) -> None:
    moves = crossing(1000, bulges=bulges)
    whole = segment_boxes(moves)
    pieces, whose = boxes_of_pieces(moves, gap_mm(moves, whole))
    points = np.random.default_rng(6).uniform(20.0, 80.0, (50, 1, 2))

    def over(boxes: np.ndarray, owner: np.ndarray) -> float:
        hit = ((points >= boxes[:, :2]) & (points <= boxes[:, 2:])).all(axis=2)
        return float(np.mean([len(set(owner[row].tolist())) for row in hit])) / len(moves)

    assert over(whole, np.arange(len(moves))) > 0.15
    assert over(pieces, whose) < 0.01


def test_there_is_an_end_to_cutting() -> None:
    moves = crossing(3000, bulges=0.5)
    boxes, _ = boxes_of_pieces(moves, 1e-9)
    assert len(boxes) <= len(moves) + MORE_PIECES
    alone = moves[:1]
    assert len(boxes_of_pieces(alone, float(segment_lengths(alone)[0]))[0]) == 1


def lifted(rng: np.random.Generator, count: int) -> tuple[Segments, np.ndarray]:
    """Crossing moves at twenty heights, every tenth of them sloping."""
    ends = rng.uniform(0.0, 100.0, (2, count, 2))
    moves = Segments.between(ends[0], ends[1], rng.uniform(-1.0, 1.0, count))
    z = np.repeat(rng.integers(0, 20, (count, 1)).astype(float), 2, axis=1)
    z[::10, 1] += rng.uniform(0.0, 5.0, len(z[::10]))
    return moves, z


@pytest.mark.parametrize("seed", range(4))
def test_layers_leave_no_near_move_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moves, z = lifted(rng, 700)
    slope = (z[:, 1] - z[:, 0]) / segment_lengths(moves)
    layers = HeightLayers(moves, z, slope, gap_mm(moves, segment_boxes(moves), levels_of(z)))
    low = rng.uniform(0.0, 90.0, (60, 2))
    boxes = np.concatenate([low, low + rng.uniform(0.1, 10.0, (60, 2))], axis=1)
    heights = np.sort(rng.uniform(-1.0, 25.0, (60, 2)), axis=1)
    for window in (0.0, 0.5):
        box, move = layers.pairs(boxes, heights, window)
        found = set(zip(box.tolist(), move.tolist(), strict=True))
        assert sorted(found) == list(zip(box.tolist(), move.tolist(), strict=True))
        for k in range(len(z)):
            points = point_at(moves, np.full(300, k), np.linspace(0.0, 1.0, 300))[:, None]
            over = ((points >= boxes[:, :2]) & (points <= boxes[:, 2:])).all(axis=2).any(axis=0)
            room = window * (1.0 + slope[k])
            over &= (heights[:, 0] - room <= z[k, 1]) & (z[k, 0] <= heights[:, 1] + room)
            assert {(b, k) for b in np.flatnonzero(over).tolist()} <= found


def test_a_thousand_passes_are_not_all_asked_for_one() -> None:
    corner = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 30.0], [0.0, 30.0]])
    begin = np.tile(corner, (1000, 1))
    end = np.tile(np.roll(corner, -1, axis=0), (1000, 1))
    moves = Segments.between(begin, end, np.zeros(4000))
    z = np.repeat(-0.001 * (np.arange(4000)[:, None] // 4), 2, axis=1)
    gap = gap_mm(moves, segment_boxes(moves), levels_of(z))
    assert gap == pytest.approx(40.0 * 30.0 / 140.0)
    layers = HeightLayers(moves, z, np.zeros(4000), gap)
    box, move = layers.pairs(np.array([[10.0, -0.1, 11.0, 0.1]]), z[400:401])
    assert 400 in move.tolist()
    assert len(box) <= 512


def test_what_lies_in_one_plane_is_one_layer() -> None:
    moves = crossing(3000, bulges=0.0)
    layers = HeightLayers(moves, np.zeros((3000, 2)), np.zeros(3000), 1.0)
    assert len(layers.layers) == 1
