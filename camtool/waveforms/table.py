"""Levels as a table: a line for each moment, with the bytes of all ports from then on.

    time_ms,0x378,0xBC00,x,y,z,spindle,block
    0,0,0,0,0,0,0,1
    2,9,9,1,0,0,1,1

A player waits until `time_…` after its start and writes each byte to its port. docs/signals.md
describes the format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from camtool.arrays import Ints
from camtool.errors import OptionError
from camtool.target.signals import Board
from camtool.waveforms.levels import LineLevels, port_names

MAX_ROWS = 10_000_000

PER_S = {"ms": 3, "us": 6}
"""Powers of ten of the units of a second."""


def time_texts(board: Board, tick: Ints) -> list[str]:
    """Return the times (L,) as text in the board's unit, with as many decimals as one tick
    needs."""
    per_unit = round(10.0 ** -PER_S[board.unit] / board.tick_s)
    if per_unit == 1:
        return [str(value) for value in tick.tolist()]
    decimals = len(str(per_unit)) - 1
    return [f"{value // per_unit}.{value % per_unit:0{decimals}d}" for value in tick.tolist()]


def table(
    board: Board, moments: Iterable[LineLevels], block: Ints, *, max_rows: int = MAX_ROWS
) -> Iterator[bytes]:
    """Yield the text of a table. `block` (N,): the block (from 1) of each row of the toolpath.
    OptionError for more than `max_rows`."""
    motors = (motor.name.lower() for motor in board.motors)
    yield (",".join([f"time_{board.unit}", *port_names(board), *motors, "block"]) + "\n").encode()
    rows = 0
    for levels in moments:
        rows += len(levels.tick)
        if rows > max_rows:
            raise OptionError(
                f"a table of more than {max_rows:,} rows",
                mend="give --from and --span, or write a .vcd",
            )
        columns = (
            time_texts(board, levels.tick),
            *(map(str, column) for column in levels.ports.T.tolist()),
            *(map(str, column) for column in levels.places.T.tolist()),
            map(str, block[levels.row].tolist()),
        )
        lines = map(",".join, zip(*columns, strict=True))
        yield "\n".join(chain(lines, [""])).encode()
