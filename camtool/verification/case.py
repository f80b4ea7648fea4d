"""What is to be judged, how, and with which tolerances."""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.geometry.drawing import Drawing
from camtool.machine.model import Machine
from camtool.planning.job import Job
from camtool.simulation.motion import ALL, Effects, Options
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Compensated, Toolpath
from camtool.toolpath.wanted import Kept
from camtool.verification.conformance import Asked

COVERAGE_MM = 0.005
"""A move is missing, or extra, when farther than this from all moves of the other side ..."""

COVERAGE_STEPS = 4.0
"""... or than this many steps of the coarser axis, if that is more ..."""

COVERAGE_RESOLUTIONS = 1.5
"""... or than this many resolutions of a dialect that is coarser than the steps: vertices are off
by up to 0.71 of them, and starts that a machine cannot reach by up to 1.41."""

DEPTH_FITS = 2.0
"""Heights may differ by as much as coverage allows, by this many steps of Z, or by this many fit
tolerances, whichever is most: slopes of machines without slopes are steps that high."""

SAMPLE_MM = 0.01
"""Spacing of the points on decoded and wanted moves that are compared with each other."""

TRACE_POINTS = 20_000
"""Points of the slides' path that are kept for pictures."""


WORST_LISTED = 10
"""Number of moves with the largest errors in a report, unless more are asked for."""


@dataclass(frozen=True)
class Cone:
    """The shape of a V bit: the radius of its flat tip, mm, and the tangent of half its angle."""

    tip_mm: float
    slope: float


def cone_of(job: Job) -> Cone | None:
    """The shape of the V bit that all operations cut with; None for other tools, and several."""
    tools = [operation.tool for operation in job.operations]
    shapes = {(tool.kind, tool.tip_angle_rad, tool.tip_diameter_mm) for tool in tools}
    if len(shapes) != 1:
        return None
    kind, angle, tip = shapes.pop()
    return Cone(0.5 * tip, math.tan(0.5 * angle)) if kind == "v" and angle is not None else None


def tool_mm(job: Job) -> float | None:
    """The diameter of the one tool that all operations cut with, mm; None for several or none."""
    diameters = {operation.tool.diameter_mm for operation in job.operations}
    return (diameters.pop() or None) if len(diameters) == 1 else None


@dataclass(frozen=True)
class VerifyOptions:
    """How to judge, and what the report says of the program.

    `interpolator` None: as the machine does. `effects`: the parts of the mechanics that act.
    `worst`: so many moves with the largest errors are listed. `size_bytes` is that of the file,
    `line_bytes` of what goes over the line to the machine. `blocks` None: counted from the decoded
    toolpath where it was read. `coverage_mm` None: `COVERAGE_MM`, `COVERAGE_STEPS` or
    `COVERAGE_RESOLUTIONS`, and `stray_mm`, by which the dialect may leave the wanted path on
    purpose. `tool_diameter_mm`: rapids below the stock top may run where the tool
    has cleared the way before; None, when nobody knows it: nowhere. `cone`: the tool is a V bit,
    that is so wide at its top only. `kept`: what is cut by whom, and what must stay; () where
    nobody knows.
    """

    interpolator: str | None = None
    effects: Effects = ALL
    tool_diameter_mm: float | None = None
    cone: Cone | None = None
    kept: tuple[Kept, ...] = ()
    source: str = ""
    size_bytes: int | None = None
    line_bytes: int | None = None
    blocks: int | None = None
    coverage_mm: float | None = None
    stray_mm: float = 0.0
    sample_mm: float = SAMPLE_MM
    trace_points: int = TRACE_POINTS
    worst: int = WORST_LISTED


@dataclass(frozen=True, eq=False)
class Case:
    """What is to be judged. `sent`: what the program should say, where it is not `wanted` itself
    but bent against the mechanics. `asked`: what the job asks for besides, and how the dialect
    would say it. `said`: what the program was written from, where that is known: its contours
    must run the same way round."""

    decoded: Toolpath
    target: LoadedTarget
    wanted: Toolpath | None
    drawing: Drawing | None
    options: VerifyOptions
    sent: Compensated | None = None
    asked: Asked | None = None
    said: Toolpath | None = None

    @property
    def machine(self) -> Machine:
        """The machine that runs it."""
        return self.target.machine

    @property
    def simulation(self) -> Options:
        """How to simulate it."""
        return Options(interpolator=self.options.interpolator, effects=self.options.effects)

    @property
    def step_mm(self) -> float:
        """The finer coded step of X and Y."""
        return min(self.machine.axes.x.coded_step_mm, self.machine.axes.y.coded_step_mm)

    @property
    def spacing_mm(self) -> float:
        """How far apart the samples of the motion are, about."""
        return self.target.model.spacing_mm(self.decoded, self.machine)

    @property
    def coverage_mm(self) -> float:
        """How far moves of one side may be from those of the other."""
        if self.options.coverage_mm is not None:
            return self.options.coverage_mm
        axes = (self.machine.axes.x, self.machine.axes.y)
        coarse = max(axis.coded_step_mm for axis in axes)
        said = max(axis.resolution_mm or 0.0 for axis in axes)
        least = max(COVERAGE_MM, COVERAGE_STEPS * coarse, COVERAGE_RESOLUTIONS * said)
        return least + self.options.stray_mm

    @property
    def depth_mm(self) -> float:
        """How far heights of one side may be from those of the other."""
        z, fit_mm = self.machine.axes.z, self.machine.defaults.fit_tolerance_mm
        steps = max(
            COVERAGE_STEPS * z.coded_step_mm, COVERAGE_RESOLUTIONS * (z.resolution_mm or 0)
        )
        return max(self.coverage_mm, steps, DEPTH_FITS * fit_mm)
