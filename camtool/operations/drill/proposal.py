"""Holes that `camtool job new` proposes: points, small circles, circles as wide as a drill."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of

SMALL_HOLE = 0.1
"""Without a tool, circles up to this part of the drawing's longer side are taken for holes."""


def propose(remaining: Remaining) -> list[Part]:
    """Return the proposed operations that drill points, and circles that are small or as wide as
    the tool or a drill of the library."""
    tool = remaining.proposal.tool_mm
    if remaining.habit == "pocket":
        return []
    if not tool:
        circles = [circle_of(remaining.drawing.paths[row]) for row in remaining.rows]
        limit = SMALL_HOLE * remaining.size_mm
        are_small = all(circle and circle[1] <= limit for circle in circles)
        if are_small and not remaining.is_divided:
            return [Part(remaining.title, "drill", remaining.rows, remaining.marks)]
    drills = remaining.proposal.tools("drill")
    parts: list[Part] = []
    if remaining.marks:
        select = (("select", '["point"]', ""),) if remaining.rows or remaining.is_divided else ()
        bit_tool = drills[-1] if drills else None
        with_bit = "" if bit_tool is None else f" with {bit_tool.name}, the finest drill"
        reason = f"points are drilled{with_bit}; a point says no diameter"
        name = f"{remaining.title} points"
        tool_name = bit_tool.name if bit_tool else ""
        part = Part(
            name, "drill", (), remaining.marks, select, "", tool_name, reason, ("engrave",)
        )
        parts.append(part)
    if not tool:
        return parts
    holes = remaining.holes
    sizes = [(each.diameter_mm, each.name) for each in drills]
    for width, name in [*sizes, (tool, "")]:
        fits = tuple(row for row, hole in holes.items() if abs(hole - width) <= HOLE_SIZE_MM)
        if not fits:
            continue
        size = f'"{width - HOLE_SIZE_MM:.6g}..{width + HOLE_SIZE_MM:.6g}mm"'
        keys = (
            ("select", '["inner", "circle"]', ""),
            ("select_size", size, "as wide as the tool"),
        )
        reason = f"circles as wide as the {'drill ' + name if name else 'mill'} are drilled"
        title = f"{remaining.title} drilled {name}".rstrip()
        parts.append(Part(title, "drill", fits, 0, keys, "", name, reason))
        holes = {row: hole for row, hole in holes.items() if row not in fits}
    return parts
