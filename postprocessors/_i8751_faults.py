"""What the readers of the three formats share: records as read, and where one goes wrong."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError

Ints = npt.NDArray[np.int64]

SHOWN_CHARS: Final = 40
"""An error message shows no more of a line than this."""


@dataclass(frozen=True, eq=False)
class Decoded:
    """R records as the controller holds them: steps (R, 3), signed by part axes, and waits (R, 2)
    s; `rounded` distances of a listing that were no whole steps, the worst off by so many."""

    steps: Ints
    waits: Ints
    rounded: int = 0
    worst_steps: float = 0.0


class ByteFault(Exception):
    """A byte (offset from 0) that no controller could take at this place of a record (from 0).

    The reader of packets or of a hex dump turns it into a ProgramError that says the place.
    """

    def __init__(self, offset: int, record: int, message: str, mend: str = "") -> None:
        self.offset = offset
        self.record = record
        self.message = message
        self.mend = mend
        super().__init__(message)


def text_lines(data: bytes) -> list[str]:
    """The lines of a text without their ends (CR LF, LF or CR); ProgramError at the first byte
    that is no printable ASCII."""
    odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
    if odd:
        lines = re.split(rb"\r\n|\n|\r", data[: odd.start()])
        raise ProgramError(
            f"the byte {data[odd.start()]:02X}H belongs to no text",
            where=f"line {len(lines)}, column {len(lines[-1]) + 1}",
            mend="for packets, use --set dialect.format=packets",
        )
    return re.split("\r\n|\n|\r", data.decode("ascii"))


def shown(text: str) -> str:
    """A line for a message: quoted, and cut when long."""
    return repr(text if len(text) <= SHOWN_CHARS else text[:SHOWN_CHARS] + "…")
