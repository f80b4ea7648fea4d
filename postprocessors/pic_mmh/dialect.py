"""The `[dialect]` table of a pic-mmh machine: all that the writer and the reader share."""

from __future__ import annotations

from typing import Literal

import msgspec

from camtool.machine.loader import convert
from camtool.machine.model import Machine
from camtool.machine.ranges import Count


class Dialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Which of the thesis's two forms of a coordinate is spoken, and how long a block may be.

    `form` "example": `X02969.00`, sign only when negative (L1731); "annex": `X+02969` (L3284).
    `buffer_chars`: characters that the controller's buffer takes, `;` included; None: as many as
    the form's blocks have. The thesis's vector holds 35 (L1740-1742), its sample block has 43.
    """

    form: Literal["example", "annex"] = "example"
    buffer_chars: Count | None = None


def dialect_of(machine: Machine) -> Dialect:
    """The machine's `[dialect]` table; MachineError naming the key that does not fit."""
    return convert(machine.dialect, Dialect, machine.target.name, "dialect")
