"""Options that the dialects grbl and linuxcnc have in common: all that writer and reader share.

The `arc_*` numbers are the controller's own rule for arcs (radii in mm, r1 at the start and r2 at
the end, as the numbers of the block give them). An arc is refused when

    |r1 − r2| > most_difference,
    or |r1 − r2| > difference and |r1 − r2| > part · r,
    or r < least_radius."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import msgspec
from msgspec import Meta, Struct

from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.machine.ranges import Angle, Part, Radius, Slack, Tolerance

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath

POWER_OF_TEN_TOLERANCE: Final = 1e-9
"""`feed.unit_mm_min` must be a power of ten to this part of its logarithm."""

MAX_FEED_DECIMALS: Final = 6
"""`feed.unit_mm_min` is at least 10 to the power of minus this."""

UNIT_GUARD: Final = 1e-9
"""Part of a length: the unit of the last decimal may exceed a limit by this, by rounding alone."""


class GcodeDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options that both dialects share, and their controller's rule for arcs.

    `units` of lengths and feeds: millimetres (G21) or inches (G20); `decimals` of coordinates in
    mm, inches have INCH_DECIMALS more; `strip_zeros` says 1.5 for 1.500; `line_chars` that the
    controller takes in a line; `block_numbers` N1 N2 …; `comments`: a "header", also what each
    operation does ("operations"), also the name of each contour ("contours"), or "none";
    `full_circles` "whole" (end = start) or as two "halves"; `program_end`; `retract` to the
    highest Z in front of the end if the tool is left in the material. `start_blocks` follow the
    modes with which a program begins, `end_blocks` stand before its end, when the spindle is off:
    what the machine wants, as its controller takes it.
    `arc_most_radius_mm`: larger arcs are written as lines; `arc_full_turn_rad`: the
    controller takes an arc that turns by less for a full circle; `arc_chord_slack_mm`: by how much
    half the chord may exceed R."""

    units: Literal["mm", "in"] = "mm"
    decimals: Annotated[int, Meta(ge=3, le=6)] = 3
    strip_zeros: bool = False
    line_chars: Annotated[int, Meta(ge=64, le=1_000_000)]
    block_numbers: bool = False
    comments: Literal["contours", "operations", "header", "none"] = "contours"
    full_circles: Literal["whole", "halves"] = "whole"
    program_end: Literal["M2", "M30"] = "M2"
    retract: bool = True
    start_blocks: tuple[str, ...] = ()
    end_blocks: tuple[str, ...] = ()
    arc_difference_mm: Tolerance
    arc_difference_part: Part
    arc_most_difference_mm: Tolerance
    arc_least_radius_mm: Slack
    arc_most_radius_mm: Radius
    arc_full_turn_rad: Angle
    arc_chord_slack_mm: Slack = 0.0


class Unit(Struct, frozen=True):
    """A unit of lengths: its `name`, its length in mm, its G word, and how many decimals more than
    mm it is written with."""

    name: str
    mm: float
    word: str
    more_decimals: int


INCH_DECIMALS: Final = 2
"""Coordinates and feeds in inches have so many decimals more than in mm, which makes the last one
worth about a quarter of what it is worth in mm."""

MM: Final = Unit("mm", 1.0, "G21", 0)

UNITS: Final = {"mm": MM, "in": Unit("inch", 25.4, "G20", INCH_DECIMALS)}
"""The values of `units`."""


def last_decimal_mm(dialect: GcodeDialect) -> float:
    """Return the value of the last decimal of a coordinate, mm."""
    unit = UNITS[dialect.units]
    return float(unit.mm * 10.0 ** -(dialect.decimals + unit.more_decimals))


