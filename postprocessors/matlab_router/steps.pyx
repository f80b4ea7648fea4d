"""The loops of the Matlab router's slaves: speed loops with integers, motors, and their master.

Compiled, because every tick depends on the one before.
Comments above each part say what it does.
"""

from __future__ import annotations

from libc cimport math
from libc.stdint cimport uint8_t
from camtool.kernels.types cimport Int

from typing import NamedTuple

from camtool.arrays import Bools, Floats, Indices, Ints

# What the kernel of the Matlab router's slaves is told and keeps: arrays, and their columns.


cpdef enum:
    # Columns of `Program.axes`.
    GAIN = 0, TAU, FRICTION, KID, KPD, CHUNK, PHASE, HOME_SPEED
    # Columns of `State.motors`: counts, counts in a tick, moments in ticks, percent, for the text.
    PLACE = 0, SPEED, BEGIN, DONE, DRIVE, SPEED_BEFORE, MOTOR_COLUMNS
    # Columns of `State.slaves`.
    COUNT = 0, UP, WRAPS, STAGE, LEFT, SHOWN, SEEN, SUM, REF, NEXT_REF, TARGET, SLAVE_COLUMNS
    # What a slave does, in its column STAGE; FOLLOWING is the text's way of running a line.
    STILL = 0, WAITING, CRUISING, SLOWING, HOMING, FOLLOWING
    # Columns of `Program.lines` behind the amounts and the speeds of three axes.
    FIRST_ROW = 6, SECOND_ROW, MAX_TICKS, PART_AXIS, PART_COUNT
    # The amount of an axis that goes home.
    HOME_AMOUNT = -1
    # Counts that an encoder shows; the program takes 1023 for each.
    TURN = 1024
    # The last counts of a line, which run by the table.
    TABLE_COUNTS = 1000
    # `TURN` is a power of two: what is shown, and how many turns lie below, are bits of a count.
    TURN_BITS = 10


# More counts than any motion has.
cdef Int NEVER = 1LL << 40

# The sign of an int of 32 bits, and all its bits.
cdef Int SIGN_OF_INT32 = 1LL << 31
cdef Int BITS_OF_INT32 = (1LL << 32) - 1


class Program(NamedTuple):
    """Commands and settings of the slaves.

    lines (L, 11), of 32 bits: amount of each axis (chunks; counts when `text`; `HOME_AMOUNT`; 0),
    its speed with sign, the row of its samples, the row of those from where an axis (its number)
    has passed a count on, the ticks after which it is given up, that axis and that count. pauses
    (L,) ticks behind each, at least 1, and negative where the next line begins on a tick; axes
    (3, 8); table (1001,); lag: ticks by which Y begins after X; text: the chapters' way instead of
    the listing's; thin (N,): rows of which nobody asks for the samples between those at which an
    axis turns and the last.
    """

    lines: Indices
    pauses: Floats
    axes: Floats
    table: Ints
    lag: float
    text: bool
    thin: Bools


class State(NamedTuple):
    """State between two calls: motors (3, 6), slaves (3, 11); clock (3,): tick,
    line, row of the line before; begin (2,) of the line and of its second row, in ticks."""

    motors: Floats
    slaves: Ints
    clock: Ints
    begin: Floats


class Account(NamedTuple):
    """Results of the rows so far: ticks (N,) that they took, steps (N, 3) in counts, ended (N,),
    samples (N,) with those that are left out."""

    ticks: Floats
    steps: Ints
    has_ended: Bools
    samples: Ints


# The programs of the Matlab router's slaves: the interrupt every 5 ms, and the main loop.
#
# The slaves below say what they do. Whole numbers, but for the text's loop, whose gains
# are none; every number of the listing is an int32 at most.


cdef Int _int32(Int value) noexcept:
    """Return the value as a signed int of 32 bits holds it, wrapped on overflow."""
    return ((value + SIGN_OF_INT32) & BITS_OF_INT32) - SIGN_OF_INT32


