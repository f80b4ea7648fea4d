"""How a toolpath runs, for the viewer: seconds, errors, the program's lines, the report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.toolpath.moves import Kind, Toolpath

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Line:
    """A line of a table: its cells, and the row of the toolpath that it speaks of."""

    cells: tuple[str, ...]
    move: int | None = None


@dataclass(frozen=True)
class Table:
    """A table of the report; `columns` may be empty."""

    title: str
    columns: tuple[str, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Worst:
    """A place (x, y) mm with a large error."""

    at_mm: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Run:
    """How N rows of a toolpath run: `seconds` (N,); `error_mm` (N,), NaN where not known;
    `trace_row` (T,) the row of each point of the scene's trace.

    `blocks` are the program's lines, one per block, or None without a program; `binary` tells
    that they are bytes in hex. ValueError when the columns do not fit.
    """

    seconds: Floats
    error_mm: Floats
    trace_row: Ints
    blocks: tuple[str, ...] | None = None
    binary: bool = False
    tables: tuple[Table, ...] = ()
    worst: tuple[Worst, ...] = ()

    def __post_init__(self) -> None:
        if self.seconds.shape != self.error_mm.shape or self.seconds.ndim != 1:
            raise ValueError("the columns of the run have different lengths")
        if not (np.isfinite(self.seconds).all() and (self.seconds >= 0.0).all()):
            raise ValueError("a duration is not finite, or below 0")


def by_feed(toolpath: Toolpath, rapid_mm_min: float) -> Run:
    """The run of a toolpath that nothing simulates: each move at its feed, rapids at
    `rapid_mm_min` (inf: in no time), dwells as long as they say."""
    seconds = np.zeros(len(toolpath))
    if len(toolpath):
        away = toolpath.end - toolpath.starts
        flat = np.hypot(away[:, 0], away[:, 1])
        spoke = toolpath.starts[:, :2] - toolpath.centre
        bow = np.abs(toolpath.sweeps()) * np.hypot(spoke[:, 0], spoke[:, 1])
        length = np.hypot(np.where(toolpath.is_arc, bow, flat), away[:, 2])
        feed = np.where(toolpath.kind == Kind.RAPID, rapid_mm_min, toolpath.feed)
        known = toolpath.is_motion & np.isfinite(feed) & (feed > 0.0)
        seconds[known] = length[known] / feed[known] * 60.0
        dwell = toolpath.kind == Kind.DWELL
        seconds[dwell] = np.nan_to_num(toolpath.value[dwell])
    return Run(seconds, np.full(len(toolpath), np.nan), np.empty(0, dtype=np.int64))
