"""Holes that `camtool job new` proposes: points, small circles, circles as wide as a drill."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of

SMALL_HOLE = 0.1
"""Without a tool, circles up to this part of the drawing's longer side are taken for holes."""


def propose(left: Remaining) -> list[Part]:
    """Holes at the points, and in the circles that are small, or fit a drill or the tool."""
    tool = left.proposal.tool_mm
    if left.habit == "pocket":
        return []
    if not tool:
        circles = [circle_of(left.drawing.paths[row]) for row in left.rows]
        limit = SMALL_HOLE * left.size_mm
        are_small = all(circle and circle[1] <= limit for circle in circles)
        if are_small and not left.is_divided:
            return [Part(left.title, "drill", left.rows, left.marks)]
    drills = left.proposal.tools("drill")
    found: list[Part] = []
    if left.marks:
        select = (("select", '["point"]', ""),) if left.rows or left.is_divided else ()
        bit = drills[-1] if drills else None
        said = "" if bit is None else f" with {bit.name}, the finest drill"
        why = f"points are drilled{said}; a point says no diameter"
        name = f"{left.title} points"
        tool_name = bit.name if bit else ""
        part = Part(name, "drill", (), left.marks, select, "", tool_name, why, ("engrave",))
        found.append(part)
    if not tool:
        return found
    holes = left.holes
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
        why = f"circles as wide as the {'drill ' + name if name else 'mill'} are drilled"
        called = f"{left.title} drilled {name}".rstrip()
        found.append(Part(called, "drill", fits, 0, keys, "", name, why))
        holes = {row: hole for row, hole in holes.items() if row not in fits}
    return found
