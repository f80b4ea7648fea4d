"""Bores that `camtool job new` proposes: circles within parts that are wider than the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of
from camtool.planning.ramps import MIN_HELIX_SHARE

HALF = 0.5
"""Depth of counterbores, over the thickness of the stock, if the drawing does not say it."""

ENTRY = ("entry", '"helix:3deg"', "how steeply it goes down")


def propose(remaining: Remaining) -> list[Part]:
    """Return the proposed operation for the circles within parts that are wider than the tool."""
    tool, min_width = remaining.proposal.tool_mm, remaining.proposal.tool_mm + HOLE_SIZE_MM
    if not tool or remaining.habit == "pocket":
        return []
    widths = {row: width for row, width in remaining.holes.items() if width > min_width}
    wider = tuple(widths)
    keys = (
        ("select", '["inner", "circle"]', ""),
        ("select_size", f'"{min_width:.6g}mm.."', "wider than the tool"),
        ENTRY,
    )
    narrow_count = sum(width < tool * (1.0 + MIN_HELIX_SHARE) for width in widths.values())
    plunged = (
        f"; {narrow_count} of them hardly wider: plunged in pecks, then once round"
        if narrow_count
        else ""
    )
    reason = f"circles wider than the mill are bored{plunged}"
    parts = _stepped(remaining)
    if wider:
        parts.append(Part(f"{remaining.title} holes", "bore", wider, 0, keys, "", "", reason))
    return parts


def _stepped(remaining: Remaining) -> list[Part]:
    """Return the proposed operations for counterbores (where the thickness of the stock is known),
    and for the holes within counterbores and countersinks."""
    parts = [counterbore(remaining, wide)] if (wide := _wider(remaining)) else []
    holes = [row for row in remaining.rows if row in remaining.steps.holes]
    bored = {row: circle_of(remaining.drawing.paths[row]) for row in holes}
    widths = {row: circle[1] for row, circle in bored.items() if circle}
    drills = {tool.name: tool.diameter_mm for tool in remaining.proposal.tools("drill")}
    drills[""] = remaining.proposal.tool_mm
    name = f"{remaining.title} stepped holes"
    reason = "the hole in a counterbore or countersink goes on through the stock"
    for drill, width in drills.items():
        fits = tuple(row for row, hole in widths.items() if abs(hole - width) <= HOLE_SIZE_MM)
        if fits:
            parts.append(Part(name, "drill", fits, 0, (), "", drill, reason))
        widths = {row: hole for row, hole in widths.items() if row not in fits}
    if widths:
        parts.append(Part(name, "bore", tuple(widths), 0, (ENTRY,), "", "", reason))
    return parts


def _wider(remaining: Remaining) -> tuple[int, ...]:
    return tuple(row for row in remaining.rows if row in remaining.steps.bored)


def counterbore(remaining: Remaining, rows: tuple[int, ...]) -> Part:
    """Return the operation that bores the wider circles of counterbores."""
    depth = remaining.depth_mm or HALF * remaining.proposal.thickness_mm
    reason = f"two circles about one centre are a counterbore; the wider is {depth:g} mm deep"
    keys = (("depth", f'"{depth:g}mm"', "of the counterbore"), ENTRY)
    return Part(
        f"{remaining.title} counterbored", "bore", rows, 0, keys, why=reason, others=("profile",)
    )
