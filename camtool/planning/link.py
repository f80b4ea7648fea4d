"""Runs linked to one toolpath: up, across, down, cut, and so on; home at the end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from camtool.planning.items import CutRun, Runs
from camtool.planning.job import Operation, Tool
from camtool.planning.paths import cuts
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

ROUNDED_DECIMALS = 10
"""Positions are rounded to this many decimals of a mm: far coarser than the noise of doubles, and
far finer than any machine or tolerance."""

Approach = Callable[[CutRun], tuple[float, float] | None]
"""Where the tool comes from at safe height, (x, y) mm, before a run begins; None: anywhere."""


def rounded(toolpath: Toolpath) -> Toolpath:
    """The same moves with their places rounded to ROUNDED_DECIMALS.

    The ends of a straight wall differ by some 1e-15 of their size, as offsets, tabs and ramps come
    to them. Where a dialect's last decimal is a tie (a cutter of 1/8 inch has a radius of 1.5875)
    one end would be rounded up and the other down, and the wall written askew.
    """
    # Adding 0 makes −0 and 0 one.
    end, centre = (
        np.round(each, ROUNDED_DECIMALS) + 0.0 for each in (toolpath.end, toolpath.centre)
    )
    return replace(toolpath, end=end, centre=centre)


def link(
    worked: Sequence[tuple[Operation, Runs]],
    safe_z_mm: float,
    approaches: Callable[[], Approach] | None = None,
) -> ToolpathBuilder:
    """All moves of a program: the tool starts at part zero on the stock and ends above it.

    `worked`: operations, each with its runs in order of cutting. Rows know their run, counted
    through all of them. `approaches` makes what gives the place from which a run is approached, a
    new one after each tool change.
    """
    builder = ToolpathBuilder().rapid(z=safe_z_mm)
    approach = approaches() if approaches is not None else None
    tool: Tool | None = None
    speed: float | None = None
    done = 0
    for operation, runs in worked:
        if not runs:
            continue
        builder.source = ""
        if _changes(tool, operation.tool):
            speed = _spin(builder, speed, None)
            builder.event(Kind.TOOL_CHANGE, float(operation.tool.number or 0))
            approach = approaches() if approaches is not None else None
        tool = operation.tool
        speed = _spin(builder, speed, operation.spindle_rpm)
        _cut(builder, runs, done, safe_z_mm, approach)
        done += len(runs)
    builder.source = ""
    _spin(builder, speed, None)
    return builder.rapid(0.0, 0.0).event(Kind.END)


def _changes(before: Tool | None, tool: Tool) -> bool:
    """Whether the program must ask for this tool: it has a number, and another was in."""
    return tool.number is not None and (before is None or before.number != tool.number)


def _spin(builder: ToolpathBuilder, speed: float | None, wanted: float | None) -> float | None:
    """Bring the spindle from one speed to another, None being off; the new speed."""
    if wanted != speed:
        builder.event(Kind.SPINDLE_OFF if wanted is None else Kind.SPINDLE_CW, wanted)
    return wanted


def _cut(
    builder: ToolpathBuilder,
    runs: Runs,
    before: int,
    safe_z_mm: float,
    approach: Approach | None,
) -> None:
    """Add the moves of runs, of which there were so many before: each from safe z and back to it.

    (the approach) · across · down · the cuts · (the dwell) · up
    """
    vertices, first, dwell = runs.vertices, runs.first, runs.dwell_s
    cut = cuts(vertices, runs.feed_mm_min, first)
    come = [] if approach is None else [approach(run) for run in runs]
    places = [place for place in come if place is not None]
    # Where each part of a run stands among all rows.
    approached = np.zeros(len(runs), dtype=np.bool_)
    approached[: len(come)] = [place is not None for place in come]
    dwells = dwell > 0.0
    cuts_each = np.bincount(cut.run, minlength=len(runs))
    begin = np.concatenate([[0], np.cumsum(approached + cuts_each + dwells + 3)])
    across = begin[:-1] + approached
    up = begin[1:] - 1
    rank = np.arange(len(cut.run)) - np.repeat(np.cumsum(cuts_each) - cuts_each, cuts_each)
    cutting = across[cut.run] + 2 + rank
    count = int(begin[-1])
    kind = np.full(count, Kind.RAPID, dtype=np.int64)
    end, centre = np.full((count, 3), safe_z_mm), np.full((count, 2), np.nan)
    speed, value = np.full(count, np.nan), np.full(count, np.nan)
    end[begin[:-1][approached], :2] = np.array(places).reshape(-1, 2)
    end[across, :2] = vertices[first[:-1], :2]
    down = across + 1
    kind[down], end[down] = Kind.LINE, vertices[first[:-1], :3]
    speed[down] = runs.plunge_mm_min
    is_arc = np.isfinite(cut.centre[:, 0]) & np.isfinite(cut.feed)
    turning = np.where(cut.ccw, Kind.ARC_CCW, Kind.ARC_CW)
    straight = np.where(np.isnan(cut.feed), Kind.RAPID, Kind.LINE)
    kind[cutting] = np.where(is_arc, turning, straight)
    end[cutting], speed[cutting] = cut.end, cut.feed
    centre[cutting[is_arc]] = cut.centre[is_arc]
    rests = up[dwells] - 1
    kind[rests], value[rests], end[rests] = Kind.DWELL, dwell[dwells], end[rests - 1]
    end[up, :2] = end[up - 1, :2]
    number = np.repeat(np.arange(len(runs)), np.diff(begin))
    source = builder.provenance(runs.names)[number]
    builder.moves(kind, end, centre, speed, value=value, source=source, run=before + number)
