"""The path of the slides, thinned for pictures: bounded, with row ends and error peaks kept.

Of every `stride` samples of a row the judge keeps the one with the largest error, and each row's
last (`camtool.kernels.thin_trace`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.toolpath.moves import Toolpath
from camtool.verify.cuts import Bools, moved_lengths
from camtool.verify.runs import run_peaks

if TYPE_CHECKING:
    from camtool.kernels.judge import Sums


@dataclass(frozen=True, eq=False)
class Trace:
    """Points (T, 2) mm of the slides in order, `error_mm` (T,) against what was wanted (0 where
    nothing is cut), `row` (T,) of the decoded toolpath, `cutting` (T,)."""

    points: Floats
    error_mm: Floats
    row: Ints
    cutting: Bools


@dataclass(frozen=True, eq=False)
class TraceSize:
    """Where the slides begin (1, 2) mm, of how many samples of a row one is kept, and how many
    points there may be in the end."""

    start: Floats
    stride: int
    most: int


def trace_size(decoded: Toolpath, spacing_mm: float, most: int) -> TraceSize:
    """A stride for samples about `spacing_mm` apart, so that about half of `most` come of it."""
    rise = np.abs(decoded.end[:, 2] - decoded.starts[:, 2]) if len(decoded) else np.zeros(0)
    expected = float((moved_lengths(decoded) + rise).sum()) / spacing_mm
    stride = max(1, int(np.ceil(2.0 * expected / most)))
    return TraceSize(decoded.start[None, :2], stride, most)


def trace_of(sums: Sums, start: Floats, cutting: Bools, most: int) -> Trace:
    """What the judge kept, and the start (1, 2) mm before it; of what is more than `most` points
    (more rows than points) the peaks again. `cutting` (N,) tells the rows that cut."""
    from camtool.kernels.thin_trace import WRITTEN, unwritten

    written, held = int(sums.pen[WRITTEN]), unwritten(sums.pen)
    kept = np.concatenate([sums.trace[:written], held])
    row, count = kept[:, 3].astype(np.int64), len(kept)
    whole = Trace(
        np.concatenate([start, kept[:, :2]]),
        np.concatenate([[0.0], kept[:, 2]]),
        np.concatenate([[0], row]),
        np.concatenate([[False], cutting[row]]),
    )
    if count + 1 <= most:
        return whole
    longest = -(-(count + 1) // most)
    offsets = np.append(np.arange(0, count + 1, longest), count + 1)
    return _picked(whole, run_peaks(whole.error_mm, offsets))


def _picked(part: Trace, which: Ints) -> Trace:
    return Trace(part.points[which], part.error_mm[which], part.row[which], part.cutting[which])
