"""The slaves of the Matlab router: speed loops with integers behind lines of whole chunks.

What the machine does with the rows of a toolpath:

1. The master runs them one at a time: a row's distance per axis, in tenths of a millimetre, and
   its speed per axis, in counts of the encoder in 5 ms, go to the slaves, which start together
   (Y a little after X) and stop each by itself. Rows of one program line are one such order.
2. Distances are differences: where an axis comes to stand beside its place, it goes on from there.
   Only homing brings it back to its zero.
3. Each slave runs as `steps` says. A line ends when all have had their counts;
   the motors still coast then, and are sampled on until the next line begins.

A sample is the place of all motors at a tick of 5 ms. `docs/controllers/matlab-router.md` has the
sources, and what is inferred."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.errors import MachineError
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.machine.servo import MotorModel, ServoTicks, SpeedLoop
from camtool.records import replace
from camtool.simulation.controller import ControllerModel
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Ledger, Options
from camtool.simulation.rows import refuse, with_event_positions
from camtool.simulation.timing import TimedChunk
from camtool.toolpath.moves import Kind, Toolpath

from .dialect import MatlabRouterController, MatlabRouterDialect, dialect_of
from .steps import (
    COUNT,
    DRIVE,
    FIRST_ROW,
    FOLLOWING,
    HOME_AMOUNT,
    HOME_SPEED,
    HOMING,
    PART_COUNT,
    PLACE,
    REF,
    SECOND_ROW,
    SHOWN,
    STAGE,
    TABLE_COUNTS,
    TARGET,
    TURN,
    Account,
    Program,
    State,
    slaves_fill,
)

_Machine = Machine[MatlabRouterController, MatlabRouterDialect]

MAX_DISTANCE_UNITS = 32767
"""Distances from home are an int16 of tenths of a millimetre (L4625-4635)."""

TICKS_AT_ONCE = 1 << 12

UNIT_MM = 0.1
"""The unit of the program (L3202-3204)."""


class MatlabRouterModel(ControllerModel[MatlabRouterController, MatlabRouterDialect]):
    """The slaves of the Matlab router: a servo for each axis."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Return the motion in chunks."""
        return _Run(self.quantised(toolpath, machine), machine, options).run()

    samples_per_speed = 1

    def timed(
        self, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> Iterator[TimedChunk]:
        """Yield the motion with the times of its samples, one a tick. Dwells, and the transmission
        of a job's numbers, pass before the samples of their row."""
        run = _Run(self.quantised(toolpath, machine), machine, options)
        ticks = 0
        for chunk in run.run():
            tick = np.arange(ticks, ticks + len(chunk.row))
            begin_s = tick * TICK_S + run.standing_s[chunk.row]
            yield TimedChunk(chunk, begin_s + TICK_S, begin_s, begin_s + TICK_S)
            ticks += len(tick)

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the toolpath with all ends on whole counts from home, and with homing at home.
        Raise ProgramError for arcs, which the machine does not have, and for ends farther from
        home than a program can say."""
        mend = "post the drawing for it: arcs become lines then"
        refuse(toolpath, toolpath.is_arc, "this machine has no arcs", mend)
        home = np.array(machine.controller.machine_zero_mm)
        is_far = (np.abs(toolpath.end - home) > MAX_DISTANCE_UNITS * UNIT_MM).any(axis=1)
        refuse(toolpath, is_far, "a position is beyond all that the controller can count")
        end = with_event_positions(toolpath, home).end
        coded = [axis.coded_step_mm for axis in machine.axes]
        columns = [
            to_steps((end - home)[:, index], step) * step for index, step in enumerate(coded)
        ]
        return replace(toolpath, end=home + np.column_stack(columns))

    def spacing_mm(self, toolpath: Toolpath, machine: _Machine) -> float:
        """Return the longest travel of an axis in one tick, mm, at the highest feed of the
        machine or of the program."""
        feeds = toolpath.feed[np.isfinite(toolpath.feed)]
        fastest = min(float(feeds.max(initial=0.0)), machine.max_feed_mm_min)
        rapid = machine.rapid_mm_min if np.isfinite(machine.rapid_mm_min) else 0.0
        step = min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
        return max(step, max(fastest, rapid) / 60.0 * TICK_S)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "servo": each axis follows its own speed loop."""
        return "servo"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind times and figures, as sentences for the report."""
        router = machine.controller
        law = (
            "slave X's program"
            if router.slaves == "listing"
            else "the program that the text describes"
        )
        rub = "no" if not any(router.friction_percent) else "dry"
        return (
            f"each slave runs {law} on all axes (controller.slaves)",
            f"the motors are of first order, with {rub} friction (controller.plant_gain,"
            " time_constant_s, friction_percent)",
            f"the speeds of the last 1000 counts are a root up to {router.table_counts} counts"
            " (controller.table_counts): the thesis does not list them",
            f"{1e3 * router.turnaround_s:g} ms between lines, {1e3 * router.pause_s:g} ms behind"
            " homing and plunges (controller.turnaround_s, pause_s)",
            "homing is even and ends at rest on machine zero",
        )


class _Run:
    """Run of a toolpath; ProgramError for rows that the controller cannot follow."""

    def __init__(self, path: Toolpath, machine: _Machine, options: Options) -> None:
        self._rows = path.executed_rows
        self._path = path
        self._lines: MasterOrders = lines_of(path, self._rows, machine)
        self.standing_s = np.cumsum(self._lines.extra_s)
        """Time (R,) s that the rows up to each take in addition to its ticks."""
        self._mechanics = Mechanics(machine, path.start, options.effects)
        # With even backlash the slide does not depend on what lies between two reversals.
        thin = (path.kind[: self._rows] == Kind.RAPID) & (
            not options.rapids and self._mechanics.even
        )
        self._program = program_of(self._lines.orders, self._lines.pauses_s, thin, machine)
        self._state = state_of(path.start, machine)
        self._account = account_of(self._rows)
        self._home = np.array(machine.controller.machine_zero_mm)
        coded = np.array([axis.coded_step_mm for axis in machine.axes])
        self._count_mm = SIGNS * coded
        self._samples = options.chunk_steps
        # One long row: numpy multiplies rows of three numbers in a tenth of the speed.
        self._counts_mm = np.tile(self._count_mm, self._samples)
        self._homes = np.tile(self._home, self._samples)

    def run(self) -> Iterator[Chunk]:
        """Yield the chunks of all rows up to the end of the program."""
        complete, finished = 0, False
        while not finished:
            positions = np.empty((self._samples, 3), dtype=np.int64)
            row = np.empty(self._samples, dtype=np.int64)
            filled, finished = slaves_fill(
                self._program, self._state, self._account, positions, row
            )
            row = row[:filled]
            closed = int(self._state.clock[1])
            next_row = int(self._lines.orders[closed - 1, SECOND_ROW]) + 1 if closed else 0
            next_row = self._rows if finished else next_row
            last = max(next_row, int(row[-1]) + 1) if filled else next_row
            if filled or last > complete:
                yield self._chunk((complete, next_row, last), row, positions[:filled])
            complete = next_row

    def ticks(self) -> Iterator[ServoTicks]:
        """Yield the passes of the slaves' interrupts, read from the compiled loop tick by tick."""
        start, travel, goal = self._ordered_motion()
        orders, top = self._lines.orders, int(self._program.table[-1])
        motors, slaves = self._state.motors, self._state.slaves
        positions, row = np.empty((1, 3), dtype=np.int64), np.empty(1, dtype=np.int64)
        tick, is_done = 0, False
        while not is_done:
            rows: list[int] = []
            lines: list[int] = []
            parts: list[tuple[Floats, ...]] = []
            while len(rows) < TICKS_AT_ONCE and not is_done:
                # Motors coast after their line; that belongs to it, up to the next one.
                line = int(self._state.clock[1])
                since = tick + 1.0 - float(self._state.begin[0])
                if line == len(orders) or since <= 0.0:
                    line, since = line - 1, math.inf
                order = max(line, 0)
                to_go = slaves[:, TARGET] - slaves[:, COUNT]
                before = motors[:, PLACE].copy()
                filled, is_done = slaves_fill(
                    self._program, self._state, self._account, positions, row
                )
                if not filled:
                    break
                reference = np.where(
                    slaves[:, STAGE] == HOMING, goal[order], slaves[:, REF].astype(float)
                )
                if self._program.text:
                    fast = np.minimum(
                        np.abs(slaves[:, REF]), top * np.sqrt(np.abs(to_go) / TABLE_COUNTS)
                    )
                    follows = slaves[:, STAGE] == FOLLOWING
                    reference = np.where(follows, np.copysign(fast, to_go), reference)
                distance = np.abs(travel[order])
                if line < 0:
                    distance = np.zeros(3)
                elif math.isfinite(since):
                    distance = np.minimum(np.abs(goal[order]) * since, distance)
                reached = motors[:, PLACE].copy()
                parts.append(
                    (
                        reference,
                        reached - before,
                        motors[:, DRIVE].copy(),
                        start[order] + np.sign(travel[order]) * distance,
                        reached,
                        goal[order],
                    )
                )
                rows.append(int(row[0]))
                lines.append(line)
                tick += 1
            if rows:
                of_row = np.array(rows)
                at_s = (tick - len(rows) + 1 + np.arange(len(rows))) * TICK_S
                columns = np.array(parts).transpose(1, 0, 2)
                yield ServoTicks(at_s + self.standing_s[of_row], of_row, np.array(lines), *columns)

    def _ordered_motion(self) -> tuple[Floats, Floats, Floats]:
        """Return for each of L lines, in counts on X, Y and Z: where it begins (from home) and its
        travel, and its signed speed in counts per tick; all (L, 3). A program without motion gives
        one line of zeros."""
        orders, path = self._lines.orders, self._path
        if not len(orders):
            return np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3))
        first, second = orders[:, FIRST_ROW], orders[:, SECOND_ROW]
        start = (path.starts_of(first) - self._home) / self._count_mm
        end = (path.end[second] - self._home) / self._count_mm
        homes = orders[:, :3] == HOME_AMOUNT
        speed = np.where(homes, self._program.axes[:, HOME_SPEED], np.abs(orders[:, 3:6]))
        return start, end - start, np.sign(end - start) * speed

    def _chunk(self, span: tuple[int, int, int], row: Ints, count: Ints) -> Chunk:
        """Return the samples of a chunk and the ledger of its rows. `span` holds three row
        numbers: rows before the first are accounted for, rows before the second are complete, rows
        before the third have samples here."""
        first, complete, last = span
        first = min(first, int(row[0])) if len(row) else first
        rows = np.arange(first, last)
        offsets = np.searchsorted(row, np.arange(first, last + 1))
        commanded = count.reshape(-1) * self._counts_mm[: count.size]
        commanded += self._homes[: count.size]
        commanded = commanded.reshape(-1, 3)
        slide, reversals = NO_SAMPLES, np.zeros((len(rows), 3), dtype=np.int64)
        if len(row):
            slide, reversals = self._mechanics.follow(commanded, offsets)
        is_complete = (rows >= span[0]) & (rows < complete)
        seconds = np.where(
            is_complete, self._account.ticks[rows] * TICK_S + self._lines.extra_s[rows], 0
        )
        ledger = Ledger(
            row=rows,
            duration_s=seconds,
            compensation_s=np.zeros(len(rows)),
            iterations=self._account.samples[first:last].copy(),
            steps=self._account.steps[first:last].copy(),
            reversals=reversals,
            ended=~is_complete | self._account.has_ended[rows],
        )
        # The next chunk may go on in the last of these rows.
        self._account.steps[first:last] = 0
        self._account.samples[first:last] = 0
        return Chunk(row, commanded, slide, ledger)


