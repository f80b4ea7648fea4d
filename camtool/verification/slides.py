"""A pass over the motion: errors of interpolation and mechanics, circles, and the slides' path.

The compiled judge (`camtool.kernels.judging`) takes the samples, from chunks or from a controller
that is judged as it is simulated, and fills columns of the rows; this module sets its task and
reads the results. A circle is evaluated when its last row is done, so that only circles in
progress have bins. Memory grows with the rows of the program, not with the steps."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.errors import ProgramError
from camtool.geometry.measure import segment_boxes
from camtool.kernels import judging as at
from camtool.kernels.judging import (
    BINS,
    WRITTEN,
    Moves,
    Sums,
    Task,
    bin_directions,
    empty_bins,
    judge_samples,
    new_pen,
    unwritten,
)
from camtool.kernels.move_tree import move_tree
from camtool.progress import Progress
from camtool.simulation.controller import FusedRun
from camtool.simulation.motion import Chunk
from camtool.simulation.rows import block_of
from camtool.toolpath.moves import Toolpath
from camtool.verification.circles import (
    NO_FIGURES,
    BidirectionalFigures,
    CircleFigures,
    CirclePairs,
    FullCircle,
    ReversalFigures,
    circle_figures,
    reversal_figures,
)
from camtool.verification.cuts import CutMoves, row_lengths
from camtool.verification.dimensions import SlideExtents
from camtool.verification.figures import RowBlock, RowFigures, empty_columns
from camtool.verification.matching import Match
from camtool.verification.nearest import ANY_CONTOUR, run_peaks

if TYPE_CHECKING:
    from camtool.kernels.judging import Shapes


BINS_KEPT = 64
"""The bins of at most this many circles are kept for pictures, 52 kB each."""


class SeenCircle(Struct, frozen=True, eq=False):
    """A circle, its figures, and its bins (720, 9) about the programmed centre."""

    circle: FullCircle
    figures: CircleFigures
    reversing: ReversalFigures
    bins: Floats


class Paths(Struct, frozen=True, eq=False):
    """The cuts of a program and the wanted cuts (the same object if it is compared with itself),
    the full circles of the latter, and the tolerance of heights, mm."""

    decoded: CutMoves
    wanted: CutMoves
    circles: list[FullCircle]
    depth_mm: float


ROWS_AT_ONCE = 16_384
"""Number of rows that are judged before their figures are summed up; a fused run reports its
progress then."""


class SlidePass:
    """Takes the motion in order and judges it: `rows` gets the figures of the rows, `extents` the
    positions of the slides; its own figures are complete after `finish`."""

    def __init__(
        self,
        paths: Paths,
        match: Match,
        results: tuple[RowFigures, SlideExtents],
        trace: TraceSize,
    ) -> None:
        self.rows, self.extents = results
        self.circles = paths.circles
        self.circle_figures: list[CircleFigures] = [NO_FIGURES] * len(paths.circles)
        self.reversing: list[ReversalFigures | None] = [None] * len(paths.circles)
        self.both_ways: list[BidirectionalFigures] = []
        self.bins: dict[int, Floats] = {}
        self._pairs = CirclePairs(paths.circles)
        self._cuts, self._is_cut = paths.decoded, paths.decoded.is_cut
        self._first, self._last = _rows_of_circles(match.circle, len(paths.circles))
        self._slot = _slots(self._first, self._last)
        seen_circles = np.flatnonzero(self._last >= 0)
        self._closing = seen_circles[np.argsort(self._last[seen_circles], kind="stable")].tolist()
        self._tasks = Tasks(paths, match, self._slot)
        self._task = self._tasks.of(0, min(ROWS_AT_ONCE, len(self._is_cut)))
        slots = int(self._slot.max(initial=-1)) + 1
        self._sums = _sums(len(self._is_cut), slots, trace)
        self._start, self._most = trace.start, trace.max_points

    def add(self, chunk: Chunk) -> None:
        """Judge the next samples of the program."""
        self.rows.books.add(chunk.ledger, self._is_cut)
        if len(chunk.row) == 0:
            return
        bounds = self._bounds(int(chunk.row[0]), int(chunk.row[-1]) + 1)
        cuts = np.searchsorted(chunk.row, bounds)
        for (low, high), row in zip(pairwise(cuts.tolist()), bounds[:-1], strict=True):
            self._close(row)
            lost_row = judge_samples(
                np.ascontiguousarray(chunk.row[low:high]),
                np.ascontiguousarray(chunk.commanded[low:high]),
                np.ascontiguousarray(chunk.slide[low:high]),
                self._task,
                self._sums,
            )
            if lost_row >= 0:
                raise self._lost(int(chunk.row[low + lost_row]))

    def _lost(self, row: int) -> ProgramError:
        return ProgramError(
            "the slides would leave every machine",
            where=block_of(self._cuts.toolpath, row),
            mend="check its numbers, and the coded and real steps of the axes",
        )

    def run(self, steps: FusedRun, progress: Progress) -> None:
        """Judge all rows of a controller that simulates and judges in one compiled loop."""
        for low, high in pairwise(self._bounds(0, steps.rows)):
            self._close(low)
            ledger = steps.judge(low, high, self._task, self._sums)
            self.rows.books.add(ledger, self._is_cut)
            progress.done = high

    def finish(self) -> SlideTrace:
        """Evaluate the rows and circles that remain at the end of the motion; return the thinned
        path of the slides."""
        self._close(len(self._is_cut))
        self._sum_up()
        sums = self._sums
        for which, figure in enumerate((self.rows.inner, self.rows.whole)):
            figure.add_sizes(sums.histograms[which])
            figure.add_pieces(which, sums.pieces)
        del self._tasks, self._task, self._sums
        return trace_of(sums, self._start, self._is_cut, self._most)

    def _bounds(self, low: int, high: int) -> list[int]:
        """Return `low`, `high`, and between them the rows before which circles are evaluated or
        figures are summed up."""
        ends = {int(self._last[circle]) + 1 for circle in self._closing}
        inner = sorted(ends.union(range(0, high, ROWS_AT_ONCE)))
        return [low, *(row for row in inner if low < row < high), high]

    def _close(self, row: int) -> None:
        """Evaluate the circles that end before a row and empty their bins; sum up the rows that
        are complete."""
        while row >= self._task.low + ROWS_AT_ONCE:
            self._sum_up()
            low = self._task.low + ROWS_AT_ONCE
            self._task = self._tasks.of(low, min(low + ROWS_AT_ONCE, len(self._is_cut)))
        while self._closing and self._last[self._closing[0]] < row:
            circle = self._closing.pop(0)
            bins = self._sums.bins[self._slot[circle]]
            one = self.circles[circle]
            self.circle_figures[circle] = circle_figures(bins, one.radius_mm)
            self.reversing[circle] = reversal_figures(bins, one.ccw)
            self.both_ways += self._pairs.add(circle, bins)
            if len(self.bins) < BINS_KEPT:
                self.bins[circle] = bins.copy()

            bins[:] = empty_bins(1)[0]

    def _sum_up(self) -> None:
        """Sum up the figures of the rows of the present task, and clear their columns."""
        low, columns = self._task.low, self._sums.rows[: len(self._task.rows)]
        self.rows.add(RowBlock(low, columns, self._is_cut[low : low + len(columns)]))
        lowest, highest = columns[:, [at.LOW_X, at.LOW_Y]], columns[:, [at.HIGH_X, at.HIGH_Y]]
        self.extents.add(low, (lowest, highest), columns[:, [at.END_X, at.END_Y]])
        columns[:] = empty_columns(len(columns))

    def seen_circles(self) -> tuple[SeenCircle, ...]:
        """Return the circles that the slides followed, in order; at most `BINS_KEPT`."""
        return tuple(
            SeenCircle(
                self.circles[circle], self.circle_figures[circle], figures, self.bins[circle]
            )
            for circle in sorted(self.bins)
            if (figures := self.reversing[circle]) is not None
        )


class Tasks:
    """Makes the tasks of the compiled judge, each for a block of rows."""

    def __init__(self, paths: Paths, match: Match, slot: Ints) -> None:
        """Index the wanted moves; `slot` (C,): the set of bins that each circle uses."""
        self._paths, self._match = paths, match
        self._slot = np.append(slot, -1)  # the last entry stands for index −1, none
        row = paths.wanted.row  # an arc of more than a half circle has two segments
        begins = np.diff(row, prepend=-1) != 0
        self._rows = row if begins.all() else row[begins]
        contour = paths.wanted.contour[self._rows]
        self._begins = np.searchsorted(contour, np.arange(paths.wanted.contour_count + 1))
        is_known = bool((match.only[paths.decoded.is_cut] != ANY_CONTOUR).all())
        every = shapes(paths.wanted, 0, len(paths.wanted.contour))
        heights = move_heights(paths.wanted)
        tree = move_tree(len(self._rows), self._boxes, contour if is_known else None)
        self._moves = Moves(every, heights, *tree)
        self._centre = np.array([circle.centre_mm for circle in paths.circles]).reshape(-1, 2)
        self._directions = bin_directions()

    def _boxes(self, indices: Ints | Indices) -> Floats:
        """Return (J, 4) mm: the bounding boxes of these cutting moves."""
        ends = _ends(self._paths.wanted, self._rows[indices])
        segments, (first, last) = self._paths.wanted.segments, np.array(ends, dtype=np.int64)
        boxes, parted = segment_boxes(segments[first]), np.flatnonzero(first < last)
        other = segment_boxes(segments[last[parted]])
        boxes[parted, :2] = np.minimum(boxes[parted, :2], other[:, :2])
        boxes[parted, 2:] = np.maximum(boxes[parted, 2:], other[:, 2:])
        return boxes

    def of(self, low: int, high: int) -> Task:
        """Return the task of the compiled judge for the rows low:high."""
        match, toolpath, rows = self._match, self._paths.decoded.toolpath, np.arange(low, high)
        cuts = self._paths.decoded.is_cut[low:high]
        of_row = np.where(cuts, np.cumsum(cuts) - 1, -1)
        circle, beside_rows = match.circle[low:high], match.row[low:high]
        beside_rows = np.where(beside_rows >= 0, np.searchsorted(self._rows, beside_rows), -1)
        ends = np.column_stack([toolpath.starts_of(rows)[:, 2], toolpath.end[low:high, 2]])
        depth_mm = self._paths.depth_mm
        return Task(
            low=low,
            own=shapes(self._paths.decoded, low, high),
            moves=self._moves,
            rows=np.column_stack(
                [
                    of_row,
                    self._ranges(match.only[low:high]),
                    circle,
                    self._slot[circle],
                    beside_rows,
                ]
            ),
            window=np.sort(ends, axis=1) + np.array([-depth_mm, depth_mm]),
            off=match.off_mm[low:high].copy(),
            centre=self._centre,
            directions=self._directions,
        )

    def _ranges(self, contours: Indices) -> Ints:
        """Return (R, 2) the range (begin, end) of the wanted moves of each contour in `contours`
        (R,); all moves for ANY_CONTOUR."""
        every = contours == ANY_CONTOUR
        low = np.where(every, 0, self._begins[contours])
        high = np.where(every, len(self._rows), self._begins[np.where(every, 0, contours + 1)])
        return np.column_stack([low, high])


def _sums(rows: int, slots: int, trace: TraceSize) -> Sums:
    room = 2 * trace.max_points + rows if trace.stride else 0
    return Sums(
        rows=empty_columns(min(rows, ROWS_AT_ONCE)),
        histograms=np.zeros((2, 4 * BINS), dtype=np.int64),
        bins=empty_bins(slots),
        trace=np.empty((room + rows + 2 if trace.stride else 2, 4)),
        pen=new_pen(trace.stride, room),
        pieces=[],
    )


def _rows_of_circles(circle: Indices, count: int) -> tuple[Ints, Ints]:
    """Return the first and the last row (count,), (count,) of each circle; the last is −1 for a
    circle without rows. `circle` (N,): the circle of each row."""
    first = np.full(count, len(circle), dtype=np.int64)
    last = np.full(count, -1, dtype=np.int64)
    rows = np.flatnonzero(circle >= 0)
    np.minimum.at(first, circle[rows], rows)
    np.maximum.at(last, circle[rows], rows)
    return first, last


def _slots(first: Ints, last: Ints) -> Ints:
    """Return (C,) the number of the set of bins that each circle uses; circles with overlapping
    rows use different sets."""
    slot = np.full(len(first), -1, dtype=np.int64)
    busy: list[tuple[int, int]] = []
    free_slots: list[int] = []
    for circle in _in_order(first, last):
        while busy and busy[0][0] < first[circle]:
            heapq.heappush(free_slots, heapq.heappop(busy)[1])
        slot[circle] = heapq.heappop(free_slots) if free_slots else len(busy)
        heapq.heappush(busy, (int(last[circle]), int(slot[circle])))
    return slot


def _in_order(first: Ints, last: Ints) -> Iterator[int]:
    seen_circles = np.flatnonzero(last >= 0)
    yield from seen_circles[np.argsort(first[seen_circles], kind="stable")].tolist()


# Cutting moves as columns for the compiled judge: one move for each row that cuts.


def move_heights(cuts: CutMoves) -> Floats:
    """Return (J, 2) mm: the lowest and the highest point of each cutting move; a single row
    broadcast to all if they have one height."""
    rows = cuts.rows
    heights_mm = np.empty((len(rows), 2))
    for low in range(0, len(rows), ROWS_AT_ONCE):
        first, last = _ends(cuts, rows[low : low + ROWS_AT_ONCE])
        ends = np.column_stack([cuts.heights(first), cuts.heights(last)])
        heights_mm[low : low + len(ends), 0] = ends.min(axis=1)
        heights_mm[low : low + len(ends), 1] = ends.max(axis=1)
    level = len(heights_mm) and (heights_mm == heights_mm[0, 0]).all()
    return np.broadcast_to(heights_mm[:1].copy(), heights_mm.shape) if level else heights_mm


def _ends(cuts: CutMoves, rows: Ints | Indices) -> tuple[Indices, Indices]:
    """Return the first and the last segment (J,), (J,) of each of these cutting rows."""
    return cuts.first[rows], cuts.first[rows + 1] - 1


def shapes(cuts: CutMoves, low: int, high: int) -> Shapes:
    """Return the cutting moves of the rows low:high, one for each row, as the columns that the
    compiled judge reads."""
    begin = cuts.first[low]
    segments = cuts.segments[begin : cuts.first[high]]
    first, last = _ends(cuts, low + np.flatnonzero(cuts.contour[low:high] >= 0))
    first -= begin
    last -= begin
    start, end = segments.start, segments.end
    if len(first) < len(segments):
        start, end = start[first], end[last]
    arcs = np.flatnonzero(segments.bulge[first])
    arc_indices = np.full(len(first), -1, dtype=np.int32)
    bent, row = segments[first[arcs].astype(np.int64)], cuts.row[begin + first[arcs]]
    arc_indices[arcs] = np.arange(len(arcs))
    sweep = np.abs(bent.sweep) * (last - first + 1)[arcs]
    turn = np.where(bent.bulge < 0.0, -1.0, 1.0)
    toolpath = cuts.toolpath
    closed = (toolpath.starts_of(row)[:, :2] == toolpath.end[row, :2]).all(axis=1)
    table = np.empty((len(arcs), at.COLUMNS))
    table[:, [at.CX, at.CY]] = bent.centre
    table[:, at.RADIUS], table[:, at.TURN] = bent.radius, turn
    table[:, [at.UX, at.UY]] = turn[:, None] * (start[arcs] - bent.centre)
    table[:, [at.VX, at.VY]] = turn[:, None] * (end[arcs] - bent.centre)
    table[:, at.WIDE] = np.where(closed, at.FULL, (sweep > np.pi).astype(float))
    return at.Shapes(start, end, arc_indices, table)


# The path of the slides, thinned for pictures to a bounded number of points.
#
# Of every `stride` samples of a row the judge keeps the one with the largest error, and the last
# sample of each row (`camtool.kernels.judging`).


class SlideTrace(Struct, frozen=True, eq=False):
    """T positions of the slides in order: `points` (T, 2) mm, `error_mm` (T,) from the wanted
    moves (0 where nothing is cut), `row` (T,) of the decoded toolpath, `cutting` (T,)."""

    points: Floats
    error_mm: Floats
    row: Ints
    cutting: Bools


class TraceSize(Struct, frozen=True, eq=False):
    """The start of the slides (1, 2), mm; `stride`: one of every so many samples of a row is kept
    (0: none); the greatest number of points of a trace."""

    start: Floats
    stride: int
    max_points: int


def trace_size(decoded: Toolpath, spacing_mm: float, max_points: int) -> TraceSize:
    """Return which samples of the slides' path are kept, given that they are `spacing_mm` apart:
    every n-th, so that about half of `max_points` are kept and a path twice as long still fits."""
    if max_points == 0:
        return TraceSize(decoded.start[None, :2], 0, 1)
    lengths = row_lengths(decoded)
    lengths += decoded.by_parts(lambda part: np.abs(part.end[:, 2] - part.starts[:, 2]))
    expected = float(lengths.sum()) / spacing_mm
    stride = max(1, int(np.ceil(2.0 * expected / max_points)))
    return TraceSize(decoded.start[None, :2], stride, max_points)


def trace_of(sums: Sums, start: Floats, cutting: Bools, max_points: int) -> SlideTrace:
    """Return the start (1, 2), mm, and the samples that the judge kept (none for a stride of 0).
    If these are more than `max_points` (more rows than points), each run of them is reduced to the
    sample with the largest error. `cutting` (N,): the mask of rows that cut."""
    written, pending = int(sums.pen[WRITTEN]), unwritten(sums.pen)
    sums.trace[written : written + len(pending)] = pending
    count = written + len(pending) + 1
    chosen_rows = np.arange(count)
    if count > max_points:
        longest = -(-count // max_points)
        error = np.concatenate([[0.0], sums.trace[: count - 1, 2]])
        chosen_rows = run_peaks(error, np.append(np.arange(0, count, longest), count))
    samples = sums.trace[np.maximum(chosen_rows - 1, 0)]
    first = chosen_rows == 0
    samples[first] = (*start[0], 0.0, 0.0)
    row = samples[:, 3].astype(np.int64)
    shown = np.append(cutting, False)[np.where(first, -1, row)]
    return SlideTrace(samples[:, :2].copy(), samples[:, 2].copy(), row, shown)
