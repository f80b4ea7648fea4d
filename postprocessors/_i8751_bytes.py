"""Records as the bytes that go over the link: `M G PH PL`, dwell pairs, 45H, 54H.

    13H                               access key
    5 times at most:                  a packet
        01 G [PH PL]  02 G [PH PL]    X and Y: 03H forward, 04H backward, 05H stands (no PH PL)
        00 T1                         seconds before Z
        03 G [PH PL]  00 T2           Z, seconds after it
    45H                               end of the packet ("E")
    54H                               after the last packet: end of data ("T")

(L4106-4167, L4343-4383, L4397-4417.)
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ._i8751_options import RECORDS_PER_PACKET, Dialect
from ._i8751_records import Records

Ints = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]

KEY: Final = 0x13
"""The byte that opens the access (13H)."""
FORWARD: Final = 3
"""A motor turns forward (03H)."""
BACKWARD: Final = 4
"""A motor turns backward (04H)."""
STOPPED: Final = 5
"""A motor stands (05H)."""
END_OF_PACKET: Final = 0x45
"""The byte behind a packet (45H)."""
END_OF_DATA: Final = 0x54
"""The byte behind the last packet (54H)."""

COLUMNS: Final = 18
"""Key, then M G PH PL for X and Y, a pair, the same for Z, a pair, end of packet."""

MOTOR_COLUMNS: Final = (1, 5, 11)
"""Where X, Y and Z begin in a row of the table."""

PAIR_COLUMNS: Final = (9, 15)


def packet_bytes(records: Records, dialect: Dialect) -> bytes:
    """The whole stream that the computer sends."""
    table, used = byte_table(records, dialect)
    return table[used].tobytes() + bytes([END_OF_DATA])


def byte_table(records: Records, dialect: Dialect) -> tuple[Bytes, Bools]:
    """(R, COLUMNS) bytes, and which of them are sent."""
    count = len(records)
    table = np.zeros((count, COLUMNS), dtype=np.uint8)
    used = np.ones((count, COLUMNS), dtype=np.bool_)
    in_packet = np.arange(count) % RECORDS_PER_PACKET
    table[:, 0] = KEY
    used[:, 0] = in_packet == 0 if dialect.key == "each-packet" else np.arange(count) == 0
    table[:, -1] = END_OF_PACKET
    used[:, -1] = in_packet == RECORDS_PER_PACKET - 1
    used[-1, -1] = True
    for motor, column in enumerate(MOTOR_COLUMNS):
        steps = records.steps[:, motor]
        forward = steps * dialect.signs[motor] > 0
        high, low = _high_low(steps, dialect)
        table[:, column] = motor + 1
        table[:, column + 1] = np.where(forward, FORWARD, BACKWARD)
        table[steps == 0, column + 1] = STOPPED
        table[:, column + 2], table[:, column + 3] = high, low
        used[:, column + 2 : column + 4] = (steps != 0)[:, None]
    for pair, column in enumerate(PAIR_COLUMNS):
        table[:, column] = dialect.dwell_mark_byte
        table[:, column + 1] = records.waits[:, pair]
    return table, used


def _high_low(steps: Ints, dialect: Dialect) -> tuple[Ints, Ints]:
    """PH and PL of each motor's pulses; where PH counts 255, 255 pulses are PL alone."""
    pulses = np.abs(steps) + dialect.lost_pulses
    unit = dialect.high_byte_steps
    high = np.maximum(pulses - (256 - unit), 0) // unit
    return high, pulses - high * unit
