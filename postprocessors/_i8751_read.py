"""Reading i8751: packets, a listing or a hex dump as the moves that the controller makes of them.

A record becomes up to four rows: X and Y, the wait T1, Z, the wait T2. Its block is its number,
from 0; the END has the block after the last record. Ends are steps times the coded step.

The machine has one speed, so nothing tells a rapid from a cut. Part zero is the top of the stock:
in a program that goes below it, what stays at or above it and what rises straight up are rapids,
all else are lines. Their feed is the way along the line over the controller's time for it, ramps
and dog-leg included.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError
from camtool.findings import Code, Finding, Severity
from camtool.machine.controllers.i8751_pulses import PulseTimes
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath

from ._i8751_dump import read_dump
from ._i8751_faults import ByteFault, Decoded
from ._i8751_listing import ListingReader
from ._i8751_options import Dialect, dialect_of
from ._i8751_packets import PacketReader

Ints = npt.NDArray[np.int64]


def read_program(data: bytes, machine: Machine) -> Toolpath:
    """The moves of a program; ProgramError naming record and byte, or line and column."""
    return _toolpath(decoded_records(data, machine), machine, dialect_of(machine))


def decoded_records(data: bytes, machine: Machine) -> Decoded:
    """The records of a program in any of its three forms; ProgramError as `read_program`."""
    dialect = dialect_of(machine)
    if not data:
        raise ProgramError("the program is empty", mend="give a file of i8751 packets")
    if dialect.format == "listing":
        return ListingReader(machine, dialect).read(data)
    if dialect.format == "hex":
        return read_dump(data, dialect)
    return _read_packets(data, dialect)


def _read_packets(data: bytes, dialect: Dialect) -> Decoded:
    try:
        return PacketReader(data, dialect).read()
    except ByteFault as fault:
        mend = fault.mend
        if fault.offset == 0:
            mend = "for text, use --set dialect.format=listing or hex; " + mend
        raise ProgramError(
            fault.message,
            where=f"record {fault.record + 1}, byte {fault.offset + 1} "
            f"(offset {fault.offset:04X})",
            mend=mend,
        ) from None


def _toolpath(decoded: Decoded, machine: Machine, dialect: Dialect) -> Toolpath:
    """Rows of all records, then END."""
    steps, waits = decoded.steps, decoded.waits
    step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    moves_xy, moves_z = steps[:, :2].any(axis=1), steps[:, 2] != 0
    present = np.column_stack([moves_xy, waits[:, 0] > 0, moves_z, waits[:, 1] > 0])
    # Slots 0 to 3 of a record: X and Y, T1, Z, T2.
    record, slot = np.nonzero(present)
    at = np.cumsum(steps, axis=0)
    ends = at[record]
    # X and Y have moved before Z does.
    before_z = slot < 2
    ends[before_z, 2] -= steps[record[before_z], 2]
    is_wait = slot % 2 == 1
    kind = np.where(is_wait, np.int64(Kind.DWELL), _kinds(ends, steps[record], slot))
    feeds = np.column_stack(_feeds(steps, step_mm, PulseTimes(dialect)))[record, slot // 2]
    value = np.where(is_wait, waits[record, slot // 2].astype(np.float64), np.nan)
    count = len(record) + 1
    last = at[-1:]
    return Toolpath(
        kind=np.append(kind, Kind.END),
        end=np.concatenate([ends, last]) * step_mm,
        centre=np.full((count, 2), np.nan),
        feed=np.append(np.where(kind == Kind.LINE, feeds, np.nan), np.nan),
        value=np.append(value, np.nan),
        source=np.full(count, -1),
        block=np.append(record, len(steps)),
        start=np.zeros(3),
        findings=(*_findings(decoded), *_two_ways(decoded, dialect)),
    )


def _kinds(ends: Ints, steps: Ints, slot: Ints) -> Ints:
    """RAPID or LINE for each row, by where it runs; waits are whatever comes out."""
    if not (ends[:, 2] < 0).any():
        return np.full(len(ends), np.int64(Kind.LINE))
    is_z = slot >= 2
    start_z = ends[:, 2] - np.where(is_z, steps[:, 2], 0)
    above = np.minimum(start_z, ends[:, 2]) >= 0
    rises = is_z & (steps[:, 2] > 0)
    return np.where(above | rises, np.int64(Kind.RAPID), np.int64(Kind.LINE))


def _feeds(
    steps: Ints, step_mm: npt.NDArray[np.float64], times: PulseTimes
) -> list[npt.NDArray[np.float64]]:
    """Feeds (R,) in X and Y, and in Z, mm/min; NaN where nothing moves."""
    way_xy = np.hypot(*(steps[:, :2] * step_mm[:2]).T)
    way_z = np.abs(steps[:, 2]) * step_mm[2]
    with np.errstate(invalid="ignore", divide="ignore"):
        return [
            60.0 * way_xy / times.legs_s(steps[:, :2]).sum(axis=1),
            60.0 * way_z / times.alone_s(steps[:, 2]),
        ]


def _two_ways(decoded: Decoded, dialect: Dialect) -> Iterator[Finding]:
    """READ_TWO_WAYS: runs that say a high byte, whose unit is 256 steps or 255."""
    pulses = dialect.pulses(decoded.steps)
    high = pulses // dialect.high_byte_steps
    count = int((high > 0).sum())
    if count and not dialect.long_runs:
        record = int((high > 0).any(axis=1).argmax())
        yield Finding(
            Code.READ_TWO_WAYS,
            Severity.WARNING,
            f"{count} runs of a motor have more than 255 steps; they are read by "
            f"dialect.high_byte = {dialect.high_byte}, and by the other reading (255 or 256) a "
            f"motor ends up to {int(high.sum(axis=0).max())} steps elsewhere: post again in "
            "shorter runs, or say dialect.long_runs=true where it is known",
            where=f"record {record + 1}",
            measured=float(count),
            unit="runs",
        )


def _findings(decoded: Decoded) -> tuple[Finding, ...]:
    if not decoded.rounded:
        return ()
    return (
        Finding(
            Code.VALUE_ROUNDED,
            Severity.INFO,
            f"{decoded.rounded} distances are no whole steps and were rounded, at most by "
            f"{decoded.worst_steps:.2f} steps",
            measured=decoded.worst_steps,
            unit="steps",
        ),
    )
