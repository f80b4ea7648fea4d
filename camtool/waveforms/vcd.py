"""Levels as a value change dump (IEEE 1364, 18.2), which GTKWave, PulseView and Surfer open.

A module for each port has its lines as wires; the module `motors` has the positions and the block
of the program, as integers. Written here: a dump is a few kinds of lines, and whole columns of
changes become text at once, thousands of moments a call."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from camtool.arrays import Ints
from camtool.plain import one_line
from camtool.target.signals import Board
from camtool.waveforms.levels import LineLevels, lines_of, port_names

SCALES = {0: "s", -3: "ms", -6: "us", -9: "ns", -12: "ps"}

WORD_BITS = 32


def timescale(tick_s: float) -> str:
    """Return the duration of a tick in the notation of a dump, such as "100 ps".

    >>> timescale(1e-3), timescale(1e-10)
    ('1 ms', '100 ps')
    """
    power = round(math.log10(tick_s))
    unit = 3 * math.floor(power / 3)
    return f"{10 ** (power - unit)} {SCALES[unit]}"


def _module(port: str) -> str:
    """Return the module name for a port; a letter is put before it, with which identifiers must
    begin."""
    return port if port[0].isalpha() else f"port_{port}"


class _Variable:
    """A variable of the dump: its code, its values in each moment, and the last one written."""

    def __init__(self, number: int, kind: str, bits: int, name: str) -> None:
        # Codes are of the printable characters ! to ~.
        digits = [number % 94, number // 94][: 1 + (number >= 94)]
        self.code = "".join(chr(33 + digit) for digit in digits)
        self.declaration = f"$var {kind} {bits} {self.code} {name} $end"
        self._is_wire, self._mask = bits == 1, (1 << bits) - 1
        self._last: int | None = None

    def changes(self, values: Ints) -> tuple[Ints, list[str]]:
        """Return the indices (C,) of the moments at which the variable changes, and the texts of
        these changes."""
        before = np.concatenate([[values[0] + 1 if self._last is None else self._last], values])
        index = np.flatnonzero(np.diff(before))
        self._last = int(values[-1])
        changed = values[index].tolist()
        if self._is_wire:
            return index, [f"{value}{self.code}" for value in changed]
        return index, [f"b{value & self._mask:b} {self.code}" for value in changed]


def dump(
    board: Board, moments: Iterable[LineLevels], block: Ints, title: str, end_tick: int | None
) -> Iterator[bytes]:
    """Yield the text of a dump. `block` (N,): the block (from 1) of each row of the toolpath;
    `end_tick`: the tick at which the dump ends, None: at its last change."""
    lines, ports = lines_of(board), port_names(board)
    wires = [_Variable(k, "wire", 1, line.name) for k, line in enumerate(lines)]
    names = [*(motor.name for motor in board.motors), "block"]
    words = [_Variable(len(lines) + k, "integer", WORD_BITS, name) for k, name in enumerate(names)]
    head = [
        f"$comment {one_line(title).replace('$', '_')} $end",
        f"$timescale {timescale(board.tick_s)} $end",
    ]
    for column, port in enumerate(ports):
        of_port = [
            wire.declaration
            for wire, line in zip(wires, lines, strict=True)
            if line.column == column
        ]
        head += [f"$scope module {_module(port)} $end", *of_port, "$upscope $end"]
    head += ["$scope module motors $end", *(word.declaration for word in words), "$upscope $end"]
    yield ("\n".join([*head, "$enddefinitions $end"]) + "\n").encode()
    first, last = True, 0
    for levels in moments:
        if not len(levels.tick):
            continue
        columns = [
            *((levels.ports[:, line.column] >> line.bit & 1).astype(np.int64) for line in lines),
            *levels.places.T,
            block[levels.row],
        ]
        text: list[list[str]] = [[] for _ in levels.tick]
        for variable, values in zip([*wires, *words], columns, strict=True):
            index, changes = variable.changes(values)
            for k, change in zip(index.tolist(), changes, strict=True):
                text[k].append(change)
        out: list[str] = []
        for tick, changes in zip(levels.tick.tolist(), text, strict=True):
            if first:
                out += [f"#{tick}", "$dumpvars", *changes, "$end"]
                first = False
            elif changes:
                out += [f"#{tick}", *changes] if tick != last else changes
            last = tick
        yield ("\n".join(out) + "\n").encode() if out else b""
    if end_tick is not None and end_tick > last:
        yield f"#{end_tick}\n".encode()
