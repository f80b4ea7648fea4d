"""Ways in from Python to kernels, for tests that know one move, one list or one circle."""

import numpy as np

from camtool.kernels.judging import Moves, Search, fill_bins, lower_errors, nearest_errors


def fill_bins_(x, y, centre, directions, bins):
    fill_bins(x, y, *centre, directions, bins, *np.empty((3, len(x))))


def lower_errors_(move, x, y, best):
    lower_errors(np.atleast_2d(move), 0, x, y, best, False)


def set_errors_(move, x, y, best):
    lower_errors(np.atleast_2d(move), 0, x, y, best, True)


def nearest_errors_(x, y, own, only, moves: Moves, out):
    """Whether there is a move, and how many nodes and moves were looked at."""
    search = Search(moves)
    return nearest_errors(x, y, own, *only, search, out), search.looked
