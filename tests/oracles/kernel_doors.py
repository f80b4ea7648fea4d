"""Ways in from Python to kernels that only compiled code calls."""

import numpy as np
from numba import njit

from camtool.kernels.circle_bins import fill_bins
from camtool.kernels.move_errors import lower_errors
from camtool.kernels.near_moves import SPOT, nearest_errors
from camtool.kernels.play_blocks import play_block, way_of
from camtool.kernels.thin_trace import trace_block


@njit
def fill_bins_(x, y, centre, directions, bins):
    fill_bins(x, y, centre, directions, bins)


@njit
def lower_errors_(move, x, y, best):
    lower_errors(move, x, y, best, False)


@njit
def set_errors_(move, x, y, best):
    lower_errors(move, x, y, best, True)


@njit
def nearest_errors_(x, y, only, moves, near, out):
    nearest_errors(x, y, only, moves, near, np.empty(SPOT), out)


@njit
def play_block_(way, positions, axis, state, out):
    return play_block(way, positions, axis, state, out)


@njit
def way_of_(before, positions):
    return way_of(before, positions)


@njit
def trace_block_(row, x, y, error, largest, pen, trace):
    trace_block(row, x, y, error, largest, pen, trace)
