"""The packets of a program record by record, for people."""

from __future__ import annotations

import numpy as np

from camtool.machine.model import Machine
from camtool.toolpath.program import Listing

from ._i8751_bytes import END_OF_DATA, byte_table
from ._i8751_options import dialect_of
from ._i8751_read import decoded_records
from ._i8751_records import Records


def listing(data: bytes, machine: Machine) -> Listing:
    """The bytes of each record in hex, then the end of the data; whatever the form of the file."""
    dialect = dialect_of(machine)
    decoded = decoded_records(data, machine)
    end = f"{END_OF_DATA:02X}"
    if not len(decoded.steps):
        return Listing((end,), binary=True)
    rows = np.zeros(len(decoded.steps), dtype=np.int64)
    table, used = byte_table(Records(decoded.steps, decoded.waits, rows, (), -1), dialect)
    lines = (row[sent].tobytes().hex(" ").upper() for row, sent in zip(table, used, strict=True))
    return Listing((*lines, end), binary=True)
