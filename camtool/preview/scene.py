"""The Scene: everything that one picture shows, in one frame (the work frame, mm)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Segments
from camtool.preview.rounds import Round
from camtool.preview.viewer.run import Run
from camtool.toolpath.moves import Toolpath

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


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
    run: Callable[[], Run] | None = None

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
