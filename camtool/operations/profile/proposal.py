"""Profiles that `camtool job new` proposes: closed contours; with a tool, slots, windows and
outlines, each with a mill that has room."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from camtool.geometry.measure import path_lengths
from camtool.jobs.template import Part, Remaining
from camtool.jobs.widths import SLOT_MM, is_slot
from camtool.planning.job import Tool

Keys = tuple[tuple[str, str, str], ...]

MAX_TABS = 4

MIN_TAB_HEIGHT_MM = 0.5


def propose(left: Remaining) -> list[Part]:
    """Return one operation for all closed contours; where the tool is known, one for slots of its
    width, one for windows and one for outlines, with tabs where the stock is known too, and others
    for those that need a finer mill."""
    if not left.proposal.tool_mm:
        select = (("select", '["closed"]', ""),) if left.is_divided else ()
        return [Part(left.title, "profile", left.contours, 0, select)] if left.contours else []
    found: list[Part] = []
    inner, outer = left.contours_that_are("inner"), left.contours_that_are("outer")
    tool, paths = left.proposal.tool_mm, left.drawing.paths
    slots = [
        row for row, slot in zip(inner, is_slot(paths.select(inner), tool), strict=True) if slot
    ]
    if slots:
        keys: Keys = (
            ("select", '["inner", "not circle"]', ""),
            ("allowance", f'"{-SLOT_MM:g}mm"', "so that the tool goes through"),
        )
        why = "slots as wide as the mill: once along the middle and back"
        found.append(Part(f"{left.title} slots", "profile", tuple(slots), 0, keys, "", "", why))
    crowd = set(left.crowded(tool)) - set(slots)
    mill = _finer(left, crowd)
    for rows, words, name in (
        (inner, _inner_words(left, inner), "inner"),
        (outer, '["outer"]', "outer"),
    ):
        main = tuple(row for row in rows if row not in crowd and row not in slots)
        fine = tuple(row for row in rows if row in crowd)
        head: Keys = (("select", words, ""), ("entry", '"ramp:3deg"', ""))
        if main:
            tabs = _tabs(left, main, tool)
            what = "windows" if name == "inner" else "outlines"
            why = f"{what} are cut along the line{', held by tabs' if tabs else ''}"
            found.append(Part(f"{left.title} {name}", "profile", main, 0, (*head, *tabs), why=why))
        if fine and mill is not None:
            why = f"there is no room for a mill of {tool:g} mm, but for {mill.name}"
            tabs = _tabs(left, fine, mill.diameter_mm)
            called = f"{left.title} fine {name}"
            part = Part(called, "profile", fine, 0, (*head, *tabs), "", mill.name, why)
            found.append(part)
    return found


def _inner_words(left: Remaining, rows: Sequence[int]) -> str:
    """The words for contours within parts: circles are left out where none of them is one."""
    others = set(left.contours_that_are("inner", "not circle"))
    return '["inner", "not circle"]' if set(rows) <= others else '["inner"]'


def _finer(left: Remaining, rows: Collection[int]) -> Tool | None:
    """The widest end mill of the library that has room beside and within all these contours."""
    for mill in left.proposal.finer_mills if rows else ():
        if not set(left.crowded(mill.diameter_mm)) & set(rows):
            return mill
    return None


def _tabs(left: Remaining, outlines: Sequence[int], tool: float) -> Keys:
    """The key for tabs of twice the tool's diameter: as many as each outline has room for, at most
    MAX_TABS, so that they leave it at least as much as they take."""
    thickness = left.proposal.thickness_mm
    shortest = float(path_lengths(left.drawing.paths.select(outlines)).min()) + math.pi * tool
    count = min(MAX_TABS, int(0.5 * shortest / (3.0 * tool)))
    if not thickness or not count:
        return ()
    # Tabs are measured from the full depth of the cut, which is below the stock.
    height = min(max(thickness / 3.0, MIN_TAB_HEIGHT_MM), thickness)
    height += left.proposal.breakthrough_mm
    tabs = f'"{count}:{2.0 * tool:.3g}mm:{height:.3g}mm"'
    return (("tabs", tabs, "so that it stays where it is; cut them by hand"),)
