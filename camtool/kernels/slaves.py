"""The slaves of the Matlab router: three speed loops with integers, three motors, one master.

Time runs in ticks of 5 ms, places in counts of the encoder. At each tick every slave measures its
speed and sets a drive u (percent); between two ticks the motor does

    τ dω/dt = A u' − ω,   u' = u − friction · sign ω        (G(s) = A / (τ s + 1), eq. 4.32)

Since u is held from tick to tick, this has a closed form (zero-order hold), with V = A u':

    ω(t) = V + (ω₀ − V) e^(−t/τ)
    θ(t) = θ₀ + V t + (ω₀ − V) τ (1 − e^(−t/τ))

which at t = 1 tick is the pulse transfer function A (1 − q) / (z − q), q = e^(−1/τ), eq. 4.34. It
holds between the moments at which something changes within a tick, and these are solved for:
where the motor turns back, ω = 0 at t = τ ln(1 − ω₀/V), and where the main loop of a slave sees
the count that it waits for. So nothing depends on a step width.

The loop of the listing (L5496-5584): shown = count mod 1024; the difference of two ticks is the
speed, unless the counter wrapped between them, when the old speed is kept. Then, all int32:

    sum += (|ref| − speed) kid,   u = (u + sum − speed kpd) / 1000, cut to 0 … 100, sign of ref

The main loop (L5589-5729) compares Posi = shown + 1023 · wraps, or (1023 − shown) + 1023 · wraps
downwards, with the counts of a chunk; wraps count in either direction, and the counter is never
cleared. The last 1000 counts of a line run at the speeds of a table.

Exact, because all that the slaves compute is whole numbers, and the motion is no approximation
but for the rounding of floats. Compiled, because every tick depends on the one before.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from camtool.kernels.inner import inner

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

GAIN, TAU, FRICTION, KID, KPD, CHUNK, PHASE, HOME_SPEED = range(8)
"""Columns of `Program.axes`."""

PLACE, SPEED, BEGIN, DONE, DRIVE, SPEED_BEFORE = range(6)
"""Columns of `State.motors`: counts, counts in a tick, moments in ticks, percent, for the text."""

COUNT, UP, WRAPS, STAGE, LEFT, SHOWN, SEEN, SUM, REF, NEXT_REF, TARGET = range(11)
"""Columns of `State.slaves`."""

STILL, WAITING, CRUISING, SLOWING, HOMING, FOLLOWING = range(6)
"""What a slave does, in its column STAGE; FOLLOWING is the text's way of running a line."""

FIRST_ROW, SECOND_ROW, MOST_TICKS, PART_AXIS, PART_COUNT = 6, 7, 8, 9, 10
"""Columns of `Program.lines` behind the amounts and the speeds of three axes."""

HOME_AMOUNT = -1
"""The amount of an axis that goes home."""

TURN = 1024
"""Counts that an encoder shows; the program takes 1023 for each."""

TABLE_COUNTS = 1000
"""The last counts of a line, which run by the table."""

NEVER = 1 << 40
"""More counts than any motion has."""

MOMENT_EPS = 1e-12
"""A moment within a tick is found when a step of the search is shorter than this part of it."""

SEARCHES = 80
"""More steps than halving a tick down to `MOMENT_EPS` takes."""

REST_COUNTS = 1e-6
"""A motor without drive that would coast for less than this stands."""


class Program(NamedTuple):
    """What the slaves are told, and what they are.

    lines (L, 11): amount of each axis (chunks; counts when `text`; `HOME_AMOUNT`; 0), its speed
    with sign, the row of its samples, the row of those from where an axis (its number) has passed
    a count on, the ticks after which it is given up, that axis and that count. pauses (L,) ticks
    behind each, at least 1; axes (3, 8); table (1001,); lag: ticks by which Y begins after X;
    text: the chapters' way instead of the listing's.
    """

    lines: Ints
    pauses: Floats
    axes: Floats
    table: Ints
    lag: float
    text: bool


class State(NamedTuple):
    """Where everything stands between two calls: motors (3, 6), slaves (3, 11); clock (3,): tick,
    line, row of the line before; begin (2,) of the line and of its second row, in ticks."""

    motors: Floats
    slaves: Ints
    clock: Ints
    begin: Floats


class Account(NamedTuple):
    """What rows did so far: ticks (N,) that they took, loops (N,) of the slaves, ended (N,)."""

    ticks: Floats
    loops: Ints
    ended: npt.NDArray[np.bool_]


@inner
def _int32(value: int) -> int:
    """As it stands in a signed int of 32 bits."""
    return ((value + 0x80000000) & 0xFFFFFFFF) - 0x80000000


