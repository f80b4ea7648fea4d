"""Writing i8751: a Toolpath to packets, to the signed-mm listing, or to a hex dump of packets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Program

from ._i8751_bytes import packet_bytes
from ._i8751_check import check_toolpath
from ._i8751_options import Dialect, dialect_of
from ._i8751_records import Counts, records_of
from ._i8751_text import dump_text, listing_text

TEXT_EXTENSION: Final = ".txt"
"""Listings and hex dumps are text whatever the machine calls its programs."""


def write_program(toolpath: Toolpath, machine: Machine) -> Program:
    """The program of a toolpath; PostError names the move that cannot be said or done."""
    dialect = dialect_of(machine)
    check_toolpath(toolpath, machine, dialect)
    records = records_of(toolpath, machine, dialect)
    extension = TEXT_EXTENSION
    if dialect.format == "listing":
        data = listing_text(records, machine).encode("ascii")
    elif dialect.format == "hex":
        data = dump_text(records, machine, dialect).encode("ascii")
    else:
        data, extension = packet_bytes(records, dialect), machine.target.extension
    return Program(
        data=data,
        extension=extension,
        target=machine.target.name,
        row_of_block=np.append(records.row, records.end_row),
        findings=tuple(_findings(records.counts, dialect)),
    )


def _findings(counts: Counts, dialect: Dialect) -> Iterator[Finding]:
    """One finding for each kind of change that was made."""
    if counts.slopes:
        yield Finding(
            Code.MOVE_SPLIT,
            Severity.WARNING,
            f"{counts.slopes} feed moves in XY and Z became steps of at most "
            f"{counts.slope_step_mm:g} mm, nowhere deeper than the slope, because Z moves alone",
            where=counts.slopes_place,
            measured=counts.slope_step_mm,
            unit="mm",
        )
    if counts.arcs:
        yield Finding(
            Code.MOVE_SPLIT,
            Severity.INFO,
            f"{counts.arcs} arcs became {counts.chords} chords within "
            f"{dialect.arc_tolerance_mm:g} mm (dialect.arc_tolerance_mm)",
            measured=float(counts.chords),
            unit="moves",
        )
    if counts.cut_lines:
        yield Finding(
            Code.MOVE_SPLIT,
            Severity.INFO,
            f"{counts.cut_lines} lines became {counts.cut_pieces}, so that 45° and then one axis "
            f"stay within {dialect.tolerance_mm:g} mm of them (dialect.tolerance_mm)",
            measured=float(counts.cut_pieces),
            unit="moves",
        )
    if counts.long_moves:
        yield Finding(
            Code.MOVE_SPLIT,
            Severity.INFO,
            f"{counts.long_moves} moves of more than {dialect.most_steps} steps were split",
            measured=float(counts.long_moves),
            unit="moves",
        )
    yield from _left_out(counts)


def _left_out(counts: Counts) -> Iterator[Finding]:
    if counts.dropped:
        yield Finding(
            Code.MOVE_COLLAPSED,
            Severity.INFO,
            f"{counts.dropped} moves of less than a step were left out",
            measured=float(counts.dropped),
            unit="moves",
        )
    if counts.feeds:
        yield Finding(
            Code.FEED_ROUNDED,
            Severity.INFO,
            f"the feeds of {counts.feeds} moves are not said: the machine has one speed, and 8 "
            "steps a second in moves of less than 90 steps",
        )
    if counts.dwells_rounded:
        yield Finding(
            Code.VALUE_ROUNDED,
            Severity.INFO,
            f"{counts.dwells_rounded} dwells were rounded up to whole seconds",
        )
    if counts.tools:
        yield Finding(
            Code.EVENT_LEFT_OUT,
            Severity.INFO,
            "the tool is not said: mount it before the program",
        )
    if counts.spindle:
        yield Finding(
            Code.EVENT_LEFT_OUT,
            Severity.WARNING,
            f"{counts.spindle} spindle events were left out: the machine cannot switch its "
            "spindle; do it by hand",
            where=counts.spindle_place,
        )