# What the master of the Matlab router orders: rows of a toolpath as lines of its slaves.
#
#     distance  d = |way| / 0.1 mm, a whole number;  chunks = (d / 2 − 1 in an unsigned int16) + 1
#     speed     v = feed · |way of the axis| / |way| in counts in 5 ms, rounded; sign: direction
#
# The reader of the dialect says as the feed of a line what both its speeds together are, so they
# come out as they were: hypot(V, v) squared is a whole number, and (V, v) the pair of whole
# numbers with that sum of squares that is nearest to the way. (Two such pairs are at least √2
# apart, and those of the GUI lie within half a count of the way.)

UNITS_PER_MM = 10

INT16 = 0xFFFF
"""The slaves' counter of chunks is unsigned, 16 bits (L5589-5600)."""

INT32 = 0x7FFFFFFF
"""Orders of the master must fit a signed int of 32 bits."""

NUMBERS_OF_HEADER, NUMBERS_OF_LINE = 3, 4
"""Counts of numbers that the PC sends for a job and for each of its lines (L4294-4360)."""

PATIENCE, PATIENCE_TICKS = 4.0, 400.0
"""Longest time of a line: a multiple of the time that its speeds need, and two seconds more."""

SETTLE_TAUS = 12.0
"""A job is followed for this many time constants after its last line: 6e-6 of the speed is
left."""

