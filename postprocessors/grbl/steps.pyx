"""Lines of whole steps by Bresenham on the axis with the most of them.

A block takes n_x, n_y, n_z steps in N = max(n) events. Each axis has a counter, N at the start
of the block; at every event it grows by 2n, and where it exceeds 2N the axis takes a step and 2N
are taken off. After k events the counter stands at N + 2nk − 2N·s in (0, 2N], so the steps taken
are

    s = ⌈(N + 2nk) / 2N⌉ − 1 = ⌊(N + 2nk − 1) / 2N⌋ :

the ideal n k / N rounded to the nearest, halves down. That is where a window into the middle of
a block goes on from. Whole numbers throughout.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Floats, Ints


def steps_taken(way: Ints, events: Ints) -> Ints:
    """(B, 3) signed steps of blocks of `way` (B, 3) steps after `events` (B,) of their events."""
    size = np.abs(way)
    most = np.maximum(size.max(axis=1, initial=0), 1)[:, None]
    taken = (most + 2 * size * events[:, None] - 1) // (2 * most)
    return np.asarray(np.sign(way) * taken)


cpdef void step_lines_fill(
    blocks, (Int, Int) first, double[::1] step_mm, double[:, ::1] out
) noexcept:
    """Positions in mm, `out` (K, 3), after K step events.

    `blocks`: where each starts (B, 3) and its way (B, 3), steps, none without steps; `first`: the
    block of the first event, and how many of its events came before.
    """
    cdef Int k, block, event, most, count, axis, size, sign, taken, counter, position, m
    cdef Int[:, ::1] start, way
    start, way = blocks
    block, event = first
    k = 0
    while k < len(out):
        most = max(abs(way[block, 0]), abs(way[block, 1]), abs(way[block, 2]))
        count = min(most - event, len(out) - k)
        for axis in range(3):
            size = abs(way[block, axis])
            sign = 1 if way[block, axis] > 0 else -1
            taken = (most + 2 * size * event - 1) // (2 * most)
            counter = most + 2 * size * event - 2 * most * taken
            position = start[block, axis] + sign * taken
            for m in range(k, k + count):
                counter += 2 * size
                if counter > 2 * most:
                    counter -= 2 * most
                    position += sign
                out[m, axis] = float(position) * step_mm[axis]
        k += count
        block += 1
        event = 0
