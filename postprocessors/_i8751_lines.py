"""How many bytes go over the line for a program in any of its three forms."""

from __future__ import annotations

import numpy as np

from camtool.machine.model import Machine

from ._i8751_bytes import packet_bytes
from ._i8751_options import dialect_of
from ._i8751_read import decoded_records
from ._i8751_records import Records


def packet_count(data: bytes, machine: Machine) -> int:
    """The length of the program as packets; ProgramError as its reader has it."""
    dialect = dialect_of(machine)
    if dialect.format == "packets":
        return len(data)
    decoded = decoded_records(data, machine)
    rows = np.zeros(len(decoded.steps), dtype=np.int64)
    return len(packet_bytes(Records(decoded.steps, decoded.waits, rows, (), -1), dialect))