PAIR_COUNTS = 10
"""The speeds of a line are searched up to this far from those of its path, in counts in a tick."""

LINES_AT_ONCE = 1 << 12

PAIR_TOLERANCE = 1e-4
"""A sum of squares of speeds that is a whole number within this comes from a program."""

ON_HOME_COUNTS = 0.5
"""A position within this many counts of home is home."""

TEXT_FACTORS = ((10.0, 1), (100.0, 10), (1100.0, 100), (math.inf, 1000))
"""Equation 4.49 (L3077-3097): a distance up to so many tenths of a millimetre goes in so many
equal parts."""


class MasterOrders(Struct, frozen=True, eq=False):
    """L orders of the master. orders (L, 11): `Program.lines` of the kernel; pauses_s (L,) behind
    each, negative where the next line begins on a tick; extra_s (N,): additional time of rows
    (dwells, and the transmission of a job's numbers from the PC)."""

    orders: Indices
    pauses_s: Floats
    extra_s: Floats


def lines_of(path: Toolpath, rows: int, machine: _Machine) -> MasterOrders:
    """Return the orders for the first `rows` rows of a quantised toolpath.

    Raises ProgramError for a line without a feed above 0, a dwell without its seconds, and part
    zero set anew away from part zero."""
    _check(path, rows)
    router = machine.controller
    way_mm = (path.end - path.starts)[:rows] * SIGNS if rows else np.zeros((0, 3))
    kind = path.kind[:rows]
    straight = kind == Kind.LINE
    homes = _homing(path, way_mm, machine)
    first = np.flatnonzero((way_mm != 0.0).any(axis=1))
    second = first.copy()
    tail = _are_tails(path, way_mm, first)
    second[np.flatnonzero(tail) - 1] = first[tail]
    first, second = first[~tail], second[~tail]
    orders = np.empty((len(first), PART_COUNT + 1), dtype=np.int32)
    header = ~straight[first]
    for low in range(0, len(first), LINES_AT_ONCE):
        batch = slice(low, low + LINES_AT_ONCE)
        begin, end = first[batch], second[batch]
        travel = way_mm[begin]
        travel[begin != end] += way_mm[end[begin != end]]
        speeds = _speeds(path, way_mm, begin, machine)
        ref = np.where(travel < 0.0, -speeds, speeds)
        amount = _axis_counts(travel, router, machine)
        amount = np.where(homes[begin][:, None] & (travel != 0.0), HOME_AMOUNT, amount)
        patience = _patience(travel, ref, amount, machine)
        part = _axis_beyond(path, begin, end, machine)
        orders[batch] = _to_int32(np.column_stack([amount, ref, begin, end, patience, part]))
        header[batch] |= travel[:, 2] != 0.0
    extra = np.where(kind == Kind.DWELL, path.value[:rows], 0.0)
    ends = _ends(header, homes[first], machine)
    return MasterOrders(
        orders, _pauses(header, ends, router), extra + _link(header, first, rows, router)
    )


