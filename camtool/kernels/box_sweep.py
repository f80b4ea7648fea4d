"""Pairs of boxes that touch, found by a sweep along one axis.

Boxes are sorted by where they begin on that axis, so those that may touch a box follow it until
one begins beyond its end. What makes it exact: comparisons of the given numbers, nothing else.
`camtool.geometry.boxes` chooses the axis on which fewer boxes are looked at.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@kernel
def touching(
    boxes: Floats, same: Ints, differ: Ints, asked: Bools, most: int
) -> tuple[Ints, Ints]:
    """Rows (J,), (J,) of boxes (K, 4) low, low, high, high that touch, each pair once.

    `boxes` are sorted by their first column. Both of a pair have the same number in `same`,
    different ones in `differ`, and at least one of them is `asked` for. No more than `most` pairs.
    """
    room = np.empty(0, np.int64)
    count = _touching(boxes, same, differ, asked, most, room, room)
    one, other = np.empty(count, np.int64), np.empty(count, np.int64)
    _touching(boxes, same, differ, asked, most, one, other)
    return one, other


@inner
def _touching(
    boxes: Floats, same: Ints, differ: Ints, asked: Bools, most: int, one: Ints, other: Ints
) -> int:
    """Counts the pairs, and writes them when there is room for them."""
    count = 0
    for i in range(len(boxes)):
        j = i + 1
        while j < len(boxes) and boxes[j, 0] <= boxes[i, 2]:
            if (
                boxes[j, 1] <= boxes[i, 3]
                and boxes[i, 1] <= boxes[j, 3]
                and same[i] == same[j]
                and differ[i] != differ[j]
                and (asked[i] or asked[j])
            ):
                if count >= most:
                    return count
                if len(one) > 0:
                    one[count], other[count] = i, j
                count += 1
            j += 1
    return count
