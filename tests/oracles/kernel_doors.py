"""Ways in from Python to kernels, for tests that know one move, one list or one circle."""

import numpy as np

from camtool.kernels.judging import (
    Curves,
    Moves,
    Search,
    Shapes,
    fill_bins,
    nearest_errors,
    set_errors,
)


def fill_bins_(x, y, centre, directions, bins):
    fill_bins(x, y, *centre, directions, bins)


def shapes(table):
    """Moves (K, 16): start, end, way, 1 / way², and of arcs centre, radius, turn, the normals into
    the wedge, and how wide it is."""
    arc = np.flatnonzero(table[:, 9] > 0.0)
    which = np.full(len(table), -1, dtype=np.int32)
    which[arc] = np.arange(len(arc))
    ends = (np.ascontiguousarray(table[:, k : k + 2], dtype=np.float64) for k in (0, 2))
    return Shapes(*ends, which, np.ascontiguousarray(table[arc, 7:], dtype=np.float64))


def set_errors_(move, x, y, errors):
    set_errors(Curves(shapes(np.atleast_2d(move))), 0, x, y, errors)


def nearest_errors_(x, y, own, only, moves: Moves, out):
    """Return True if there is a move, and the numbers of nodes and moves that were visited."""
    search = Search(moves)
    return nearest_errors(x, y, own, *only, search, out), search.looked
