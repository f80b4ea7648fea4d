"""A case: the program to judge, the options, and the tolerances that follow from the machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from camtool.arrays import Indices
from camtool.geometry.drawing import Drawing
from camtool.machine.model import Machine
from camtool.planning.job import Job, Tool
from camtool.simulation.motion import ALL, Effects, Options
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import CompensatedToolpath, Toolpath
from camtool.toolpath.wanted import ProtectedRegion

if TYPE_CHECKING:
    from camtool.verification.conformance import ProgramRequest
    from camtool.verification.registration import Registration

COVERAGE_MM = 0.005
"""A move is missing, or extra, when farther than this from all moves of the other side ..."""

COVERAGE_STEPS = 4.0
"""... or than this many steps of the coarser axis, whichever is more ..."""

COVERAGE_RESOLUTIONS = 1.5
"""... or than this many units of a dialect that is coarser than the steps: rounding moves vertices
by up to 0.71 of a unit, and starts that a machine cannot reach by up to 1.41."""

DEPTH_FITS = 2.0
"""Heights may differ by the tolerance of coverage, by that of Z, or by this many fit tolerances,
whichever is most: machines without slopes make slopes in steps of that height."""

SAMPLE_MM = 0.01
"""Spacing of the points on decoded and wanted moves that are compared with each other."""

TRACE_POINTS = 20_000

WORST_LISTED = 10


def nose_of(job: Job) -> Tool | None:
    """Return a tool with the tip with which all operations cut, if that is narrower than the tool
    (a V bit, a mill with a nose). None for tools as wide at their tip as above, and for several
    tools."""
    tools = [operation.tool for operation in job.operations]
    shapes = {(tool.kind, tool.tip_angle_rad, tool.tip_diameter_mm) for tool in tools}
    noses = {tool.nose_mm for tool in tools}
    if len(shapes) != 1 or len(noses) != 1:
        return None
    tool = tools[0]
    return tool if tool.nose_mm or (tool.kind == "v" and tool.tip_angle_rad is not None) else None


def tool_mm(job: Job) -> float | None:
    """Return the diameter of the tool with which all operations cut, mm; None if there are
    several, or none."""
    diameters = {operation.tool.diameter_mm for operation in job.operations}
    return (diameters.pop() or None) if len(diameters) == 1 else None


def coverage_of(machine: Machine) -> float:
    """Return the tolerance within which a contour counts as cut on this machine, mm in XY, without
    the deviation that its dialect allows itself (`stray_mm`)."""
    axes = (machine.axes.x, machine.axes.y)
    coarse = max(axis.coded_step_mm for axis in axes)
    unit = max(axis.resolution_mm or 0.0 for axis in axes)
    return max(COVERAGE_MM, COVERAGE_STEPS * coarse, COVERAGE_RESOLUTIONS * unit)


class VerifyOptions(Struct, frozen=True):
    """Options of verification, and figures of the program for the report.

    `interpolator` None: that of the machine. `effects`: the parts of the mechanics that act.
    `tool_diameter_mm`: None where it is not known. `nose`: the tool has that diameter only above
    its cone or nose.
    `kept`: which runs cut, and what must stay; () where that is not known. `size_bytes`: size of
    the file; `line_bytes`: what is sent over the line to the machine. `stray_mm`: how far the
    dialect may leave the wanted path on purpose. `trace_points`: points of the slides' path for
    pictures. `worst`: number of moves listed as those with the largest errors. `shape`: the part
    that comes out is compared with the one that is wanted, if the tool is known. `keep_ledger`:
    keep time, steps and reversals of each row."""

    interpolator: str | None = None
    effects: Effects = ALL
    tool_diameter_mm: float | None = None
    nose: Tool | None = None
    kept: tuple[ProtectedRegion, ...] = ()
    source: str = ""
    size_bytes: int | None = None
    line_bytes: int | None = None
    stray_mm: float = 0.0
    trace_points: int = TRACE_POINTS
    worst: int = WORST_LISTED
    shape: bool = True
    keep_ledger: bool = False


class Case(Struct, frozen=True, eq=False):
    """A program to judge, its machine, and what it is compared with; fields that do not apply are
    None.

    `decoded`: the moves that the controller reads from the program. `wanted`: the moves that it
    should make; both are in the work frame. `drawing`, in that frame too, gives its findings.
    `compensated`: the moves that the program should contain if `wanted` is compensated against the
    mechanics. `asked`: what else the job asks for, as a program of the dialect. `written_from`:
    the moves from which the program was written, whose contours it must cut in the same direction;
    `row_from` (N,): the row of these from which each decoded row was written, −1 for none.
    `registration`: the parts of the drawing that a program of others cuts."""

    decoded: Toolpath
    target: LoadedTarget
    wanted: Toolpath | None = None
    drawing: Drawing | None = None
    options: VerifyOptions = VerifyOptions()
    compensated: CompensatedToolpath | None = None
    asked: ProgramRequest | None = None
    written_from: Toolpath | None = None
    row_from: Indices | None = None
    registration: Registration | None = None

    @property
    def machine(self) -> Machine:
        """The machine that runs the program."""
        return self.target.machine

    @property
    def simulation(self) -> Options:
        """The options of the simulation."""
        return Options(interpolator=self.options.interpolator, effects=self.options.effects)

    @property
    def step_mm(self) -> float:
        """The finer coded step of X and Y."""
        return min(self.machine.axes.x.coded_step_mm, self.machine.axes.y.coded_step_mm)

    @property
    def spacing_mm(self) -> float:
        """Distance between samples of the motion, mm, approximately."""
        return self.target.model.spacing_mm(self.decoded, self.machine)

    @property
    def coverage_mm(self) -> float:
        """Tolerance of coverage in XY, mm: a move farther from the other side is missing or
        extra."""
        return coverage_of(self.machine) + self.options.stray_mm

    @property
    def depth_mm(self) -> float:
        """Tolerance of coverage in height, mm."""
        z, fit_mm = self.machine.axes.z, self.machine.defaults.fit_tolerance_mm
        steps = max(
            COVERAGE_STEPS * z.coded_step_mm, COVERAGE_RESOLUTIONS * (z.resolution_mm or 0)
        )
        return max(self.coverage_mm, steps, DEPTH_FITS * fit_mm)
