"""How many bytes go over the line for a program in any of its three forms."""

from __future__ import annotations

import msgspec

from camtool.machine.model import Machine

from ._i8751_options import dialect_of
from ._i8751_read import read_program
from ._i8751_write import write_program


def packet_count(data: bytes, machine: Machine) -> int:
    """The length of the program as packets; ProgramError as its reader has it."""
    if dialect_of(machine).format == "packets":
        return len(data)
    as_packets = msgspec.structs.replace(machine, dialect={**machine.dialect, "format": "packets"})
    return len(write_program(read_program(data, machine), as_packets).data)
