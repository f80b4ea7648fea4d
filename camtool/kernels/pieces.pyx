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
    """Return (J, 7) the pieces of at least `min_cells` cells that come loose when the cells of a
    raster are cut through at a `time` (NY, NX), `standing` for never; what touches the edge of the
    raster is held.

    Backwards in time the cells come back, those of the same time together. A cell that joins two
    pieces has separated them when it was cut: the one that is not held, or the smaller, came
    loose.
    """
    cdef Int[::1] flat = np.ascontiguousarray(time, dtype=np.int64).reshape(-1)
    cdef int ny = time.shape[0], nx = time.shape[1]
    removed = np.flatnonzero(np.asarray(flat) != standing)
    refilled = removed[np.argsort(-np.asarray(flat)[removed], kind="stable")]
    stay = np.flatnonzero(np.asarray(flat) == standing)
    cdef Int[::1] order = np.concatenate([stay, refilled])
    cdef Int count = ny * nx, first, last, k
    cdef int[::1] parent = np.full(count, -1, dtype=np.int32)
    cdef int[::1] size = np.zeros(count, dtype=np.int32)
    cdef int[::1] cut = np.zeros(count, dtype=np.int32)
    cdef uint8_t[::1] is_held = np.zeros(count, dtype=np.uint8)
    cdef int[:, ::1] span = np.empty((count, 4), dtype=np.int32)
    cdef int cell, neighbour, root, other_root, x, y, dx, dy, left_over
    cdef bint is_standing
    rows = []
    first = 0
    while first < count:
        last = first
        is_standing = flat[order[first]] == standing
        while last < count and flat[order[last]] == flat[order[first]]:
            cell = <int> order[last]
            y, x = cell // nx, cell % nx
            parent[cell] = cell
            span[cell, 0] = span[cell, 1] = y
            span[cell, 2] = span[cell, 3] = x
            if is_standing:
                size[cell] = 1
                is_held[cell] = y == 0 or x == 0 or y == ny - 1 or x == nx - 1
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    if not (0 <= y + dy < ny and 0 <= x + dx < nx) or (dx == 0 and dy == 0):
                        continue
                    neighbour = cell + dy * nx + dx
                    if parent[neighbour] < 0:
                        continue
                    root, other_root = root_of(parent, cell), root_of(parent, neighbour)
                    if root == other_root:
                        continue
                    if (
                        is_held[root]
                        or (not is_held[other_root] and size[root] > size[other_root])
                    ):
                        root, other_root = other_root, root
                    left_over = size[root] if is_held[other_root] else size[root] - cut[root]
                    if not is_standing and left_over >= min_cells and not is_held[root]:
                        rows.append(
                            (
                                flat[cell], root, span[root, 0], span[root, 1], span[root, 2],
                                span[root, 3], cut[root],
                            )
                        )
                    parent[root] = other_root
                    is_held[other_root] = is_held[other_root] or is_held[root]
                    size[other_root] += size[root]
                    cut[other_root] += cut[root]
                    span[other_root, 0] = min(span[other_root, 0], span[root, 0])
                    span[other_root, 1] = max(span[other_root, 1], span[root, 1])
                    span[other_root, 2] = min(span[other_root, 2], span[root, 2])
                    span[other_root, 3] = max(span[other_root, 3], span[root, 3])
            last += 1
        if not is_standing:
            for k in range(first, last):
                root = root_of(parent, <int> order[k])
                size[root] += 1
                cut[root] += 1
        first = last
    return np.array(rows, dtype=np.int64).reshape(-1, PARTING_COLUMNS)


def piece_at(standing: Bools, Int row, Int column):
    """Return a mask (NY, NX), true for the cells of the piece of standing cells that contains
    (row, column)."""
    cdef uint8_t[:, ::1] is_standing = np.ascontiguousarray(standing).view(np.uint8)
    cdef Int ny = is_standing.shape[0], nx = is_standing.shape[1], height = 0, x, y, dx, dy
    cdef uint8_t[:, ::1] is_piece = np.zeros((ny, nx), dtype=np.uint8)
    cdef int[::1] stack = np.empty(ny * nx + 1, dtype=np.int32)
    if is_standing[row, column]:
        is_piece[row, column] = True
        stack[0], height = <int> (row * nx + column), 1
    while height:
        height -= 1
        y, x = stack[height] // nx, stack[height] % nx
        for dy in range(max(y - 1, 0), min(y + 2, ny)):
            for dx in range(max(x - 1, 0), min(x + 2, nx)):
                if is_standing[dy, dx] and not is_piece[dy, dx]:
                    is_piece[dy, dx] = True
                    stack[height] = <int> (dy * nx + dx)
                    height += 1
    return np.asarray(is_piece).view(np.bool_)
