"""Runs linked to one toolpath: up, across, down, cut, and so on; home at the end."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from camtool.planning.items import CutRun
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
    worked: Sequence[tuple[Operation, Sequence[CutRun]]],
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
        for run in runs:
            builder.run = done
            _cut_one(builder, run, safe_z_mm, approach)
            done += 1
        builder.run = -1
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


def _cut_one(
    builder: ToolpathBuilder, run: CutRun, safe_z_mm: float, approach: Approach | None
) -> None:
    builder.source = run.name
    x, y, z, _ = run.vertices[0].tolist()
    before = approach(run) if approach is not None else None
    if before is not None:
        builder.rapid(*before)
    builder.rapid(x, y).line(z=z, feed=run.plunge_mm_min)
    for cut in cuts(run.vertices, run.feed_mm_min):
        x, y, z = cut.end
        if math.isnan(cut.feed):
            builder.rapid(x, y, z)
        elif cut.centre is None:
            builder.line(x, y, z, feed=cut.feed)
        else:
            builder.arc(x, y, z=z, centre=cut.centre, ccw=cut.ccw, feed=cut.feed)
    if run.dwell_s > 0.0:
        builder.event(Kind.DWELL, run.dwell_s)
    builder.rapid(z=safe_z_mm)