def _to_int32(orders: Ints) -> Indices:
    """Convert orders to 32 bits; MachineError for numbers that do not fit."""
    if np.abs(orders).max(initial=0) > INT32:
        raise MachineError(
            "a position has more counts than 32 bits hold",
            where="table [axes], keys coded_step_mm",
            mend="write how far each count really goes",
        )
    return orders.astype(np.int32)


def _check(path: Toolpath, rows: int) -> None:
    """Raise ProgramError for rows that the controller cannot follow."""
    running = np.arange(len(path)) < rows
    with np.errstate(invalid="ignore"):
        no_feed = path.is_feed & ~((path.feed > 0.0) & np.isfinite(path.feed))
        no_time = (path.kind == Kind.DWELL) & ~((path.value >= 0.0) & np.isfinite(path.value))
    is_moved = (path.kind == Kind.SET_ZERO) & path.end.any(axis=1)
    for is_bad, message in (
        (no_feed, "a cutting move without a feed above 0"),
        (no_time, "a dwell without its seconds"),
        (is_moved, "part zero is set away from part zero"),
    ):
        refuse(path, is_bad & running, message)


def _homing(path: Toolpath, way_mm: Floats, machine: _Machine) -> Bools:
    """Return a mask (R,), true for rows that go home: homing, and rapids that end at home on all
    axes that move."""
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    distance = np.abs(path.end[: len(way_mm)] - np.array(machine.controller.machine_zero_mm))
    ends_home = ((distance <= ON_HOME_COUNTS * coded) | (way_mm == 0.0)).all(axis=1)
    kind = path.kind[: len(way_mm)]
    homing = (kind == Kind.HOME_XY) | (kind == Kind.HOME_Z)
    return np.asarray(homing | ((kind == Kind.RAPID) & ends_home & (way_mm <= 0.0).all(axis=1)))


