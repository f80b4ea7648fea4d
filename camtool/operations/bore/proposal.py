"""Bores that `camtool job new` proposes: circles within parts that are wider than the tool."""

from __future__ import annotations

from camtool.jobs.template import Part, Remaining
from camtool.planning.holes import HOLE_SIZE_MM, circle_of


def propose(left: Remaining) -> list[Part]:
    """Return one operation for the circles in which the tool has room to go round."""
    paths, least = left.drawing.paths, left.proposal.tool_mm + HOLE_SIZE_MM
    if not left.proposal.tool_mm:
        return []
    inner = left.contours_that_are("inner", "circle")
    wider = tuple(row for row in inner if (circle := circle_of(paths[row])) and circle[1] > least)
    keys = (
        ("select", '["inner", "circle"]', ""),
        ("select_size", f'"{least:.6g}mm.."', "wider than the tool"),
        ("entry", '"helix:3deg"', "how steeply it goes down"),
    )
    return [Part(f"{left.title} holes", "bore", wider, 0, keys)] if wider else []
