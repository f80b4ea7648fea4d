"""The path of the slides, thinned for pictures: bounded, with row ends and error peaks kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.toolpath.moves import Toolpath
from camtool.verify.cuts import Bools, moved_lengths
from camtool.verify.runs import run_offsets, run_peaks


@dataclass(frozen=True, eq=False)
class Trace:
    """Points (T, 2) mm of the slides in order, `error_mm` (T,) against what was wanted (0 where
    nothing is cut), `row` (T,) of the decoded toolpath, `cutting` (T,)."""

    points: Floats
    error_mm: Floats
    row: Ints
    cutting: Bools


class TraceBuffer:
    """Collects a Trace of at most `most` points.

    Of every `stride` samples of a row the one with the largest error is kept, and each row's last.
    The stride is chosen from the way of the whole toolpath, so that about half of `most` come of
    it. What is too many in the end (more rows than points) is thinned likewise.
    """

    def __init__(self, decoded: Toolpath, spacing_mm: float, most: int) -> None:
        rise = np.abs(decoded.end[:, 2] - decoded.starts[:, 2]) if len(decoded) else np.zeros(0)
        expected = float((moved_lengths(decoded) + rise).sum()) / spacing_mm
        self._most = most
        self._stride = max(1, int(np.ceil(2.0 * expected / most)))
        start = decoded.start[None, :2]
        self._parts = [Trace(start, np.zeros(1), np.zeros(1, np.int64), np.zeros(1, np.bool_))]

    def add(self, part: Trace) -> None:
        """The next points, not yet thinned; rows ascend."""
        self._parts.append(_thinned(part, run_offsets(part.row, self._stride)))

    def trace(self) -> Trace:
        """What was kept."""
        whole = Trace(
            np.concatenate([part.points for part in self._parts]),
            np.concatenate([part.error_mm for part in self._parts]),
            np.concatenate([part.row for part in self._parts]),
            np.concatenate([part.cutting for part in self._parts]),
        )
        count = len(whole.row)
        if count <= self._most:
            return whole
        longest = -(-count // self._most)
        offsets = np.append(np.arange(0, count, longest), count)
        return _picked(whole, run_peaks(whole.error_mm, offsets))


def _thinned(part: Trace, offsets: Ints) -> Trace:
    """The peak of each run, and the last point of each row."""
    if len(part.row) == 0:
        return part
    ends = np.append(np.flatnonzero(np.diff(part.row)), len(part.row) - 1)
    return _picked(part, np.union1d(run_peaks(part.error_mm, offsets), ends))


def _picked(part: Trace, which: Ints) -> Trace:
    return Trace(part.points[which], part.error_mm[which], part.row[which], part.cutting[which])