@inner
def _listed_loop(motor: Floats, slave: Ints, axis: Floats, table: Ints) -> None:
    """The interrupt of the listing: L5496-5584."""
    shown = (slave[COUNT] + np.int64(axis[PHASE])) % TURN
    change = shown - slave[SHOWN] if slave[UP] == 1 else slave[SHOWN] - shown
    slave[SHOWN] = shown
    if change >= 0:
        slave[SEEN] = change
    if slave[STAGE] == SLOWING:
        left = int(axis[CHUNK]) - _seen_way(slave, axis, slave[UP])
        fast = table[min(max(left, 0), TABLE_COUNTS)]
        slave[REF] = fast if slave[NEXT_REF] >= 0 else -fast
    speed, ref = slave[SEEN], slave[REF]
    kid, kpd = np.int64(axis[KID]), np.int64(axis[KPD])
    slave[SUM] = _int32(slave[SUM] + (abs(ref) - speed) * kid)
    drive = _int32(np.int64(motor[DRIVE]) + slave[SUM] - speed * kpd)
    drive = 0 if drive < 0 else min(drive // 1000, 100)
    motor[DRIVE] = drive if ref > 0 else -drive if ref < 0 else 0


@inner
def _text_loop(motor: Floats, slave: Ints, axis: Floats, top: int) -> None:
    """Equations 4.15-4.18 and 4.27: the reference by the way that is left, and the loop in its
    velocity form. Nothing drives an axis that has arrived."""
    speed = float(slave[COUNT] - slave[SHOWN])
    slave[SHOWN] = slave[COUNT]
    if slave[STAGE] == FOLLOWING:
        left = float(slave[TARGET] - slave[COUNT])
        most = float(abs(slave[REF]))
        ref = min(most, top * math.sqrt(abs(left) / TABLE_COUNTS))
        ref = math.copysign(ref if abs(left) < TABLE_COUNTS else most, left)
        change = axis[KID] * (ref - speed) - axis[KPD] * (speed - motor[SPEED_BEFORE])
        motor[DRIVE] = min(max(motor[DRIVE] + change / 1000.0, -100.0), 100.0)
    motor[SPEED_BEFORE] = speed


@inner
def _seen_way(slave: Ints, axis: Floats, up: int) -> int:
    """Posi of the main loop, when the counter's direction is `up`."""
    shown = (slave[COUNT] + np.int64(axis[PHASE])) % TURN
    return int((shown if up == 1 else TURN - 1 - shown) + (TURN - 1) * slave[WRAPS])


@inner
def _to_go(slave: Ints, axis: Floats, sense: int) -> int:
    """Counts in the direction `sense` until the loop that the slave is in ends.

    Posi does not fall: within the turn number k it is c + 1023 k, c = 0 … 1023. It first reaches
    T in the turn k' = ⌈T / 1023⌉ − 1, or in the present one, at c' = max(T − 1023 k', 0).
    """
    stage = slave[STAGE]
    if stage == FOLLOWING:
        left = slave[TARGET] - slave[COUNT]
        left = left if slave[NEXT_REF] >= 0 else -left
        ahead = sense == (1 if slave[NEXT_REF] >= 0 else -1)
        return int(left) if left <= 0 or ahead else NEVER
    if stage != CRUISING and stage != SLOWING:
        return NEVER
    wanted = int(axis[CHUNK])
    if stage == CRUISING:
        wanted += 1 if slave[LEFT] > 1 else -TABLE_COUNTS
    up = int(slave[UP]) if sense == 0 else int(sense > 0)
    wraps = int(slave[WRAPS])
    here = _seen_way(slave, axis, up) - (TURN - 1) * wraps
    turn = max(wraps, (wanted + TURN - 2) // (TURN - 1) - 1)
    way = (turn - wraps) * TURN + max(wanted - (TURN - 1) * turn, 0) - here
    # The direction is that of the last count: a motor that turns back must count first.
    return way if up == int(slave[UP]) else max(way, 1)


@inner
def _next_stage(motor: Floats, slave: Ints, moment: float) -> None:
    """The count that the slave waited for has come."""
    if slave[STAGE] == CRUISING and slave[LEFT] > 1:
        slave[LEFT] -= 1
        slave[WRAPS] = 0
    elif slave[STAGE] == CRUISING:
        slave[STAGE] = SLOWING
    else:
        slave[STAGE], slave[REF], slave[SEEN], slave[WRAPS] = STILL, 0, 0, 0
        motor[DONE], motor[DRIVE] = moment, 0.0


@inner
def _start(motor: Floats, slave: Ints, text: bool) -> None:
    """The master's word to go. The text's distances add up, so that what an axis went too far is
    taken back by its next line; the listing's begin where the axis is."""
    slave[WRAPS], slave[REF] = 0, slave[NEXT_REF]
    amount = slave[LEFT]
    motor[DONE] = motor[BEGIN]
    if amount == HOME_AMOUNT:
        slave[STAGE] = HOMING
    elif text:
        slave[STAGE] = FOLLOWING
        slave[TARGET] += amount if slave[NEXT_REF] >= 0 else -amount
        slave[NEXT_REF] = -1 if slave[TARGET] < slave[COUNT] else 1
    else:
        slave[STAGE] = CRUISING


@inner
def _moment(way: float, speed: float, aim: float, tau: float, most: float) -> float:
    """When a motor at `speed` that tends to `aim` has gone `way`; it has by `most`."""
    low, high, moment = 0.0, most, 0.5 * most
    for _ in range(SEARCHES):
        fade = -math.expm1(-moment / tau)
        miss = aim * moment + (speed - aim) * tau * fade - way
        if (miss > 0.0) == (way > 0.0):
            high = moment
        else:
            low = moment
        rate = speed + (aim - speed) * fade
        better = moment - miss / rate if rate != 0.0 else low
        if not low < better < high:
            better = 0.5 * (low + high)
        if abs(better - moment) <= MOMENT_EPS:
            return better
        moment = better
    return moment


@inner
def _glide(
    motor: Floats, slave: Ints, axis: Floats, aim: float, span: tuple[int, float, int]
) -> tuple[float, bool]:
    """Move one way (`span`: sense, ticks at most, counts until the loop ends) without a turn;
    returns the ticks it took and whether the loop ends there."""
    sense, ticks, to_go = span
    place, speed, tau, count = motor[PLACE], motor[SPEED], axis[TAU], slave[COUNT]
    fade = -math.expm1(-ticks / tau)
    end = place + aim * ticks + (speed - aim) * tau * fade
    if sense > 0:
        new = max(count, np.int64(math.floor(end)))
    else:
        new = min(count, np.int64(math.ceil(end)) - 1)
    reached = sense * (new - count) >= to_go
    if reached:
        new = count + sense * to_go
        end = float(new) if sense > 0 else float(new + 1)
        ticks = _moment(end - place, speed, aim, tau, ticks) if end != place else 0.0
        fade = -math.expm1(-ticks / tau)
    if new != count:
        phase = np.int64(axis[PHASE])
        slave[UP] = 1 if sense > 0 else 0
        slave[WRAPS] += abs((new + phase) // TURN - (count + phase) // TURN)
        slave[COUNT] = new
    motor[PLACE], motor[SPEED] = end, speed + (aim - speed) * fade
    return ticks, reached


@inner
def _home(motor: Floats, slave: Ints, axis: Floats, at: float, tick: int) -> float:
    """Run home evenly from `at` in a tick, and stand there; returns the time within the tick."""
    needed = max(motor[PLACE], 0.0) / axis[HOME_SPEED]
    if needed > 1.0 - at:
        motor[PLACE] -= axis[HOME_SPEED] * (1.0 - at)
        slave[COUNT] = np.int64(math.floor(motor[PLACE]))
        return 1.0
    motor[:] = 0.0
    motor[DONE] = tick + at + needed
    slave[:] = 0
    slave[SHOWN] = np.int64(axis[PHASE])
    return float(at + needed)


@inner
def _advance(motor: Floats, slave: Ints, axis: Floats, tick: int, text: bool) -> None:
    """One motor through one tick, from event to event."""
    at = 0.0
    while at < 1.0:
        until = 1.0
        if slave[STAGE] == WAITING:
            until = min(motor[BEGIN] - tick, 1.0)
            if until <= at:
                _start(motor, slave, text)
                continue
        if slave[STAGE] == HOMING:
            at = _home(motor, slave, axis, at, tick)
            continue
        speed, drive = motor[SPEED], motor[DRIVE]
        pushed = drive if speed != 0.0 else drive if abs(drive) > axis[FRICTION] else 0.0
        sense = int(np.sign(speed if speed != 0.0 else pushed))
        to_go = _to_go(slave, axis, sense)
        if to_go <= 0:
            _next_stage(motor, slave, tick + at)
            continue
        if sense == 0:
            at = until
            continue
        aim = axis[GAIN] * (drive - sense * axis[FRICTION])
        ticks, turns = until - at, False
        if speed * aim < 0.0:
            back = axis[TAU] * math.log1p(-speed / aim)
            ticks, turns = min(ticks, back), back <= ticks
        took, reached = _glide(motor, slave, axis, aim, (sense, ticks, to_go))
        if reached:
            _next_stage(motor, slave, tick + at + took)
            at += took
        else:
            at = at + ticks if turns else until
            if turns:
                motor[SPEED] = 0.0
    if motor[DRIVE] == 0.0 and abs(motor[SPEED]) * axis[TAU] < REST_COUNTS:
        motor[SPEED] = 0.0


@inner
def _open(program: Program, state: State, line: int) -> None:
    """The slaves wait for the word to run a line."""
    for index in range(3):
        motor, slave = state.motors[index], state.slaves[index]
        motor[BEGIN] = state.begin[0] + (program.lag if index == 1 else 0.0)
        motor[DONE] = state.begin[0]
        slave[LEFT], slave[NEXT_REF] = program.lines[line, index], program.lines[line, 3 + index]
        slave[STAGE] = WAITING if slave[LEFT] != 0 else STILL


@inner
def _close(program: Program, state: State, account: Account, line: int, tick: int) -> None:
    """All slaves have answered: account for the line, and tell when the next one begins."""
    lines, motors, begin = program.lines, state.motors, state.begin
    done = max(motors[0, DONE], motors[1, DONE], motors[2, DONE])
    after = max(done + program.pauses[line], float(tick))
    parted = min(begin[1], after) if begin[1] > begin[0] else after
    account.ticks[lines[line, FIRST_ROW]] += parted - begin[0]
    account.ticks[lines[line, SECOND_ROW]] += after - parted
    begin[0] = after
    state.clock[2] = lines[line, SECOND_ROW]


@inner
def _row(program: Program, state: State, line: int, tick: int) -> int:
    """Whose sample the places at a tick are: the start of a row is none of it."""
    lines, begin = program.lines, state.begin
    if line == len(lines) or tick <= begin[0]:
        return int(state.clock[2])
    first, second = lines[line, FIRST_ROW], lines[line, SECOND_ROW]
    if first != second and begin[1] <= begin[0]:
        axis = lines[line, PART_AXIS]
        ahead = state.slaves[axis, COUNT] - lines[line, PART_COUNT]
        if (ahead if lines[line, 3 + axis] >= 0 else -ahead) > 0:
            begin[1] = tick
    return int(second if begin[1] > begin[0] else first)


@inner
def _all_still(state: State) -> bool:
    """Whether all slaves have answered."""
    slaves = state.slaves
    moving = slaves[0, STAGE] != STILL or slaves[1, STAGE] != STILL or slaves[2, STAGE] != STILL
    return not moving


@inner
def _given_up(state: State, tick: int) -> None:
    """Somebody switches off what has not arrived."""
    for index in range(3):
        motor, slave = state.motors[index], state.slaves[index]
        if slave[STAGE] != STILL:
            slave[STAGE], slave[REF], slave[TARGET] = STILL, 0, slave[COUNT]
            motor[DONE], motor[DRIVE] = tick, 0.0


@njit(cache=True)
def slaves_fill(
    program: Program, state: State, account: Account, out: Ints, row: Ints
) -> tuple[int, bool]:
    """Counts of the axes at each tick into `out` (n, 3), the rows that they belong to into `row`
    (n,), until these are full or all lines have run and their last pause is over.

    `state` goes on from call to call; `account` grows. Returns samples filled, and whether that
    was all.
    """
    top = program.table[TABLE_COUNTS]
    count, filled = len(program.lines), 0
    tick, line = state.clock[0], state.clock[1]
    while filled < len(out) and (line < count or tick < state.begin[0]):
        if tick == 0 and count > 0:
            _open(program, state, 0)
        for index in range(3):
            motor, slave, axis = state.motors[index], state.slaves[index], program.axes[index]
            if slave[STAGE] == HOMING:
                motor[DRIVE] = 0.0
            elif program.text:
                _text_loop(motor, slave, axis, top)
            else:
                _listed_loop(motor, slave, axis, program.table)
            _advance(motor, slave, axis, tick, program.text)
        tick += 1
        row[filled] = _row(program, state, line, tick)
        account.loops[row[filled]] += 1
        for index in range(3):
            out[filled, index] = state.slaves[index, COUNT]
        filled += 1
        if line == count or tick < state.begin[0]:
            continue
        if tick - state.begin[0] > program.lines[line, MOST_TICKS]:
            if not _all_still(state):
                account.ended[program.lines[line, SECOND_ROW]] = False
            _given_up(state, tick)
        if _all_still(state):
            _close(program, state, account, line, tick)
            line += 1
            if line < count:
                _open(program, state, line)
    state.clock[0], state.clock[1] = tick, line
    return filled, line == count and tick >= state.begin[0]
