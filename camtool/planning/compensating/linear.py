"""Scale and squareness undone: where the motors must go for the slides to be where wanted.

A slide is where its motor is times s = `real_step_mm` / `coded_step_mm` of the axis, about part
zero, and Y leans by q (`camtool.simulation.mechanics`):

    x = s_x m_x + s_y m_y tan q,  y = s_y m_y    so    m_y = y / s_y,  m_x = (x − y tan q) / s_x.

An arc stays an arc where that changes its radius alike in all
directions, or by less than the machine's fit tolerance; else it becomes an ellipse, which is
fitted by arcs within that tolerance.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.curves import EllipseCurve
from camtool.geometry.fit import fit_curve
from camtool.machine.model import Machine
from camtool.planning.compensating.stretch import Point
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Bent, Floats, Kind, Move, Toolpath


def motor_matrix(machine: Machine) -> Floats:
    """(3, 3): wanted mm to the mm that the motors must be sent to."""
    square = np.eye(3)
    square[0, 1] = -math.tan(machine.mechanics.squareness_rad)
    return np.diag([axis.coded_step_mm / axis.real_step_mm for axis in machine.axes]) @ square


def motor_path(toolpath: Toolpath, machine: Machine) -> Bent:
    """The path of the motors for slides on `toolpath`; itself where both are as they should."""
    matrix = motor_matrix(machine)
    if np.array_equal(matrix, np.eye(3)):
        return Bent(toolpath, np.arange(len(toolpath)))
    return _Mapped(toolpath, matrix, machine.defaults.fit_tolerance_mm).bent()


class _Mapped:
    """One toolpath on its way through the matrix."""

    def __init__(self, toolpath: Toolpath, matrix: Floats, tolerance_mm: float) -> None:
        self._toolpath, self._matrix, self._tolerance_mm = toolpath, matrix, tolerance_mm
        plane = matrix[:2, :2]
        sizes = np.linalg.svd(plane, compute_uv=False)
        self._unround = float(sizes[0] - sizes[-1])
        self._scale = float(sizes.mean())
        self._b = ToolpathBuilder(self._to(tuple(toolpath.start.tolist())))

    def bent(self) -> Bent:
        sweeps = self._toolpath.sweeps()
        rows: list[int] = []
        for move in self._toolpath:
            self._b.source = move.source
            end = self._to(move.end)
            if move.kind == Kind.RAPID:
                self._b.rapid(*end)
            elif move.kind == Kind.LINE:
                self._b.line(*end, feed=_feed(move))
            elif move.kind in (Kind.ARC_CW, Kind.ARC_CCW):
                self._arc(move, end, float(sweeps[move.index]))
            else:
                _event(self._b, move, self._toolpath)
                self._b.moved_to(*end)
            rows += [move.index] * (len(self._b) - len(rows))
        return Bent(self._b.finish(self._toolpath.findings), np.array(rows, dtype=np.int64))

    def _to(self, point: tuple[float, ...]) -> Point:
        x, y, z = (self._matrix @ np.array(point)).tolist()
        return x, y, z

    def _arc(self, move: Move, end: Point, sweep: float) -> None:
        if move.centre is None:
            raise GeometryError("an arc without a centre", where=f"move {move.index}")
        centre = np.array(move.centre)
        spoke = np.array(move.start[:2]) - centre
        radius = float(np.hypot(*spoke))
        plane = self._matrix[:2, :2]
        middle = plane @ centre
        level = move.start[2] == move.end[2]
        if radius * self._unround <= self._tolerance_mm or not level:
            x, y = middle.tolist()
            ccw = move.kind == Kind.ARC_CCW
            self._b.arc(*end, centre=(x, y), ccw=ccw, feed=_feed(move))
            return
        angle = float(np.arctan2(spoke[1], spoke[0]))
        axes = plane * radius
        ellipse = EllipseCurve(middle, axes[:, 0], axes[:, 1], angle, angle + sweep)
        vertices = fit_curve(ellipse, self._tolerance_mm).vertices
        add_vertices(self._b, vertices, end, _feed(move))


def add_vertices(builder: ToolpathBuilder, vertices: Floats, end: Point, feed: float) -> None:
    """The lines and arcs between vertices (n, 3) x, y, bulge, the last of which is `end`."""
    for (x0, y0, bulge), (x1, y1, _) in zip(
        vertices[:-1].tolist(), [*vertices[1:-1].tolist(), list(end)], strict=True
    ):
        if bulge == 0.0:
            builder.line(x1, y1, feed=feed)
            continue
        # Centre: off the middle of the chord by (1 − b²)/(4b) of it, to the left for b > 0.
        share = (1.0 - bulge * bulge) / (4.0 * bulge)
        centre = (
            0.5 * (x0 + x1) - share * (y1 - y0),
            0.5 * (y0 + y1) + share * (x1 - x0),
        )
        builder.arc(x1, y1, centre=centre, ccw=bulge > 0.0, feed=feed)


def _feed(move: Move) -> float:
    return float("nan") if move.feed is None else move.feed


def _event(builder: ToolpathBuilder, move: Move, toolpath: Toolpath) -> None:
    """The same event; a message keeps its words."""
    if move.kind == Kind.MESSAGE and move.value is not None:
        builder.message(toolpath.texts[int(move.value)])
    else:
        builder.event(move.kind, move.value)
