"""The figures of a verification: of streams of errors, of rows, of contours, of the whole motion.

`Figure` takes errors in mm, batch by batch, and gives the maximum (exact, with its place), the
root of the mean square (exact, all samples with the same weight) and the 95th percentile, in
memory that does not grow with the stream. The percentile comes from a histogram: it is the middle
of the bin with the sample of that rank. Bins (`camtool.kernels.judging`) are between 1/256 and
1/128 of their value wide, so the percentile is within 0.4 % of the exact value.

`RowFigures` are the figures of each row of the program. All figures of contours, of the worst
moves and of the whole motion (`Tally`) are sums and maxima over rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.judging import BEFORE_FIRST, BINS, SHIFT, leading_bits
from camtool.simulation.motion import Ledger
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.cuts import CutMoves
from camtool.verification.matching import Match

PERCENTILE = 0.95
"""The percentile of the errors that the report calls p95."""


class Figure:
    """Maximum, rms and 95th percentile of errors ≥ 0, mm; all NaN without any error."""

    def __init__(self) -> None:
        self.count = 0
        self.at_mm: tuple[float, float] = (math.nan, math.nan)
        """The place of the maximum, mm; of several, the first."""
        self.row = -1
        """Toolpath row of the maximum."""
        self._max = -math.inf
        self._squares = 0.0
        self._histogram = np.zeros(BINS, dtype=np.int64)

    def add(self, errors: Floats, points: Floats, rows: Ints) -> None:
        """Errors (J,) mm measured at points (J, 2) mm of these rows (J,)."""
        if len(errors) == 0:
            return
        self.count += len(errors)
        self._squares += float((errors * errors).sum())  # np.dot would start threads
        worst = int(np.argmax(errors))
        if float(errors[worst]) > self._max:
            self._max = float(errors[worst])
            self.at_mm = (float(points[worst, 0]), float(points[worst, 1]))
            self.row = int(rows[worst])
        # The first bin is for 0, the last one for all larger errors.
        bins = np.clip(leading_bits(errors) - BEFORE_FIRST, 0, BINS - 1)
        self._histogram += np.bincount(bins, minlength=BINS)

    @classmethod
    def of_rows(
        cls, largest: Floats, squares: Floats, counts: Ints, histogram: Ints | None
    ) -> Figure:
        """The figure of N rows: `largest` error (N,) mm of each row, or NaN; sums of squares (N,)
        mm²; counts (N,) of samples; `histogram` (L · BINS,) of all samples, L numbers for each
        bin."""
        made = cls()
        made.count = int(counts.sum())
        if made.count:
            made.row = int(np.nanargmax(largest))
            made._max = float(largest[made.row])
            made._squares = float(squares.sum())
        if histogram is not None:
            made._histogram = histogram.reshape(BINS, -1).sum(axis=1)
        return made

    @property
    def max(self) -> float:
        """Largest error, mm, exact."""
        return self._max if self.count else math.nan

    @property
    def rms(self) -> float:
        """Root of the mean square, mm."""
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    @property
    def p95(self) -> float:
        """The error that 95 % of the samples do not exceed, mm, within 0.4 %."""
        if not self.count:
            return math.nan
        rank = math.ceil(PERCENTILE * self.count)
        chosen = int(np.searchsorted(np.cumsum(self._histogram), rank))
        if chosen == 0:
            return 0.0
        edges = np.array([chosen, chosen + 1], dtype=np.int64) + BEFORE_FIRST
        middle = float(np.left_shift(edges, SHIFT).view(np.float64).mean())
        return min(middle, self._max)


# Figures of rows.


@dataclass(frozen=True, eq=False)
class RowFigures:
    """Figures of the N rows of the decoded toolpath, in mm and XY; rows after the end have none.

    `samples` (N,): their number. For rows that cut (others have NaN as maxima and 0 as sums):
    `interpolation` and `mechanics` (N,), the largest errors, and `interpolation_squares` and
    `mechanics_squares` (N,) mm², their sums of squares over the samples; `known` (N,), the number
    of samples with a total error, `total` (N,), the largest of them, `total_squares` (N,) mm²,
    `total_sum` (N,) with sign, + to the left of the wanted move, and `total_at` (N, 2), the
    position of the slides at the largest.

    `low`, `high` (N, 2): extents of the slides, infinite where they did not move; `slide_end` and
    `commanded_end` (N, 2): positions of the slides and of the controller after the last sample,
    NaN without samples. `ledger`: the sum of the ledgers of all chunks.
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
    """(count, 19) columns of `camtool.kernels.judging` for rows without samples."""
    from camtool.kernels import judging as at

    columns = np.zeros((count, at.ROW_COLUMNS))
    columns[:, [at.LOW_X, at.LOW_Y]] = np.inf
    columns[:, [at.HIGH_X, at.HIGH_Y]] = -np.inf
    ends = [at.END_X, at.END_Y, at.COMMANDED_X, at.COMMANDED_Y, at.TOTAL_X, at.TOTAL_Y]
    columns[:, ends] = np.nan
    return columns


def row_figures(columns: Floats, is_cut: Bools, ledger: Ledger) -> RowFigures:
    """The figures in the columns (N, 19) that the judge has filled."""
    from camtool.kernels import judging as at

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
    """Add the ledger of a chunk, with each row at most once, to that of the whole program."""
    rows = part.row
    whole.duration_s[rows] += part.duration_s
    whole.compensation_s[rows] += part.compensation_s
    whole.iterations[rows] += part.iterations
    whole.steps[rows] += part.steps
    whole.reversals[rows] += part.reversals
    whole.ended[rows] &= part.ended


# Figures of the whole motion: steps, reversals, time, and endless arcs.


