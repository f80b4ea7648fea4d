"""Pockets that `camtool job new` proposes: layers of that name, and windows so small that what
they cut out would come loose as a splinter beside the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.jobs.widths import has_room, is_slot

HALF = 0.5
"""Share of the thickness that a pocket leaves below it, if its depth is not known."""

SPLINTER_SHARE = 4.0
"""Windows that are nowhere wider than this many tool diameters are cleared."""


def propose(remaining: Remaining) -> list[Part]:
    """Return the proposed pocket for a layer whose name asks for it, or for the small windows of
    another layer."""
    tool, paths = remaining.proposal.tool_mm, remaining.drawing.paths
    if not tool:
        return []
    if remaining.habit == "pocket" and remaining.contours:
        thickness = remaining.proposal.thickness_mm
        depth = remaining.depth_mm or HALF * thickness
        cause = f"{remaining.title} is called so: all within is cleared"
        keys: tuple[tuple[str, str, str], ...] = ()
        if remaining.is_divided:
            keys = (("select", '["closed"]', ""),)
        if remaining.depth_mm is None and thickness:
            cause += f"; its name says no depth, as POCKET 2mm would: {depth:g} mm, half the stock"
            keys = (*keys, ("depth", f'"{depth:g}mm"', "half the stock"))
        other_kinds = ("profile",) if remaining.depth_mm is None else ()
        return [
            Part(
                remaining.title, "pocket", remaining.contours, 0, keys, "", "", cause, other_kinds
            )
        ]
    windows = remaining.contours_that_are("inner")
    if not windows:
        return []
    lines = paths.select(windows)
    parents = set(remaining.drawing.nesting.levels.parent.tolist())
    too_fine = set(remaining.crowded(tool))
    is_splinter = ~has_room(lines, 0.5 * SPLINTER_SHARE * tool) & ~is_slot(lines, tool)
    rows = [row for row, fits in zip(windows, is_splinter.tolist(), strict=True) if fits]
    rows = [row for row in rows if row not in parents and row not in too_fine]
    keys = (("select", '["inner"]', ""), ("entry", '"ramp:3deg"', ""))
    cause = (
        f"windows no wider than {SPLINTER_SHARE:g} mills are cleared, so that no piece comes loose"
    )
    return (
        [Part(f"{remaining.title} small", "pocket", tuple(rows), 0, keys, "", "", cause)]
        if rows
        else []
    )
