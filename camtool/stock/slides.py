"""The moves of the tools that the simulated slides make, and which tool makes each of them.

The samples of a simulation are thinned to straight moves, so that every sample lies within
`THIN_MM` or a step of the axes of them; samples themselves lie on the path, which bends away from
the line between two of them by spacing² / 8 r at most."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.errors import OptionError
from camtool.kernels.stock import thinned
from camtool.planning.job import Job
from camtool.simulation.motion import Options
from camtool.stock.cutters import CutterProfile, cutter_profile
from camtool.stock.moves import StockMoves
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.wanted import Operations

THIN_MM = 5e-4
"""Samples may lie this far beside the moves that replace them ..."""

THIN_STEPS = 1.0
"""... or this many steps of the coarsest axis, since steps form stairs beside a sloping line."""


class ToolsOfRows(Struct, frozen=True, eq=False):
    """The distinct cutters of a program, and for each of its N rows the index of its cutter."""

    cutters: tuple[CutterProfile, ...]
    index: Ints


def tools_of_rows(
    decoded: Toolpath, job: Job | None, plan: Operations | None = None
) -> ToolsOfRows:
    """Return the cutter of each row of a program. That is the tool of the row's operation if the
    program was planned; else the only tool of the `plan` of this program or of the job; else the
    job's tool with the number of the last tool change (before the first change, the tool of the
    first operation). OptionError if a tool is not known."""
    if decoded.operations is not None and decoded.operations.notes:
        notes = decoded.operations.notes
        row = np.searchsorted(decoded.operations.begin, np.arange(len(decoded)), side="right") - 1
        return _of_profiles([cutter_profile(note.tool) for note in notes], row.clip(min=0))
    tools = {each.tool: cutter_profile(each.tool) for each in (job.operations if job else ())}
    plan_profiles = {cutter_profile(note.tool) for note in (plan.notes if plan else ())}
    for profiles in (plan_profiles, set(tools.values())):
        profile = next(iter(profiles), None)
        if len(profiles) == 1 and profile is not None and profile.radius_mm > 0.0:
            return _of_profiles([profile], np.zeros(len(decoded), dtype=np.int64))
    numbers = {tool.number: profile for tool, profile in tools.items() if tool.number is not None}
    changes = np.flatnonzero(decoded.kind == Kind.TOOL_CHANGE)
    if not numbers or not len(changes):
        raise OptionError(
            "the shape of the tool is not known, so the stock is not either",
            where=decoded.made_from,
            mend="give --tool-diameter, or the job that it was made with (--job)",
        )
    tool_numbers = [int(value) for value in decoded.value[changes].tolist()]
    for number in tool_numbers:
        if number not in numbers:
            numbers_known = ", ".join(map(str, sorted(numbers)))
            raise OptionError(
                f"the program calls tool {number}; the job has {numbers_known}",
                where=decoded.made_from,
                mend=f"give an operation of the job a tool with number = {number}",
            )
    # Before the first change the tool of the first operation is mounted.
    mounted = [next(iter(tools.values())), *(numbers[number] for number in tool_numbers)]
    return _of_profiles(mounted, np.searchsorted(changes, np.arange(len(decoded)), side="right"))


def _of_profiles(profiles: list[CutterProfile], row: Ints) -> ToolsOfRows:
    """Return the distinct profiles, and for each row, whose index among `profiles` is `row` (N,),
    its index among the distinct ones."""
    cutters = tuple(dict.fromkeys(profiles))
    index = np.array([cutters.index(each) for each in profiles], dtype=np.int64)
    return ToolsOfRows(cutters, index[row])


def slide_moves(
    decoded: Toolpath,
    target: LoadedTarget,
    tools: ToolsOfRows,
    options: Options | None = None,
    *,
    z_weight: float = 1.0,
    thin_mm: float | None = None,
) -> StockMoves:
    """Simulate a program and return the thinned moves of the tips that its slides make. The moves
    are no farther from the slides than `thin_mm` (None: THIN_MM or a step), and `z_weight` times
    nearer in Z. Raises what `LoadedTarget.simulate` raises."""
    machine = target.machine
    axes = (machine.axes.x, machine.axes.y, machine.axes.z)
    step_mm = max(abs(axis.coded_step_mm) for axis in axes)
    beside_mm = max(THIN_MM, THIN_STEPS * step_mm) if thin_mm is None else thin_mm
    weight = np.array([1.0, 1.0, z_weight])
    points, rows = [decoded.start[None]], [np.zeros(1, dtype=np.int64)]
    for chunk in target.simulate(decoded, options):
        if len(chunk.row):
            last = points[-1][-1] * weight
            kept_rows = thinned(chunk.slide * weight, chunk.row, last, beside_mm)
            points.append(chunk.slide[kept_rows])
            rows.append(chunk.row[kept_rows])
    path, row = np.concatenate(points), np.concatenate(rows)[1:].astype(np.int64)
    has_moved = (path[1:] != path[:-1]).any(axis=1)
    bend_mm = _bend_mm(decoded, target.model.spacing_mm(decoded, machine))
    return StockMoves(
        path[:-1][has_moved],
        path[1:][has_moved],
        row[has_moved],
        (decoded.kind == Kind.RAPID)[row[has_moved]],
        tools.index[row[has_moved]],
        tools.cutters,
        beside_mm + bend_mm,
    )


def _bend_mm(decoded: Toolpath, spacing_mm: float) -> float:
    """Return the largest distance, mm, of an arc from the line between two of its samples."""
    arcs = np.flatnonzero(decoded.is_arc)
    if not len(arcs):
        return 0.0
    radius: Floats = np.hypot(*(decoded.end[arcs, :2] - decoded.centre[arcs]).T)
    return float((np.minimum(spacing_mm, 2.0 * radius) ** 2 / (8.0 * radius)).max(initial=0.0))
