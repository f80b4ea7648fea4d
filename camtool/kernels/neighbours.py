"""The nearest other point of each point, on a grid whose cells are looked at ring by ring.

What makes it exact: after ring k of cells around a point's own, every point nearer than k cells
has been seen. `tests/oracles/chaining.py` is the twin.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@kernel
def nearest_others(
    cells: Ints, points: Floats, size: float, least: float, reach: float
) -> tuple[Ints, Floats]:
    """For each point (P, 2) the row of the nearest one farther than `least`, and its distance.

    `cells` (P, 2): column and row of the grid cell of each point, `size` wide, sorted. A point
    with none within `reach` gets −1. Equal distances go to the first row.
    """
    count = len(points)
    nearest = np.full(count, -1, np.int64)
    distance = np.full(count, np.inf)
    for i in range(count):
        ring = 0
        while (ring - 1) * size <= min(distance[i], reach):
            for column in range(cells[i, 0] - ring, cells[i, 0] + ring + 1):
                at_side = abs(column - cells[i, 0]) == ring
                step = 1 if at_side else 2 * ring
                for row in range(cells[i, 1] - ring, cells[i, 1] + ring + 1, step):
                    stop = cells[i, 1] + ring if at_side else row
                    j = _first(cells, column, row)
                    while j < count and cells[j, 0] == column and cells[j, 1] <= stop:
                        apart = math.hypot(
                            points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
                        )
                        if least < apart <= reach and (
                            apart < distance[i] or (apart == distance[i] and j < nearest[i])
                        ):
                            nearest[i], distance[i] = j, apart
                        j += 1
                    if at_side:
                        break
            ring += 1
    return nearest, distance


@inner
def _first(cells: Ints, column: int, row: int) -> int:
    """The first sorted cell that is not before (column, row)."""
    low, high = 0, len(cells)
    while low < high:
        middle = (low + high) // 2
        if cells[middle, 0] < column or (cells[middle, 0] == column and cells[middle, 1] < row):
            low = middle + 1
        else:
            high = middle
    return low