def _are_tails(path: Toolpath, way_mm: Floats, first: Ints) -> Bools:
    """Return a mask (L,) over the rows `first`, true where a row only continues the program line
    of the row before it, because one axis arrives later than the other."""
    block, travel = path.block[first], way_mm[first]
    flat = (path.kind[first] == Kind.LINE) & (travel[:, 2] == 0.0)
    tail = np.zeros(len(first), dtype=np.bool_)
    tail[1:] = (block[1:] == block[:-1]) & (block[1:] >= 0) & flat[1:] & flat[:-1]
    tail[1:] &= (np.diff(first) == 1) & ((travel[1:] != 0.0).sum(axis=1) == 1)
    tail[2:] &= ~tail[1:-1]
    return tail


def _axis_beyond(path: Toolpath, first: Ints, second: Ints, machine: _Machine) -> Ints:
    """Return (L, 2): the axis that goes on alone from the row `first` to the row `second`, and its
    count from home at the end of `first`; zeros where both are the same row."""
    part = np.zeros((len(first), 2), dtype=np.int64)
    pairs = np.flatnonzero(first != second)
    axis = np.abs(path.end[second] - path.end[first])[pairs, :2].argmax(axis=1)
    home = np.array(machine.controller.machine_zero_mm)
    coded = np.array([each.coded_step_mm for each in machine.axes])
    part[pairs, 0] = axis
    part[pairs, 1] = np.rint((path.end[first[pairs], axis] - home[axis]) / coded[axis])
    return part


def _speeds(path: Toolpath, way_mm: Floats, first: Ints, machine: _Machine) -> Ints:
    """Return the speeds (L, 3) of the axes in the rows `first`, counts per tick."""
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    travel = np.abs(way_mm[first])
    feed = path.feed[first] / (60.0 * TICKS_PER_S)
    along = feed[:, None] * travel / np.linalg.norm(travel, axis=1)[:, None]
    # No axis takes more than an int16, and none of the listing's programs sends as much.
    speeds_wanted = np.minimum(np.where(np.isfinite(along), along / coded, 0.0), INT16)
    speeds = to_steps(speeds_wanted, 1.0)
    slanted = np.flatnonzero(
        (speeds_wanted[:, 0] > 0.0) & (speeds_wanted[:, 1] > 0.0) & (speeds_wanted[:, 2] == 0.0)
    )
    speeds[slanted, :2] = _speed_pairs(speeds_wanted[slanted, :2])
    rapid_mm = machine.rapid_mm_min / (60.0 * TICKS_PER_S)
    rapid = to_steps(min(rapid_mm, INT16 * coded[0]), float(coded[0]))
    return np.where((path.kind[first] == Kind.LINE)[:, None], speeds, rapid)


def _speed_pairs(speeds: Floats) -> Ints:
    """Return (K, 2) integer speeds whose sum of squares equals that of `speeds` (K, 2) rounded:
    the pair nearest to them within `PAIR_COUNTS`. Where there is no such pair, each speed is
    rounded by itself."""
    total = np.rint((speeds**2).sum(axis=1))
    rounded = to_steps(speeds, 1.0)
    slow = speeds.argmin(axis=1)[:, None]
    nearest_speeds = np.take_along_axis(rounded, slow, axis=1)
    nearest_speeds = nearest_speeds + np.arange(-PAIR_COUNTS, PAIR_COUNTS + 1)
    other = np.rint(np.sqrt(np.maximum(total[:, None] - nearest_speeds**2, 0.0))).astype(np.int64)
    adds_up = (nearest_speeds >= 0) & (nearest_speeds**2 + other**2 == total[:, None])
    errors = np.abs(nearest_speeds - np.take_along_axis(speeds, slow, axis=1))
    best = np.where(adds_up, errors, np.inf).argmin(axis=1)[:, None]
    pair = np.empty_like(rounded)
    np.put_along_axis(pair, slow, np.take_along_axis(nearest_speeds, best, axis=1), axis=1)
    np.put_along_axis(pair, 1 - slow, np.take_along_axis(other, best, axis=1), axis=1)
    exact = np.abs((speeds**2).sum(axis=1) - total) <= PAIR_TOLERANCE
    return np.asarray(np.where((adds_up.any(axis=1) & exact)[:, None], pair, rounded))


