"""Profiles that `camtool job new` proposes: closed contours; with a tool, the outer ones last."""

from __future__ import annotations

import math
from collections.abc import Sequence

from camtool.geometry.measure import path_lengths
from camtool.jobs.template import Part, Remaining

MAX_TABS = 4

MIN_TAB_HEIGHT_MM = 0.5


def propose(left: Remaining) -> list[Part]:
    """Return one operation for all closed contours; where the tool is known, one for those within
    parts and one for the outer ones, with tabs where the stock is known too."""
    if not left.proposal.tool_mm:
        select = (("select", '["closed"]', ""),) if left.is_divided else ()
        return [Part(left.title, "profile", left.contours, 0, select)] if left.contours else []
    found: list[Part] = []
    keys: tuple[tuple[str, str, str], ...]
    inner = left.contours_that_are("inner", "not circle")
    if inner:
        keys = (("select", '["inner", "not circle"]', ""), ("entry", '"ramp:3deg"', ""))
        found.append(Part(f"{left.title} inner", "profile", inner, 0, keys))
    outer = left.contours_that_are("outer")
    if outer:
        keys = (("select", '["outer"]', ""), ("entry", '"ramp:3deg"', ""), *_tabs(left, outer))
        found.append(Part(f"{left.title} outer", "profile", outer, 0, keys))
    return found


def _tabs(left: Remaining, outlines: Sequence[int]) -> tuple[tuple[str, str, str], ...]:
    """The key for tabs of twice the tool's diameter: as many as each outline has room for, at most
    MAX_TABS, so that they leave it at least as much as they take."""
    tool, thickness = left.proposal.tool_mm, left.proposal.thickness_mm
    shortest = float(path_lengths(left.drawing.paths.select(outlines)).min()) + math.pi * tool
    count = min(MAX_TABS, int(0.5 * shortest / (3.0 * tool)))
    if not thickness or not count:
        return ()
    # Tabs are measured from the full depth of the cut, which is below the stock.
    height = min(max(thickness / 3.0, MIN_TAB_HEIGHT_MM), thickness)
    height += left.proposal.breakthrough_mm
    tabs = f'"{count}:{2.0 * tool:.3g}mm:{height:.3g}mm"'
    return (("tabs", tabs, "so that it stays where it is; cut them by hand"),)
