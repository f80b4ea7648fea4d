"""The path of the slides, thinned as it comes: of so many samples of a row that with the largest
error, and each row's last.

The pen holds what is not yet written: the largest of the present run, and the last sample.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.wide import first_of, larger, wide

Floats = npt.NDArray[np.float64]

(
    STRIDE,
    WRITTEN,
    ROOM,
    ROW,
    IN_RUN,
    PEAK,
    PEAK_X,
    PEAK_Y,
    LAST,
    LAST_X,
    LAST_Y,
    LAST_IS_WRITTEN,
) = range(12)
"""The pen, float64: samples of a run; points written, and how many may be besides the ends of
rows; the row (−1: none yet); samples in the present run; its largest error and where; the last
sample's error and where, and whether it is the largest of its run or written already."""

PEN = 12
"""Numbers of a pen."""


def new_pen(stride: int, room: int) -> Floats:
    """A pen that has written nothing."""
    pen = np.zeros(PEN)
    pen[STRIDE], pen[ROOM], pen[ROW], pen[PEAK] = stride, room, -1.0, -1.0
    return pen


def unwritten(pen: Floats) -> Floats:
    """(0 to 2, 4) points that the pen still holds: x, y, error, row."""
    peak, last = pen[[PEAK_X, PEAK_Y, PEAK, ROW]], pen[[LAST_X, LAST_Y, LAST, ROW]]
    held = [peak] if pen[IN_RUN] > 0.0 else []
    if pen[ROW] >= 0.0 and not (pen[LAST_IS_WRITTEN] > 0.0):
        held.append(last)
    return np.array(held).reshape(-1, 4)


@wide
def _write(pen: Floats, x: float, y: float, error: float, trace: Floats) -> None:
    at = int(pen[WRITTEN])
    trace[at, 0], trace[at, 1], trace[at, 2], trace[at, 3] = x, y, error, pen[ROW]
    pen[WRITTEN] += 1.0


@wide
def _end_run(pen: Floats, trace: Floats) -> None:
    if pen[IN_RUN] > 0.0 and pen[WRITTEN] < pen[ROOM]:
        _write(pen, pen[PEAK_X], pen[PEAK_Y], pen[PEAK], trace)
    elif pen[IN_RUN] > 0.0:
        pen[LAST_IS_WRITTEN] = 0.0
    pen[IN_RUN], pen[PEAK] = 0.0, -1.0


@wide
def end_row(pen: Floats, trace: Floats) -> None:
    """Write what the pen holds."""
    _end_run(pen, trace)
    if pen[ROW] >= 0.0 and pen[LAST_IS_WRITTEN] == 0.0:
        _write(pen, pen[LAST_X], pen[LAST_Y], pen[LAST], trace)
        pen[LAST_IS_WRITTEN] = 1.0


@wide
def _largest(error: Floats) -> float:
    peak = 0.0
    for k in range(len(error)):
        peak = larger(peak, error[k])
    return peak


@wide
def trace_block(
    row: int,
    x: Floats,
    y: Floats,
    error: Floats,
    largest: float,
    pen: Floats,
    trace: Floats,
) -> None:
    """Take points x, y (n,) of one row; `error` (n,) of them and the `largest`, where that is
    above 0; else they have none. What is full of points takes only the ends of rows."""
    count = len(x)
    if pen[ROW] != row:
        end_row(pen, trace)
        pen[ROW] = row
    low = 0
    while low < count:
        high = min(count, low + int(pen[STRIDE] - pen[IN_RUN]))
        at, peak = low, 0.0
        if largest > pen[PEAK] and largest > 0.0:
            peak = _largest(error[low:high])
            at += first_of(error[low:high], peak)
        if peak > pen[PEAK]:
            pen[PEAK], pen[PEAK_X], pen[PEAK_Y] = peak, x[at], y[at]
            pen[LAST_IS_WRITTEN] = 1.0 if at == high - 1 else 0.0
        else:
            pen[LAST_IS_WRITTEN] = 0.0
        pen[IN_RUN] += high - low
        pen[LAST_X], pen[LAST_Y] = x[high - 1], y[high - 1]
        pen[LAST] = error[high - 1] if largest > 0.0 else 0.0
        if pen[IN_RUN] >= pen[STRIDE]:
            _end_run(pen, trace)
        low = high