@dataclass(frozen=True, eq=False)
class Tally:
    """Sums over the whole program. Reversals and times are divided into cutting and the rest;
    `compensation_s` is a part of cutting and air."""

    steps: Ints
    iterations: int
    reversals: Ints
    cutting_reversals: Ints
    cutting_s: float
    air_s: float
    dwell_s: float
    compensation_s: float
    endless_arcs: dict[int, tuple[float, float]]
    """Rows whose stop test was never met, with the place in XY (mm) where they were left."""

    @property
    def time_s(self) -> float:
        """Cutting, air moves and dwells together."""
        return self.cutting_s + self.air_s + self.dwell_s


def tally_of(rows: RowFigures, decoded: Toolpath, is_cut: Bools) -> Tally:
    """The sums over all rows; `is_cut` (N,): the rows that cut."""
    ledger, dwell = rows.ledger, decoded.kind == Kind.DWELL
    air = ~is_cut & ~dwell
    missed = np.flatnonzero(~ledger.ended).tolist()
    return Tally(
        steps=ledger.steps.sum(axis=0),
        iterations=int(ledger.iterations.sum()),
        reversals=ledger.reversals.sum(axis=0),
        cutting_reversals=ledger.reversals[is_cut].sum(axis=0),
        cutting_s=float(ledger.duration_s[is_cut].sum()),
        air_s=float(ledger.duration_s[air].sum()),
        dwell_s=float(ledger.duration_s[dwell].sum()),
        compensation_s=float(ledger.compensation_s.sum()),
        endless_arcs={
            row: (float(rows.commanded_end[row, 0]), float(rows.commanded_end[row, 1]))
            for row in missed
        },
    )


# Figures of contours, the worst moves, and missed ends.

END_STEPS = 1.5
"""A move misses its end when the controller stops more than this many steps beside it; one step is
the rounding of an interpolator."""


@dataclass(frozen=True)
class ContourFigures:
    """The total error of one wanted contour, mm: the maximum with its place and toolpath row, the
    root of the mean square, and the signed mean (+ to the left of the direction of travel) without
    the fit; and the largest errors of interpolation, mechanics and fit on it."""

    contour: int
    row: int
    at_mm: tuple[float, float]
    max_mm: float
    rms_mm: float
    mean_mm: float
    interpolation_mm: float
    mechanics_mm: float
    fit_mm: float


def contour_figures(rows: RowFigures, match: Match) -> Iterator[ContourFigures]:
    """The figures of each wanted contour to which rows with a known error belong."""
    known = np.flatnonzero((rows.known > 0) & (match.contour >= 0))
    if len(known) == 0:
        return
    of = match.contour[known]
    count = int(of.max()) + 1
    samples = np.bincount(of, rows.known[known], count)
    squares = np.bincount(of, rows.total_squares[known], count)
    sums = np.bincount(of, rows.total_sum[known], count)
    inner, lag, off = np.zeros((3, count))
    np.maximum.at(off, of, match.off_mm[known, 0])
    np.maximum.at(inner, of, rows.interpolation[known])
    np.maximum.at(lag, of, rows.mechanics[known])
    order = known[np.lexsort((known, -rows.total[known], of))]
    worst = order[np.flatnonzero(np.diff(match.contour[order], prepend=-1))]
    here = match.contour[worst]
    columns = (
        here,
        worst,
        rows.total_at[worst, 0],
        rows.total_at[worst, 1],
        rows.total[worst],
        np.sqrt(squares[here] / samples[here]),
        sums[here] / samples[here],
        inner[here],
        lag[here],
        off[here],
    )
    for contour, row, x, y, *figures in zip(*(one.tolist() for one in columns), strict=True):
        yield ContourFigures(contour, row, (x, y), *figures)


def mean_error_mm(rows: RowFigures) -> float:
    """The signed mean of all total errors, mm; NaN without any."""
    count = int(rows.known.sum())
    return float(rows.total_sum.sum()) / count if count else float("nan")


def worst_rows(rows: RowFigures, count: int) -> Ints:
    """The `count` rows with the largest total errors, worst first; of equals the first."""
    known = np.flatnonzero(rows.known > 0)
    order = np.lexsort((known, -rows.total[known]))
    return np.asarray(known[order][:count])


@dataclass(frozen=True)
class MissedEnds:
    """The number of moves that the controller leaves beside their ends, and the row (−1 for none)
    and the distance (mm) of the farthest."""

    count: int
    row: int
    most_mm: float


def missed_ends(
    rows: RowFigures,
    quantised: Toolpath,
    steps_mm: tuple[float, float],
    without: tuple[int, ...] = (),
) -> MissedEnds:
    """The positions of the controller after the rows, against the ends of the `quantised` moves,
    except for the rows `without`; `steps_mm` are the coded steps of X and Y."""
    stood = np.isfinite(rows.commanded_end[:, 0])
    stood[list(without)] = False
    off = np.abs(np.where(stood[:, None], rows.commanded_end - quantised.end[:, :2], 0.0))
    missed = (off > END_STEPS * np.array(steps_mm)).any(axis=1)
    if not missed.any():
        return MissedEnds(0, -1, 0.0)
    far = np.where(missed, np.hypot(off[:, 0], off[:, 1]), 0.0)
    row = int(far.argmax())
    return MissedEnds(int(missed.sum()), row, float(far[row]))


def contour_names(cuts: CutMoves) -> list[str]:
    """`contour 3 (CUT/CIRCLE 3C)` for each contour: they are numbered from 1."""
    sources = [cuts.toolpath.text(row) for row in cuts.contour_ends()[0].tolist()]
    return [
        f"contour {number}" + (f" ({source})" if source else "")
        for number, source in enumerate(sources, start=1)
    ]
