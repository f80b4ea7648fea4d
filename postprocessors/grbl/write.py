"""Writing grbl 1.1: what it has of its own beside `gcode/write.py`."""

from __future__ import annotations

from dataclasses import replace

from camtool.toolpath.moves import Kind, Toolpath, mounted_before
from camtool.toolpath.program import Program

from ..gcode.write import Event, Style, common_words, tool_number, write_modal
from .dialect import MOST_TOOL, Dialect, GrblMachine
from .findings import EVENT_LEFT_OUT

HEADER = ("G17 G21 G90 G94", "G54")
"""XY plane, mm, absolute, feeds a minute; the first work frame. In grbl I and J are always
offsets, so G91.1 is not written."""


def write_program(toolpath: Toolpath, machine: GrblMachine) -> Program:
    """The program; PostError names the move that cannot be written or done."""
    dialect = machine.dialect
    style = Style(dialect, HEADER, lambda event: _words(event, dialect))
    program = write_modal(toolpath, machine, style)
    if dialect.tool_change == "pause" or not mounted_before(toolpath).any():
        return program
    return replace(program, findings=(*program.findings, EVENT_LEFT_OUT()))


def _words(event: Event, dialect: Dialect) -> str:
    """The block of an event."""
    if event.kind == Kind.TOOL_CHANGE:
        if dialect.tool_change == "refuse" and event.mounted_before:
            return ""
        if dialect.tool_change == "refuse":
            raise event.refuse(
                "grbl knows no tool change",
                "write one program for each tool, or use --set dialect.tool_change=pause",
            )
        if tool_number(event) > MOST_TOOL:
            raise event.refuse(f"grbl's highest tool number is {MOST_TOOL}")
        return f"T{tool_number(event)} M0"
    block = common_words(event)
    if event.kind == Kind.DWELL and event.value > dialect.most_dwell_s:
        raise event.refuse(
            f"a dwell of {event.value:g} s is too long: grbl counts at most"
            f" {dialect.most_dwell_s:g} s",
            "use several dwells",
        )
    return block
