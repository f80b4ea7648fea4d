"""Bores that `camtool job new` proposes: circles within parts that are wider than the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM
from camtool.planning.ramps import MIN_HELIX_SHARE


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
        ("entry", '"helix:3deg"', "how steeply it goes down"),
    )
    narrow = sum(width < tool * (1.0 + MIN_HELIX_SHARE) for width in widths.values())
    plunged = (
        f"; {narrow} of them hardly wider: plunged in pecks, then once round" if narrow else ""
    )
    why = f"circles wider than the mill are bored{plunged}"
    return [Part(f"{left.title} holes", "bore", wider, 0, keys, "", "", why)] if wider else []
