"""Engravings that `camtool job new` proposes: text, open lines, layers whose name says so, and
what is finer than the mills. A V bit of the library cuts them that leaves what is between the
lines."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from camtool.geometry.drawing import Drawing, is_text
from camtool.geometry.measure import extents, signed_areas
from camtool.jobs.template import COLOURS, Part, Remaining
from camtool.operations.engrave.work import leaves_all
from camtool.planning.job import Tool
from camtool.records import replace

TEXT_DEPTH_MM = 0.2

SIZES_TOLD = 4
"""Largest number of hole diameters that are listed."""

MAX_POINTS = 4000
"""In drawings with more vertices the narrowest place is not searched for, and the finest bit is
taken."""


def propose(paths: Remaining) -> list[Part]:
    """Return the proposed operations that engrave text, open paths, and closed paths that the end
    mills are too wide for; or all that is left, if the name of the layer asks for it."""
    sources, closed = paths.drawing.sources, paths.drawing.paths.closed
    parts: list[Part] = []
    text = tuple(row for row in paths.rows if is_text(sources[row]))
    notes = _text_beside_parts(paths.drawing, text) if paths.habit != "engrave" else set()
    keys = (("select", '["text"]', ""),)
    for rows, is_left in (
        (tuple(row for row in text if row not in notes), False),
        (tuple(row for row in text if row in notes), True),
    ):
        if rows:
            name = f"{paths.title} text{' beside parts' if is_left else ''}"
            part = Part(name, "engrave", rows, 0, keys, "not text", is_left=is_left)
            part = _cut(paths, part, "text is engraved", always_deep=True)
            remark = "it does not lie within a part; engrave it with --ask"
            parts.append(replace(part, why=remark) if is_left else part)
    paths = paths.without([Part("", "", text, excludes="not text")])
    open_ = tuple(row for row in paths.rows if not closed[row])
    is_named = paths.habit == "engrave"
    if (paths.rows or paths.marks) and (is_named or (open_ and len(open_) == len(paths.rows))):
        reason = f"{paths.title} is called so" if is_named else "open lines are engraved"
        is_colour = is_named and paths.name in COLOURS
        reason = "lines of this colour are marked" if is_colour else reason
        others = ("profile",) if is_colour and len(open_) < len(paths.rows) else ()
        part = Part(paths.title, "engrave", paths.rows, paths.marks, others=others)
        parts.append(_cut(paths, part, reason))
        return parts
    if open_:
        select = (("select", '["open"]', ""),)
        part = Part(f"{paths.title} open", "engrave", open_, 0, select)
        parts.append(_cut(paths, part, "open lines are engraved"))
    if not paths.proposal.tool_mm or paths.habit == "pocket":
        return parts
    branched = [row for row in paths.branched if closed[row]]
    mills = [tool.diameter_mm for tool in paths.proposal.finer_mills]
    finest = mills[-1] if mills else paths.proposal.tool_mm
    drilled = [row for row, width in paths.holes.items() if paths.proposal.has_drill(width)]
    small = tuple(row for row in paths.crowded(finest) if row not in drilled)
    holes = {row: width for row, width in paths.holes.items() if row in small and width < finest}
    for rows, name, reason in (
        (tuple(holes), "holes", _undrilled(holes.values(), finest)),
        (
            tuple(row for row in small if row not in holes),
            "fine",
            f"lines too near to each other, or too small within, for a mill of {finest:g} mm:"
            " marked (a finer mill in the library, or more room, would cut them)",
        ),
    ):
        if rows:
            part = _cut(paths, Part(f"{paths.title} {name}", "engrave", rows), reason)
            parts.append(replace(part, others=("profile",)))
    unclear = tuple(row for row in branched if row not in small)
    if unclear:
        part = Part(f"{paths.title} branched", "engrave", unclear)
        reason = "more than two ends meet, so that it is not clear what they enclose: marked"
        parts.append(replace(_cut(paths, part, reason), others=("profile",)))
    return parts


def _undrilled(widths_mm: Collection[float], mill_mm: float) -> str:
    """Return the reason why holes are only marked, with the drill diameters that would
    make them."""
    sizes = sorted({round(width, 2) for width in widths_mm})
    listed = ", ".join(f"{size:g}" for size in sizes[:SIZES_TOLD])
    more = ", …" if len(sizes) > SIZES_TOLD else ""
    return (
        f"holes narrower than the mill of {mill_mm:g} mm are marked: the library has no drill of"
        f" {listed}{more} mm with presets for the material; add one to drill them"
    )


def _text_beside_parts(drawing: Drawing, text: Sequence[int]) -> set[int]:
    """Return the rows of texts that lie beside the parts or across their edges, as notes do. Texts
    larger than every part are not counted."""
    lines, levels = drawing.paths, drawing.nesting.levels
    lettered = np.array([is_text(source) for source in drawing.sources], dtype=np.bool_)
    edges = np.flatnonzero(lines.closed & ~lettered)
    largest = np.abs(signed_areas(lines.select(edges))).max(initial=0.0)
    by_source: dict[str, list[int]] = {}
    for row in text:
        by_source.setdefault(drawing.sources[row], []).append(row)
    notes = set[int]()
    for rows in by_source.values():
        size = np.ptp(extents(lines.select(rows)), axis=1)
        if float(size.prod()) >= largest:
            continue
        for row in rows:
            holder = int(levels.parent[row])
            while 0 <= holder < len(lettered) and lettered[holder]:
                holder = int(levels.parent[holder])
            if holder < 0:
                notes.update(rows)
    return notes


def _cut(remaining: Remaining, part: Part, reason: str, *, always_deep: bool = False) -> Part:
    """Return the part with a depth, the V bit that fits between its lines, and the reason. Without
    V bits the depth is set only if `always_deep`."""
    bits = remaining.proposal.tools("v")
    if not bits and not always_deep:
        return replace(part, why=reason)
    remark = "" if bits else "a V bit makes finer letters"
    keys = (*part.keys, ("depth", f'"{TEXT_DEPTH_MM:g}mm"', remark))
    bit_tool = _fitting(remaining, part.rows, bits) if bits else None
    with_bit = (
        ""
        if bit_tool is None
        else f" with {bit_tool.name}, {_width(bit_tool):.2g} mm wide at this depth"
    )
    name = "" if bit_tool is None else bit_tool.name
    return replace(part, keys=keys, tool=name, why=f"{reason}{with_bit}")


def _fitting(remaining: Remaining, rows: Sequence[int], bits: Sequence[Tool]) -> Tool:
    """Return the widest V bit whose groove keeps the material between the lines, or else the
    narrowest bit."""
    lines = remaining.drawing.paths.select(rows)
    widest = sorted(bits, key=_width, reverse=True)
    if len(lines.vertices) <= MAX_POINTS:
        for bit_tool in widest:
            if leaves_all(lines, _width(bit_tool)):
                return bit_tool
    return widest[-1]


def _width(bit_tool: Tool) -> float:
    return 2.0 * bit_tool.radius_at(TEXT_DEPTH_MM)