def feed_decimals(machine: Machine) -> int:
    """Return the number of decimals of an F word in mm/min, from `feed.unit_mm_min`; MachineError
    when that is no power of ten between 1 and 10^−6."""
    digits = -math.log10(machine.feed.unit_mm_min)
    rounded = round(digits)
    if abs(digits - rounded) > POWER_OF_TEN_TOLERANCE or not 0 <= rounded <= MAX_FEED_DECIMALS:
        raise MachineError(
            f"{machine.feed.unit_mm_min:g} is not a unit that F words can have",
            file=machine.target.name,
            where="table [feed], key unit_mm_min",
            mend="use 1, 0.1, 0.01 or 0.001",
        )
    return rounded


MAX_BLOCKS: Final = 100


def check_blocks(machine: Machine[Any, Any], read: Callable[[bytes], Toolpath]) -> None:
    """Raise MachineError for start and end blocks that the controller would not accept by
    themselves, that cut, end the program, or go farther than the machine can."""
    import numpy as np

    from camtool.toolpath.moves import Kind, toolpath_extents

    dialect: GcodeDialect = machine.dialect
    for key in ("start_blocks", "end_blocks"):
        blocks: tuple[str, ...] = getattr(dialect, key)
        for number, block in enumerate(blocks, 1):
            _check_block(block, f"table [dialect], key {key}, block {number}", machine)
        if not blocks:
            continue
        where = f"table [dialect], key {key}"
        try:
            # Behind the modes of the beginning, which say the unit.
            units = UNITS[dialect.units].word
            path = read("\n".join([units, *blocks, dialect.program_end]).encode())
        except ProgramError as error:
            raise MachineError(
                f"{error.message} ({error.where})",
                file=machine.target.name,
                where=where,
                mend=error.mend,
            ) from error
        spans = np.ptp(toolpath_extents(path), axis=1).tolist()
        beyond_limits = [
            name
            for name, span, axis in zip("XYZ", spans, machine.axes, strict=True)
            if axis.travel_mm is not None and span > axis.travel_mm
        ]
        complaint = ""
        if len(blocks) > MAX_BLOCKS:
            complaint = f"{len(blocks)} blocks are more than {MAX_BLOCKS}"
        elif path.is_feed.any():
            complaint = "they cut: only rapids and switches may stand here"
        elif path.block[path.kind == Kind.END].tolist() != [len(blocks) + 1]:
            complaint = "they end the program, which camtool does"
        elif beyond_limits:
            complaint = f"they leave the travel of {' and '.join(beyond_limits)}"
        if complaint:
            raise MachineError(complaint, file=machine.target.name, where=where)


def _check_block(block: str, where: str, machine: Machine[Any, Any]) -> None:
    """Raise MachineError for a text that is not one plain block."""
    if not block.strip() or not block.isascii() or not block.isprintable():
        raise MachineError(
            f"{block!r} is no block", file=machine.target.name, where=where, mend="such as M8"
        )


def check_unit(machine: Machine, unit_mm: float, arc_spread_mm: float) -> None:
    """Raise MachineError where the last decimal of a coordinate, `unit_mm`, is coarser than a step
    of the machine, or than the difference of an arc's two radii that the controller accepts
    (`arc_spread_mm`): rounding alone makes a difference of up to one unit."""
    step_mm = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    if unit_mm > step_mm * (1.0 + UNIT_GUARD):
        raise MachineError(
            f"the last decimal is worth {unit_mm:g} mm, more than a step of {step_mm:g} mm",
            file=machine.target.name,
            where="table [dialect], key decimals",
            mend=f"add {math.ceil(math.log10(unit_mm / step_mm) - UNIT_GUARD)} to decimals",
        )
    if arc_spread_mm <= unit_mm * (1.0 + UNIT_GUARD):
        raise MachineError(
            f"{arc_spread_mm:g} mm is no more than the last decimal is worth, {unit_mm:g} mm: "
            "rounding alone makes the radii of an arc differ by that",
            file=machine.target.name,
            where="table [dialect], key arc_spread_mm",
            mend=f"use {2.0 * unit_mm:g}, or more decimals",
        )
