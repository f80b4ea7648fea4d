"""Profiles that `camtool job new` proposes: closed contours; with a tool, slots, windows and
outlines, each with a mill that has room."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from camtool.arrays import distinct
from camtool.geometry.measure import path_extents, path_lengths
from camtool.jobs.template import Part, Remaining
from camtool.jobs.widths import SLOT_MM, is_slot
from camtool.planning.job import Tool

Keys = tuple[tuple[str, str, str], ...]

MAX_TABS = 4

MIN_TAB_HEIGHT_MM = 0.5


def propose(remaining: Remaining) -> list[Part]:
    """Return one proposed operation for all closed contours. If the tool is known, return instead
    one for slots of its width, one for windows and one for outlines (with tabs if the stock is
    known), and others for contours that need a finer mill."""
    if not remaining.proposal.tool_mm:
        select = (("select", '["closed"]', ""),) if remaining.is_divided else ()
        return (
            [Part(remaining.title, "profile", remaining.contours, 0, select)]
            if remaining.contours
            else []
        )
    subject: list[Part] = []
    inner, outer = remaining.contours_that_are("inner"), remaining.contours_that_are("outer")
    tool, paths = remaining.proposal.tool_mm, remaining.drawing.paths
    slots = [
        row for row, slot in zip(inner, is_slot(paths.select(inner), tool), strict=True) if slot
    ]
    if slots:
        keys: Keys = (
            ("select", '["inner", "not circle"]', ""),
            ("allowance", f'"{-SLOT_MM:g}mm"', "so that the tool goes through"),
        )
        reason = "slots as wide as the mill: once along the middle and back"
        subject.append(
            Part(f"{remaining.title} slots", "profile", tuple(slots), 0, keys, "", "", reason)
        )
    crowd = set(remaining.crowded(tool)) - set(slots)
    mill = _finer(remaining, crowd)
    for rows, words, name in (
        (inner, _inner_words(remaining, inner), "inner"),
        (outer, '["outer"]', "outer"),
    ):
        main = tuple(row for row in rows if row not in crowd and row not in slots)
        fine = tuple(row for row in rows if row in crowd)
        head: Keys = (("select", words, ""), ("entry", '"ramp:3deg"', ""))
        what = "windows" if name == "inner" else "outlines"
        for tabs, some in _by_tabs(remaining, main, tool) if main else ():
            why = f"{what} are cut along the line{', held by tabs' if tabs else ''}"
            keys = (*head, *tabs)
            subject.append(
                Part(f"{remaining.title} {name}", "profile", tuple(some), 0, keys, why=why)
            )
        if fine and mill is not None:
            why = f"there is no room for a mill of {tool:g} mm, but for {mill.name}"
            called = f"{remaining.title} fine {name}"
            for tabs, some in _by_tabs(remaining, fine, mill.diameter_mm):
                keys = (*head, *tabs)
                part = Part(called, "profile", tuple(some), 0, keys, "", mill.name, why)
                subject.append(part)
    return subject


def _inner_words(remaining: Remaining, rows: Sequence[int]) -> str:
    """Return the words of `select` for contours within parts; they leave circles out if none of
    the rows is one."""
    other_rows = set(remaining.contours_that_are("inner", "not circle"))
    return '["inner", "not circle"]' if set(rows) <= other_rows else '["inner"]'


def _finer(remaining: Remaining, rows: Collection[int]) -> Tool | None:
    """Return the widest end mill of the library that has room beside and within all these
    contours, None if there is none."""
    for mill in remaining.proposal.finer_mills if rows else ():
        if not set(remaining.crowded(mill.diameter_mm)) & set(rows):
            return mill
    return None


def _by_tabs(
    remaining: Remaining, rows: Sequence[int], tool: float
) -> list[tuple[Keys, list[int]]]:
    """Return (key for tabs, rows of the contours that get it) for each number of tabs. Tabs are
    twice the tool's diameter wide; a contour gets at most MAX_TABS, and no more than leave as much
    of it free as they take. Larger contours get at least as many as smaller ones, so that the
    operations can select by size."""
    thickness = remaining.proposal.thickness_mm
    if not thickness:
        return [((), list(rows))]
    lines = remaining.drawing.paths.select(rows)
    sizes, of = np.unique(
        np.ptp(path_extents(lines), axis=2).max(axis=1).round(3), return_inverse=True
    )
    room = 0.5 * (path_lengths(lines) + math.pi * tool) / (3.0 * tool)
    fewest = np.full(len(sizes), MAX_TABS, dtype=np.int64)
    np.minimum.at(fewest, of, room.astype(np.int64))
    counts = np.minimum.accumulate(fewest[::-1])[::-1][of]
    # Tabs are measured from the full depth of the cut, which is below the stock.
    height = min(max(thickness / 3.0, MIN_TAB_HEIGHT_MM), thickness)
    height += remaining.proposal.breakthrough_mm
    groups: list[tuple[Keys, list[int]]] = []
    for count in distinct(counts).tolist():
        tabs = f'"{count}:{2.0 * tool:.3g}mm:{height:.3g}mm"'
        key = (("tabs", tabs, "so that it stays where it is; cut them by hand"),)
        groups.append((key if count else (), np.array(rows)[counts == count].tolist()))
    return groups
