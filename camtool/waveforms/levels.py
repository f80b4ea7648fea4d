"""The levels of all lines of a controller over time, from the pulses of its motors.

A row is a moment at which a line changes: the bytes of all ports and the positions of all motors
from then on. Pulses within one tick are one row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Ints, distinct
from camtool.simulation.pulses import Pulses, in_order
from camtool.target.signals import Board, Coils, StepDirection

Bytes = npt.NDArray[np.uint8]


class LineLevels(Struct, frozen=True, eq=False):
    """L moments in order: `tick` (L,) since the start of the program; `ports`
    (L, P), the bytes of the ports; `places` (L, M), the positions of the motors in steps or states
    of their coils, with the steps that the controller adds; `row` (L,) of the toolpath."""

    tick: Ints
    ports: Bytes
    places: Ints
    row: Ints

    def part(self, low: int, high: int) -> LineLevels:
        """Return the moments low:high."""
        rows = slice(low, high)
        return LineLevels(self.tick[rows], self.ports[rows], self.places[rows], self.row[rows])


class Line(Struct, frozen=True):
    """A line of a motor: its name, such as "X_A", and the bit of the port in this column."""

    motor: str
    name: str
    column: int
    bit: int


def port_names(board: Board) -> tuple[str, ...]:
    """Return the names of the ports, in the order in which the motors use them."""
    names: dict[str, None] = {}
    for motor in board.motors:
        if isinstance(motor, Coils):
            names[motor.port] = None
        else:
            names |= {motor.step[0]: None, motor.direction[0]: None}
    return tuple(names)


def lines_of(board: Board) -> tuple[Line, ...]:
    """Return the lines of all motors, motor by motor."""
    ports, lines = port_names(board), []
    for motor in board.motors:
        if isinstance(motor, Coils):
            lines += [
                Line(motor.name, f"{motor.name}_{name}", ports.index(motor.port), motor.shift + k)
                for k, name in enumerate(motor.lines)
            ]
        else:
            for name, (port, bit) in (("step", motor.step), ("dir", motor.direction)):
                lines.append(Line(motor.name, f"{motor.name}_{name}", ports.index(port), bit))
    return tuple(lines)


def levels(board: Board, chunks: Iterable[Pulses]) -> Iterator[LineLevels]:
    """Yield the moments of all pulses, chunk by chunk. The first, at tick 0, is the state before
    the program; all others are at different ticks, in order."""
    run = _LevelRun(board)
    yield run.start()
    for pulses in chunks:
        yield run.add(pulses)
    yield run.finish()


class _Changes(Struct, frozen=True, eq=False):
    """Changes of the bits `mask` of the port in this column: at tick (E,), to `value` (E,)."""

    column: int
    mask: int
    tick: Ints
    value: Ints


class _LevelRun:
    """State of a run: the bytes and positions so far, and what is still to come."""

    def __init__(self, board: Board) -> None:
        self._board, names = board, port_names(board)
        self._columns = {name: k for k, name in enumerate(names)}
        self._bytes = np.zeros(len(names), dtype=np.int64)
        count = len(board.motors)
        self._places = np.zeros(count, dtype=np.int64)
        self._phases: list[int | None] = [None] * count
        for k, motor in enumerate(board.motors):
            if isinstance(motor, Coils) and motor.at_start == "first":
                self._phases[k] = 0
                self._bytes[self._columns[motor.port]] |= motor.states[0] << motor.shift
        self._row = 0
        self._waiting = Pulses.none(count)
        self._falls: list[_Changes] = []

    def start(self) -> LineLevels:
        """Return the moment at the start of the program, before any pulse."""
        return LineLevels(
            np.zeros(1, dtype=np.int64),
            self._bytes[None, :].astype(np.uint8),
            self._places[None, :].copy(),
            np.zeros(1, dtype=np.int64),
        )

    def add(self, pulses: Pulses) -> LineLevels:
        """Return the moments that are final: those before the next pulses can come."""
        until = int(np.rint(pulses.until_s / self._board.tick_s))
        pulses = in_order([self._waiting, pulses], pulses.until_s)
        ticks = np.rint(pulses.at_s / self._board.tick_s).astype(np.int64)
        count = int(np.searchsorted(ticks, until))
        self._waiting = pulses.part(count, len(ticks))
        return self._moments(ticks[:count], pulses.part(0, count), until)

    def finish(self) -> LineLevels:
        """Return the moments that remain."""
        pulses = self._waiting
        ticks = np.rint(pulses.at_s / self._board.tick_s).astype(np.int64)
        return self._moments(ticks, pulses, None)

    def _moments(self, ticks: Ints, pulses: Pulses, until: int | None) -> LineLevels:
        changes = [*self._falls]
        for k in range(len(self._board.motors)):
            changes += self._of_motor(k, ticks, pulses.moves[:, k])
        if until is not None:
            self._falls = [_those(each, each.tick >= until) for each in changes]
            changes = [_those(each, each.tick < until) for each in changes]
        moments = distinct(np.concatenate([ticks, *(each.tick for each in changes)]))
        ports = np.tile(self._bytes, (len(moments), 1))
        for each in changes:
            index = np.searchsorted(moments, each.tick)
            latest = np.full(len(moments), -1)
            latest[index] = np.arange(len(index))
            latest = np.maximum.accumulate(latest)
            is_set = latest >= 0
            column = ports[:, each.column]
            column[is_set] = (column[is_set] & ~each.mask) | each.value[latest[is_set]]
        travelled = np.concatenate(
            [self._places[None, :], self._places + np.cumsum(pulses.moves, axis=0)]
        )
        count = np.searchsorted(ticks, moments, side="right")
        places = travelled[count]
        row = np.concatenate([[self._row], pulses.row])[count]
        if len(moments):
            self._bytes, self._places, self._row = ports[-1], places[-1], int(row[-1])
        return LineLevels(moments, ports.astype(np.uint8), places, row)

    def _of_motor(self, number: int, ticks: Ints, moves: Ints) -> list[_Changes]:
        """Return the changes of the lines of motor `number`, which makes `moves` at `ticks`."""
        motor = self._board.motors[number]
        moving = np.flatnonzero(moves)
        if not len(moving):
            return []
        at, travel = ticks[moving], moves[moving]
        if isinstance(motor, Coils):
            phase = self._phases[number]
            first = (-1 if travel[0] > 0 else 0) if phase is None else phase
            phases = (first + np.cumsum(travel)) % len(motor.states)
            self._phases[number] = int(phases[-1])
            mask = ((1 << len(motor.lines)) - 1) << motor.shift
            values = np.array(motor.states)[phases] << motor.shift
            return [_Changes(self._columns[motor.port], mask, at, values)]
        return self._of_driver(motor, at, travel)

    def _of_driver(self, motor: StepDirection, at: Ints, travel: Ints) -> list[_Changes]:
        """Return the changes of a motor's step and direction lines. The step line does not fall
        between two pulses if the first lasts until the second."""
        (step_port, step_bit), (way_port, way_bit) = motor.step, motor.direction
        falls = at + max(int(np.rint(motor.width_s / self._board.tick_s)), 1)
        edges = np.concatenate([falls, at])
        levels_after = np.concatenate([np.zeros_like(at), np.full_like(at, 1 << step_bit)])
        order = np.lexsort((levels_after, edges))
        is_high = np.where(travel > 0, motor.positive, 1 - motor.positive)
        return [
            _Changes(self._columns[step_port], 1 << step_bit, edges[order], levels_after[order]),
            _Changes(self._columns[way_port], 1 << way_bit, at, is_high << way_bit),
        ]


def _those(changes: _Changes, mask: npt.NDArray[np.bool_]) -> _Changes:
    return _Changes(changes.column, changes.mask, changes.tick[mask], changes.value[mask])
