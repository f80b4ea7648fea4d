"""Pieces of a raster that come loose while it is cut: a union of cells, backwards in time.

Cells that touch at an edge or a corner hold each other. `tests/oracles/stock_pieces.py` is the
twin of both functions.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int
from libc.stdint cimport uint8_t

import numpy as np

from camtool.arrays import Bools, Ints

cpdef enum:
    # Columns of a parting: time, a cell of the piece, least and greatest row and column of it, and
    # how many of its cells are cut later.
    TIME, CELL, LOW, HIGH, LEFT, RIGHT, CUT, PARTING_COLUMNS


cdef inline int root_of(int[::1] parent, int cell) noexcept nogil:
    while parent[cell] != cell:
        parent[cell] = parent[parent[cell]]
        cell = parent[cell]
    return cell


def partings(time: Ints, Int standing, double min_cells):
    """(J, 7) the pieces of `min_cells` or more that come loose of cells that are cut through at a
    `time` (NY, NX), `standing` for never; what stands at the edge of the raster is held.

    Backwards in time the cells come back, those of one time at once. One that joins two pieces has
    parted them: the one that is not held, or the smaller, came loose.
    """
    cdef Int[::1] flat = np.ascontiguousarray(time, dtype=np.int64).reshape(-1)
    cdef int ny = time.shape[0], nx = time.shape[1]
    gone = np.flatnonzero(np.asarray(flat) != standing)
    back = gone[np.argsort(-np.asarray(flat)[gone], kind="stable")]
    stay = np.flatnonzero(np.asarray(flat) == standing)
    cdef Int[::1] order = np.concatenate([stay, back])
    cdef Int count = ny * nx, first, last, k
    cdef int[::1] parent = np.full(count, -1, dtype=np.int32)
    cdef int[::1] size = np.zeros(count, dtype=np.int32)
    cdef int[::1] cut = np.zeros(count, dtype=np.int32)
    cdef uint8_t[::1] held = np.zeros(count, dtype=np.uint8)
    cdef int[:, ::1] span = np.empty((count, 4), dtype=np.int32)
    cdef int cell, near, one, other, x, y, dx, dy, left_over
    cdef bint stands
    found = []
    first = 0
    while first < count:
        last = first
        stands = flat[order[first]] == standing
        while last < count and flat[order[last]] == flat[order[first]]:
            cell = <int> order[last]
            y, x = cell // nx, cell % nx
            parent[cell] = cell
            span[cell, 0] = span[cell, 1] = y
            span[cell, 2] = span[cell, 3] = x
            if stands:
                size[cell] = 1
                held[cell] = y == 0 or x == 0 or y == ny - 1 or x == nx - 1
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    if not (0 <= y + dy < ny and 0 <= x + dx < nx) or (dx == 0 and dy == 0):
                        continue
                    near = cell + dy * nx + dx
                    if parent[near] < 0:
                        continue
                    one, other = root_of(parent, cell), root_of(parent, near)
                    if one == other:
                        continue
                    if held[one] or (not held[other] and size[one] > size[other]):
                        one, other = other, one
                    left_over = size[one] if held[other] else size[one] - cut[one]
                    if not stands and left_over >= min_cells and not held[one]:
                        found.append(
                            (
                                flat[cell], one, span[one, 0], span[one, 1], span[one, 2],
                                span[one, 3], cut[one],
                            )
                        )
                    parent[one] = other
                    held[other] = held[other] or held[one]
                    size[other] += size[one]
                    cut[other] += cut[one]
                    span[other, 0] = min(span[other, 0], span[one, 0])
                    span[other, 1] = max(span[other, 1], span[one, 1])
                    span[other, 2] = min(span[other, 2], span[one, 2])
                    span[other, 3] = max(span[other, 3], span[one, 3])
            last += 1
        if not stands:
            for k in range(first, last):
                one = root_of(parent, <int> order[k])
                size[one] += 1
                cut[one] += 1
        first = last
    return np.array(found, dtype=np.int64).reshape(-1, PARTING_COLUMNS)


def piece_at(standing: Bools, Int row, Int column):
    """(NY, NX) True for the cells of the piece of standing cells in which one lies."""
    cdef uint8_t[:, ::1] stands = np.ascontiguousarray(standing).view(np.uint8)
    cdef Int ny = stands.shape[0], nx = stands.shape[1], height = 0, x, y, dx, dy
    cdef uint8_t[:, ::1] found = np.zeros((ny, nx), dtype=np.uint8)
    cdef int[::1] stack = np.empty(ny * nx + 1, dtype=np.int32)
    if stands[row, column]:
        found[row, column] = True
        stack[0], height = <int> (row * nx + column), 1
    while height:
        height -= 1
        y, x = stack[height] // nx, stack[height] % nx
        for dy in range(max(y - 1, 0), min(y + 2, ny)):
            for dx in range(max(x - 1, 0), min(x + 2, nx)):
                if stands[dy, dx] and not found[dy, dx]:
                    found[dy, dx] = True
                    stack[height] = <int> (dy * nx + dx)
                    height += 1
    return np.asarray(found).view(np.bool_)
