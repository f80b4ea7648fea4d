"""Writing valcnc: each block has its code and all of X, Y and Z; arcs have I and J too.

    rows ──checked──▶ XY and Z apart ──arcs cut short──▶ scaled ──units──▶ blocks

Lengths are scaled before they are rounded, so arcs are made consistent in the very numbers that
the controller computes with. On axes of unequal steps a circle would be an ellipse in those
numbers: there arcs become lines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from camtool.arrays import Floats
from camtool.bounds import refuse_too_long
from camtool.findings import Finding
from camtool.machine.model import FEED_TOLERANCE
from camtool.records import replace
from camtool.toolpath.lower import LoweredToolpath, arcs_to_lines, arcs_within
from camtool.toolpath.moves import Kind, Toolpath, mounted_before
from camtool.toolpath.program import Program
from camtool.toolpath.refusals import refuse
from camtool.toolpath.words import WordColumn, texts_of

from ..gcode.format import NumberStyle, check_length, word_of
from ..gcode.plain import (
    ArcRules,
    PlainRows,
    arc_findings,
    check_plain,
    left_out,
    plain_rows,
    split_z,
)
from .dialect import ValcncDialect, ValcncMachine, scales_of
from .findings import ARC_MENDED, COORDINATES_SCALED, EVENT_LEFT_OUT, FEED_ROUNDED

UNSAID: Final = (Kind.DWELL, Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF, Kind.TOOL_CHANGE)

MAX_UNITS: Final = 99_999.0
"""An arc becomes lines when its centre is farther from its start (in units of the program)."""


def write_program(toolpath: Toolpath, machine: ValcncMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    dialect = machine.dialect
    check_plain(toolpath, machine)
    _check_tools(toolpath)
    scales = scales_of(machine, dialect)
    lowered_path, split = split_z(toolpath, machine)
    lowered_path, squeezed = _lower_arcs(lowered_path, scales, machine, dialect)
    rules = ArcRules(dialect.decimals, "halves", MAX_UNITS, chord_fits=True)
    rows = plain_rows(_in_units(lowered_path.toolpath, scales), rules)
    of_row = lowered_path.row[rows.row]
    refuse_too_long(int(np.count_nonzero(rows.moves)), "line")
    data = _text(rows, dialect)
    check_length(data, dialect.block_chars, "block", "use fewer decimals, or check the units")
    first = toolpath.place(int(lowered_path.row[rows.first])) if rows.first >= 0 else ""
    return Program.of_text(
        data,
        machine,
        of_row[rows.moves],
        (
            *_scale_finding(dialect),
            *split,
            *squeezed,
            *arc_findings(rows, first),
            *_feed_finding(toolpath, machine),
            *left_out(toolpath, UNSAID, EVENT_LEFT_OUT),
        ),
    )


def _check_tools(toolpath: Toolpath) -> None:
    """Raise PostError for a second tool: no block stops the machine for a tool change."""
    refuse(
        toolpath,
        (toolpath.kind == Kind.TOOL_CHANGE) & ~mounted_before(toolpath),
        "this machine has no code that stops it for a tool change",
        "write a program for each tool (--split tool)",
    )


def _lower_arcs(
    lowered_path: LoweredToolpath, scales: Floats, machine: ValcncMachine, dialect: ValcncDialect
) -> tuple[LoweredToolpath, list[Finding]]:
    """Split arcs at the dialect's longest sweep; turn them into lines where X and Y are scaled
    differently."""
    path = lowered_path.toolpath
    count = int(path.is_arc.sum())
    if scales[0] == scales[1] or not count:
        shortened = arcs_within(path, math.radians(dialect.max_sweep_deg))
        return shortened.after(lowered_path), []
    tolerance = machine.defaults.fit_tolerance_mm
    chords = arcs_to_lines(path, path.is_arc, tolerance)
    finding = ARC_MENDED(measured=count, tolerance=tolerance)
    return chords.after(lowered_path), [finding]


def _in_units(toolpath: Toolpath, scales: Floats) -> Toolpath:
    """Return the toolpath in the units of the program."""
    return replace(
        toolpath,
        end=toolpath.end * scales,
        centre=toolpath.centre * scales[:2],
        start=toolpath.start * scales,
    )


def _text(rows: PlainRows, dialect: ValcncDialect) -> bytes:
    """Return the blocks of all rows that move."""
    style = NumberStyle(dialect.decimals)
    is_sent = rows.moves
    arc = is_sent & rows.is_arc
    columns = [
        WordColumn("G", rows.kind, is_sent, digits=2),
        *(word_of(axis, rows.end[:, k], is_sent, style) for k, axis in enumerate("XYZ")),
        *(word_of(axis, rows.offset[:, k], arc, style) for k, axis in enumerate("IJ")),
    ]
    return texts_of(columns, blanks=True).data


def _scale_finding(dialect: ValcncDialect) -> Iterator[Finding]:
    """Yield a warning while the scale is unchecked: a wrong one makes parts 8 times too large or
    too small."""
    if not dialect.coord_scale_checked:
        yield COORDINATES_SCALED(measured=dialect.coord_scale)


def _feed_finding(toolpath: Toolpath, machine: ValcncMachine) -> Iterator[Finding]:
    """Yield FEED_ROUNDED for feeds other than the machine's only speed."""
    speed = machine.max_feed_mm_min
    with np.errstate(invalid="ignore"):
        other = toolpath.is_feed & (np.abs(toolpath.feed - speed) > FEED_TOLERANCE * speed)
    if other.any():
        row = int(other.argmax())
        yield FEED_ROUNDED(
            where=toolpath.place(row),
            measured=toolpath.feed[row],
            limit=speed,
            count=int(other.sum()),
        )
