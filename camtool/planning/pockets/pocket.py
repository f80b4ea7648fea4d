"""Pockets: all within closed contours is cleared, except islands, which stay.

    closed paths ─nesting─▶ regions ─shrunk by tool and allowance─▶ regions of the tool's middle
    ─contour or zigzag─▶ ways in the plane ─levels, entry─▶ runs

Closed contours count by nesting: what an odd number of them hold is cleared. Rings run so that
the teeth go with the feed (climb): round walls CCW and round islands CW, as a spindle turning CW
wants it. "conventional" is the other way; "drawn" is climb too, because no ring is drawn.

The tool goes down once for each connected region of its middle, and stays at depth between rings:
links run within that region, so they cut nothing that is to stay.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.intersect import meetings, self_crossings
from camtool.geometry.measure import extents, signed_areas
from camtool.geometry.nesting import nesting, oriented
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Floats, Polylines, Segments
from camtool.planning.items import Chosen, Fixed, Run, Setting, Work
from camtool.planning.job import Operation
from camtool.planning.places import at_place, tool_name
from camtool.planning.pockets.entry import back_along, down_for, lowered, over_floor
from camtool.planning.pockets.parts import parts_of
from camtool.planning.pockets.rings import Steps, ring_cells, ring_ways
from camtool.planning.pockets.route import Rails
from camtool.planning.pockets.slots import SLOT_TOLERANCE, slot_ways
from camtool.planning.pockets.zigzag import Scan, zigzag_ways
from camtool.planning.uncut import unreached_findings

MOST_WAYS = 10_000
"""More steps than this across a pocket are taken as a mistake."""


@dataclass(frozen=True, eq=False)
class Pocket:
    """One region to be cleared, on the left of its closed paths, work frame; the name of its
    outer path and the index of that in the placed drawing."""

    region: Polylines
    name: str
    source: int


@dataclass(frozen=True, eq=False)
class Cleared:
    """The runs that clear a region, in order; and what did not fit of their entries, with the
    first run for which that is so."""

    runs: list[Run]
    changed: dict[str, Run]


def pocket(chosen: Chosen, setting: Setting) -> Work:
    """One item for each region that the closed paths enclose (even-odd), and what stays uncut.

    OptionError for an open path, for paths that cross, and for a tool that cuts no width.
    """
    _check(chosen, setting.operation)
    _check_step(chosen, setting.operation)
    items: list[Fixed] = []
    findings: list[Finding] = []
    for each in pockets(chosen):
        radius = setting.operation.tool.radius_mm
        wanted = offset_shape(each.region, setting.operation.allowance_mm)
        slots = slot_ways(wanted, radius)
        cleared = _cleared(wanted, slots, each, setting)
        if not cleared.runs:
            findings.append(_too_small(each, setting.operation))
            continue
        outline = each.region[0]
        items.append(Fixed(tuple(cleared.runs), setting, each.name, each.source, outline))
        findings += [_changed(each, *change) for change in cleared.changed.items()]
        findings += [_slot(each, slot, setting.operation) for slot in slots]
        hair_mm = 2.0 * SLOT_TOLERANCE * setting.operation.tool.diameter_mm if slots else 0.0
        findings += unreached_findings(wanted, setting, hair_mm=hair_mm)
    return Work(tuple(items), tuple(findings))


def pockets(chosen: Chosen) -> list[Pocket]:
    """The regions that the closed paths enclose, each outer path with the islands in it."""
    nest = nesting(chosen.lines)
    lines = oriented(chosen.lines)
    found = []
    for row in np.flatnonzero(nest.depth % 2 == 0).tolist():
        islands = np.flatnonzero((nest.parent == row) & (nest.depth % 2 == 1)).tolist()
        region = lines.select([row, *islands])
        found.append(Pocket(region, chosen.names[row], int(chosen.source[row])))
    return found


def _cleared(wanted: Polylines, slots: list[Floats], each: Pocket, setting: Setting) -> Cleared:
    """The runs of one region: each connected region of the tool's middle, then the slots."""
    groups: list[list[Run]] = []
    changed: dict[str, Run] = {}
    tool_region = offset_shape(wanted, setting.operation.tool.radius_mm)
    for part in parts_of(tool_region):
        whole, runs = Rails(part), list[Run]()
        for way, middle in _ways(part, setting.operation):
            down = down_for(way, middle, whole, setting)
            runs += lowered(way, down, over_floor(whole), setting, each.name)
            changed.setdefault(down.changed, runs[0])
        groups.append(runs)
    for way in slots:
        down = down_for(way, None, None, setting)
        groups.append(lowered(way, down, back_along(way), setting, each.name))
        changed.setdefault(down.changed, groups[-1][0])
    changed.pop("", None)
    return Cleared(_nearest_next(groups), changed)


