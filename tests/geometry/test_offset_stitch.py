"""Stitching on its own: kept slices become loops, in whatever order they come."""

from itertools import permutations

import numpy as np

from camtool.geometry.offset import Slices, trace_loops
from camtool.geometry.polylines import Segments


def lines_between(nodes: list[tuple[float, float]], ways: list[tuple[int, int]]) -> Slices:
    count = len(ways)
    return Slices(
        element=np.arange(count),
        t0=np.zeros(count),
        t1=np.ones(count),
        from_node=np.array([a for a, _ in ways]),
        to_node=np.array([b for _, b in ways]),
        nodes=np.array(nodes, dtype=np.float64),
    )


def test_a_loop_that_hangs_on_another_is_taken_off_once() -> None:
    # A triangle with a second one at its node 1: begun anywhere, both come back, and only they.
    # Begun before node 1, the second loop closes while the first is still open.
    slices = lines_between(
        [(0, 0), (2, 0), (4, 0), (4, 1), (0, 2)], [(0, 1), (1, 2), (2, 3), (3, 1), (1, 4), (4, 0)]
    )
    places = slices.nodes
    elements = Segments.between(places[slices.from_node], places[slices.to_node], np.zeros(6))
    for order in permutations(range(6)):
        rows = np.array(order)
        loops = [rows[loop] for loop in trace_loops(slices[rows], elements)]
        assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 4, 5], [1, 2, 3]]
