"""The packets of a program in any of its three forms, and the listing of their bytes."""

from __future__ import annotations

import numpy as np

from camtool.toolpath.program import Listing

from .dialect import I8751Machine
from .read import decoded_records
from .write import END_OF_DATA, byte_table, packet_bytes


def stream_of(data: bytes, machine: I8751Machine) -> bytes:
    """Return the program as packets; ProgramError as for its reader."""
    dialect = machine.dialect
    if dialect.format == "packets":
        return data
    decoded = decoded_records(data, machine)
    return packet_bytes(decoded.steps.astype(np.int64), decoded.waits.astype(np.int64), dialect)


def listing(data: bytes, machine: I8751Machine) -> Listing:
    """Return the bytes of each record in hex, then those of the end of the data, whatever the form
    of the file."""
    dialect = machine.dialect
    decoded = decoded_records(data, machine)
    end = f"{END_OF_DATA:02X}"
    if not len(decoded.steps):
        return Listing((end,), binary=True)
    table, is_used = byte_table(
        decoded.steps.astype(np.int64), decoded.waits.astype(np.int64), dialect
    )
    lines = (
        row[is_sent].tobytes().hex(" ").upper()
        for row, is_sent in zip(table, is_used, strict=True)
    )
    return Listing((*lines, end), binary=True)
