"""Engravings that `camtool job new` proposes: text, open lines, layers whose name says so, and
what is finer than the mills. A V bit of the library cuts them that leaves what is between the
lines."""

from __future__ import annotations

from collections.abc import Sequence

from camtool.geometry.drawing import is_text
from camtool.jobs.template import Part, Remaining
from camtool.operations.engrave.work import leaves_all
from camtool.planning.job import Tool
from camtool.records import replace

TEXT_DEPTH_MM = 0.2

MAX_LINES = 1000
"""Of more lines the narrowest place is not looked for: the finest bit is taken."""


def propose(left: Remaining) -> list[Part]:
    """Engravings of the letters, of the open paths, of what the mills are too wide for, or of all
    that is left."""
    sources, closed = left.drawing.sources, left.drawing.paths.closed
    found: list[Part] = []
    text = tuple(row for row in left.rows if is_text(sources[row]))
    if text:
        keys = (("select", '["text"]', ""),)
        part = Part(f"{left.title} text", "engrave", text, 0, keys, "not text")
        found.append(_cut(left, part, "text is engraved", always_deep=True))
    left = left.without([Part("", "", text, excludes="not text")])
    open_ = tuple(row for row in left.rows if not closed[row])
    is_named = left.habit == "engrave"
    if (left.rows or left.marks) and (is_named or (open_ and len(open_) == len(left.rows))):
        why = f"{left.title} is called so" if is_named else "open lines are engraved"
        found.append(_cut(left, Part(left.title, "engrave", left.rows, left.marks), why))
        return found
    if open_:
        select = (("select", '["open"]', ""),)
        part = Part(f"{left.title} open", "engrave", open_, 0, select)
        found.append(_cut(left, part, "open lines are engraved"))
    if not left.proposal.tool_mm or left.habit == "pocket":
        return found
    branched = [row for row in left.branched if closed[row]]
    mills = [tool.diameter_mm for tool in left.proposal.finer_mills]
    finest = mills[-1] if mills else left.proposal.tool_mm
    drilled = [row for row, width in left.holes.items() if left.proposal.has_drill(width)]
    small = tuple(row for row in left.crowded(finest) if row not in drilled)
    if small:
        part = Part(f"{left.title} fine", "engrave", small)
        why = f"lines too near to each other, or too small within, for a mill of {finest:g} mm"
        found.append(replace(_cut(left, part, f"{why}: marked"), others=("profile",)))
    unclear = tuple(row for row in branched if row not in small)
    if unclear:
        part = Part(f"{left.title} branched", "engrave", unclear)
        why = "more than two ends meet, so that it is not clear what they enclose: marked"
        found.append(replace(_cut(left, part, why), others=("profile",)))
    return found


def _cut(left: Remaining, part: Part, why: str, *, always_deep: bool = False) -> Part:
    """The part with the bit that fits between its lines, its depth, and why."""
    bits = left.proposal.tools("v")
    if not bits and not always_deep:
        return Part(part.name, part.kind, part.rows, part.marks, part.keys, part.excludes, why=why)
    remark = "" if bits else "a V bit makes finer letters"
    keys = (*part.keys, ("depth", f'"{TEXT_DEPTH_MM:g}mm"', remark))
    bit = _fitting(left, part.rows, bits) if bits else None
    said = "" if bit is None else f" with {bit.name}, {_width(bit):.2g} mm wide at this depth"
    name = "" if bit is None else bit.name
    return Part(
        part.name, part.kind, part.rows, part.marks, keys, part.excludes, name, f"{why}{said}"
    )


def _fitting(left: Remaining, rows: Sequence[int], bits: Sequence[Tool]) -> Tool:
    """The bit of the widest groove that keeps what is between the lines, or else the finest."""
    lines = left.drawing.paths.select(rows)
    widest = sorted(bits, key=_width, reverse=True)
    if len(rows) <= MAX_LINES:
        for bit in widest:
            if leaves_all(lines, _width(bit)):
                return bit
    return widest[-1]


def _width(bit: Tool) -> float:
    return 2.0 * bit.radius_at(TEXT_DEPTH_MM)
