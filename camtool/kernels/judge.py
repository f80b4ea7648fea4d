"""Judging the samples of a motion: errors, extents, circles and a thinned trace in one pass.

Samples come in blocks of at most `BLOCK`, each of one row of the program, and stay in the
processor's cache: a few loops run over a block before the next one comes. Per sample of a row
that cuts:

    interpolation = commanded position to the row's own move
    mechanics     = |slide − commanded|
    total         = slide to the nearest wanted move that the row may be compared with, and how
                    far what was drawn may lie from that

Memory is that of the rows, the moves and the circles; it does not grow with the samples.
Distances are exact (`camtool.kernels.move_errors`, `camtool.kernels.near_moves`); sums are taken
in no certain order. Compiled, because a program takes millions of steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.circle_bins import fill_bins
from camtool.kernels.compiled import kernel
from camtool.kernels.error_bins import BEFORE_FIRST, BINS, SHIFT
from camtool.kernels.move_errors import lower_errors
from camtool.kernels.near_moves import COUNT, Moves, Near, nearest_errors
from camtool.kernels.thin_trace import trace_block
from camtool.kernels.wide import first_of, larger, smaller, wide

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

BLOCK = 768
"""Samples that are judged together: their columns about fill a processor's first cache."""

FARTHEST_MM = 1e9
"""No slide is farther from zero (a thousand kilometres): squares of such positions and their sums
stay finite, which all loops here and below take for granted. What judges steps on the way keeps to
it by its own limits: five digits of micrometres, and the ranges of a machine file."""

(
    SAMPLES,
    INNER_MAX,
    INNER_SQUARES,
    LAG_MAX,
    LAG_SQUARES,
    KNOWN,
    TOTAL_MAX,
    TOTAL_SQUARES,
    TOTAL_SUM,
    TOTAL_X,
    TOTAL_Y,
    LOW_X,
    LOW_Y,
    HIGH_X,
    HIGH_Y,
    END_X,
    END_Y,
    COMMANDED_X,
    COMMANDED_Y,
) = range(19)
"""Columns of the rows: how many samples; of those of rows that cut the largest error and the sum
of squares; how many have a total, that with its sum and its place; extents; last positions."""

ROW_COLUMNS = 19
"""How many columns."""


OWN, FIRST, LAST, CIRCLE, SLOT = range(5)
"""Columns of `Task.rows`."""


class Task(NamedTuple):
    """What N rows are judged by.

    own (J, 16) moves of the rows that cut (`move_errors`), the K moves that are wanted; rows
    (N, 5): which of `own` a row is, −1 where nothing is cut, first and last of the moves that it
    is compared with, the circle that it goes round or −1, and the bins of that; window (N, 2)
    between which heights moves are compared; off (N,) mm: how far what was drawn lies at most from
    the moves that a row is compared with; centre (C, 2) mm of circles; directions (721, 2) of
    `circle_bins`.
    """

    own: Floats
    moves: Moves
    rows: Ints
    window: Floats
    off: Floats
    centre: Floats
    directions: Floats


class Sums(NamedTuple):
    """What is found: rows (N, 19); histograms (2, 4 BINS) of interpolation and total, every
    fourth sample in the same place of its four; bins (S, 720, 9); trace (T, 4) x, y, error, row,
    and its pen; the list of near moves."""

    rows: Floats
    histograms: Ints
    bins: Floats
    trace: Floats
    pen: Floats
    near: Near


X, Y, SLIDE_X, SLIDE_Y, ERRORS, SIZE, PLACES, SPOT = range(8)
"""Rows of a bench (8, BLOCK), room for a block: commanded and slides mm, their errors, the sizes
of these, the bins of these (int64), and room for one point."""

BENCH_ROWS = 8
"""How many rows."""


