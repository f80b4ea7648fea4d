"""Engravings that `camtool job new` proposes: text, open lines, and layers whose name says so."""

from __future__ import annotations

from camtool.geometry.drawing import is_text
from camtool.jobs.template import Part, Remaining
from camtool.records import replace

LAYER_WORDS = ("engrav", "etch", "scribe")
"""A layer with one of these in its name is engraved."""

TEXT_DEPTH_MM = 0.2


def propose(left: Remaining) -> list[Part]:
    """Engravings of the letters, and of the open paths or of all that is left."""
    sources, closed = left.drawing.sources, left.drawing.paths.closed
    found: list[Part] = []
    text = tuple(row for row in left.rows if is_text(sources[row]))
    if text:
        depth = ("depth", f'"{TEXT_DEPTH_MM:g}mm"', "a V bit makes finer letters")
        keys = (("select", '["text"]', ""), depth)
        found.append(Part(f"{left.title} text", "engrave", text, 0, keys, "not text"))
        left = replace(left, rows=tuple(row for row in left.rows if row not in text))
    open_ = tuple(row for row in left.rows if not closed[row])
    is_named = any(word in left.name.casefold() for word in LAYER_WORDS)
    if (left.rows or left.marks) and (is_named or (open_ and len(open_) == len(left.rows))):
        found.append(Part(left.title, "engrave", left.rows, left.marks))
    elif open_:
        select = (("select", '["open"]', ""),)
        found.append(Part(f"{left.title} open", "engrave", open_, 0, select))
    return found