def _axis_counts(way_mm: Floats, router: MatlabRouterController, machine: _Machine) -> Ints:
    """Return the distances (L, 3) that the slaves receive: chunks with the listing's program, else
    counts of the encoder; 0 where an axis does not move."""
    units = to_steps(np.abs(way_mm), 1.0 / UNITS_PER_MM)
    if router.slaves == "listing":
        return np.asarray(np.where(units > 0, ((units // 2 - 1) & INT16) + 1, 0))
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    counts = np.rint(np.abs(way_mm) / coded).astype(np.int64)
    bounds = np.array([bound for bound, _ in TEXT_FACTORS])
    parts = np.array([factor for _, factor in TEXT_FACTORS])[np.searchsorted(bounds, units)]
    return np.asarray(counts // parts * parts)


def _patience(way_mm: Floats, ref: Ints, amount: Ints, machine: _Machine) -> Ints:
    """Return (L,) ticks after which the simulation gives up waiting for the axes of a line to
    arrive."""
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    router = machine.controller
    speed = np.where(amount < 0, np.array(router.home_counts), np.abs(ref))
    needed = np.abs(way_mm) / coded / np.maximum(speed, 1)
    needed = np.where(speed > 0, needed, 0.0)
    ticks = PATIENCE * needed.max(axis=1, initial=0.0) + PATIENCE_TICKS
    return np.asarray(np.ceil(ticks).astype(np.int64))


def _ends(header: Bools, homing: Bools, machine: _Machine) -> Bools:
    """Return a mask (L,), true for the last line of each job: its last cut, or the way home behind
    it where the master raises the tool at the end."""
    ends: Bools = ~header & np.append(header[1:], True)
    if dialect_of(machine).end == "raise":
        behind_cuts = np.cumsum(~header) > 0
        ends = homing & behind_cuts & np.append((header & ~homing)[1:], True)
    if len(ends):
        ends[-1] = True
    return ends


def _pauses(header: Bools, ends: Bools, router: MatlabRouterController) -> Floats:
    """Return (L,) seconds of pause behind each line. Behind the last line of a job it is negative:
    the next job begins after a reset of the master, which is not synchronous with the slaves'
    ticks, and is simulated to begin on a tick."""
    pauses = np.where(header, router.pause_s, router.turnaround_s)
    settle = SETTLE_TAUS * max(router.time_constant_s)
    return np.where(ends, -np.maximum(settle, pauses), pauses)


def _link(header: Bools, first: Ints, rows: int, router: MatlabRouterController) -> Floats:
    """Return (R,) seconds that the transmission of each job's numbers takes, at the first row of
    its way home; 0 in all other rows."""
    extra = np.zeros(rows)
    opens = np.flatnonzero(header & ~np.concatenate([[False], header[:-1]]))
    lines = np.add.reduceat(~header, opens) if len(opens) else np.zeros(0)
    pause = NUMBERS_OF_HEADER * router.header_pause_s
    extra[first[opens]] = pause + lines * NUMBERS_OF_LINE * router.number_pause_s
    return extra


# The machine's numbers as arrays for the kernel.

TICK_S = 0.005
"""The slaves' timer: (65536 − 53036) · 2 / 5 MHz (L2757)."""

TICKS_PER_S = 200

SIGNS = np.array([1, 1, -1])
"""Home is at the low ends of X and Y and at the top of Z: all distances are away from it."""

TEXT_KID = (17.549, 28.152, 16.2)
"""Table 4.1, L2872-2880, in thousandths; the table's order is Y, X, Z."""

TEXT_KPD = (98.125, 159.124, 92.64)
"""The same."""

IDENTIFIED = 70.0
"""The drive at which gains were measured (L2704): its speed does not depend on the friction."""


GAIN_UNIT = 0.001
"""Gains are stored in thousandths (L5104-5106)."""


def speed_loop(router: MatlabRouterController) -> SpeedLoop:
    """Return the motors and the gains of the slaves."""
    is_text = router.slaves == "text"
    motors = (
        MotorModel(gain * IDENTIFIED / (IDENTIFIED - friction), time_constant_s, friction)
        for gain, time_constant_s, friction in zip(
            router.plant_gain, router.time_constant_s, router.friction_percent, strict=True
        )
    )
    return SpeedLoop(
        tick_s=TICK_S,
        motors=tuple(motors),
        kid=router.kid or (TEXT_KID if is_text else (28.0,) * 3),
        kpd=router.kpd or (TEXT_KPD if is_text else (159.0,) * 3),
        gain_unit=GAIN_UNIT,
        is_whole=not is_text,
        counts_per_turn=TURN,
    )


def servo_ticks(toolpath: Toolpath, machine: _Machine) -> Iterator[ServoTicks]:
    """Yield the passes of the slaves' interrupts while they run a toolpath."""
    path = MatlabRouterModel().quantised(toolpath, machine)
    return _Run(path, machine, Options()).ticks()


def loop_keys(loop: SpeedLoop) -> dict[str, Any]:
    """Return the `[controller]` table that describes these motors and gains, to 6 digits."""
    motors = loop.motors
    keys = {
        "plant_gain": [motor.speed_at(IDENTIFIED) / IDENTIFIED for motor in motors],
        "time_constant_s": [motor.time_constant_s for motor in motors],
        "friction_percent": [motor.friction_percent for motor in motors],
        "kid": loop.kid,
        "kpd": loop.kpd,
    }
    return {key: [float(f"{value:.6g}") for value in values] for key, values in keys.items()}


def program_of(orders: Indices, pauses_s: Floats, thin: Bools, machine: _Machine) -> Program:
    """Return the program for the compiled loops; MachineError for gains that the listing's
    integers cannot hold."""
    router = machine.controller
    text = router.slaves == "text"
    loop = speed_loop(router)
    axes = np.zeros((3, 8))
    axes[:, 0] = [motor.gain for motor in loop.motors]
    axes[:, 1] = [motor.time_constant_s * TICKS_PER_S for motor in loop.motors]
    axes[:, 2] = router.friction_percent
    axes[:, 3], axes[:, 4] = loop.kid, loop.kpd
    axes[:, 5] = router.chunk_counts
    axes[:, 6] = 0 if text else router.home_phase_counts
    axes[:, 7] = router.home_counts
    if not text and (axes[:, 3:5] % 1.0).any():
        raise MachineError(
            "the gains of the listing are whole thousandths",
            where="table [controller], keys kid and kpd",
            mend='round them, or write slaves = "text"',
        )
    share = np.arange(TABLE_COUNTS + 1) / TABLE_COUNTS
    table = np.rint(router.table_counts * np.sqrt(share)).astype(np.int64)
    lag = router.start_lag_s * TICKS_PER_S
    return Program(orders, pauses_s * TICKS_PER_S, axes, table, lag, text, thin)


def state_of(start_mm: Floats, machine: _Machine) -> State:
    """Return the state of all motors at rest at a place (3,) mm."""
    router = machine.controller
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    place = np.rint((start_mm - np.array(machine.controller.machine_zero_mm)) * SIGNS / coded)
    motors, slaves = np.zeros((3, 6)), np.zeros((3, 11), dtype=np.int64)
    motors[:, PLACE] = place
    slaves[:, COUNT] = slaves[:, TARGET] = slaves[:, SHOWN] = place
    if router.slaves == "listing":
        slaves[:, SHOWN] = (slaves[:, COUNT] + np.array(router.home_phase_counts)) % TURN
    return State(motors, slaves, np.zeros(3, dtype=np.int64), np.zeros(2))


def account_of(rows: int) -> Account:
    """Return the account of `rows` rows, none of which has been run yet."""
    steps, samples = np.zeros((rows, 3), dtype=np.int64), np.zeros(rows, dtype=np.int64)
    return Account(np.zeros(rows), steps, np.ones(rows, dtype=np.bool_), samples)
