"""The figures of a verification: of streams of errors, of rows, of contours, of the whole motion.

`Figure` takes errors in mm, batch by batch, and gives the maximum (exact, with its place), the
root of the mean square (exact, all samples with the same weight) and the 95th percentile, in
memory that does not grow with the stream. The percentile comes from a histogram: it is the middle
of the bin with the sample of that rank. Bins (`camtool.kernels.judging`) are between 1/256 and
1/128 of their value wide, so the percentile is within 0.4 % of the exact value.

`RowFigures` takes the figures of the rows block by block, and keeps what is needed of them: the
figures of contours, the worst moves, and sums of the whole motion (`Tally`)."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.kernels import judging as at
from camtool.kernels.judging import BEFORE_FIRST, BINS, SHIFT, leading_bits
from camtool.kernels.lines import COUNT, PIECE_COLUMNS, WHICH, count_below
from camtool.simulation.motion import Ledger, still_ledger
from camtool.toolpath.moves import Kind, Toolpath, are_arcs
from camtool.verification.cuts import CutMoves
from camtool.verification.matching import Match

PERCENTILE = 0.95

PIECES_GUESSED = 500
"""The place of the percentile is guessed from this many pieces of lines; then all are counted."""


class Figure:
    """Maximum, rms and 95th percentile of errors ≥ 0, mm; all NaN if there are no errors."""

    def __init__(self) -> None:
        self.count = 0
        self.at_mm: tuple[float, float] = (math.nan, math.nan)
        """The place of the maximum, mm; of several, the first."""
        self.row = -1
        """Toolpath row of the maximum, −1 without errors."""
        self._max = -math.inf
        self._squares = 0.0
        self._histogram = np.zeros(BINS, dtype=np.int64)
        self._pieces = np.empty((0, PIECE_COLUMNS))

    def add(self, errors: Floats, points: Floats, rows: Ints | Indices) -> None:
        """Add errors (J,), mm, which were measured at points (J, 2), mm, in these rows (J,)."""
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

    def add_rows(self, low: int, largest: Floats, squares: Floats, counts: Ints) -> None:
        """Add the errors of the rows from `low` on, without their histogram: the `largest` (R,) mm
        of each row, or NaN; sums of squares (R,) mm²; counts (R,) of samples."""
        if counts.any():
            worst = int(np.nanargmax(largest))
            if float(largest[worst]) > self._max:
                self._max, self.row = float(largest[worst]), low + worst
            self.count += int(counts.sum())
        self._squares += float(squares.sum())

    def add_sizes(self, histogram: Ints) -> None:
        """Add the `histogram` (L · BINS,) of errors added by `add_rows`: L numbers for each
        bin."""
        self._histogram += histogram.reshape(BINS, -1).sum(axis=1)

    def add_pieces(self, which: int, pieces: list[Floats]) -> None:
        """Add the histogram of errors along pieces of lines (`camtool.kernels.lines`), which
        `add_sizes` does not have."""
        own = [part[part[:, WHICH] == which] for part in pieces]
        self._pieces = np.concatenate([self._pieces, *own])

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
        cumulative = np.cumsum(self._histogram)
        few = self._pieces[:: len(self._pieces) // PIECES_GUESSED + 1]
        more = float(self._pieces[:, COUNT].sum()) / max(float(few[:, COUNT].sum()), 1.0)
        guess = bisect_left(
            range(BINS), rank, key=lambda k: int(cumulative[k] + more * _below(few, k))
        )
        bin_index = _first_at_least(
            rank, guess, lambda k: int(cumulative[k]) + _below(self._pieces, k)
        )
        if bin_index == 0:
            return 0.0
        return min(0.5 * (_edge(bin_index) + _edge(bin_index + 1)), self._max)


def _below(pieces: Floats, bin_index: int) -> int:
    """Return the number of errors of pieces in a bin and in all bins before it."""
    return count_below(pieces, _edge(bin_index + 1))


def _edge(bin_index: int) -> float:
    """Return the lower edge of a bin, the least number that falls in it."""
    bits = np.array([bin_index + BEFORE_FIRST], dtype=np.int64)
    return float(np.left_shift(bits, SHIFT).view(np.float64)[0])


def _first_at_least(count_wanted: int, guess: int, count: Callable[[int], int]) -> int:
    """Return the first bin up to which there are at least `count_wanted` errors; the search starts
    at `guess`."""
    low, high, step = -1, guess, 1
    while high < BINS - 1 and count(high) < count_wanted:
        low, high, step = high, min(high + step, BINS - 1), 2 * step
    step = 1
    while high - low > 1:
        middle = high - step if high - step > low else (low + high) // 2
        if count(middle) >= count_wanted:
            high, step = middle, 2 * step
        else:
            low = middle
    return high


# Figures of rows: taken from the judge's columns in blocks of rows, of which only sums are kept.


class RowBlock(Struct, frozen=True, eq=False):
    """The columns (R, 19) of `camtool.kernels.judging` for the rows from `low` on, mm, in XY;
    `is_cut` (R,): the mask of rows that cut."""

    low: int
    columns: Floats
    is_cut: Bools

    @property
    def rows(self) -> slice:
        """The rows."""
        return slice(self.low, self.low + len(self.columns))

    def count(self, column: int) -> Ints:
        """Return a column of whole numbers (R,)."""
        return self.columns[:, column].astype(np.int64)

    def largest(self, column: int, is_seen: Bools) -> Floats:
        """Return a column of largest errors (R,), NaN except in the rows of the mask `is_seen`
        (R,)."""
        return np.where(is_seen, self.columns[:, column], np.nan)


def empty_columns(count: int) -> Floats:
    """Return the columns (count, 19) of `camtool.kernels.judging` for rows without samples yet."""
    columns = np.zeros((count, at.ROW_COLUMNS))
    columns[:, [at.LOW_X, at.LOW_Y]] = np.inf
    columns[:, [at.HIGH_X, at.HIGH_Y]] = -np.inf
    ends = [at.END_X, at.END_Y, at.COMMANDED_X, at.COMMANDED_Y, at.TOTAL_X, at.TOTAL_Y]
    columns[:, ends] = np.nan
    return columns


class RowFigures:
    """The figures of the N rows of the decoded toolpath, which come in blocks, in order.

    Kept of each row: `seconds` (N,) and `total` (N,) mm, its largest total error, NaN where none
    is known. `inner`, `lag` and `whole` are the figures of interpolation, mechanics and total;
    `lines_mm` and `arcs_mm` the largest errors of interpolation, NaN without any; `mean_mm` the
    signed mean of all total errors, + to the left of the wanted moves."""

    def __init__(
        self,
        cuts: CutMoves,
        match: Match,
        steps_mm: tuple[float, float],
        worst: int,
        *,
        keep_ledger: bool = False,
    ) -> None:
        """Begin without rows. `steps_mm`: the coded steps of X and Y; `worst`: the number of worst
        rows to list; `keep_ledger`: keep the ledger of each row."""
        count = len(cuts.contour)
        self._toolpath, self._steps_mm = cuts.toolpath, steps_mm
        self.total = np.full(count, np.nan)
        self.books = LedgerSums(count, keep_ledger=keep_ledger)
        self.inner, self.lag, self.whole = Figure(), Figure(), Figure()
        self.lines_mm = self.arcs_mm = math.nan
        self.contours = ContourSums(match)
        self.worst = WorstRows(worst)
        self.missed, self.missed_by_others = MissedEnds(), MissedEnds()
        self._sum = 0.0

    def add(self, block: RowBlock) -> None:
        """Add the next rows; all their samples must have been judged."""
        columns = block.columns
        samples, known_samples = block.count(at.SAMPLES), block.count(at.KNOWN)
        if self.books.ledger is not None:
            self.books.samples[block.rows] = samples
        judged_samples = np.where(block.is_cut, samples, 0)
        inner = block.largest(at.INNER_MAX, judged_samples > 0)
        lag = block.largest(at.LAG_MAX, judged_samples > 0)
        total = block.largest(at.TOTAL_MAX, known_samples > 0)
        self.inner.add_rows(block.low, inner, columns[:, at.INNER_SQUARES], judged_samples)
        self.lag.add_rows(block.low, lag, columns[:, at.LAG_SQUARES], judged_samples)
        self.whole.add_rows(block.low, total, columns[:, at.TOTAL_SQUARES], known_samples)
        is_arc = are_arcs(self._toolpath.kind[block.rows])
        self.lines_mm = _larger_error(self.lines_mm, inner[~is_arc])
        self.arcs_mm = _larger_error(self.arcs_mm, inner[is_arc])
        self._sum += float(columns[:, at.TOTAL_SUM].sum())
        self.total[block.rows] = total
        self.contours.add(block, known_samples, (inner, lag, total))
        self.worst.add(block, (inner, lag, total))
        self._add_ends(block.low, columns[:, [at.COMMANDED_X, at.COMMANDED_Y]])

    def _add_ends(self, low: int, commanded: Floats) -> None:
        """Compare the positions of the controller after the next rows with the ends of the
        moves."""
        distances = np.abs(commanded - self._toolpath.end[low : low + len(commanded), :2])
        endless = ~self.books.ended[low : low + len(distances)]
        for row in np.flatnonzero(endless).tolist():
            x, y = commanded[row].tolist()
            self.books.endless[low + row] = x, y
        distances[~np.isfinite(distances[:, 0])] = 0.0
        self.missed.add(low, distances, self._steps_mm)
        distances[endless] = 0.0
        self.missed_by_others.add(low, distances, self._steps_mm)

    @property
    def seconds(self) -> Floats:
        """(N,) s, of each row."""
        return self.books.seconds

    @property
    def mean_mm(self) -> float:
        """The signed mean of all total errors, mm; NaN without any."""
        return self._sum / self.whole.count if self.whole.count else math.nan


def _larger_error(previous: float, errors: Floats) -> float:
    """Return the largest of `previous` and the errors, mm, ignoring NaN; NaN if all are."""
    known_errors = errors[np.isfinite(errors)]
    return float(np.fmax(previous, known_errors.max())) if len(known_errors) else previous


# Figures of the whole motion: steps, reversals, time, and endless arcs.


class LedgerSums:
    """The ledgers of all chunks, summed up: `seconds` (N,) of each row, `ended` (N,), False for
    rows whose stop test was never met, and `endless`, the places in XY (mm) where these were left.
    Other columns are kept by row only with `keep_ledger`: `ledger` of N rows, `samples` (N,)."""

    def __init__(self, count: int, *, keep_ledger: bool = False) -> None:
        self.ledger = still_ledger(np.arange(count)) if keep_ledger else None
        self.samples = np.zeros(count if keep_ledger else 0, dtype=np.int64)
        self.seconds = np.zeros(count)
        self.ended = np.ones(count, dtype=np.bool_)
        self.endless: dict[int, tuple[float, float]] = {}
        self.steps, self.reversals = np.zeros((2, 3), dtype=np.int64)
        self.cutting_reversals = np.zeros(3, dtype=np.int64)
        self.iterations, self.cutting_iterations, self.compensation_s = 0, 0, 0.0

    def add(self, ledger: Ledger, is_cut: Bools) -> None:
        """Add the ledger of a chunk, which has each row at most once; `is_cut` (N,): the mask of
        rows that cut."""
        rows = ledger.row
        if self.ledger is not None:
            self.ledger.add(ledger)
        self.seconds[rows] += ledger.duration_s
        self.ended[rows] &= ledger.ended
        self.steps += ledger.steps.sum(axis=0)
        self.iterations += int(ledger.iterations.sum())
        self.cutting_iterations += int(ledger.iterations[is_cut[rows]].sum())
        self.compensation_s += float(ledger.compensation_s.sum())
        self.reversals += ledger.reversals.sum(axis=0)
        self.cutting_reversals += ledger.reversals[is_cut[rows]].sum(axis=0)


class Tally(Struct, frozen=True, eq=False):
    """Sums over the whole program. Iterations, reversals and times are divided into cutting and
    the rest; `compensation_s` is a part of cutting and air."""

    steps: Ints
    iterations: int
    cutting_iterations: int
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


def tally_of(books: LedgerSums, decoded: Toolpath, is_cut: Bools) -> Tally:
    """Return the sums over all rows; `is_cut` (N,): the mask of rows that cut."""
    dwell = decoded.kind == Kind.DWELL
    return Tally(
        steps=books.steps,
        iterations=books.iterations,
        cutting_iterations=books.cutting_iterations,
        reversals=books.reversals,
        cutting_reversals=books.cutting_reversals,
        cutting_s=float(books.seconds[is_cut].sum()),
        air_s=float(books.seconds[~is_cut & ~dwell].sum()),
        dwell_s=float(books.seconds[dwell].sum()),
        compensation_s=books.compensation_s,
        endless_arcs=books.endless,
    )


# Figures of contours, the worst moves, and missed ends.

END_STEPS = 1.5
"""A move misses its end when the controller stops more than this many steps beside it; one step is
the rounding of an interpolator."""


class ContourFigures(Struct, frozen=True):
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


CONTOURS_AT_ONCE = 4096


class ContourSums:
    """Sums and largest errors of the wanted contours to which rows with a known error belong."""

    def __init__(self, match: Match) -> None:
        self._match = match
        count = int(match.contour.max(initial=-1)) + 1
        self._samples, self._squares, self._sums, *self._largest = np.zeros((6, count))
        self._row = np.full(count, -1, dtype=np.int64)
        self._total, self._at = np.full(count, -np.inf), np.zeros((count, 2))

    def add(self, block: RowBlock, samples: Ints, errors: tuple[Floats, Floats, Floats]) -> None:
        """Add the next rows: `samples` (R,), the number of samples with a total error; `errors`,
        each (R,), the largest of interpolation, of mechanics and in all."""
        contour = self._match.contour[block.rows]
        known_rows = np.flatnonzero((samples > 0) & (contour >= 0))
        contours, columns = contour[known_rows], block.columns[known_rows]
        inner, lag, total = (one[known_rows] for one in errors)
        np.add.at(self._samples, contours, samples[known_rows])
        np.add.at(self._squares, contours, columns[:, at.TOTAL_SQUARES])
        np.add.at(self._sums, contours, columns[:, at.TOTAL_SUM])
        drawn_off = self._match.off_mm[block.rows][known_rows]
        for largest, one in zip(self._largest, (inner, lag, drawn_off), strict=True):
            np.maximum.at(largest, contours, one)
        order = np.lexsort((known_rows, -total, contours))
        worst = order[np.flatnonzero(np.diff(contours[order], prepend=-1))]
        worst = worst[total[worst] > self._total[contours[worst]]]
        worst_contours = contours[worst]
        self._total[worst_contours], self._row[worst_contours] = (
            total[worst],
            block.low + known_rows[worst],
        )
        self._at[worst_contours] = columns[worst][:, [at.TOTAL_X, at.TOTAL_Y]]

    def figures(self) -> Iterator[ContourFigures]:
        """Yield the figures of each contour with a known error."""
        every = np.flatnonzero(self._row >= 0)
        for low in range(0, len(every), CONTOURS_AT_ONCE):
            batch = every[low : low + CONTOURS_AT_ONCE]
            columns = (
                batch,
                self._row[batch],
                *self._at[batch].T,
                self._total[batch],
                np.sqrt(self._squares[batch] / self._samples[batch]),
                self._sums[batch] / self._samples[batch],
                *(largest[batch] for largest in self._largest),
            )
            numbers = (one.tolist() for one in columns)
            for contour, row, x, y, *figures in zip(*numbers, strict=True):
                yield ContourFigures(contour, row, (x, y), *figures)


class WorstRows:
    """The rows with the largest total errors: `found` (W, 6) of row, total, interpolation and
    mechanics mm, place x, y mm; worst first, of equals the first."""

    def __init__(self, count: int) -> None:
        self._count = count
        self.found = np.empty((0, 6))

    def add(self, block: RowBlock, errors: tuple[Floats, Floats, Floats]) -> None:
        """Add the next rows; `errors`, each (R,), are their largest of interpolation, of mechanics
        and in all."""
        inner, lag, total = errors
        rows = np.flatnonzero(~np.isnan(total))
        rows = rows[np.lexsort((rows, -total[rows]))][: self._count]
        place = block.columns[rows][:, [at.TOTAL_X, at.TOTAL_Y]]
        columns = [block.low + rows, total[rows], inner[rows], lag[rows], place]
        candidates = np.concatenate([self.found, np.column_stack(columns)])
        self.found = candidates[np.lexsort((candidates[:, 0], -candidates[:, 1]))][: self._count]


class MissedEnds:
    """The number of moves that the controller leaves beside their programmed ends, with the row
    (−1: none) and the distance (mm) of the farthest; of equal ones the first."""

    def __init__(self) -> None:
        self.count, self.row, self.most_mm = 0, -1, 0.0

    def add(self, low: int, differences: Floats, steps_mm: tuple[float, float]) -> None:
        """Add the distances (R, 2), mm, of the controller from the programmed ends of the rows
        from `low` on."""
        missed_rows = np.flatnonzero((differences > END_STEPS * np.array(steps_mm)).any(axis=1))
        if len(missed_rows):
            distances = np.hypot(*differences[missed_rows].T)
            self.count += len(missed_rows)
            if distances.max() > self.most_mm:
                self.row, self.most_mm = (
                    low + int(missed_rows[distances.argmax()]),
                    float(distances.max()),
                )


def contour_names(cuts: CutMoves) -> list[str]:
    """Return a name for each contour, such as `contour 3 (CUT/CIRCLE 3C)`, numbered from 1."""
    sources = [cuts.toolpath.text(row) for row in cuts.contour_ends()[0].tolist()]
    return [
        f"contour {number}" + (f" ({source})" if source else "")
        for number, source in enumerate(sources, start=1)
    ]
