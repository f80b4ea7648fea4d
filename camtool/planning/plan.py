"""The plan: a drawing and a job become the toolpath of a machine.

contours ──order──▶ paths in order, each from its start ──link──▶ toolpath ──▶ checked
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import PurePath

from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.machine.model import Machine
from camtool.planning.job import Job
from camtool.planning.link import feeds_of, heights_of, link
from camtool.planning.order import order, ordered
from camtool.planning.profile import contours, path_name
from camtool.toolpath.extents import toolpath_extents
from camtool.toolpath.moves import Toolpath


def plan(drawing: Drawing, job: Job, machine: Machine) -> Toolpath:
    """The toolpath that cuts the drawing, work frame, with the findings of planning.

    Contours run as they are drawn, inner ones before those that hold them, in one pass at the
    depth of the job. Feeds are the job's or the machine's own; the dialect rounds them.
    OptionError for a feed above the machine's highest and for layers that the drawing has not.
    """
    feeds, heights = feeds_of(job, machine), heights_of(job, machine)
    wanted = contours(drawing, job)
    way = order(wanted.lines)
    names = [path_name(drawing, int(wanted.source[path])) for path in way.path]
    toolpath = link(ordered(wanted.lines, way), names, job, heights, feeds).finish()
    findings = list(wanted.findings)
    if drawing.marks:
        findings.append(
            Finding(
                Code.ENTITY_SKIPPED,
                Severity.WARNING,
                f"{len(drawing.marks)} single points are not cut: a profile follows lines",
                measured=float(len(drawing.marks)),
            )
        )
    if len(wanted.lines) == 0 and (len(drawing.paths) > 0 or drawing.marks):
        findings.append(
            Finding(
                Code.NOTHING_DRAWN,
                Severity.ERROR,
                "no contour is left to cut"
                + (": use a smaller tool, or --side on" if len(drawing.paths) else ""),
                where=drawing.file,
            )
        )
    findings.extend(_out_of_travel(toolpath, machine))
    return replace(toolpath, findings=tuple(findings), made_from=PurePath(drawing.file).name)


def _out_of_travel(toolpath: Toolpath, machine: Machine) -> Iterator[Finding]:
    """Axes on which the toolpath, part zero included, spans more than they can travel."""
    for name, axis, (low, high) in zip(
        "XYZ", machine.axes, toolpath_extents(toolpath).tolist(), strict=True
    ):
        span = high - low
        if axis.travel_mm is None or span <= axis.travel_mm + POSITION_EPS_MM:
            continue
        yield Finding(
            Code.OUT_OF_TRAVEL,
            Severity.ERROR,
            f"{name} spans {span:.4f} mm with part zero, more than its travel of"
            f" {axis.travel_mm:g} mm: use --origin lower-left, or scale the drawing",
            where=f"axis {name}, from {low:.4f} to {high:.4f} mm",
            measured=span,
            limit=axis.travel_mm,
            unit="mm",
        )
