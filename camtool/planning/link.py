"""Runs linked to one toolpath: up, across, down, cut, and so on; home at the end."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.machine.model import Machine, Spindle
from camtool.planning.items import CutRun, Runs, Setting
from camtool.planning.job import Operation, Tool
from camtool.planning.paths import cuts
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from camtool.toolpath.wanted import OperationNote, ToolNote

ROUNDED_DECIMALS = 10
"""Positions are rounded to this many decimals of a mm: far coarser than the noise of doubles, and
far finer than any machine or tolerance."""

CHANGE_HEIGHTS = 5.0
"""On a machine that states no height for tool changes, the tool is lifted this many times its safe
height above the stock, or as far as its travel goes, so that a hand can reach it."""

VERTICES_AT_ONCE = 1 << 15

Approach = Callable[[CutRun], tuple[float, float] | None]
"""The function that returns the place (x, y), mm, from which the tool approaches a run at safe
height; None: from anywhere."""


def _rounded(places: Floats) -> Floats:
    """Return places rounded to ROUNDED_DECIMALS, with 0 for −0.

    The ends of a straight wall differ by some 1e-15 of their size, as offsets, tabs and ramps come
    to them. Where a dialect's last decimal is a tie (a cutter of 1/8 inch has a radius of 1.5875)
    one end would be rounded up and the other down, and the wall written askew."""
    return np.asarray(np.round(places, ROUNDED_DECIMALS) + 0.0)


def link(
    worked: Sequence[tuple[Setting, Runs]],
    machine: Machine,
    approaches: Callable[[], Approach] | None = None,
) -> ToolpathBuilder:
    """Return the builder with all moves of a program: the tool starts at part zero on the stock
    and ends above it, where the machine parks.

    `worked`: (setting, runs in order of cutting) of each operation. Rows know their run, counted
    through all of them. `approaches` makes the function that returns the place from which a run is
    approached; a new one is made after each tool change. All places are rounded to
    ROUNDED_DECIMALS."""
    safe_z_mm = worked[0][0].safe_z_mm
    feed_z_mm = machine.defaults.feed_z_mm
    heights = (safe_z_mm, None if feed_z_mm is None or feed_z_mm >= safe_z_mm else feed_z_mm)
    spindle = machine.spindle
    turns_work = machine.spindle.turns == "work"
    builder = ToolpathBuilder()
    if not turns_work:
        builder.rapid(z=float(_rounded(np.array(safe_z_mm))))
    approach = approaches() if approaches is not None else None
    tool: Tool | None = None
    speed: float | None = None
    cooled, done_count = "off", 0
    lowest = min((float(runs.vertices[:, 2].min()) for _, runs in worked if runs), default=0.0)
    for setting, runs in worked:
        operation = setting.operation
        if not runs:
            continue
        builder.source = ""
        number = operation.tool.number
        changes = number is not None and (tool is None or tool.number != number)
        if changes:
            cooled = _set_coolant(builder, cooled, "off")
            speed = _set_spindle(builder, speed, None, spindle)
            if tool is not None and turns_work:
                builder.rapid(*(machine.defaults.change_mm or machine.defaults.park_mm))
            elif tool is not None:
                _go_to_tool_change(builder, machine, lowest)
        builder.operation(_operation_note(setting))
        if changes:
            builder.event(Kind.TOOL_CHANGE, float(operation.tool.number or 0))
            approach = approaches() if approaches is not None else None
        tool = operation.tool
        speed = _set_spindle(builder, speed, setting.spindle_rpm, spindle)
        cooled = _set_coolant(builder, cooled, operation.coolant)
        if turns_work:
            _add_section(builder, runs, done_count)
            done_count += len(runs)
            continue
        if builder.position[2] > heights[0]:  # from the place of the tool change, not on a slope
            builder.rapid(*_rounded(runs.vertices[0, :2]).tolist())
        for run_lot in _lots(runs):
            _add_cuts(builder, run_lot, done_count, heights, approach)
        done_count += len(runs)
    builder.source = ""
    _set_coolant(builder, cooled, "off")
    _set_spindle(builder, speed, None, spindle)
    return builder.rapid(*machine.defaults.park_mm).event(Kind.END)


def _add_section(builder: ToolpathBuilder, runs: Runs, before: int) -> None:
    """Add the moves of runs on a lathe, which has no height: across to each run and along it.
    `before`: the number of runs added before."""
    for index, run in enumerate(runs, before):
        cut = cuts(run.vertices, run.feed_mm_min, np.array([0, len(run.vertices)]))
        is_arc = np.isfinite(cut.centre[:, 0]) & np.isfinite(cut.feed)
        turning = np.where(cut.ccw, Kind.ARC_CCW, Kind.ARC_CW)
        straight = np.where(np.isnan(cut.feed), Kind.RAPID, Kind.LINE)
        kind = np.append(int(Kind.RAPID), np.where(is_arc, turning, straight))
        end = np.concatenate([run.vertices[:1, :3], cut.end])
        centre = np.concatenate(
            [[[np.nan, np.nan]], np.where(is_arc[:, None], cut.centre, np.nan)]
        )
        builder.moves(
            kind.astype(np.int64),
            _rounded(end),
            _rounded(centre),
            np.append(np.nan, cut.feed),
            source=builder.provenance([run.name])[np.zeros(len(kind), dtype=np.int64)],
            run=np.full(len(kind), index),
        )


def _go_to_tool_change(builder: ToolpathBuilder, machine: Machine, lowest_mm: float) -> None:
    """Move to the place where the machine changes tools, up first. If the machine states none,
    move up as far as a hand needs, and to where it parks. `lowest_mm`: the lowest Z of the
    program."""
    x, y, z = builder.position
    height, place = machine.defaults.change_z_mm, machine.defaults.change_mm
    if height is None:
        travel = machine.axes.z.travel_mm
        top = math.inf if travel is None else lowest_mm + travel
        height = min(CHANGE_HEIGHTS * machine.defaults.safe_z_mm, top)
    if place is None:
        place = machine.defaults.park_mm
    if height > z:
        builder.rapid(z=float(_rounded(np.array(height))))
    if place != (x, y):
        builder.rapid(*place)


def tool_note(operation: Operation) -> ToolNote:
    """Return the tool of an operation as it is named in programs."""
    tool = operation.tool
    return ToolNote(
        tool.number,
        tool.name,
        operation.contract.tool_shape or tool.kind,
        tool.diameter_mm,
        tool.tip_angle_rad,
        tool.tip_diameter_mm,
        tool.corner_radius_mm,
    )


def _operation_note(setting: Setting) -> OperationNote:
    """Return the description of an operation for the comments of the program."""
    operation = setting.operation
    return OperationNote(
        kind=operation.kind,
        name=operation.name,
        tool=tool_note(operation),
        feed_mm_min=setting.feeds.cut_mm_min,
        plunge_mm_min=setting.feeds.plunge_mm_min,
        depth_mm=-setting.levels_mm[-1],
        spindle_rpm=setting.spindle_rpm,
        passes=len(setting.levels_mm) if operation.contract.descent == "passes" else None,
        drills=operation.contract.descent == "pecks",
        peck_mm=operation.peck_mm,
        pitch_mm=(
            setting.feeds.cut_mm_min / setting.spindle_rpm
            if operation.contract.follows_spindle and setting.spindle_rpm
            else None
        ),
    )


def _set_spindle(
    builder: ToolpathBuilder, speed: float | None, wanted_rpm: float | None, spindle: Spindle
) -> float | None:
    """Switch the spindle from one speed to another (None: off) and return the new speed. Nothing
    is added if the program does not switch this spindle."""
    if wanted_rpm == speed or spindle.switched != "program":
        return speed
    if wanted_rpm is None:
        builder.event(Kind.SPINDLE_OFF, None)
        return None
    builder.event(Kind.SPINDLE_CCW if spindle.direction == "ccw" else Kind.SPINDLE_CW, wanted_rpm)
    if spindle.spin_up_s > 0.0:
        builder.event(Kind.DWELL, spindle.spin_up_s)
    return wanted_rpm


def _set_coolant(builder: ToolpathBuilder, coolant_now: str, wanted_coolant: str) -> str:
    """Switch from one kind of coolant to another and return the new one."""
    if coolant_now != wanted_coolant and (
        wanted_coolant == "off"
        or (coolant_now not in ("off", wanted_coolant) and wanted_coolant != "both")
    ):
        builder.event(Kind.COOLANT_OFF, None)
        coolant_now = "off"
    if coolant_now != wanted_coolant and wanted_coolant != "off":
        if wanted_coolant in ("mist", "both") and coolant_now != "mist":
            builder.event(Kind.COOLANT_MIST, None)
        if wanted_coolant in ("flood", "both") and coolant_now != "flood":
            builder.event(Kind.COOLANT_FLOOD, None)
    return wanted_coolant


class _Lot(Struct, frozen=True, eq=False):
    """A part of the runs, from run `first` on. `is_begun`: its first run began in the lot before;
    `goes_on`: its last run continues in the next lot, from the vertex at which this one ends."""

    runs: Runs
    first: int
    is_begun: bool
    goes_on: bool


def _lots(runs: Runs) -> Iterator[_Lot]:
    """Yield the runs in lots of about VERTICES_AT_ONCE vertices. A run is split only before a
    line, so that no arc is split."""
    first, count = runs.first, len(runs.vertices)
    may_part = runs.vertices[:, 3] == 0.0
    may_part[first[1:] - 1] = False
    may_part[first[:-1]] = True
    begin = 0
    while begin < count:
        may_end = may_part[begin + VERTICES_AT_ONCE :]
        end = begin + VERTICES_AT_ONCE + int(may_end.argmax()) if may_end.any() else count
        low = int(np.searchsorted(first, begin, side="right")) - 1
        high = int(np.searchsorted(first, end))
        goes_on = bool(first[high] > end)
        rows, run_rows = slice(begin, end + goes_on), slice(low, high)
        part = Runs(
            runs.vertices[rows],
            runs.feed_mm_min[rows],
            first[low : high + 1].clip(begin, rows.stop) - begin,
            runs.plunge_mm_min[run_rows],
            runs.dwell_s[run_rows],
            runs.names[run_rows],
        )
        yield _Lot(part, low, bool(first[low] < begin), goes_on)
        begin = end


def _add_cuts(
    builder: ToolpathBuilder,
    run_lot: _Lot,
    before: int,
    heights: tuple[float, float | None],
    approach: Approach | None,
) -> None:
    """Add the moves of the runs of a lot; `before`: the number of runs added before. Each run
    begins and ends at safe z, the first of `heights`; it goes down as a rapid to the second of
    these (None: not), and from there at the plunge feed.

    (the approach) · across · (as a rapid) · down · the cuts · (the dwell) · up"""
    safe_z_mm, feed_z_mm = heights
    come_down = 2 + (feed_z_mm is not None)
    runs, count = run_lot.runs, len(run_lot.runs)
    vertices, first = runs.vertices, runs.first
    cut = cuts(vertices, runs.feed_mm_min, first)
    begins, ends = np.ones(count, dtype=np.bool_), np.ones(count, dtype=np.bool_)
    begins[0], ends[-1] = not run_lot.is_begun, not run_lot.goes_on
    heads = np.flatnonzero(begins)
    come = [] if approach is None else [approach(runs[k]) for k in heads.tolist()]
    places = [place for place in come if place is not None]
    # Where each part of a run stands among all rows.
    approached = np.zeros(count, dtype=np.bool_)
    approached[heads[: len(come)]] = [place is not None for place in come]
    dwells = ends & (runs.dwell_s > 0.0)
    cuts_each = np.bincount(cut.run, minlength=count)
    rows_each = approached + come_down * begins + cuts_each + dwells + ends
    stop = np.cumsum(rows_each)
    start = stop - rows_each
    rank = np.arange(len(cut.run)) - np.repeat(np.cumsum(cuts_each) - cuts_each, cuts_each)
    cutting = (start + approached + come_down * begins)[cut.run] + rank
    total = int(stop[-1])
    kind = np.full(total, Kind.RAPID, dtype=np.int64)
    end, centre = np.full((total, 3), safe_z_mm), np.full((total, 2), np.nan)
    speed, value = np.full(total, np.nan), np.full(total, np.nan)
    end[start[approached], :2] = np.array(places).reshape(-1, 2)
    across = (start + approached)[heads]
    end[across, :2] = vertices[first[heads], :2]
    down_rows = across + come_down - 1
    if feed_z_mm is not None:
        end[across + 1, :2], end[across + 1, 2] = vertices[first[heads], :2], feed_z_mm
    kind[down_rows], end[down_rows] = Kind.LINE, vertices[first[heads], :3]
    speed[down_rows] = runs.plunge_mm_min[heads]
    is_arc = np.isfinite(cut.centre[:, 0]) & np.isfinite(cut.feed)
    turning = np.where(cut.ccw, Kind.ARC_CCW, Kind.ARC_CW)
    straight = np.where(np.isnan(cut.feed), Kind.RAPID, Kind.LINE)
    kind[cutting] = np.where(is_arc, turning, straight)
    end[cutting], speed[cutting] = cut.end, cut.feed
    centre[cutting[is_arc]] = cut.centre[is_arc]
    up_rows = stop[ends] - 1
    rests = stop[dwells] - 2
    kind[rests], value[rests], end[rests] = Kind.DWELL, runs.dwell_s[dwells], end[rests - 1]
    end[up_rows, :2] = end[up_rows - 1, :2]
    number = np.repeat(np.arange(count), rows_each)
    source = builder.provenance(runs.names)[number]
    run = before + run_lot.first + number
    columns = _rounded(end), _rounded(centre), speed
    builder.moves(kind, *columns, value=value, source=source, run=run)
