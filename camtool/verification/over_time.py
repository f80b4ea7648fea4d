"""Errors over time: the distance of the slides from the wanted path at each moment.

The motion is run once more, in chunks, and judged by the compiled judge of `slides`, whose trace
keeps every sample of a chunk here: the largest error over time is that of the report."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.arrays import Floats
from camtool.kernels import judging as at
from camtool.kernels.judging import BINS, Sums, empty_bins, judge_samples, new_pen
from camtool.records import replace
from camtool.simulation.motion import Chunk
from camtool.simulation.timing import TimedChunk
from camtool.verification.case import Case
from camtool.verification.figures import empty_columns
from camtool.verification.slides import ROWS_AT_ONCE, Paths, Tasks
from camtool.verification.verify import compare_cuts


def errors_over_time(case: Case) -> Iterator[tuple[TimedChunk, Floats]]:
    """Yield the motion of a case in chunks, with the distance (K,) mm of the slides from the
    wanted path at each sample; NaN where nothing is cut, and where no wanted move is known."""
    paths, coverage, _, _ = compare_cuts(case)
    match = coverage.match
    match = replace(match, circle=np.full(len(match.circle), -1, dtype=match.circle.dtype))
    paths = Paths(paths.decoded, paths.wanted, [], paths.depth_mm)
    tasks = Tasks(paths, match, np.zeros(0, dtype=np.int64))
    rows = len(paths.decoded.is_cut)
    for timed in case.target.timed(case.decoded, case.simulation):
        yield timed, _errors(timed.chunk, tasks, rows)


def _errors(chunk: Chunk, tasks: Tasks, rows: int) -> Floats:
    """Return the errors (K,) mm of the samples of a chunk."""
    errors = np.full(len(chunk.row), np.nan)
    if not len(chunk.row):
        return errors
    first, last = int(chunk.row[0]), int(chunk.row[-1])
    for low in range(first, last + 1, ROWS_AT_ONCE):
        high = min(low + ROWS_AT_ONCE, rows)
        begin, end = np.searchsorted(chunk.row, [low, high]).tolist()
        row = np.ascontiguousarray(chunk.row[begin:end])
        sums = Sums(
            rows=empty_columns(high - low),
            histograms=np.zeros((2, 4 * BINS), dtype=np.int64),
            bins=empty_bins(0),
            trace=np.empty((len(row) + 2, 4)),
            pen=new_pen(1, len(row) + 2),
            pieces=[],
        )
        judge_samples(
            row,
            np.ascontiguousarray(chunk.commanded[begin:end]),
            np.ascontiguousarray(chunk.slide[begin:end]),
            tasks.of(low, high),
            sums,
        )
        is_known = sums.rows[row - low, at.KNOWN] > 0.0
        errors[begin:end] = np.where(is_known, sums.trace[: len(row), 2], np.nan)
    return errors