def _nearest_next(groups: list[list[Run]]) -> list[Run]:
    """All runs, after those of one connected region those of the one whose begin is nearest."""
    runs: list[Run] = []
    left = list(groups)
    while left:
        here = runs[-1].vertices[-1, :2] if runs else left[0][0].vertices[0, :2]
        begins = np.array([group[0].vertices[0, :2] for group in left])
        runs += left.pop(int(np.hypot(*(begins - here).T).argmin()))
    return runs


def _ways(part: Polylines, operation: Operation) -> Iterator[tuple[Floats, Rails]]:
    """The ways through one connected region of the tool's middle, each with the region in whose
    middle there is the most room to go down."""
    radius = operation.tool.radius_mm
    step = operation.step_over * operation.tool.diameter_mm
    forward = operation.direction != "conventional"
    if operation.pattern == "zigzag":
        for way in zigzag_ways(part, Scan(step, radius, operation.angle_rad, forward)):
            yield way, Rails(part)
        return
    steps = Steps(step, radius, forward, operation.entry.kind == "helix")
    ways, first = ring_ways(ring_cells(part, steps), steps)
    for way in ways:
        yield way, first.rails


def _check(chosen: Chosen, operation: Operation) -> None:
    """OptionError for what cannot be a pocket."""
    where = f"operation {operation.name or operation.kind!r}"
    if operation.tool.radius_mm == 0.0 and len(chosen.lines):
        raise OptionError(
            "a pocket needs a tool that cuts a width",
            where=f"{where}, key tool",
            mend="give the tool a diameter",
        )
    if not chosen.lines.closed.all():
        row = int(np.argmin(chosen.lines.closed))
        place = at_place(chosen.names[row], chosen.lines[row].start.tolist())
        raise OptionError(
            f"a pocket of the open path {place}",
            where=where,
            mend="close it (perhaps --gap), or take it out by layer or colour",
        )
    segments = Segments.of(chosen.lines)
    found = self_crossings(segments)
    met, crosses = meetings(segments, found.row_a, found.row_b)
    if crosses.any():
        first = int(np.argmax(crosses))
        one, other = (int(segments.path[rows[first]]) for rows in (met.row_a, met.row_b))
        raise OptionError(
            f"a pocket of paths that cross: {chosen.names[one]} and"
            f" {at_place(chosen.names[other], met.point[first].tolist())}",
            where=where,
            mend="unite or part them in the drawing: what is inside is not clear",
        )


def _check_step(chosen: Chosen, operation: Operation) -> None:
    """OptionError for a step-over that would take for ever."""
    step = operation.step_over * operation.tool.diameter_mm
    size = float(np.ptp(extents(chosen.lines), axis=1).max()) if len(chosen.lines) else 0.0
    if size > MOST_WAYS * step:
        raise OptionError(
            f"steps of {step:g} mm go more than {MOST_WAYS} times into {size:g} mm",
            where=f"operation {operation.name or operation.kind!r}, key step_over",
            mend="give a larger step-over, or a larger tool",
        )


def _too_small(each: Pocket, operation: Operation) -> Finding:
    area = float(signed_areas(each.region).sum())
    return Finding(
        Code.CONTOUR_TOO_SMALL,
        Severity.WARNING,
        f"{tool_name(operation.tool)} does not fit into this pocket of {area:.6g} mm²:"
        " it is not cut",
        where=at_place(each.name, extents(each.region).mean(axis=1).tolist()),
        measured=area,
        unit="mm2",
    )


def _changed(each: Pocket, change: str, run: Run) -> Finding:
    return Finding(
        Code.ENTRY_CHANGED,
        Severity.WARNING,
        f"the tool goes down by {change}, which does not fit",
        where=at_place(each.name, run.vertices[0, :2].tolist()),
    )


def _slot(each: Pocket, slot: Floats, operation: Operation) -> Finding:
    return Finding(
        Code.SLOT_AS_WIDE,
        Severity.INFO,
        f"a slot as wide as {tool_name(operation.tool)} is cut along its middle",
        where=at_place(each.name, slot[0, :2].tolist()),
        measured=operation.tool.diameter_mm,
        unit="mm",
    )