@wide
def _spread(
    figures: Floats, x: Floats, y: Floats, slide_x: Floats, slide_y: Floats
) -> tuple[float, float]:
    """Extents of the slides; returns the largest square of mechanics and their sum."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    lag, lags = 0.0, 0.0
    for k in range(len(x)):
        low_x = smaller(low_x, slide_x[k])
        high_x = larger(high_x, slide_x[k])
        low_y = smaller(low_y, slide_y[k])
        high_y = larger(high_y, slide_y[k])
        off_x, off_y = slide_x[k] - x[k], slide_y[k] - y[k]
        square = off_x * off_x + off_y * off_y
        lags += square
        lag = larger(lag, square)
    figures[LOW_X], figures[HIGH_X] = min(figures[LOW_X], low_x), max(figures[HIGH_X], high_x)
    figures[LOW_Y], figures[HIGH_Y] = min(figures[LOW_Y], low_y), max(figures[HIGH_Y], high_y)
    return lag, lags


@wide
def _sizes(errors: Floats, off: float, size: Floats, places: Ints) -> tuple[float, float, float]:
    """Sizes of errors, all `off` larger than they are alone, and their places in a histogram,
    where four samples take turns so that none waits for the one before; returns the largest, the
    sum of squares, and the sum of the errors alone with their signs."""
    largest, squares, signed = 0.0, 0.0, 0.0
    for k in range(len(errors)):
        error = abs(errors[k]) + off
        size[k] = error
        signed += errors[k]
        squares += error * error
        largest = larger(largest, error)
    bits = size.view(np.int64)
    for k in range(len(errors)):
        leading = (bits[k] >> SHIFT) - BEFORE_FIRST
        places[k] = 4 * min(max(leading, 0), BINS - 1) + (k & 3)
    return largest, squares, signed


@wide
def _count(places: Ints, histogram: Ints) -> None:
    for k in range(len(places)):
        histogram[np.uint64(places[k])] += 1


@wide
def _inner(figures: Floats, sums: tuple[float, float, float]) -> None:
    """Interpolation of samples."""
    figures[INNER_MAX] = max(figures[INNER_MAX], sums[0])
    figures[INNER_SQUARES] += sums[1]


@wide
def _total(
    figures: Floats, sums: tuple[float, float, float], x: Floats, y: Floats, size: Floats
) -> None:
    """Total error of samples."""
    largest, squares, signed = sums
    figures[TOTAL_SQUARES] += squares
    figures[TOTAL_SUM] += signed
    if largest > figures[TOTAL_MAX] or figures[KNOWN] == 0.0:
        k = first_of(size, largest)
        figures[TOTAL_MAX] = largest
        figures[TOTAL_X], figures[TOTAL_Y] = x[k], y[k]
    figures[KNOWN] += len(size)


@wide
def judge_block(row: int, count: int, task: Task, sums: Sums, bench: Floats) -> None:
    """Judge the first `count` samples of the bench, all of one row."""
    if count == 0:
        return
    x, y = bench[X, :count], bench[Y, :count]
    slide_x, slide_y = bench[SLIDE_X, :count], bench[SLIDE_Y, :count]
    errors, size = bench[ERRORS, :count], bench[SIZE, :count]
    places = bench[PLACES, :count].view(np.int64)
    figures = sums.rows[row]
    lag, lags = _spread(figures, x, y, slide_x, slide_y)
    last = count - 1
    figures[SAMPLES] += count
    figures[END_X], figures[END_Y] = slide_x[last], slide_y[last]
    figures[COMMANDED_X], figures[COMMANDED_Y] = x[last], y[last]
    about, largest = task.rows[row], 0.0
    own = about[OWN]
    if own >= 0:
        figures[LAG_MAX] = max(figures[LAG_MAX], math.sqrt(lag))
        figures[LAG_SQUARES] += lags
        lower_errors(task.own[own], x, y, errors, True)
        _inner(figures, _sizes(errors, 0.0, size, places))
        _count(places, sums.histograms[0])
        only = about[FIRST], about[LAST], task.window[row, 0], task.window[row, 1]
        nearest_errors(slide_x, slide_y, only, task.moves, sums.near, bench[SPOT], errors)
        if sums.near.memo[COUNT] > 0.0:
            found = _sizes(errors, task.off[row], size, places)
            _total(figures, found, slide_x, slide_y, size)
            _count(places, sums.histograms[1])
            largest = found[0]
        if about[CIRCLE] >= 0:
            bins = sums.bins[about[SLOT]]
            fill_bins(slide_x, slide_y, task.centre[about[CIRCLE]], task.directions, bins)
    trace_block(row, slide_x, slide_y, size, largest, sums.pen, sums.trace)


@kernel
def judge_samples(row: Ints, commanded: Floats, slide: Floats, task: Task, sums: Sums) -> int:
    """Judge K samples in order: row (K,), commanded and slide (K, 3) mm, whose Z is not looked at;
    any number of rows. Returns the first sample that is no place within `FARTHEST_MM`, none of
    which is judged from its block on, or −1."""
    bench = np.empty((BENCH_ROWS, BLOCK))
    done = 0
    while done < len(row):
        count = 0
        while count < BLOCK and done + count < len(row) and row[done + count] == row[done]:
            k = done + count
            for axis in range(2):  # NaN fails too
                near = abs(commanded[k, axis]) <= FARTHEST_MM
                if not (near and abs(slide[k, axis]) <= FARTHEST_MM):
                    return k
            bench[X, count], bench[Y, count] = commanded[k, 0], commanded[k, 1]
            bench[SLIDE_X, count], bench[SLIDE_Y, count] = slide[k, 0], slide[k, 1]
            count += 1
        judge_block(row[done], count, task, sums, bench)
        done += count
    return -1
