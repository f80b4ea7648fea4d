"""Checks of a whole toolpath before anything is written."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.machine.model import Machine
from camtool.planning.job import Job
from camtool.toolpath.extents import toolpath_extents
from camtool.toolpath.moves import Toolpath


def checked(toolpath: Toolpath, job: Job, machine: Machine) -> tuple[Finding, ...]:
    """What is wrong with a toolpath: axes out of travel."""
    return tuple(out_of_travel(toolpath, machine))


def out_of_travel(toolpath: Toolpath, machine: Machine) -> Iterator[Finding]:
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
