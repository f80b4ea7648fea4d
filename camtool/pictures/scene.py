"""The Scene: everything that one picture shows, in one frame (the work frame, mm)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Segments
from camtool.toolpath.moves import Kind, Toolpath


@dataclass(frozen=True, eq=False)
class Scene:
    """What to draw; whatever is None or empty is left out.

    `wanted` are the lines and arcs that the trace was held against, `worst` the places of the
    largest errors, mm, the largest first; `tool_mm` is the diameter of the one tool,
    `rounds` are full circles with what became of them.

    trace_points (T, 2) mm is the path of the slides, trace_error_mm (T,) its distance to what was
    wanted, trace_cutting (T,) whether the tool cut on the way to each point (always when None);
    other errors do not count. travel_mm is the size of the table's travel from (0, 0). `run` gives
    how the toolpath runs, for the viewer; it is called only there.
    The drawing is in the work frame. With a trace the picture is one of the
    part: rapids and plunges are left out, feeds are pale. ValueError when the trace is incomplete
    or not finite.
    """

    title: str = ""
    drawing: Drawing | None = None
    toolpath: Toolpath | None = None
    trace_points: Floats | None = None
    trace_error_mm: Floats | None = None
    trace_cutting: Bools | None = None
    travel_mm: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    wanted: Segments | None = None
    worst: tuple[tuple[float, float], ...] = ()
    tool_mm: float | None = None
    rounds: tuple[Round, ...] = ()
    run: Callable[[], Playback] | None = None

    def __post_init__(self) -> None:
        points, error = self.trace_points, self.trace_error_mm
        if points is None and error is None and self.trace_cutting is None:
            return
        if points is None or error is None:
            raise ValueError("a trace needs both its points and their errors")
        cutting = self.trace_cutting
        if cutting is None:
            cutting = np.ones(len(points), dtype=np.bool_)
            object.__setattr__(self, "trace_cutting", cutting)
        count = (len(points),)
        if points.shape != (*count, 2) or error.shape != count or cutting.shape != count:
            raise ValueError("the columns of the trace have different lengths")
        if not (np.isfinite(points).all() and np.isfinite(error[cutting]).all()):
            raise ValueError("a number of the trace is not finite")


def scene_of_drawing(drawing: Drawing) -> Scene:
    """A drawing alone, with its size."""
    return Scene(title=drawing.file, drawing=drawing, notes=(_size_note(drawing),))


def scene_of_toolpath(toolpath: Toolpath, *, title: str, drawing: Drawing | None = None) -> Scene:
    """A toolpath, over the drawing that it was planned from where there is one."""
    moves, feeds = int(toolpath.is_motion.sum()), int(toolpath.is_feed.sum())
    note = f"{moves} moves, {feeds} of them at a feed"
    sizes = () if drawing is None else (_size_note(drawing),)
    return Scene(title=title, toolpath=toolpath, drawing=drawing, notes=(*sizes, note))


def _size_note(drawing: Drawing) -> str:
    from camtool.geometry.measure import extents

    if not len(drawing.paths):
        return f"{len(drawing.marks)} points" if drawing.marks else "nothing drawn"
    (left, right), (bottom, top) = extents(drawing.paths).tolist()
    return f"{right - left:.4g} × {top - bottom:.4g} mm"


# A full circle and what became of it, as a polar plot shows it.


@dataclass(frozen=True, eq=False)
class Round:
    """A circle (x, y) mm of this radius mm and direction, with its bins (B, 9) as
    `camtool.kernels.circle_bins` fills them; circular error G, radial errors F max, F min and
    their mean D, and the reversal values B of X and Y, mm, NaN where nobody knows. `partner` is
    the number, from 1, of the same circle gone round the other way, `both_circular_mm` the
    bi-directional circular error G(b) of the two."""

    centre_mm: tuple[float, float]
    radius_mm: float
    ccw: bool
    bins: Floats
    circular_mm: float
    radial_mm: tuple[float, float, float]
    reversal_mm: tuple[float, float]
    partner: int | None = None
    both_circular_mm: float = math.nan

    def errors(self) -> Floats:
        """(B, 3) mm: least, mean and largest radial error of each bin; NaN where nothing was."""
        seen = self.bins[:, 0] > 0.0
        found = np.full((len(self.bins), 3), np.nan)
        bins = self.bins[seen]
        mean = bins[:, 1:3] / bins[:, :1]
        # The mean of points along an arc of angle w lies at sin(w/2)/(w/2) of the radius.
        half = np.pi / len(self.bins)
        found[seen, 0] = np.sqrt(bins[:, 3])
        found[seen, 1] = np.hypot(mean[:, 0], mean[:, 1]) * (half / np.sin(half))
        found[seen, 2] = np.sqrt(bins[:, 6])
        return found - self.radius_mm


# How a toolpath runs, for the viewer: seconds, errors, the program's lines, the report.


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
class Playback:
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


def by_feed(toolpath: Toolpath, rapid_mm_min: float) -> Playback:
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
    return Playback(seconds, np.full(len(toolpath), np.nan), np.empty(0, dtype=np.int64))
