"""Bores that `camtool job new` proposes: circles within parts that are wider than the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of
from camtool.planning.ramps import MIN_HELIX_SHARE

HALF = 0.5
"""Counterbores of unknown depth go so far into the stock."""

ENTRY = ("entry", '"helix:3deg"', "how steeply it goes down")


def propose(left: Remaining) -> list[Part]:
    """Return one operation for the circles in which the tool has room to go round."""
    tool, least = left.proposal.tool_mm, left.proposal.tool_mm + HOLE_SIZE_MM
    if not tool or left.habit == "pocket":
        return []
    widths = {row: width for row, width in left.holes.items() if width > least}
    wider = tuple(widths)
    keys = (
        ("select", '["inner", "circle"]', ""),
        ("select_size", f'"{least:.6g}mm.."', "wider than the tool"),
        ENTRY,
    )
    narrow = sum(width < tool * (1.0 + MIN_HELIX_SHARE) for width in widths.values())
    plunged = (
        f"; {narrow} of them hardly wider: plunged in pecks, then once round" if narrow else ""
    )
    why = f"circles wider than the mill are bored{plunged}"
    found = _stepped(left)
    if wider:
        found.append(Part(f"{left.title} holes", "bore", wider, 0, keys, "", "", why))
    return found


def _stepped(left: Remaining) -> list[Part]:
    """Return the counterbores of the stock whose thickness is known, and the holes in them and in
    countersinks."""
    found = [counterbore(left, wide)] if (wide := _wider(left)) else []
    holes = [row for row in left.rows if row in left.steps.holes]
    bored = {row: circle_of(left.drawing.paths[row]) for row in holes}
    widths = {row: circle[1] for row, circle in bored.items() if circle}
    drills = {tool.name: tool.diameter_mm for tool in left.proposal.tools("drill")}
    drills[""] = left.proposal.tool_mm
    name = f"{left.title} stepped holes"
    said = "the hole in a counterbore or countersink goes on through the stock"
    for drill, width in drills.items():
        fits = tuple(row for row, hole in widths.items() if abs(hole - width) <= HOLE_SIZE_MM)
        if fits:
            found.append(Part(name, "drill", fits, 0, (), "", drill, said))
        widths = {row: hole for row, hole in widths.items() if row not in fits}
    if widths:
        found.append(Part(name, "bore", tuple(widths), 0, (ENTRY,), "", "", said))
    return found


def _wider(left: Remaining) -> tuple[int, ...]:
    return tuple(row for row in left.rows if row in left.steps.bored)


def counterbore(left: Remaining, rows: tuple[int, ...]) -> Part:
    """Return the operation for the wider circles of counterbores."""
    deep = left.depth_mm or HALF * left.proposal.thickness_mm
    why = f"two circles about one centre are a counterbore; the wider is {deep:g} mm deep"
    keys = (("depth", f'"{deep:g}mm"', "of the counterbore"), ENTRY)
    return Part(f"{left.title} counterbored", "bore", rows, 0, keys, why=why, others=("profile",))
