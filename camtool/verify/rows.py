"""What became of each row of the program: the figures that all others are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.simulation.motion import Ledger
from camtool.verify.cuts import Bools


@dataclass(frozen=True, eq=False)
class RowFigures:
    """Of N rows of the decoded toolpath, all in mm and XY; rows behind the end have nothing.

    samples (N,). Only of rows that cut, NaN for the others' maxima and 0 for their sums:
    `interpolation` and `mechanics` (N,) largest errors with `interpolation_squares` and
    `mechanics_squares` (N,) mm² the sums of squares over the samples; `known` (N,) how many
    samples have a total error, `total` (N,) the largest, `total_squares` (N,) mm²,
    `total_sum` (N,) with the sign, + to the left of the wanted move, and `total_at` (N, 2)
    where the slides were when it was largest.

    `low`, `high` (N, 2) extents of the slides, infinite where they did not move; `slide_end` and
    `commanded_end` (N, 2) where they and the controller stood after the last sample, NaN where
    there is none. `ledger`: what all chunks say of each row, added up.
    """

    samples: Ints
    interpolation: Floats
    interpolation_squares: Floats
    mechanics: Floats
    mechanics_squares: Floats
    known: Ints
    total: Floats
    total_squares: Floats
    total_sum: Floats
    total_at: Floats
    low: Floats
    high: Floats
    slide_end: Floats
    commanded_end: Floats
    ledger: Ledger


def empty_columns(count: int) -> Floats:
    """(count, 19) columns of `camtool.kernels.judge` of rows that did nothing."""
    from camtool.kernels import judge as at

    columns = np.zeros((count, at.ROW_COLUMNS))
    columns[:, [at.LOW_X, at.LOW_Y]] = np.inf
    columns[:, [at.HIGH_X, at.HIGH_Y]] = -np.inf
    ends = [at.END_X, at.END_Y, at.COMMANDED_X, at.COMMANDED_Y, at.TOTAL_X, at.TOTAL_Y]
    columns[:, ends] = np.nan
    return columns


def row_figures(columns: Floats, is_cut: Bools, ledger: Ledger) -> RowFigures:
    """The record of the columns (N, 19) that the judge has filled."""
    from camtool.kernels import judge as at

    samples, known = columns[:, at.SAMPLES].astype(np.int64), columns[:, at.KNOWN].astype(np.int64)
    judged = is_cut & (samples > 0)

    def largest(column: int, seen: Bools) -> Floats:
        return np.where(seen, columns[:, column], np.nan)

    return RowFigures(
        samples=samples,
        interpolation=largest(at.INNER_MAX, judged),
        interpolation_squares=columns[:, at.INNER_SQUARES],
        mechanics=largest(at.LAG_MAX, judged),
        mechanics_squares=columns[:, at.LAG_SQUARES],
        known=known,
        total=largest(at.TOTAL_MAX, known > 0),
        total_squares=columns[:, at.TOTAL_SQUARES],
        total_sum=columns[:, at.TOTAL_SUM],
        total_at=columns[:, [at.TOTAL_X, at.TOTAL_Y]],
        low=columns[:, [at.LOW_X, at.LOW_Y]],
        high=columns[:, [at.HIGH_X, at.HIGH_Y]],
        slide_end=columns[:, [at.END_X, at.END_Y]],
        commanded_end=columns[:, [at.COMMANDED_X, at.COMMANDED_Y]],
        ledger=ledger,
    )


def add_ledger(whole: Ledger, part: Ledger) -> None:
    """Add what a chunk says of its rows, each of which it says once, to the whole program's."""
    rows = part.row
    whole.duration_s[rows] += part.duration_s
    whole.compensation_s[rows] += part.compensation_s
    whole.iterations[rows] += part.iterations
    whole.steps[rows] += part.steps
    whole.reversals[rows] += part.reversals
    whole.ended[rows] &= part.ended
