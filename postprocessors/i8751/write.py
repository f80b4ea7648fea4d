"""Writing i8751: a Toolpath to packets, to the signed-mm listing, or to a hex dump of packets.

The bytes that go over the link (L4106-4167, L4343-4383, L4397-4417):

    13H                               access key
    5 times at most:                  a packet
        01 G [PH PL]  02 G [PH PL]    X and Y: 03H forward, 04H backward, 05H stands (no PH PL)
        00 T1                         seconds before Z
        03 G [PH PL]  00 T2           Z, seconds after it
    45H                               end of the packet ("E")
    54H                               after the last packet: end of data ("T")

The listing is what the operator of the second version types: distances in mm with their sign
(L5240-5254), and the two waits. Its layout is ours, the thesis's is lost:

    X+10.000 Y-2.500 T0 Z+0.000 T0
    END

The hex dump shows every byte of the packets with its offset, its meaning and the expected reply:

    0001  01 03 00 64              ; 1: X +100 steps (+1.250 mm) <- B M M M"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.arrays import Bools, Ints
from camtool.bounds import refuse_too_long
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Program

from .dialect import RECORDS_PER_PACKET, I8751Dialect, I8751Machine
from .findings import (
    EVENT_LEFT_OUT_SPINDLE,
    EVENT_LEFT_OUT_TOOL,
    FEED_ROUNDED,
    MOVE_COLLAPSED,
    MOVE_SPLIT,
    MOVE_SPLIT_ARCS,
    MOVE_SPLIT_LINES,
    MOVE_SPLIT_LONG,
    VALUE_ROUNDED_DWELL,
)
from .records import Counts, Records, check_toolpath, records_of

Bytes = npt.NDArray[np.uint8]

KEY: Final = 0x13
"""The byte that opens the access (13H)."""
FORWARD: Final = 3
"""A motor turns forward (03H)."""
BACKWARD: Final = 4
"""A motor turns backward (04H)."""
STOPPED: Final = 5
"""A motor stands (05H)."""
END_OF_PACKET: Final = 0x45
"""The byte after a packet (45H)."""
END_OF_DATA: Final = 0x54
"""The byte after the last packet (54H)."""

COLUMNS: Final = 18
"""Key, then M G PH PL for X and Y, a pair, the same for Z, a pair, end of packet."""

MOTOR_COLUMNS: Final = (1, 5, 11)
"""Columns at which X, Y and Z begin in a row of the table."""

PAIR_COLUMNS: Final = (9, 15)

RECORDS_AT_ONCE: Final = 3_000 * RECORDS_PER_PACKET
"""Whole packets."""

TEXT_EXTENSION: Final = ".txt"
"""Listings and hex dumps are text whatever the machine calls its programs."""

MIN_DECIMALS: Final = 3
"""A listing has at least this many decimals of a millimetre."""

STEPS_PER_LAST_DIGIT: Final = 0.05
"""The last decimal of a listing is worth this part of the finest step or less."""

MAX_MESSAGE_CHARS: Final = 60
"""Longest comment of the hex dump, in characters."""

BYTES_WIDTH: Final = 24
"""Width of the bytes in the hex dump, so that its comments are aligned."""


def write_program(toolpath: Toolpath, machine: I8751Machine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    dialect = machine.dialect
    check_toolpath(toolpath, machine, dialect)
    records = records_of(toolpath, machine, dialect)
    setup_messages = ((0, words) for words in toolpath.setup)
    records = replace(records, messages=(*setup_messages, *records.messages))
    extension = TEXT_EXTENSION
    if dialect.format == "listing":
        refuse_too_long(len(records) + len(records.messages) + 2, "line")  # its head, and END
    else:
        refuse_too_long(len(records), "record")
    if dialect.format == "listing":
        data = listing_text(records, machine).encode("ascii")
    elif dialect.format == "hex":
        data = dump_text(records, machine, dialect).encode("ascii")
    else:
        data, extension = (
            packet_bytes(records.steps, records.waits, dialect),
            machine.target.extension,
        )
    return Program(
        data=data,
        extension=extension,
        target=machine.target.name,
        row_of_block=np.append(records.row, records.end_row).astype(np.int32),
        findings=tuple(_findings(records.counts, dialect)),
    )


def packet_bytes(steps: Ints, waits: Ints, dialect: I8751Dialect) -> bytes:
    """Return the whole stream that the computer sends for R records: steps (R, 3) and waits (R,
    2)."""
    parts = []
    for low in range(0, len(steps), RECORDS_AT_ONCE):
        rows = slice(low, low + RECORDS_AT_ONCE)
        table, is_used = byte_table(steps[rows], waits[rows], dialect)
        is_used[0, 0] &= low == 0 or dialect.key == "each-packet"
        parts.append(table[is_used].tobytes())
    return b"".join([*parts, bytes([END_OF_DATA])])


def byte_table(steps: Ints, waits: Ints, dialect: I8751Dialect) -> tuple[Bytes, Bools]:
    """Return the bytes (R, COLUMNS) of records of steps (R, 3) and waits (R, 2), and a mask of
    those that are sent."""
    count = len(steps)
    table = np.zeros((count, COLUMNS), dtype=np.uint8)
    is_used = np.ones((count, COLUMNS), dtype=np.bool_)
    in_packet = np.arange(count) % RECORDS_PER_PACKET
    table[:, 0] = KEY
    is_used[:, 0] = in_packet == 0 if dialect.key == "each-packet" else np.arange(count) == 0
    table[:, -1] = END_OF_PACKET
    is_used[:, -1] = in_packet == RECORDS_PER_PACKET - 1
    is_used[-1, -1] = True
    for motor, column in enumerate(MOTOR_COLUMNS):
        turns = steps[:, motor]
        forward = turns * dialect.signs[motor] > 0
        high, low = _high_low(turns, dialect)
        table[:, column] = motor + 1
        table[:, column + 1] = np.where(forward, FORWARD, BACKWARD)
        table[turns == 0, column + 1] = STOPPED
        table[:, column + 2], table[:, column + 3] = high, low
        is_used[:, column + 2 : column + 4] = (turns != 0)[:, None]
    for pair, column in enumerate(PAIR_COLUMNS):
        table[:, column] = dialect.dwell_mark_byte
        table[:, column + 1] = waits[:, pair]
    return table, is_used


def _high_low(steps: Ints, dialect: I8751Dialect) -> tuple[Ints, Ints]:
    """Return PH and PL of each motor's pulses. Where PH counts units of 255, 255 pulses are
    written with PL alone."""
    pulses = np.abs(steps) + dialect.lost_pulses
    unit = dialect.high_byte_steps
    high = np.maximum(pulses - (256 - unit), 0) // unit
    return high, pulses - high * unit


def decimals_of(machine: I8751Machine) -> int:
    """Return the number of decimals of mm that distinguishes all steps of the machine."""
    finest = min(axis.coded_step_mm for axis in machine.axes)
    return max(MIN_DECIMALS, math.ceil(-math.log10(STEPS_PER_LAST_DIGIT * finest)))


def safe_text(text: str) -> str:
    """Return a text from outside as part of a comment: printable ASCII, one line, short."""
    cleaned = re.sub(r"[^A-Za-z0-9 _.,:+/#-]+", " ", text)
    return " ".join(cleaned.split())[:MAX_MESSAGE_CHARS]


def listing_text(records: Records, machine: I8751Machine) -> str:
    """Return the listing, one record a line, END last."""
    step_x, step_y, step_z = (axis.coded_step_mm for axis in machine.axes)
    digits = decimals_of(machine)
    form = f"X%+.{digits}f Y%+.{digits}f T%d Z%+.{digits}f T%d"
    lines = [
        form % (x * step_x, y * step_y, before, z * step_z, after)
        for (x, y, z), (before, after) in zip(
            records.steps.tolist(), records.waits.tolist(), strict=True
        )
    ]
    for record, text in reversed(records.messages):
        lines.insert(record, f"; {safe_text(text)}")
    head = "; i8751 signed mm: X and Y together, wait T1 s, Z, wait T2 s"
    return "\n".join([head, *lines, "END"]) + "\n"


def dump_text(records: Records, machine: I8751Machine, dialect: I8751Dialect) -> str:
    """Return the hex dump of the packets: offset, bytes, meaning, expected replies."""
    lines = ["; i8751 packets: offset, bytes, meaning <- expected replies"]
    offset = 0
    for data, meaning in _Dump(records, machine, dialect).parts():
        if not data:
            lines.append(f"; {meaning}")
            continue
        lines.append(f"{offset:04X}  {data.hex(' ').upper():<{BYTES_WIDTH}} ; {meaning}")
        offset += len(data)
    return "\n".join(lines) + "\n"


class _Dump:
    """Runs of bytes with their meaning and replies; a run without bytes is a line of comment."""

    def __init__(self, records: Records, machine: I8751Machine, dialect: I8751Dialect) -> None:
        self._records = records
        self._steps_mm = [axis.coded_step_mm for axis in machine.axes]
        self._digits = decimals_of(machine)
        self._wait_reply = " ".join(dialect.dwell_replies)
        self._moving_reply = f"{dialect.motor_reply} M M M"
        self._standing_reply = f"{dialect.motor_reply} M"
        self._table, self._used = byte_table(records.steps, records.waits, dialect)

    def parts(self) -> Iterator[tuple[bytes, str]]:
        """Yield the runs of bytes in order, each with its meaning."""
        messages = list(self._records.messages)
        rows = [bytes(row) for row in self._table]
        for record, (row, steps) in enumerate(
            zip(rows, self._records.steps.tolist(), strict=True)
        ):
            while messages and messages[0][0] <= record:
                yield b"", safe_text(messages.pop(0)[1])
            if self._used[record, 0]:
                yield row[:1], "access key <- LISTO"
            if record % RECORDS_PER_PACKET == 0:
                yield b"", f"packet {record // RECORDS_PER_PACKET + 1}"
            head = f"{record + 1}: "
            (x, y, z), (before, after) = MOTOR_COLUMNS, PAIR_COLUMNS
            yield self._motor(row, x, steps[0], f"{head}X", 0)
            yield self._motor(row, y, steps[1], f"{head}Y", 1)
            yield row[before : before + 2], f"{head}T1 {row[before + 1]} s <- {self._wait_reply}"
            yield self._motor(row, z, steps[2], f"{head}Z", 2)
            yield row[after : after + 2], f"{head}T2 {row[after + 1]} s <- {self._wait_reply}"
            if self._used[record, -1]:
                yield row[-1:], "end of packet <- F"
        for _, text in messages:
            yield b"", safe_text(text)
        yield bytes([END_OF_DATA]), "end of data <- A"

    def _motor(
        self, row: bytes, column: int, steps: int, head: str, axis: int
    ) -> tuple[bytes, str]:
        if not steps:
            return row[column : column + 2], f"{head} stands <- {self._standing_reply}"
        travel = steps * self._steps_mm[axis]
        meaning = f"{head} {steps:+d} steps ({travel:+.{self._digits}f} mm)"
        return row[column : column + 4], f"{meaning} <- {self._moving_reply}"


def _findings(counts: Counts, dialect: I8751Dialect) -> Iterator[Finding]:
    """Yield one finding for each kind of change that the writer made."""
    if counts.slopes:
        yield MOVE_SPLIT(
            where=counts.slopes_place, measured=counts.slope_step_mm, count=counts.slopes
        )
    if counts.arcs:
        yield MOVE_SPLIT_ARCS(
            measured=counts.chords, arcs=counts.arcs, tolerance=dialect.arc_tolerance_mm
        )
    if counts.cut_lines:
        yield MOVE_SPLIT_LINES(
            measured=counts.cut_pieces, lines=counts.cut_lines, tolerance=dialect.tolerance_mm
        )
    if counts.long_moves:
        yield MOVE_SPLIT_LONG(measured=counts.long_moves, most=dialect.most_steps)
    yield from _left_out(counts)


def _left_out(counts: Counts) -> Iterator[Finding]:
    if counts.dropped:
        yield MOVE_COLLAPSED(measured=counts.dropped)
    if counts.feeds:
        yield FEED_ROUNDED(count=counts.feeds)
    if counts.dwells_rounded:
        yield VALUE_ROUNDED_DWELL(count=counts.dwells_rounded)
    if counts.tools:
        yield EVENT_LEFT_OUT_TOOL()
    if counts.spindle:
        yield EVENT_LEFT_OUT_SPINDLE(where=counts.spindle_place, count=counts.spindle)
