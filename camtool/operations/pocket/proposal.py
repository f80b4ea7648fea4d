"""Pockets that `camtool job new` proposes: layers of that name, and windows so small that what
they cut out would come loose as a splinter beside the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.jobs.widths import has_room, is_slot

HALF = 0.5
"""A pocket of unknown depth leaves this part of the stock below it."""

SPLINTER_SHARE = 4.0
"""Windows that are nowhere wider than so many times the tool are cleared."""


def propose(left: Remaining) -> list[Part]:
    """Return one operation for a layer of pockets, or for the small windows of another one."""
    tool, paths = left.proposal.tool_mm, left.drawing.paths
    if not tool:
        return []
    if left.habit == "pocket" and left.contours:
        thickness = left.proposal.thickness_mm
        deep = left.depth_mm or HALF * thickness
        why = f"{left.title} is called so: all within is cleared"
        keys: tuple[tuple[str, str, str], ...] = ()
        if left.is_divided:
            keys = (("select", '["closed"]', ""),)
        if left.depth_mm is None and thickness:
            why += f"; its name says no depth, as POCKET 2mm would: {deep:g} mm, half the stock"
            keys = (*keys, ("depth", f'"{deep:g}mm"', "half the stock"))
        others = ("profile",) if left.depth_mm is None else ()
        return [Part(left.title, "pocket", left.contours, 0, keys, "", "", why, others)]
    windows = left.contours_that_are("inner")
    if not windows:
        return []
    lines = paths.select(windows)
    parents = set(left.drawing.nesting.levels.parent.tolist())
    too_fine = set(left.crowded(tool))
    small = ~has_room(lines, 0.5 * SPLINTER_SHARE * tool) & ~is_slot(lines, tool)
    rows = [row for row, fits in zip(windows, small.tolist(), strict=True) if fits]
    rows = [row for row in rows if row not in parents and row not in too_fine]
    keys = (("select", '["inner"]', ""), ("entry", '"ramp:3deg"', ""))
    why = (
        f"windows no wider than {SPLINTER_SHARE:g} mills are cleared, so that no piece comes loose"
    )
    return (
        [Part(f"{left.title} small", "pocket", tuple(rows), 0, keys, "", "", why)] if rows else []
    )
