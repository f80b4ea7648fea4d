"""Records as text: the signed-mm listing, and the annotated hex dump.

The listing is what the operator of the second version types: distances in mm with their sign
(L5240-5254), and the two waits. Its layout is ours, the thesis's is lost:

    X+10.000 Y-2.500 T0 Z+0.000 T0
    END

The hex dump shows every byte of the packets with its offset, its meaning and the expected reply:

    0001  01 03 00 64              ; 1: X +100 steps (+1.250 mm) <- B M M M
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Final

from camtool.machine.model import Machine

from ._i8751_bytes import END_OF_DATA, MOTOR_COLUMNS, PAIR_COLUMNS, byte_table
from ._i8751_options import RECORDS_PER_PACKET, Dialect
from ._i8751_records import Records

LEAST_DECIMALS: Final = 3
"""A listing has at least so many decimals of a millimetre."""

STEPS_PER_LAST_DIGIT: Final = 0.05
"""The last decimal of a listing is worth this part of the finest step or less."""

MOST_MESSAGE_CHARS: Final = 60
"""A comment of the hex dump takes so much of a text, no more."""

BYTES_WIDTH: Final = 24
"""The comments of the hex dump stand in one column."""


def decimals_of(machine: Machine) -> int:
    """Decimals of mm that say every step of the machine without doubt."""
    finest = min(axis.coded_step_mm for axis in machine.axes)
    return max(LEAST_DECIMALS, math.ceil(-math.log10(STEPS_PER_LAST_DIGIT * finest)))


def safe_text(text: str) -> str:
    """A text from outside as part of a comment: printable ASCII, one line, short."""
    plain = re.sub(r"[^A-Za-z0-9 _.,:+/#-]+", " ", text)
    return " ".join(plain.split())[:MOST_MESSAGE_CHARS]


def listing_text(records: Records, machine: Machine) -> str:
    """The listing, one record a line, END last."""
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


def dump_text(records: Records, machine: Machine, dialect: Dialect) -> str:
    """The hex dump of the packets: offset, bytes, meaning, expected replies."""
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
    """Runs of bytes with their meaning and replies; no bytes for a line of comment alone."""

    def __init__(self, records: Records, machine: Machine, dialect: Dialect) -> None:
        self._records = records
        self._steps_mm = [axis.coded_step_mm for axis in machine.axes]
        self._digits = decimals_of(machine)
        self._wait_reply = " ".join(dialect.dwell_replies)
        self._moving_reply = f"{dialect.motor_reply} M M M"
        self._standing_reply = f"{dialect.motor_reply} M"
        self._table, self._used = byte_table(records, dialect)

    def parts(self) -> Iterator[tuple[bytes, str]]:
        """All runs in order."""
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
        way = steps * self._steps_mm[axis]
        meaning = f"{head} {steps:+d} steps ({way:+.{self._digits}f} mm)"
        return row[column : column + 4], f"{meaning} <- {self._moving_reply}"
