"""Moves by timers that run each axis on its own, the method of the parallel-port machine.

A displacement of n steps of the longer axis and m ≤ n of the shorter one ends when the longer
one has made n. With the half period P of the longer axis, that of the shorter one is P·n/m, so
that both should end together (thesis L1127-1129, L1188). But a timer fires at the first whole
millisecond above its half period (reading "whole-ms"):

    longer:  every P + 1 ms        shorter:  every ⌊P·n/m⌋ + 1 ms
    steps of the shorter one:  ⌊n (P + 1) / (⌊P·n/m⌋ + 1)⌋  ≥ m,  and = m as long as m ≤ P

and nothing stops it at m. In the other reading ("late-longer") the longer axis is a millisecond
late at each step and the shorter one never: it fires every P·n/m ms and makes ⌊m (P + 1) / P⌋
steps. Steps of both axes at the same time are one sample; so is the one that ends the move.

Exact, because times are integers (in the second reading those of a move are taken m times), and
only the time of the next firing and its difference to the other one are carried along: below 2⁶²
for all half periods and displacements below 2³¹. Lengths become steps as everywhere, by
floor(length / step + a half and a guard); no position is summed up. Compiled, because a
displacement may depend on where the one before it ended, and a part has millions of steps.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int

from typing import NamedTuple

import numpy as np

from camtool.arrays import Floats, Ints

cpdef enum:
    # What moves: X and Y by their timers, one axis alone, or one to its sensor at machine zero.
    XY = 0, Z, HOME_X, HOME_Y, HOME_Z


class Moves(NamedTuple):
    """M moves: what moves (M,), where to (M, 3) mm, half period of the longer axis (M,) ms, and
    their rows (M,) of `Issued.duration_ms` and `Issued.steps`."""

    what: Ints
    target: Floats
    half_period: Ints
    row: Ints


class Rules(NamedTuple):
    """Origin of all steps (3,) mm, steps (3,) mm, what is added to a quotient before
    its floor is taken, whether displacements are counted from what was reached, and whether the
    longer axis is late and the shorter one not."""

    origin: Floats
    step_mm: Floats
    added: float
    from_reached: bool
    late_longer: bool


class Counters(NamedTuple):
    """State of the controller, changed in place: steps issued so far (3,), where the program is
    (3,) mm, and of the move that is under way (10,): steps of its longer axis to come, by how much
    its shorter axis fires later than that, their columns (the shorter −1: none), their senses,
    the times between their steps, the next step of the longer axis from the start of the move on,
    ms, and how many units of the other times are a millisecond."""

    steps: Ints
    programmed: Floats
    under_way: Ints


class Issued(NamedTuple):
    """Samples: positions (K, 3) mm, their rows (K,), their moves (K,) and half periods (K,) ms
    since the start of these; of each row (R,) the half periods of the longer axis with their
    lateness, ms, and (R, 3) steps: added to what is there."""

    commanded: Floats
    row: Ints
    move: Ints
    since_ms: Ints
    duration_ms: Ints
    steps: Ints


cdef class Timers:
    """All of these as the loops read them, and where the axes are."""

    cdef Int[::1] what, half_period, move_row, steps, under_way, row, move, since_ms, duration_ms
    cdef Int[:, ::1] steps_of_rows
    cdef double[:, ::1] target, commanded
    cdef const double[::1] origin
    cdef double[::1] step_mm, programmed, position
    cdef double added
    cdef bint from_reached, late_longer

    def __init__(self, moves: Moves, rules: Rules, counters: Counters, issued: Issued) -> None:
        self.what, self.target, self.half_period, self.move_row = moves
        self.origin, self.step_mm, self.added, self.from_reached, self.late_longer = rules
        self.steps, self.programmed, self.under_way = counters
        self.commanded, self.row, self.move, self.since_ms = issued[:4]
        self.duration_ms, self.steps_of_rows = issued[4:]
        self.position = np.empty(3)


cdef Int _displacement(Int axis, double target, bint sensed, Timers timers) noexcept:
    """Return the steps of an axis to its target, which becomes the program's position."""
    cdef Int steps
    cdef double position
    position = timers.programmed[axis]
    if sensed or timers.from_reached:
        position = timers.origin[axis] + float(timers.steps[axis]) * timers.step_mm[axis]
    timers.programmed[axis] = target
    change = target - position
    steps = int(abs(change) / timers.step_mm[axis] + timers.added)
    return -steps if change < 0.0 else steps


