"""One pass over the motion: the errors of interpolation and mechanics, and what the part becomes.

Per step that cuts:  interpolation = commanded position to the decoded move of its row;
mechanics = |slide − commanded|;  total = slide to the nearest move of the wanted contour that its
row belongs to. Per row, whatever it does: the extents of the slides and where they end.
Memory grows with the rows of the program, not with the steps.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.verify.circles import UNSEEN, CircleBins, CircleFigures
from camtool.verify.compare import Groups, Target
from camtool.verify.figures import Figure, LargestError
from camtool.verify.match import Goal, Match
from camtool.verify.motion import Batch
from camtool.verify.runs import run_offsets
from camtool.verify.trace import Trace, TraceBuffer

STEPS_PER_GROUP = 128
"""Neighbouring steps of a row that share one search for near moves."""


class SlidePass:
    """Takes batches in order; its figures hold for all that was added so far."""

    def __init__(
        self,
        decoded: Target,
        goal: Goal,
        match: Match,
        trace: TraceBuffer,
    ) -> None:
        self.interpolation = Figure()
        self.lines, self.arcs = LargestError(), LargestError()
        self.mechanics = Figure()
        self.total = Figure()
        self.trace = trace
        count = len(match.contour)
        self.low = np.full((count, 2), np.inf)
        """(N, 2) mm: lowest X and Y of the slides in each row; inf where they did not move."""
        self.high = np.full((count, 2), -np.inf)
        """(N, 2) mm: highest X and Y of the slides in each row; −inf where they did not move."""
        self.row_end = np.full((count, 2), np.nan)
        """(N, 2) mm: where the slides stand after each row; NaN where they did not move."""
        self.circles = goal.circles
        self.circle_figures: list[CircleFigures] = [UNSEEN] * len(goal.circles)
        self._decoded, self._wanted, self._match = decoded, goal.target, match
        self._heights = _heights(decoded, goal.depth_mm)
        self._bins: dict[int, CircleBins] = {}
        self._last_row = _last_rows(match.circle, len(goal.circles))

    def add(self, batch: Batch) -> None:
        """The next steps of the program."""
        offsets = run_offsets(batch.row, len(batch.row))
        rows = batch.row[offsets[:-1]]
        self.low[rows] = np.minimum(
            self.low[rows], np.minimum.reduceat(batch.slide, offsets[:-1], axis=0)
        )
        self.high[rows] = np.maximum(
            self.high[rows], np.maximum.reduceat(batch.slide, offsets[:-1], axis=0)
        )
        self.row_end[rows] = batch.slide[offsets[1:] - 1]
        cutting = self._decoded.cuts.is_cut[batch.row]
        error = np.zeros(len(batch.row))
        if cutting.any():
            cut = Batch(batch.row[cutting], batch.commanded[cutting], batch.slide[cutting])
            error[cutting] = self._errors(cut)
            self._add_circles(cut)
        self.trace.add(Trace(batch.slide, error, batch.row, cutting))

    def finish(self) -> None:
        """No more batches will come: close the circles."""
        for index in list(self._bins):
            self.circle_figures[index] = self._bins.pop(index).figures()

    def _errors(self, cut: Batch) -> Floats:
        """Count the steps (J,) that cut; returns their total error (J,) mm."""
        row, commanded, slide = cut.row, cut.commanded, cut.slide
        interpolation = self._decoded.own(commanded, row)
        self.interpolation.add(interpolation, commanded, row)
        is_arc = self._decoded.cuts.toolpath.is_arc[row]
        self.arcs.add(interpolation[is_arc])
        self.lines.add(interpolation[~is_arc])
        lag = slide - commanded
        mechanics = np.sqrt(lag[:, 0] ** 2 + lag[:, 1] ** 2)
        self.mechanics.add(mechanics, slide, row)
        # No way is longer than the sum of its parts: a margin within which the search succeeds.
        bound = self._match.apart_mm[row] + interpolation + mechanics
        total = self._nearest(slide, row, bound)
        known = np.isfinite(total)
        self.total.add(total[known], slide[known], row[known])
        return np.where(known, total, 0.0)

    def _nearest(self, slide: Floats, row: Ints, bound: Floats) -> Floats:
        """Distances to wanted moves at the row's height, and at any height where none is there."""
        distance = self._nearest_within(slide, row, bound, self._heights[row])
        rest = np.flatnonzero(np.isinf(distance))
        if len(rest):
            any_z = np.tile([-np.inf, np.inf], (len(rest), 1))
            distance[rest] = self._nearest_within(slide[rest], row[rest], bound[rest], any_z)
        return distance

    def _nearest_within(self, slide: Floats, row: Ints, bound: Floats, z: Floats) -> Floats:
        offsets = run_offsets(row, STEPS_PER_GROUP)
        first = offsets[:-1]
        margin = np.maximum.reduceat(bound, first)
        groups = Groups(offsets, margin, self._match.only[row[first]], z[first])
        return self._wanted.nearest(slide, groups).distance

    def _add_circles(self, cut: Batch) -> None:
        """Give the steps to the circles that they belong to; close those that are done."""
        if not self.circles:
            return
        circle = self._match.circle[cut.row]
        offsets = run_offsets(circle, len(circle))
        for low, high in pairwise(offsets.tolist()):
            index = int(circle[low])
            if index >= 0:
                bins = self._bins.get(index) or CircleBins(self.circles[index])
                self._bins[index] = bins
                bins.add(cut.slide[low:high])
        row = int(cut.row[-1])
        for index in [index for index in self._bins if self._last_row[index] < row]:
            self.circle_figures[index] = self._bins.pop(index).figures()


def _heights(decoded: Target, depth_mm: float) -> Floats:
    """(N, 2) mm: between which heights each row is compared."""
    toolpath = decoded.cuts.toolpath
    ends = np.column_stack([toolpath.starts[:, 2], toolpath.end[:, 2]])
    return np.asarray(np.sort(ends, axis=1) + np.array([-depth_mm, depth_mm]))


def _last_rows(circle: Ints, count: int) -> Ints:
    """(count,) last row (N,) that belongs to each circle."""
    last = np.full(count, -1, dtype=np.int64)
    rows = np.flatnonzero(circle >= 0)
    np.maximum.at(last, circle[rows], rows)
    return last
