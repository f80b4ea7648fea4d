"""The keys of `[dialect]` and `[controller]` of an i8751 machine.

Where the thesis contradicts itself or is silent, an option says which reading is meant;
docs/dialects/i8751.md explains each, with the lines of the thesis."""

from __future__ import annotations

import re
from typing import Final, Literal

from camtool.errors import MachineError
from camtool.machine.model import Link, Machine, SlideStart
from camtool.machine.ranges import Tolerance

from .pulses import Firmware

RECORDS_PER_PACKET: Final = 5
"""15 blocks of three motors (L4106-4134)."""

MAX_DWELL_BYTE_S: Final = 255
"""Seconds that one byte of a dwell pair can hold (L4136-4147)."""


MAX_LOW_BYTE: Final = 255
"""Pulses that PL alone can hold."""


class I8751Dialect(Firmware, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Format of programs, tolerances of lines, and one reading for each open question.

    `tolerance_mm`: how far the dog-leg of a line may stray from it; `arc_tolerance_mm`: how far
    the chords of an arc may. `plus_backward`: axes ("xz") whose motors turn backward for +. The
    options of `Firmware` are those on pulses. `long_runs`: a motor may be sent more steps at once
    than the low byte can hold; without them a program means the same whatever the high byte
    counts."""

    tolerance_mm: Tolerance
    arc_tolerance_mm: Tolerance
    format: Literal["packets", "listing", "hex"] = "packets"
    plus_backward: str = ""
    key: Literal["once", "each-packet"] = "once"
    dwell_mark: Literal["00H", "30H"] = "00H"
    motor_reply: Literal["B", "8"] = "B"
    dwell_reply: Literal["B M", "M", "none", "unstated"] = "B M"
    z_alone: Literal["plain", "with-step"] = "plain"
    long_runs: bool = False

    @property
    def high_byte_steps(self) -> int:
        """Steps that one unit of PH stands for."""
        return int(self.high_byte)

    @property
    def dwell_mark_byte(self) -> int:
        """The first byte of a dwell pair."""
        return int(self.dwell_mark[:-1], 16)

    @property
    def most_steps(self) -> int:
        """Steps that one record may move a motor."""
        return self.encodable_steps if self.long_runs else MAX_LOW_BYTE - self.lost_pulses

    @property
    def encodable_steps(self) -> int:
        """Steps that PH and PL can hold."""
        return MAX_LOW_BYTE * self.high_byte_steps + MAX_LOW_BYTE - self.lost_pulses

    @property
    def dwell_replies(self) -> list[str]:
        """Replies of the controller to the two bytes of a dwell pair."""
        return {
            "B M": [self.motor_reply, "M"],
            "M": ["M", "M"],
            "none": ["-", "-"],
            "unstated": ["?", "?"],
        }[self.dwell_reply]

    @property
    def signs(self) -> tuple[int, int, int]:
        """Signs of X, Y, Z: 1 when + is forward, -1 when + is backward."""
        x, y, z = (-1 if axis in self.plus_backward else 1 for axis in "xyz")
        return x, y, z


class I8751Controller(SlideStart, frozen=True, tag_field="model", tag="i8751"):
    """The Intel 8751.

    How its firmware counts and times pulses decides what its bytes mean too, so those options
    stand once, in `[dialect]`: `camtool_postprocessors.i8751.pulses`."""


class I8751Link(Link, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open beside the replies of `[dialect]`. `packet_end`:
    whether the end of a packet, which is stored too (L4343-4352), is answered by an M before its
    F. `homing`: whether the controller's program seeks the optos of its origin at its "start", as
    the thesis proposes and has not built (L5267-5338)."""

    packet_end: Literal["F", "M F"] = "F"
    homing: Literal["none", "start"] = "none"


I8751Machine = Machine[SlideStart, I8751Dialect]


def check(machine: I8751Machine) -> None:
    """Raise MachineError where values of the dialect are impossible, or too fine for the machine's
    steps."""
    name, dialect = machine.target.name, machine.dialect
    if not re.fullmatch("x?y?z?", dialect.plus_backward):
        raise MachineError(
            f"{dialect.plus_backward!r} names no axes",
            file=name,
            where="table [dialect], key plus_backward",
            mend='write axes in the order x, y, z, such as "xz", or ""',
        )
    # Staying within half of the coarser step is possible for every line; see `dogleg`.
    half_step = 0.5 * max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    if dialect.tolerance_mm < half_step:
        raise MachineError(
            f"{dialect.tolerance_mm:g} mm is finer than the steps of the machine can be",
            file=name,
            where="table [dialect], key tolerance_mm",
            mend=f"use {half_step:g} mm or more",
        )