cdef void _begin(Int move, Timers timers) noexcept:
    """Set the timers of a move."""
    cdef Int what, half_period, longer, shorter, short_way, along_x, along_y, long_way, n, m
    cdef Int every, short_every, unit
    cdef Int[::1] under_way
    what, half_period, under_way = timers.what[move], timers.half_period[move], timers.under_way
    longer, shorter, short_way = 2, -1, 0
    if what == XY:
        along_x = _displacement(0, timers.target[move, 0], False, timers)
        along_y = _displacement(1, timers.target[move, 1], False, timers)
        longer, shorter, long_way, short_way = 0, 1, along_x, along_y
        if abs(along_y) > abs(along_x):
            longer, shorter, long_way, short_way = 1, 0, along_y, along_x
    else:
        longer = 0 if what == HOME_X else 1 if what == HOME_Y else 2
        long_way = _displacement(longer, timers.target[move, longer], what != Z, timers)
    n, m = abs(long_way), abs(short_way)
    every, short_every, unit = half_period + 1, 0, 1
    if m == 0:
        shorter = -1
    elif timers.late_longer:
        every, short_every, unit = every * m, half_period * n, m
    else:
        short_every = half_period * n // m + 1
    under_way[0], under_way[1] = n, short_every - every
    under_way[2], under_way[3] = longer, shorter
    under_way[4] = 1 if long_way >= 0 else -1
    under_way[5] = 1 if short_way >= 0 else -1
    under_way[6], under_way[7] = every, short_every
    under_way[8], under_way[9] = half_period + 1, unit


cdef Int _run(Timers timers, Int row, Int move, Int first) noexcept:
    """Let the timers run until the move ends or the samples are full; return the number of samples
    filled."""
    cdef Int axis, steps_left, gap, longer, shorter, sense, short_sense, every, short_every, count
    cdef Int short_count, k, next_ms, unit
    cdef Int[::1] steps, under_way, rows, moves, since
    cdef bint fires
    cdef double[:, ::1] commanded
    cdef double[::1] step_mm, position
    under_way, step_mm = timers.under_way, timers.step_mm
    steps, position, commanded, rows = timers.steps, timers.position, timers.commanded, timers.row
    moves, since = timers.move, timers.since_ms
    steps_left, gap, longer, shorter = under_way[0], under_way[1], under_way[2], under_way[3]
    sense, short_sense = under_way[4], under_way[5]
    every, short_every, next_ms, unit = under_way[6], under_way[7], under_way[8], under_way[9]
    for axis in range(3):
        position[axis] = timers.origin[axis] + float(steps[axis]) * step_mm[axis]
    count, short_count, k = steps[longer], steps[max(shorter, 0)], first
    while steps_left > 0 and k < len(rows):
        fires = shorter < 0 or gap >= 0
        since[k] = next_ms if fires else next_ms - (unit - 1 - gap) // unit
        if shorter >= 0 and gap <= 0:
            short_count += short_sense
            position[shorter] = timers.origin[shorter] + float(short_count) * step_mm[shorter]
            gap += short_every
        if fires:
            count += sense
            position[longer] = timers.origin[longer] + float(count) * step_mm[longer]
            gap -= every
            next_ms += every // unit
            steps_left -= 1
        for axis in range(3):
            commanded[k, axis] = position[axis]
        rows[k], moves[k] = row, move
        k += 1
    timers.steps_of_rows[row, longer] += abs(count - steps[longer])
    steps[longer] = count
    if shorter >= 0:
        timers.steps_of_rows[row, shorter] += abs(short_count - steps[shorter])
        steps[shorter] = short_count
    under_way[0], under_way[1], under_way[8] = steps_left, gap, next_ms
    return k


cpdef (Int, Int) timers_fill(moves, Int first, rules, counters, issued):
    """Run moves from `first` on until all are done or the samples of `issued` are full.

    Return the move to continue with and the number of samples filled.
    """
    cdef Int k, move, ticks, row, before
    cdef Timers timers
    timers = Timers(moves, rules, counters, issued)
    k, move = 0, first
    while move < len(timers.what):
        if timers.under_way[0] == 0:
            _begin(move, timers)
        row, before = timers.move_row[move], timers.under_way[0]
        k = _run(timers, row, move, k)
        ticks = before - timers.under_way[0]
        timers.duration_ms[row] += ticks * (timers.half_period[move] + 1)
        if timers.under_way[0] > 0:
            break
        move += 1
    return move, k
