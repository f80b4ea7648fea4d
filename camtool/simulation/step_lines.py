"""Lines of whole steps, judged as they are: without chunks, and in threads.

    lines, some rows at a time ─follow_lines─▶ slides at the start of each ─judge_lines─▶ figures

Where the slides are at the start of a line follows from the lines before it without their steps;
then each row can be judged on its own. Rows are judged in parts whose size does not depend on the
number of threads, and each part has a trace of its own: results are the same to the last bit,
however many threads there are."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints, distinct
from camtool.kernels.judging import CIRCLE, STRIDE, WRITTEN, Sums, Task, new_pen
from camtool.kernels.lines import Followed, StepLines, follow_lines, judge_lines
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Ledger, still_ledger

LINES_AT_ONCE = 1024
"""Least number of lines, of whole rows, that one thread judges at a time."""


class LineRows(Struct, frozen=True, eq=False):
    """The rows low:high of a program: `seconds` (high − low,) of each, and the B lines of whole
    steps: `row` (B,), ascending, `start` and `travel` (B, 3), steps. Every line has at least one
    step."""

    low: int
    high: int
    seconds: Floats
    row: Ints
    start: Ints
    travel: Ints


class LineRun:
    """A run of lines, judged row by row (`camtool.simulation.controller.FusedRun`)."""

    def __init__(
        self,
        blocks: Iterator[LineRows],
        rows: int,
        step_mm: Floats,
        mechanics: Mechanics,
        *,
        rounds: bool,
        compensation_s: float = 0.0,
    ) -> None:
        """Take the blocks, which are all `rows` rows of the program in order; `step_mm` (3,) and
        `rounds` as in `StepLines`; `compensation_s`: the time of each step that is added at a
        reversal."""
        self.rows = rows
        self._blocks, self._block = blocks, LineRows(0, 0, *_no_lines())
        self._step_mm = step_mm
        self._mechanics, self._rounds = mechanics, rounds
        self._compensation_s = compensation_s

    def judge(self, low: int, high: int, task: Task, sums: Sums) -> Ledger:
        """Judge the rows low:high, which follow those of the last call; their figures are added to
        `sums` in place. Return the ledger of the rows."""
        ledger = still_ledger(np.arange(low, high))
        while low < high:
            if low == self._block.high:
                self._block = next(self._blocks)
            end = min(high, self._block.high)
            self._judge_block(low, end, task, sums, ledger)
            low = end
        return ledger

    def _judge_block(self, low: int, high: int, task: Task, sums: Sums, ledger: Ledger) -> None:
        block, first = self._block, int(ledger.row[0])
        part = slice(*np.searchsorted(block.row, [low, high]).tolist())
        lines = StepLines(
            row=block.row[part],
            start=block.start[part],
            travel=block.travel[part],
            rounds=self._rounds,
            step_mm=self._step_mm,
            axes=self._mechanics.axes,
            lean=self._mechanics.lean,
        )
        rows, count = slice(low - first, high - first), len(lines.row)
        followed = Followed(
            slides=np.empty((count, 3)),
            added=np.empty((count, 3)),
            steps=ledger.steps[rows],
            reversals=ledger.reversals[rows],
            events=ledger.iterations[rows],
        )
        follow_lines(lines, self._mechanics.states, low, followed)
        added = followed.reversals @ self._mechanics.compensation_steps * self._compensation_s
        ledger.compensation_s[rows] = added
        ledger.duration_s[rows] = block.seconds[low - block.low : high - block.low] + added
        judge_in_parts(lines, followed, task, sums)


def _no_lines() -> tuple[Floats, Ints, Ints, Ints]:
    none = np.zeros((0, 3), dtype=np.int64)
    return np.zeros(0), none[:, 0].copy(), none, none


def judge_in_parts(lines: StepLines, followed: Followed, task: Task, sums: Sums) -> None:
    """Judge lines in threads, part by part; their figures, traces and pieces are added to `sums`
    in order."""
    bounds = _parts(lines.row, task)
    parts = [
        _Part(lines, followed, slice(low, high), task, sums) for low, high in pairwise(bounds)
    ]
    for part in _in_threads([part.judge for part in parts]):
        part.join(sums)


def _parts(row: Ints, task: Task) -> list[int]:
    """Return the indices of lines at which parts begin, and the end of the last. Parts begin at
    the first line of a row; if a row goes round a full circle there is a single part, since its
    bins may have only one writer."""
    count = len(row)
    if count == 0 or (task.rows[row[[0, -1]] - task.low, CIRCLE] >= 0).any():
        return [0, count] if count else [0]
    if (task.rows[row[0] - task.low : row[-1] - task.low + 1, CIRCLE] >= 0).any():
        return [0, count]
    begins = np.flatnonzero(np.diff(row, prepend=-1))
    cuts = begins[np.searchsorted(begins, np.arange(0, begins[-1] + 1, LINES_AT_ONCE))]
    return [*distinct(cuts).tolist(), count]


class _Part:
    """A part of the lines with the sums that threads cannot share."""

    def __init__(
        self, lines: StepLines, followed: Followed, part: slice, task: Task, sums: Sums
    ) -> None:
        self._lines = lines._replace(
            row=lines.row[part], start=lines.start[part], travel=lines.travel[part]
        )
        self._followed = followed._replace(
            slides=followed.slides[part], added=followed.added[part]
        )
        stride = int(sums.pen[STRIDE])
        points = 2
        if stride:
            events = np.abs(self._lines.travel).max(axis=1, initial=0)
            points += int((events // stride + 2).sum()) + len(events)
        self._task = task
        self._sums = sums._replace(
            histograms=np.zeros_like(sums.histograms),
            trace=np.empty((points, 4)),
            pen=new_pen(stride, points),
        )
        self._pieces = np.empty((0, 0))

    def judge(self) -> _Part:
        """Judge the lines of the part and return it."""
        self._pieces = judge_lines(self._lines, self._followed, self._task, self._sums)
        return self

    def join(self, sums: Sums) -> None:
        """Add the part's results to the sums of all lines, in place."""
        written, begin = int(self._sums.pen[WRITTEN]), int(sums.pen[WRITTEN])
        sums.trace[begin : begin + written] = self._sums.trace[:written]
        sums.pen[WRITTEN] += written
        sums.histograms[:] += self._sums.histograms
        sums.pieces.append(self._pieces)


def thread_count() -> int:
    """Return the number of threads that judge: the process's cores, or OMP_NUM_THREADS if set (1
    for the workers of a batch)."""
    limit = os.environ.get("OMP_NUM_THREADS", "")
    if limit.isdecimal():
        return max(int(limit), 1)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _in_threads(tasks: list[Callable[[], _Part]]) -> Iterator[_Part]:
    """Yield the results of all tasks in order."""
    threads = min(len(tasks), thread_count())
    if threads < 2:
        yield from (task() for task in tasks)
        return
    with ThreadPoolExecutor(threads) as pool:
        yield from pool.map(lambda task: task(), tasks)
