"""Lines of whole steps by Bresenham on the axis with the most of them.

A block takes n_x, n_y, n_z steps in N = max(n) events. Each axis has a counter, N at the start
of the block; at every event it grows by 2n, and where it exceeds 2N the axis takes a step and 2N
are taken off. After k events the counter stands at N + 2nk − 2N·s in (0, 2N], so the steps taken
are

    s = ⌈(N + 2nk) / 2N⌉ − 1 = ⌊(N + 2nk − 1) / 2N⌋ :

the ideal n k / N rounded to the nearest, halves down. That is where a window into the middle of
a block goes on from. Whole numbers throughout.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Floats, Ints


def steps_taken(travel: Ints, events: Ints) -> Ints:
    """Return (B, 3) signed steps of blocks of `travel` (B, 3) steps after `events` (B,) events
    of each."""
    size = np.abs(travel)
    event_count = np.maximum(size.max(axis=1, initial=0), 1)[:, None]
    step_count = (event_count + 2 * size * events[:, None] - 1) // (2 * event_count)
    return np.asarray(np.sign(travel) * step_count)


cpdef void step_lines_fill(
    blocks, (Int, Int) first, double[::1] step_mm, double[:, ::1] out
) noexcept:
    """Fill `out` (K, 3) mm with the positions after K step events.

    `blocks`: the start (B, 3) and the travel (B, 3) of each, steps, none without steps; `first`:
    the block of the first event, and how many of its events came before.
    """
    cdef Int k, block, event, event_count, count, axis, size, sign, taken_steps, counter, position, m
    cdef Int[:, ::1] start, travel
    start, travel = blocks
    block, event = first
    k = 0
    while k < len(out):
        event_count = max(abs(travel[block, 0]), abs(travel[block, 1]), abs(travel[block, 2]))
        count = min(event_count - event, len(out) - k)
        for axis in range(3):
            size = abs(travel[block, axis])
            sign = 1 if travel[block, axis] > 0 else -1
            taken_steps = (event_count + 2 * size * event - 1) // (2 * event_count)
            counter = event_count + 2 * size * event - 2 * event_count * taken_steps
            position = start[block, axis] + sign * taken_steps
            for m in range(k, k + count):
                counter += 2 * size
                if counter > 2 * event_count:
                    counter -= 2 * event_count
                    position += sign
                out[m, axis] = float(position) * step_mm[axis]
        k += count
        block += 1
        event = 0


# The segments of grbl's stepper: how long each tick of its timer is (`st_prep_buffer`, stepper.c).
#
# A block is cut into segments of about 10 ms, of whole steps of its longest axis and one tick each.
# Below 8, 4 and 2 kHz a step takes 2, 4 and 8 ticks (AMASS), in any of which the other axes may
# step. The arithmetic is that of the firmware, in 32-bit floats and in its order, mm and minutes;
# its timer counts one cycle more than it is told.


cpdef enum:
    # Eighths of a step of the longest axis: the finest tick.
    EIGHTHS = 8
    # Cycles of the longest tick.
    MAX_CYCLES = 65535

cdef enum:
    ACCELERATES, CRUISES, BRAKES

# Cycles of a minute, and those of a step from which on it takes 2, 4 and 8 ticks.
cdef float CYCLES_PER_MINUTE = 960000000.0
cdef Int TWO_TICKS = 2000, FOUR_TICKS = 4000, EIGHT_TICKS = 8000

# Minutes of a segment, and the least way of one in steps.
cdef float SEGMENT_MIN = 1.0 / 6000.0
cdef float MIN_STEPS = 1.25

cdef float HALF = 0.5, TWO = 2.0, ZERO = 0.0


cdef class Segments:
    """The segments of B blocks, from the first on. Columns (B,), 32-bit: length mm,
    acceleration mm/min², squares of the speeds at start and end (mm/min)², highest speed
    mm/min; and the steps of the longest axis."""

    cdef float[::1] length, acceleration, entry, exit, nominal
    cdef int[::1] events
    cdef Int block
    cdef bint is_loaded
    cdef int ramp
    cdef float mm, steps_remaining, step_per_mm, least_mm, dt_remainder, speed, maximum, exit_speed
    cdef float accelerate_until, decelerate_after

    def __init__(self, length, acceleration, entry, exit, nominal, events) -> None:
        self.length, self.acceleration, self.entry = length, acceleration, entry
        self.exit, self.nominal, self.events = exit, nominal, events
        self.block, self.is_loaded = 0, False

    def fill(self, Int[::1] block, Int[::1] eighths, Int[::1] tick, Int[::1] cycles) -> int:
        """Fill in the next segments (S,): their blocks, lengths in eighths of a step, eighths of a
        tick, and cycles of a tick. Return their number, less than S only at the end."""
        cdef Int k, steps, level, count
        cdef float dt, inv_rate, distance, remaining, last
        k = 0
        while k < len(block) and self.block < len(self.length):
            if not self.is_loaded:
                self._load()
            dt = self._advance()
            distance = self.step_per_mm * self.mm
            remaining = <float>math.ceil(distance)
            last = <float>math.ceil(self.steps_remaining)
            steps = <Int>(last - remaining)
            dt += self.dt_remainder
            inv_rate = dt / (last - distance)
            count = <Int>math.ceil(CYCLES_PER_MINUTE * inv_rate)
            level = 0
            if count >= EIGHT_TICKS:
                level = 3
            elif count >= FOUR_TICKS:
                level = 2
            elif count >= TWO_TICKS:
                level = 1
            block[k], eighths[k] = self.block, steps * EIGHTHS
            tick[k] = EIGHTHS >> level
            cycles[k] = min(count >> level, <Int>MAX_CYCLES) + 1
            self.steps_remaining = remaining
            self.dt_remainder = (remaining - distance) * inv_rate
            if self.mm == ZERO:
                self.block += 1
                self.is_loaded = False
            k += 1
        return k

    cdef void _load(self) noexcept:
        """Load the next block, and compute its ramps."""
        cdef float inv_2_accel, entry, exit, nominal, meeting
        cdef Int b
        b = self.block
        self.mm = self.length[b]
        self.steps_remaining = <float>self.events[b]
        self.step_per_mm = self.steps_remaining / self.mm
        self.least_mm = MIN_STEPS / self.step_per_mm
        self.dt_remainder = ZERO
        entry, exit = self.entry[b], self.exit[b]
        self.speed, self.exit_speed = <float>math.sqrt(entry), <float>math.sqrt(exit)
        inv_2_accel = HALF / self.acceleration[b]
        self.ramp, self.accelerate_until = ACCELERATES, self.mm
        self.decelerate_after = ZERO
        nominal = self.nominal[b] * self.nominal[b]
        meeting = HALF * (self.mm + inv_2_accel * (entry - exit))
        self.is_loaded = True
        if meeting <= ZERO:
            self.accelerate_until, self.maximum = ZERO, self.exit_speed
        elif meeting >= self.mm:
            self.ramp = BRAKES
        else:
            self.decelerate_after = inv_2_accel * (nominal - exit)
            if self.decelerate_after < meeting:
                self.maximum = self.nominal[b]
                if entry >= nominal:
                    self.ramp = CRUISES
                else:
                    self.accelerate_until -= inv_2_accel * (nominal - entry)
            else:
                self.accelerate_until = self.decelerate_after = meeting
                self.maximum = <float>math.sqrt(TWO * self.acceleration[b] * meeting + exit)

    cdef float _advance(self) noexcept:
        """Advance by one segment; return its duration, min."""
        cdef float longest, dt, time, ahead, change, end_mm, mm, acceleration
        acceleration = self.acceleration[self.block]
        longest, dt, time, mm = SEGMENT_MIN, ZERO, SEGMENT_MIN, self.mm
        end_mm = mm - self.least_mm
        if end_mm < ZERO:
            end_mm = ZERO
        while True:
            change = acceleration * time
            if self.ramp == ACCELERATES:
                mm -= time * (self.speed + HALF * change)
                if mm < self.accelerate_until:
                    mm = self.accelerate_until
                    time = TWO * (self.mm - mm) / (self.speed + self.maximum)
                    self.ramp = BRAKES if mm == self.decelerate_after else CRUISES
                    self.speed = self.maximum
                else:
                    self.speed += change
            elif self.ramp == CRUISES:
                ahead = mm - self.maximum * time
                if ahead < self.decelerate_after:
                    time = (mm - self.decelerate_after) / self.maximum
                    mm = self.decelerate_after
                    self.ramp = BRAKES
                else:
                    mm = ahead
            else:
                ahead = mm - time * (self.speed - HALF * change)
                if self.speed > change and ahead > ZERO:
                    mm = ahead
                    self.speed -= change
                else:
                    time = TWO * mm / (self.speed + self.exit_speed)
                    mm = ZERO
                    self.speed = self.exit_speed
            dt += time
            if dt < longest:
                time = longest - dt
            elif mm > end_mm:
                longest += SEGMENT_MIN
                time = longest - dt
            else:
                break
            if mm <= ZERO:
                break
        self.mm = mm
        return dt
