"""Chamfers: the edges of closed contours are broken by the flank of a V bit.

         w              stock top
       ├───┤
    ───╮   ┊  ╱
    part╲  ┊ ╱          the bevel ends at the drawn line, where the bit is r(o) wide;
         ╲ ┊╱           its tip runs o below that, beside the wall
         │╲╱

The axis of the bit runs r(o) away from the line, on the side of the waste, as the tool of a
profile of that radius would: so a chamfer is one, whose depth its width makes
(`chamfered`).
Round an outer corner the cone rolls about the corner, and the bevels meet in a mitre there; in an
inner one it leaves its own round. All passes run along the same line, each deeper than the one
before."""

from __future__ import annotations

import math

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.operations.profile.work import profile
from camtool.planning.findings import NOT_CHAMFERED, NOTHING_DRAWN_TO_CHAMFER
from camtool.planning.holes import named
from camtool.planning.items import Chosen, Setting, Work
from camtool.planning.job import MIN_POSITIVE, THROUGH_SLACK, Operation, Stock
from camtool.planning.naming import operation_name
from camtool.records import replace


def chamfered(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation with the depth at which the V bit cuts its chamfer.

    A cone of half angle α and tip radius t is r(h) = t + h·tan α wide, h above its tip. Its tip
    runs an offset o below the bevel, whose lower edge is the drawn line: the axis runs r(o) beside
    that line, and the bevel is w = r(D) − r(o) wide at the stock top for a tip D = o + w / tan α
    deep. OptionError without a width, for a tool that is no V bit, and for one too narrow."""
    place = f"operation {operation.name or operation.kind!r}, key chamfer"
    if operation.chamfer_mm is None:
        raise OptionError(
            "a chamfer has no width",
            where=place,
            mend='say how wide it is, seen from above: chamfer = "0.5mm"',
        )
    tool = operation.tool
    if tool.kind != "v" or tool.tip_angle_rad is None:
        raise OptionError(
            "a chamfer needs a V bit, and its angle",
            where=f"operation {operation.name or operation.kind!r}, key tool",
            mend='give a tool with kind = "v" and its tip_angle',
        )
    depth = operation.tip_offset_mm + operation.chamfer_mm / math.tan(0.5 * tool.tip_angle_rad)
    needed = 2.0 * (operation.wall_radius_mm + operation.chamfer_mm)
    width, offset = operation.chamfer_mm, operation.tip_offset_mm
    if 0.0 < tool.diameter_mm < needed * (1.0 - THROUGH_SLACK):
        raise OptionError(
            f"a chamfer of {width:g} mm, the tip {offset:g} mm below it,"
            f" needs a bit of {needed:.4g} mm, and this one has {tool.diameter_mm:g} mm",
            where=place,
            mend="give a smaller chamfer or tip_offset, or a wider bit",
        )
    if operation.depth_mm is not None and abs(operation.depth_mm - depth) > MIN_POSITIVE:
        raise OptionError(
            f"a depth of {operation.depth_mm:g} mm is given too, but the chamfer makes it"
            f" {depth:.4g} mm",
            where=place,
            mend="leave the depth out",
        )
    return replace(operation, depth_mm=depth)


def chamfer(chosen: Chosen, setting: Setting) -> Work:
    """Return the contours of an operation of the kind chamfer; open paths are named in a
    finding."""
    closed = np.flatnonzero(chosen.lines.closed)
    opens = [chosen.names[k] for k in np.flatnonzero(~chosen.lines.closed).tolist()]
    findings = list[Finding]()
    if opens:
        findings.append(NOT_CHAMFERED(where=named(opens), measured=len(opens)))
    if not len(closed):
        findings.append(NOTHING_DRAWN_TO_CHAMFER(where=operation_name(setting.operation)))
    edges = replace(
        chosen,
        nesting=chosen.nesting.among(closed),
        source=chosen.source[closed],
        names=tuple(chosen.names[k] for k in closed.tolist()),
        rim=chosen.rim[closed],
    )
    work = profile(edges, setting)
    return Work(work.items, (*findings, *work.findings))
