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

import numpy as np

from camtool.kernels.compiled import inner, kernel
from camtool.kernels.slave_loops import listed_loop, next_stage, start_line, text_loop, to_go_of
from camtool.kernels.slave_record import (
    BEGIN,
    COUNT,
    DONE,
    DRIVE,
    FIRST_ROW,
    FRICTION,
    GAIN,
    HOME_SPEED,
    HOMING,
    LEFT,
    MOST_TICKS,
    NEXT_REF,
    PART_AXIS,
    PART_COUNT,
    PHASE,
    PLACE,
    REF,
    SECOND_ROW,
    SHOWN,
    SPEED,
    STAGE,
    STILL,
    TABLE_COUNTS,
    TARGET,
    TAU,
    TURN,
    UP,
    WAITING,
    WRAPS,
    Account,
    Floats,
    Ints,
    Program,
    State,
)

MOMENT_EPS = 1e-12
"""A moment within a tick is found when a step of the search is shorter than this part of it."""

SEARCHES = 80
"""More steps than halving a tick down to `MOMENT_EPS` takes."""

REST_COUNTS = 1e-6
"""A motor without drive that would coast for less than this stands."""


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
                start_line(motor, slave, text)
                continue
        if slave[STAGE] == HOMING:
            at = _home(motor, slave, axis, at, tick)
            continue
        speed, drive = motor[SPEED], motor[DRIVE]
        pushed = drive if speed != 0.0 else drive if abs(drive) > axis[FRICTION] else 0.0
        sense = int(np.sign(speed if speed != 0.0 else pushed))
        to_go = to_go_of(slave, axis, sense)
        if to_go <= 0:
            next_stage(motor, slave, tick + at)
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
            next_stage(motor, slave, tick + at + took)
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


@kernel
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
                text_loop(motor, slave, axis, top)
            else:
                listed_loop(motor, slave, axis, program.table)
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
