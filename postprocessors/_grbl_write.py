"""Writing grbl 1.1: what it has of its own beside `_gcode_write`."""

from __future__ import annotations

from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program

from ._gcode_events import Event, common_words, tool_number
from ._gcode_write import Style, write_program
from ._grbl_options import Dialect, dialect_of

HEADER = ("G17 G21 G90 G94", "G54")
"""XY plane, mm, absolute, feeds a minute; the first work frame. grbl knows I J as offsets only,
so it is not told so (G91.1)."""

MOST_TOOL = 255
"""`MAX_TOOL_NUMBER` of grbl's gcode.c."""


def write_grbl(toolpath: Toolpath, machine: Machine) -> Program:
    """The program; PostError names the move that cannot be said or done."""
    dialect = dialect_of(machine)
    style = Style(dialect, HEADER, lambda event: _words(event, dialect))
    return write_program(toolpath, machine, style)


def _words(event: Event, dialect: Dialect) -> str:
    """The block of an event."""
    if event.kind == Kind.TOOL_CHANGE:
        if dialect.tool_change == "refuse":
            raise event.refuse(
                "grbl knows no tool change",
                "write one program for each tool, or use --set dialect.tool_change=pause",
            )
        if tool_number(event) > MOST_TOOL:
            raise event.refuse(f"grbl's tools end at {MOST_TOOL}")
        return f"T{tool_number(event)} M0"
    block = common_words(event)
    if event.kind == Kind.DWELL and event.value > dialect.most_dwell_s:
        raise event.refuse(
            f"a dwell of {event.value:g} s; grbl counts at most {dialect.most_dwell_s:g} s",
            "use several dwells",
        )
    return block
