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


def propose(paths: Remaining) -> list[Part]:
    """Engravings of the letters, of the open paths, of what the mills are too wide for, or of all
    that is left."""
    sources, closed = paths.drawing.sources, paths.drawing.paths.closed
    parts: list[Part] = []
    text = tuple(row for row in paths.rows if is_text(sources[row]))
    if text:
        keys = (("select", '["text"]', ""),)
        part = Part(f"{paths.title} text", "engrave", text, 0, keys, "not text")
        parts.append(_cut(paths, part, "text is engraved", always_deep=True))
    paths = paths.without([Part("", "", text, excludes="not text")])
    open_ = tuple(row for row in paths.rows if not closed[row])
    is_named = paths.habit == "engrave"
    if (paths.rows or paths.marks) and (is_named or (open_ and len(open_) == len(paths.rows))):
        reason = f"{paths.title} is called so" if is_named else "open lines are engraved"
        parts.append(
            _cut(
                paths,
                Part(paths.title, "engrave", paths.rows, paths.marks),
                reason,
            )
        )
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
    if small:
        part = Part(f"{paths.title} fine", "engrave", small)
        why = f"lines too near to each other, or too small within, for a mill of {finest:g} mm"
        why += ": marked (a finer mill in the library, or more room, would cut them)"
        parts.append(replace(_cut(paths, part, why), others=("profile",)))
    unclear = tuple(row for row in branched if row not in small)
    if unclear:
        part = Part(f"{paths.title} branched", "engrave", unclear)
        reason = "more than two ends meet, so that it is not clear what they enclose: marked"
        parts.append(replace(_cut(paths, part, reason), others=("profile",)))
    return parts


def _cut(remaining: Remaining, part: Part, reason: str, *, always_deep: bool = False) -> Part:
    """The part with the bit that fits between its lines, its depth, and why."""
    bits = remaining.proposal.tools("v")
    if not bits and not always_deep:
        return Part(
            part.name, part.kind, part.rows, part.marks, part.keys, part.excludes, why=reason
        )
    remark = "" if bits else "a V bit makes finer letters"
    keys = (*part.keys, ("depth", f'"{TEXT_DEPTH_MM:g}mm"', remark))
    vbit = _fitting(remaining, part.rows, bits) if bits else None
    words = "" if vbit is None else f" with {vbit.name}, {_width(vbit):.2g} mm wide at this depth"
    name = "" if vbit is None else vbit.name
    return Part(
        part.name,
        part.kind,
        part.rows,
        part.marks,
        keys,
        part.excludes,
        name,
        f"{reason}{words}",
    )


def _fitting(remaining: Remaining, rows: Sequence[int], bits: Sequence[Tool]) -> Tool:
    """The bit of the widest groove that keeps what is between the lines, or else the finest."""
    lines = remaining.drawing.paths.select(rows)
    widest = sorted(bits, key=_width, reverse=True)
    if len(rows) <= MAX_LINES:
        for bit_tool in widest:
            if leaves_all(lines, _width(bit_tool)):
                return bit_tool
    return widest[-1]


def _width(bit_tool: Tool) -> float:
    return 2.0 * bit_tool.radius_at(TEXT_DEPTH_MM)