cdef void listed_loop(
    double* motor, Int* slave, double* axis, Int* table
) noexcept:
    """Run the interrupt of the listing once: L5496-5584."""
    cdef Int phase, shown, change, drive, to_go, fast, speed, ref, kid, kpd
    phase = int(axis[PHASE])
    shown = (slave[COUNT] + phase) & (TURN - 1)
    change = shown - slave[SHOWN] if slave[UP] == 1 else slave[SHOWN] - shown
    slave[SHOWN] = shown
    if change >= 0:
        slave[SEEN] = change
    if slave[STAGE] == SLOWING:
        to_go = int(axis[CHUNK])
        to_go -= _seen_way(slave, axis, slave[UP])
        fast = table[min(max(to_go, 0), TABLE_COUNTS)]
        slave[REF] = fast if slave[NEXT_REF] >= 0 else -fast
    speed, ref = slave[SEEN], slave[REF]
    kid, kpd = int(axis[KID]), int(axis[KPD])
    slave[SUM] = _int32(slave[SUM] + (abs(ref) - speed) * kid)
    drive = int(motor[DRIVE])
    drive = _int32(drive + slave[SUM] - speed * kpd)
    drive = 0 if drive < 0 else min(drive // 1000, 100)
    drive = drive if ref > 0 else -drive if ref < 0 else 0
    motor[DRIVE] = float(drive)


cdef void text_loop(double* motor, Int* slave, double* axis, Int top) noexcept:
    """Run one pass of the loop that the text describes, equations 4.15-4.18 and 4.27: the
    reference by the remaining distance, and the loop in its velocity form. An axis that has
    arrived has no drive."""
    speed = float(slave[COUNT] - slave[SHOWN])
    slave[SHOWN] = slave[COUNT]
    if slave[STAGE] == FOLLOWING:
        to_go = float(slave[TARGET] - slave[COUNT])
        full_speed = float(abs(slave[REF]))
        ref = min(full_speed, float(top) * math.sqrt(abs(to_go) / float(TABLE_COUNTS)))
        ref = math.copysign(ref if abs(to_go) < float(TABLE_COUNTS) else full_speed, to_go)
        change = axis[KID] * (ref - speed) - axis[KPD] * (speed - motor[SPEED_BEFORE])
        motor[DRIVE] = min(max(motor[DRIVE] + change / 1000.0, -100.0), 100.0)
    motor[SPEED_BEFORE] = speed


cdef Int _seen_way(Int* slave, double* axis, Int up) noexcept:
    """Return Posi of the main loop, the position that it computes from the counter, when the
    counter's direction is `up`."""
    cdef Int phase, shown
    phase = int(axis[PHASE])
    shown = (slave[COUNT] + phase) & (TURN - 1)
    return int((shown if up == 1 else TURN - 1 - shown) + (TURN - 1) * slave[WRAPS])


cdef Int to_go_of(Int* slave, double* axis, Int sense) noexcept:
    """Return the counts in the direction `sense` until the loop that the slave is in ends.

    Posi does not fall: within the turn number k it is c + 1023 k, c = 0 … 1023. It first reaches T
    in the turn k' = ⌈T / 1023⌉ − 1, or in the present one, at c' = max(T − 1023 k', 0).
    """
    cdef Int stage, goal, up, wraps, turned, turn, to_go
    cdef bint ahead
    stage = slave[STAGE]
    if stage == FOLLOWING:
        to_go = slave[TARGET] - slave[COUNT]
        to_go = to_go if slave[NEXT_REF] >= 0 else -to_go
        ahead = sense == (1 if slave[NEXT_REF] >= 0 else -1)
        return int(to_go) if to_go <= 0 or ahead else NEVER
    if stage != CRUISING and stage != SLOWING:
        return NEVER
    goal = int(axis[CHUNK])
    if stage == CRUISING:
        goal += 1 if slave[LEFT] > 1 else -TABLE_COUNTS
    up = slave[UP]
    if sense != 0:
        up = 1 if sense > 0 else 0
    wraps = slave[WRAPS]
    turned = _seen_way(slave, axis, up) - (TURN - 1) * wraps
    turn = max(wraps, (max(goal, 0) + TURN - 2) // (TURN - 1) - 1)
    to_go = (turn - wraps) * TURN + max(goal - (TURN - 1) * turn, 0) - turned
    # The direction is that of the last count: a motor that turns back must count first.
    return int(to_go) if up == slave[UP] else int(max(to_go, 1))


cdef void next_stage(double* motor, Int* slave, double moment) noexcept:
    """Begin the next stage of a motor, when its slave has reached the count that it waited for."""
    if slave[STAGE] == CRUISING and slave[LEFT] > 1:
        slave[LEFT] -= 1
        slave[WRAPS] = 0
    elif slave[STAGE] == CRUISING:
        slave[STAGE] = SLOWING
    else:
        slave[STAGE], slave[REF], slave[SEEN], slave[WRAPS] = STILL, 0, 0, 0
        motor[DONE], motor[DRIVE] = moment, 0.0


cdef void start_line(double* motor, Int* slave, bint text) noexcept:
    """Start a line at the master's signal. The text's distances add up, so that an overshoot is
    taken back by the axis' next line; the listing's distances begin where the axis is."""
    cdef Int amount
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


# The slaves of the Matlab router: three speed loops with integers, three motors, one master.
#
# Time runs in ticks of 5 ms, places in counts of the encoder. At each tick every slave measures
# its speed and sets a drive u (percent); between two ticks the motor does
#
#     τ dω/dt = A u' − ω,   u' = u − friction · sign ω        (G(s) = A / (τ s + 1), eq. 4.32)
#
# Since u is held from tick to tick, this has a closed form (zero-order hold), with V = A u':
#
#     ω(t) = V + (ω₀ − V) e^(−t/τ)
#     θ(t) = θ₀ + V t + (ω₀ − V) τ (1 − e^(−t/τ))
#
# which at t = 1 tick is the pulse transfer function A (1 − q) / (z − q), q = e^(−1/τ), eq. 4.34.
# It holds between the moments at which something changes within a tick, and these are solved for:
# where the motor turns back, ω = 0 at t = τ ln(1 − ω₀/V), and where the main loop of a slave sees
# the count that it waits for. So nothing depends on a step width.
#
# The loop of the listing (L5496-5584): shown = count mod 1024; the difference of two ticks is the
# speed, unless the counter wrapped between them, when the old speed is kept. Then, all int32:
#
#     sum += (|ref| − speed) kid,   u = (u + sum − speed kpd) / 1000, cut to 0 … 100, sign of ref
#
# The main loop (L5589-5729) compares Posi = shown + 1023 · wraps, or (1023 − shown) + 1023 · wraps
# downwards, with the counts of a chunk; wraps count in either direction, and the counter is never
# cleared. The last 1000 counts of a line run at the speeds of a table.
#
# Exact, because all that the slaves compute is whole numbers, and the motion is no approximation
# but for the rounding of floats. Compiled, because every tick depends on the one before.


# A moment within a tick is found when a step of the search is shorter than this part of it.
cdef double MOMENT_EPS = 1e-12

cpdef enum:
    # More steps than halving a tick down to `MOMENT_EPS` takes.
    SEARCHES = 80

# A motor without drive that would coast for less than this stands.
cdef double REST_COUNTS = 1e-6


cdef double _moment(double travel, double speed, double aim, double tau, double upper) noexcept:
    """Return the time in ticks after which a motor at `speed` that tends to `aim` has gone
    `travel`, at most `upper`; by bisection with Newton steps."""
    cdef Int _
    cdef double low, high, moment, better
    low, high, moment = 0.0, upper, 0.5 * upper
    for _ in range(SEARCHES):
        fade = -math.expm1(-moment / tau)
        miss = aim * moment + (speed - aim) * tau * fade - travel
        if (miss > 0.0) == (travel > 0.0):
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


cdef inline Int _floor(double value) noexcept:
    """Return the greatest integer not above a value, which must fit into an Int."""
    cdef Int integer = <Int>value
    return integer - (value < <double>integer)


cdef (double, bint) _glide(
    double* motor, Int* slave, double* axis, double aim, Int sense, double ticks,
    Int to_go, double whole_fade
) noexcept:
    """Move in one direction (`sense`) for at most `ticks`, and at most the counts `to_go` until
    the loop ends; return the ticks it took and True if the loop ends there. `whole_fade` is 1 − q
    of a whole tick."""
    cdef Int count, new, phase
    cdef bint reached
    cdef double end, fade
    place, speed, tau, count = motor[PLACE], motor[SPEED], axis[TAU], slave[COUNT]
    fade = whole_fade if ticks == 1.0 else -math.expm1(-ticks / tau)
    end = place + aim * ticks + (speed - aim) * tau * fade
    if sense > 0:
        new = max(count, _floor(end))
    else:
        new = min(count, -_floor(-end) - 1)
    reached = sense * (new - count) >= to_go
    if reached:
        new = count + sense * to_go
        end = float(new) if sense > 0 else float(new + 1)
        ticks = _moment(end - place, speed, aim, tau, ticks) if end != place else 0.0
        fade = -math.expm1(-ticks / tau)
    if new != count:
        phase = int(axis[PHASE])
        slave[UP] = 1 if sense > 0 else 0
        slave[WRAPS] += abs(((new + phase) >> TURN_BITS) - ((count + phase) >> TURN_BITS))
        slave[COUNT] = new
    motor[PLACE], motor[SPEED] = end, speed + (aim - speed) * fade
    return ticks, reached


cdef double _home(
    double* motor, Int* slave, double* axis, double at, Int tick
) noexcept:
    """Run home at constant speed from `at` in a tick, and stop there; return the time within the
    tick."""
    cdef Int phase, k
    needed = max(motor[PLACE], 0.0) / axis[HOME_SPEED]
    if needed > 1.0 - at:
        motor[PLACE] -= axis[HOME_SPEED] * (1.0 - at)
        slave[COUNT] = _floor(motor[PLACE])
        return 1.0
    for k in range(MOTOR_COLUMNS):
        motor[k] = 0.0
    for k in range(SLAVE_COLUMNS):
        slave[k] = 0
    motor[DONE] = float(tick) + at + needed
    phase = int(axis[PHASE])
    slave[SHOWN] = phase
    return float(at + needed)


cdef struct Ahead:
    # Counts that a slave waits for in one sense, while the motor goes on that way; in the sense
    # `UNKNOWN_SENSE` they are not known.
    Int sense, to_go


cdef Int UNKNOWN_SENSE = 2


cdef bint _passes_chunk(
    double* motor, Int* slave, double* axis, Int sense, double aim, Ahead* ahead, double whole_fade
) noexcept:
    """Glide for a whole tick in which at most one chunk of a line ends, and not the last: the main
    loop counts it, and nothing else changes, so the motion need not be divided there. Return
    False, with nothing done, where something else may happen within the tick."""
    cdef Int begin, end, phase, up, wraps, to_go, passed
    cdef double place, speed
    place, speed, begin = motor[PLACE], motor[SPEED], slave[COUNT]
    up, wraps, to_go = slave[UP], slave[WRAPS], ahead.to_go
    _glide(motor, slave, axis, aim, sense, 1.0, NEVER, whole_fade)
    end = slave[COUNT]
    passed = sense * (end - begin) - to_go
    if passed < 0:
        ahead.to_go = -passed
        return True
    phase = <Int>axis[PHASE]
    slave[COUNT], slave[LEFT] = begin + sense * to_go, slave[LEFT] - 1
    slave[UP], slave[WRAPS] = 1 if sense > 0 else 0, 0
    ahead.to_go = to_go_of(slave, axis, sense) - passed
    if ahead.to_go > 0:
        slave[WRAPS] = abs(((end + phase) >> TURN_BITS) - ((slave[COUNT] + phase) >> TURN_BITS))
        slave[COUNT] = end
        return True
    motor[PLACE], motor[SPEED], slave[COUNT] = place, speed, begin
    slave[UP], slave[WRAPS], slave[LEFT], ahead.to_go = up, wraps, slave[LEFT] + 1, to_go
    return False


cdef void _advance(
    double* motor, Int* slave, double* axis, Int tick, bint text, double whole_fade, Ahead* ahead
) noexcept:
    """Advance one motor by one tick, from event to event."""
    cdef Int sense, count
    cdef bint turns, reached
    cdef double toward, at, until, ticks
    at = 0.0
    while at < 1.0:
        until = 1.0
        if slave[STAGE] == WAITING:
            until = min(motor[BEGIN] - float(tick), 1.0)
            if until <= at:
                start_line(motor, slave, text)
                ahead.sense = UNKNOWN_SENSE
                continue
        if slave[STAGE] == HOMING:
            at = _home(motor, slave, axis, at, tick)
            ahead.sense = UNKNOWN_SENSE
            continue
        speed, drive = motor[SPEED], motor[DRIVE]
        pushed = drive if speed != 0.0 else drive if abs(drive) > axis[FRICTION] else 0.0
        toward = speed if speed != 0.0 else pushed
        sense = 1 if toward > 0.0 else -1 if toward < 0.0 else 0
        if ahead.sense != sense:
            ahead.sense, ahead.to_go = sense, to_go_of(slave, axis, sense)
        if ahead.to_go <= 0:
            next_stage(motor, slave, float(tick) + at)
            ahead.sense = UNKNOWN_SENSE
            continue
        if sense == 0:
            at = until
            continue
        aim = axis[GAIN] * (drive - float(sense) * axis[FRICTION])
        ticks, turns = until - at, False
        if (
            ticks == 1.0
            and slave[STAGE] == CRUISING
            and slave[LEFT] > 1
            and speed * aim >= 0.0
            and _passes_chunk(motor, slave, axis, sense, aim, ahead, whole_fade)
        ):
            break
        if speed * aim < 0.0:
            back = axis[TAU] * math.log1p(-speed / aim)
            ticks, turns = min(ticks, back), back <= ticks
        count = slave[COUNT]
        took, reached = _glide(motor, slave, axis, aim, sense, ticks, ahead.to_go, whole_fade)
        # The same way on, that many counts less are left; NEVER stays far.
        ahead.to_go -= sense * (slave[COUNT] - count)
        if reached:
            next_stage(motor, slave, float(tick) + at + took)
            ahead.sense = UNKNOWN_SENSE
            at += took
        else:
            at = at + ticks if turns else until
            if turns:
                motor[SPEED] = 0.0
    if motor[DRIVE] == 0.0 and abs(motor[SPEED]) * axis[TAU] < REST_COUNTS:
        motor[SPEED] = 0.0


cdef class Slaves:
    """Arrays of a program, its state and its results, as the loops read them."""

    cdef int[:, ::1] lines
    cdef Int[:, ::1] slaves
    cdef Int[:, ::1] steps
    cdef Int[::1] table, clock, samples
    cdef double[:, ::1] axes, motors
    cdef double[::1] pauses, begin, ticks
    cdef uint8_t[::1] has_ended, thin
    cdef double lag
    cdef bint text

    def __init__(self, program: Program, state: State, account: Account) -> None:
        self.lines, self.pauses, self.axes, self.table, self.lag, self.text, self.thin = program
        self.motors, self.slaves, self.clock, self.begin = state
        self.ticks, self.steps, self.has_ended, self.samples = account


cdef void _open(Slaves all_, Int line) noexcept:
    """Prepare the slaves to run a line: they wait for the master's signal."""
    cdef Int index
    cdef int[:, ::1] lines
    cdef Int[:, ::1] slaves
    cdef double[:, ::1] motors
    cdef double[::1] begin
    lines, motors, slaves, begin = all_.lines, all_.motors, all_.slaves, all_.begin
    for index in range(3):
        motors[index, BEGIN] = begin[0] + (all_.lag if index == 1 else 0.0)
        motors[index, DONE] = begin[0]
        slaves[index, LEFT] = lines[line, index]
        slaves[index, NEXT_REF] = lines[line, 3 + index]
        slaves[index, STAGE] = WAITING if slaves[index, LEFT] != 0 else STILL


cdef void _close(Slaves all_, Int line, Int tick) noexcept:
    """Account for a line that all slaves have completed, and set when the next one begins."""
    cdef int[:, ::1] lines
    cdef double[:, ::1] motors
    cdef double[::1] begin
    lines, motors, begin = all_.lines, all_.motors, all_.begin
    last_tick = max(motors[0, DONE], motors[1, DONE], motors[2, DONE])
    pause = all_.pauses[line]
    after = max(last_tick + abs(pause), float(tick))
    if pause < 0.0:
        after = math.ceil(after)
    parted = min(begin[1], after) if begin[1] > begin[0] else after
    all_.ticks[lines[line, FIRST_ROW]] += parted - begin[0]
    all_.ticks[lines[line, SECOND_ROW]] += after - parted
    begin[0] = after
    all_.clock[2] = lines[line, SECOND_ROW]


cdef Int _row(Slaves all_, Int line, Int tick) noexcept:
    """Return the row to which the sample at a tick belongs; the start of a row belongs to the row
    before. Note the moment at which a second row begins."""
    cdef Int first, second, axis, ahead
    cdef int* order
    cdef double* begin
    begin = &all_.begin[0]
    if line == len(all_.lines) or float(tick) <= begin[0]:
        return int(all_.clock[2])
    order = &all_.lines[line, 0]
    first, second = order[FIRST_ROW], order[SECOND_ROW]
    if first != second and begin[1] <= begin[0]:
        axis = order[PART_AXIS]
        ahead = all_.slaves[axis, COUNT] - order[PART_COUNT]
        if (ahead if order[3 + axis] >= 0 else -ahead) > 0:
            begin[1] = float(tick)
    if begin[1] > begin[0]:
        return int(second)
    return int(first)


cdef bint _all_still(Int[:, ::1] slaves) noexcept:
    """Return True if all slaves have answered."""
    cdef bint moving
    moving = slaves[0, STAGE] != STILL or slaves[1, STAGE] != STILL or slaves[2, STAGE] != STILL
    return not moving


cdef void _given_up(double[:, ::1] motors, Int[:, ::1] slaves, Int tick) noexcept:
    """Stop all axes that have not arrived, as a user would switch them off."""
    cdef Int index
    for index in range(3):
        if slaves[index, STAGE] != STILL:
            slaves[index, STAGE], slaves[index, REF] = STILL, 0
            slaves[index, TARGET] = slaves[index, COUNT]
            motors[index, DONE], motors[index, DRIVE] = float(tick), 0.0


cdef inline bint _goes_on(Int* moves, Int* ways) noexcept:
    """Return True if no axis reverses; `ways` (3,) then has the direction of each axis, 0 for one
    that has not moved. Otherwise set `ways` to the directions of `moves` (3,)."""
    cdef Int axis
    cdef bint turns = False
    for axis in range(3):
        turns |= moves[axis] * ways[axis] < 0
    for axis in range(3):
        if turns or ways[axis] == 0:
            ways[axis] = (moves[axis] > 0) - (moves[axis] < 0)
    return not turns


cdef inline bint _is_at_rest(double* motor, Int* slave, double* axis, Int tick) noexcept:
    """Return True if neither the loop nor the motor changes anything in this tick: the axis stands
    without drive, waits for no signal that comes within the tick, and has been seen to stand."""
    cdef Int phase
    if motor[SPEED] != 0.0 or motor[DRIVE] != 0.0 or slave[REF] != 0:
        return False
    if slave[STAGE] != STILL and (slave[STAGE] != WAITING or motor[BEGIN] < float(tick + 1)):
        return False
    phase = int(axis[PHASE])
    return slave[SEEN] == 0 and slave[SHOWN] == (slave[COUNT] + phase) & (TURN - 1)


cdef Int _homes_on(double* motor, Int* slave, double* axis, Int longest) noexcept:
    """Run home for as many ticks, up to `longest`, as nothing else happens; return their
    number."""
    cdef Int ticks = 0
    cdef double place = motor[PLACE]
    cdef double rate = axis[HOME_SPEED]
    while place > 2.0 * rate and ticks < longest:
        place -= rate
        ticks += 1
    if ticks > 0:
        motor[PLACE], slave[COUNT] = place, _floor(place)
    return ticks


cdef Int _cruises_on(
    double* motor, Int* slave, double* axis, Int longest, Ahead* ahead, double fade
) noexcept:
    """Run the listing's loop and the motor for as many whole ticks, up to `longest`, as the motor
    does not reverse and no chunk ends; return their number. The same steps as `listed_loop` and
    `_glide`, in registers."""
    cdef Int ticks, sense, phase, shown, change, drive, count, begin, new, remaining
    cdef Int measured, total, ref, kid, kpd, wraps
    cdef bint is_up
    cdef double place, speed, tau, gain, rub, aim, end
    ticks, place, speed, remaining = 0, motor[PLACE], motor[SPEED], ahead.to_go
    sense = 1 if speed > 0.0 else -1
    if speed == 0.0 or ahead.sense != sense or slave[LEFT] < 2:
        return 0
    begin = count = slave[COUNT]
    tau, gain, rub = axis[TAU], axis[GAIN], float(sense) * axis[FRICTION]
    phase, kid, kpd = <Int>axis[PHASE], <Int>axis[KID], <Int>axis[KPD]
    shown, measured, total, wraps = slave[SHOWN], slave[SEEN], slave[SUM], slave[WRAPS]
    ref, drive, is_up = slave[REF], <Int>motor[DRIVE], slave[UP] == 1
    while ticks < longest:
        new = (count + phase) & (TURN - 1)
        change = new - shown if is_up else shown - new
        change = change if change >= 0 else measured
        end_total = _int32(total + (abs(ref) - change) * kid)
        new_drive = _int32(drive + end_total - change * kpd)
        new_drive = 0 if new_drive < 0 else min(new_drive // 1000, 100)
        new_drive = new_drive if ref > 0 else -new_drive if ref < 0 else 0
        aim = gain * (float(new_drive) - rub)
        end = place + aim + (speed - aim) * tau * fade
        new = max(count, _floor(end)) if sense > 0 else min(count, -_floor(-end) - 1)
        if speed * aim < 0.0 or new_drive == 0 or sense * (new - count) >= remaining:
            break
        shown, measured, total = (count + phase) & (TURN - 1), change, end_total
        drive, place, speed = new_drive, end, speed + (aim - speed) * fade
        if new != count:
            is_up = sense > 0
            wraps += abs(((new + phase) >> TURN_BITS) - ((count + phase) >> TURN_BITS))
            remaining -= sense * (new - count)
            count = new
        ticks += 1
    if ticks > 0:
        motor[PLACE], motor[SPEED], motor[DRIVE] = place, speed, float(drive)
        slave[COUNT], slave[UP], slave[WRAPS], slave[SHOWN] = count, is_up, wraps, shown
        slave[SEEN], slave[SUM], ahead.to_go = measured, total, remaining
    return ticks


cdef Int _goes_alone(
    Slaves all_, Int line, Int tick, Int* moves, Ahead* ahead, double* whole_fade
) noexcept:
    """Run one axis for as many ticks as only its speed changes while the others stand; return
    their number, and set `moves` (3,) to the counts that it goes."""
    cdef Int axis, mover, ticks, longest
    mover = -1
    for axis in range(3):
        moves[axis] = 0
        if mover < 0 and all_.slaves[axis, STAGE] in (HOMING, CRUISING):
            mover = axis
        elif all_.slaves[axis, STAGE] != STILL or not _is_at_rest(
            &all_.motors[axis, 0], &all_.slaves[axis, 0], &all_.axes[axis, 0], tick
        ):
            return 0
    if mover < 0 or all_.lines[line, FIRST_ROW] != all_.lines[line, SECOND_ROW]:
        return 0
    longest = all_.lines[line, MAX_TICKS] - (tick - <Int>all_.begin[0]) - 1
    moves[mover] = -all_.slaves[mover, COUNT]
    if all_.slaves[mover, STAGE] == HOMING:
        ticks = _homes_on(
            &all_.motors[mover, 0], &all_.slaves[mover, 0], &all_.axes[mover, 0], longest
        )
    else:
        ticks = _cruises_on(
            &all_.motors[mover, 0],
            &all_.slaves[mover, 0],
            &all_.axes[mover, 0],
            longest,
            &ahead[mover],
            whole_fade[mover],
        )
    moves[mover] += all_.slaves[mover, COUNT]
    return ticks


cpdef (Int, bint) slaves_fill(program, state, account, Int[:, ::1] out, Int[::1] row):
    """Fill `out` (n, 3) with the counts of the axes at each tick and `row` (n,) with the rows that
    these belong to, until both are full or all lines have run and the last pause is over.

    In thin rows a sample replaces the one before, unless an axis reversed there. `state` continues
    from call to call; `account` grows. Return the number of samples filled, and True if that was
    all.
    """
    cdef Int top, count, filled, tick, ticks, line, index, of
    cdef Int[3] moves
    cdef Int[3] ways
    cdef Int[:, ::1] slaves
    cdef Slaves all_
    cdef bint text
    cdef double[3] whole_fade
    cdef Ahead[3] ahead
    cdef double* begin
    cdef double* motor
    cdef double* axis
    cdef Int* slave
    cdef Int* steps
    all_ = Slaves(program, state, account)
    begin, slaves, text = &all_.begin[0], all_.slaves, all_.text
    top = all_.table[TABLE_COUNTS]
    count, filled = len(all_.lines), 0
    tick, line = all_.clock[0], all_.clock[1]
    for index in range(3):
        whole_fade[index] = -math.expm1(-1.0 / all_.axes[index, TAU])
        ahead[index].sense = UNKNOWN_SENSE
    while filled < len(out) and (line < count or float(tick) < begin[0]):
        if tick == 0 and count > 0:
            _open(all_, 0)
        of = row[filled - 1] if filled else -1
        if of >= 0 and not text and all_.thin[of] and line < count and of == all_.lines[line, FIRST_ROW]:
            ticks = _goes_alone(all_, line, tick, moves, ahead, whole_fade)
            if ticks > 0:
                tick += ticks
                all_.samples[of] += ticks
                filled += not _goes_on(moves, ways)
                row[filled - 1] = of
                for index in range(3):
                    out[filled - 1, index] = slaves[index, COUNT]
                    all_.steps[of, index] += abs(moves[index])
                continue
        for index in range(3):
            motor, slave, axis = &all_.motors[index, 0], &slaves[index, 0], &all_.axes[index, 0]
            moves[index] = -slave[COUNT]
            if slave[STAGE] == HOMING:
                motor[DRIVE] = 0.0
            elif text:
                text_loop(motor, slave, axis, top)
            elif _is_at_rest(motor, slave, axis, tick):
                continue
            else:
                listed_loop(motor, slave, axis, &all_.table[0])
            _advance(motor, slave, axis, tick, text, whole_fade[index], &ahead[index])
        tick += 1
        of = _row(all_, line, tick)
        all_.samples[of] += 1
        steps = &all_.steps[of, 0]
        for index in range(3):
            moves[index] += slaves[index, COUNT]
            steps[index] += abs(moves[index])
        if filled == 0 or row[filled - 1] != of:
            ways[0] = ways[1] = ways[2] = 0
            _goes_on(moves, ways)
        elif all_.thin[of] and _goes_on(moves, ways):
            filled -= 1
        row[filled] = of
        for index in range(3):
            out[filled, index] = slaves[index, COUNT]
        filled += 1
        if line == count or float(tick) < begin[0]:
            continue
        if float(tick) - begin[0] > float(all_.lines[line, MAX_TICKS]):
            if not _all_still(slaves):
                all_.has_ended[all_.lines[line, SECOND_ROW]] = False
            _given_up(all_.motors, slaves, tick)
            for index in range(3):
                ahead[index].sense = UNKNOWN_SENSE
        if _all_still(slaves):
            _close(all_, line, tick)
            line += 1
            if line < count:
                _open(all_, line)
            for index in range(3):
                ahead[index].sense = UNKNOWN_SENSE
    all_.clock[0], all_.clock[1] = tick, line
    return filled, line == count and float(tick) >= begin[0]
