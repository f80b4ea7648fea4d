"""The best rows for a given order, exactly: the shortest way through layers.

    cost(s) = min over the rows r of the item before of  cost(r) + |exit r → entry s|.

Rows r whose cost alone is not below what has been found are not tried: gaps are not negative. Of
equal ways that of the cheaper row counts, and of equal rows the lower one.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@kernel
def best_rows(ends: Floats, first: Ints, order: Ints, start: Floats, goal: Floats) -> Ints:
    """Rows (M,) for items (M,) in this order, from `start` (2,) to `goal` (2,), NaN for no goal.

    `ends` (S, 4): entry x, y and exit x, y; item i owns the rows from first[i] to first[i + 1].
    """
    count = len(order)
    came_from, cost = np.full(first[-1], -1), np.empty(first[-1])
    for row in range(first[order[0]], first[order[0] + 1]):
        cost[row] = math.hypot(ends[row, 0] - start[0], ends[row, 1] - start[1])
    for rank in range(1, count):
        low, high = first[order[rank - 1]], first[order[rank - 1] + 1]
        for row in range(first[order[rank]], first[order[rank] + 1]):
            best = np.inf
            for r in range(low, high):
                if cost[r] >= best:
                    continue
                x, y = ends[row, 0] - ends[r, 2], ends[row, 1] - ends[r, 3]
                length = cost[r] + math.sqrt(x * x + y * y)
                if length < best or (length == best and cost[r] < cost[came_from[row]]):
                    best, came_from[row] = length, r
            cost[row] = best
    chosen, best = -1, np.inf
    for row in range(first[order[-1]], first[order[-1] + 1]):
        home = math.hypot(ends[row, 2] - goal[0], ends[row, 3] - goal[1])
        length = cost[row] + (0.0 if math.isnan(goal[0]) else home)
        if length < best:
            chosen, best = row, length
    rows = np.empty(count, np.int64)
    for rank in range(count - 1, -1, -1):
        rows[rank] = chosen
        chosen = came_from[chosen]
    return rows
