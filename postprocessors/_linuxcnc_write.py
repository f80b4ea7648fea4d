"""Writing LinuxCNC: what it has of its own beside `_gcode_write`."""

from __future__ import annotations

from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program

from ._gcode_events import Event, common_words, tool_number
from ._gcode_format import NumberStyle, say_number
from ._gcode_write import Style, write_program
from ._linuxcnc_options import Dialect, dialect_of

MODES = "G17 G21 G40 G49 G54 G80 G90 G91.1 G94"
"""XY plane, mm, no cutter radius, no tool length, the first work frame, no cycle, absolute, I J as
offsets, feeds a minute: whatever the last program left."""

MOST_TOOL = 99_999
"""Ours: LinuxCNC's tool tables hold far fewer."""

TOLERANCE = NumberStyle(6, strip=True)


def write_linuxcnc(toolpath: Toolpath, machine: Machine) -> Program:
    """The program; PostError names the move that cannot be said or done."""
    dialect = dialect_of(machine)
    style = Style(
        dialect,
        (MODES, _path_mode(dialect)),
        _words,
        message="MSG,",
        frame="%" if dialect.percent else "",
    )
    return write_program(toolpath, machine, style)


def _path_mode(dialect: Dialect) -> str:
    if dialect.path == "exact-path":
        return "G61"
    if dialect.path == "exact-stop":
        return "G61.1"
    return f"G64 P{say_number(dialect.blend_tolerance_mm, TOLERANCE)}"


def _words(event: Event) -> str:
    """The block of an event."""
    if event.kind == Kind.TOOL_CHANGE:
        if tool_number(event) > MOST_TOOL:
            raise event.refuse(f"tools end at {MOST_TOOL}")
        return f"T{tool_number(event)} M6"
    return common_words(event)
