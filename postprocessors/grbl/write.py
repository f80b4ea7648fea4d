"""Writing grbl 1.1: what it has of its own beside `gcode/write.py`."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath, mounted_before
from camtool.toolpath.program import Program

from ..gcode.comments import mounting_messages
from ..gcode.dialect import UNITS
from ..gcode.write import (
    COOLANT_OFF,
    SPINDLE_OFF,
    Event,
    ProgramStyle,
    common_words,
    tool_number,
    write_modal,
)
from .controller import GrblModel
from .dialect import MAX_TOOL, GrblDialect, GrblMachine
from .findings import EVENT_LEFT_OUT, TOOL_BY_HAND

HEADER = ("G17 {unit} G90 G94", "G54")
"""XY plane, mm or inches, absolute, feeds a minute; the first work frame. In grbl I and J are
always offsets, so G91.1 is not written."""

BY_HAND = ("the spindle does not stop by itself: stop it",)
"""Message to the operator of a spindle that is switched by hand."""


def write_program(toolpath: Toolpath, machine: GrblMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    dialect = machine.dialect
    before = BY_HAND if machine.spindle.switched == "hand" else ()

    unit = UNITS[dialect.units]

    def mounted(path: Toolpath, row: int) -> list[str]:
        return [*before, *mounting_messages(path, row, unit)]

    header = tuple(block.format(unit=unit.word) for block in HEADER)
    style = ProgramStyle(
        dialect, header, lambda event: _words(event, dialect), mounted=mounted, model=GrblModel()
    )
    program = write_modal(toolpath, machine, style)
    return replace(program, findings=(*program.findings, *_by_hand(toolpath, dialect)))


def _by_hand(toolpath: Toolpath, dialect: GrblDialect) -> Iterator[Finding]:
    """Yield findings on tools that the operator must mount, before the program and in it."""
    first = mounted_before(toolpath)
    if dialect.tool_change != "pause" and first.any():
        yield EVENT_LEFT_OUT()
    changes = (toolpath.kind == Kind.TOOL_CHANGE) & ~first
    if changes.any():
        tools = ", ".join(f"{number:g}" for number in toolpath.value[changes].tolist())
        yield TOOL_BY_HAND(
            where=toolpath.place(int(changes.argmax())), measured=changes.sum(), tools=tools
        )


def _words(event: Event, dialect: GrblDialect) -> tuple[str, ...]:
    """Return the blocks of an event."""
    if event.kind == Kind.TOOL_CHANGE:
        return _change(event, dialect)
    blocks = common_words(event)
    if event.kind == Kind.DWELL and event.value > dialect.most_dwell_s:
        raise event.refuse(
            f"a dwell of {event.value:g} s is too long: grbl counts at most"
            f" {dialect.most_dwell_s:g} s",
            "use several dwells",
        )
    return blocks


def _change(event: Event, dialect: GrblDialect) -> tuple[str, ...]:
    """Return the blocks that stop for another tool, with spindle and coolant off; nothing for the
    tool that is mounted before the program."""
    if event.mounted_before and dialect.tool_change != "pause":
        return ()
    if dialect.tool_change == "refuse":
        raise event.refuse(
            "grbl knows no tool change",
            "write one program for each tool (--split tool), or stop for it with --set"
            " dialect.tool_change=stop",
        )
    if tool_number(event) > MAX_TOOL:
        raise event.refuse(f"grbl's highest tool number is {MAX_TOOL}")
    coolant = (COOLANT_OFF,) if event.cools else ()
    spindle = (SPINDLE_OFF,) if event.spindle_on else ()
    return (*coolant, *spindle, f"T{tool_number(event)} M0")
