"""Holes that `camtool job new` proposes: points, small circles, circles as wide as the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of

SMALL_HOLE = 0.1
"""Without a tool, circles up to this part of the drawing's longer side are taken for holes."""


def propose(left: Remaining) -> list[Part]:
    """Holes at the points, and in the circles that are small, or fit the tool."""
    paths, tool = left.drawing.paths, left.proposal.tool_mm
    circles = {row: circle_of(paths[row]) for row in left.rows}
    limit = SMALL_HOLE * left.size_mm
    are_small = all(circle and circle[1] <= limit for circle in circles.values())
    if are_small and not left.is_divided and not tool:
        return [Part(left.title, "drill", left.rows, left.marks)]
    found: list[Part] = []
    if left.marks:
        select = (("select", '["point"]', ""),) if left.rows or left.is_divided else ()
        found.append(Part(f"{left.title} points", "drill", (), left.marks, select))
    if not tool:
        return found
    inner = left.contours_that_are("inner", "circle")
    wide = {row: circle[1] for row in inner if (circle := circles[row])}
    fits = tuple(row for row, width in wide.items() if abs(width - tool) <= HOLE_SIZE_MM)
    if fits:
        size = f'"{tool - HOLE_SIZE_MM:.6g}..{tool + HOLE_SIZE_MM:.6g}mm"'
        words = ("select", '["inner", "circle"]', "")
        keys = (words, ("select_size", size, "as wide as the tool"))
        found.append(Part(f"{left.title} drilled", "drill", fits, 0, keys))
    return found
