"""Writing LinuxCNC: what it has of its own beside `gcode/write.py`."""

from __future__ import annotations

from typing import Final

from camtool.records import replace
from camtool.toolpath.moves import Kind, PathMode, Toolpath, mounted_before
from camtool.toolpath.program import Program

from ..gcode.dialect import UNITS, Unit
from ..gcode.findings import EVENT_LEFT_OUT_TOOL
from ..gcode.format import NumberStyle, format_number
from ..gcode.write import Event, ProgramStyle, common_words, tool_number, write_modal
from .controller import LinuxcncModel
from .dialect import LinuxcncDialect, LinuxcncMachine

MODES: Final = "{plane} {unit} G40{length} G54 G80 G90 G91.1 G94"
"""The plane, mm or inches, no cutter radius, no tool length where the machine uses none, the first
work frame, no cycle, absolute, I J as offsets, feeds a minute: whatever the last program left."""

MAX_TOOL: Final = 99_999
"""Our choice: LinuxCNC's tool tables hold far fewer."""

TOLERANCE: Final = NumberStyle(6, strip=True)
"""Tolerances of corners in mm; in inches they have as many decimals more as coordinates."""


def write_program(toolpath: Toolpath, machine: LinuxcncMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    dialect, unit = machine.dialect, UNITS[machine.dialect.units]
    # The length in force belongs to the tool in the spindle, as does a zero set with that tool.
    no_length = "" if dialect.tool_lengths else " G49"
    is_lathe = machine.spindle.turns == "work"
    plane = "G18 G8" if is_lathe else "G17"
    style = ProgramStyle(
        dialect,
        (MODES.format(plane=plane, unit=unit.word, length=no_length),),
        lambda event: _words(event, dialect),
        message="MSG,",
        frame="%" if dialect.percent else "",
        path_mode=lambda mode: _path_mode(mode, unit),
        cycles=dialect.canned_cycles,
        change_first=dialect.tool_lengths and dialect.tool_change == "m6",
        model=LinuxcncModel(),
        own_mode=PathMode(dialect.path, dialect.blend_tolerance_mm, dialect.blend_tolerance_mm),
        axes=("Z", "X", "") if is_lathe else ("X", "Y", "Z"),
        offsets=("K", "I") if is_lathe else ("I", "J"),
    )
    program = write_modal(toolpath, machine, style)
    if dialect.tool_change == "m6" or not mounted_before(toolpath).any():
        return program
    return replace(program, findings=(*program.findings, EVENT_LEFT_OUT_TOOL()))


def _path_mode(mode: PathMode, unit: Unit) -> str:
    """Return the block that sets a path mode, in a program of this unit."""
    if mode.corners == "exact-path":
        return "G61"
    if mode.corners == "exact-stop":
        return "G61.1"
    style = replace(TOLERANCE, decimals=TOLERANCE.decimals + unit.more_decimals)
    corner, merging = (
        format_number(length / unit.mm, style) for length in (mode.tolerance_mm, mode.merging_mm)
    )
    merges = mode.merging_mm != mode.tolerance_mm
    return (
        "G64" + (f" P{corner}" if mode.tolerance_mm else "") + (f" Q{merging}" if merges else "")
    )


def _words(event: Event, dialect: LinuxcncDialect) -> tuple[str, ...]:
    """Return the blocks of an event."""
    if event.kind != Kind.TOOL_CHANGE:
        return common_words(event)
    number = tool_number(event)
    if dialect.tool_change == "refuse":
        if event.mounted_before:
            return ()
        raise event.refuse(
            "the machine changes no tools",
            "write one program for each tool (--split tool), or use --set dialect.tool_change=m6",
        )
    if number > MAX_TOOL:
        raise event.refuse(f"the highest tool number is {MAX_TOOL}")
    length = (f"G43 H{number}",) if dialect.tool_lengths else ()
    return (f"T{number} M6", *length)
