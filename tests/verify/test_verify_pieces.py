"""Boxes of the pieces of long moves: they hold all of the move, and little else."""

import numpy as np
import pytest

from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import Segments
from camtool.verify.pieces import MORE_PIECES, boxes_of_pieces, gap_mm

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
