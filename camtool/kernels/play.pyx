"""The play of axes: slides that follow the motor's positions, and random numbers for axes that
scatter.

Compiled, because every position depends on the one before.
"""

from __future__ import annotations

from libc.stdint cimport uint64_t
from camtool.kernels.types cimport Int
from camtool.kernels.wide cimport wide

import numpy as np

from camtool.arrays import Floats, Ints

# Random numbers with a number each: the same on every machine, in whatever order they are asked.
#
# The n-th number of a stream is the sum of twelve uniform ones, less its mean: of mean 0, of
# standard deviation 1 (1 − 2⁻³³ of it), never beyond ±6, and near enough to a normal one (fourth
# moment 2.9 for 3). Sums of integers are exact; logarithms and cosines, of which normal numbers
# are made else, differ between platforms in their last bits.
#
# The uniform numbers are the 16-bit parts of three outputs of SplitMix64 (Steele, Lea, Flood,
# "Fast splittable pseudorandom number generators", 2014), whose k-th output from a key is a
# mixture of the bits of key + k·γ: nothing is carried along.


# 2⁶⁴ divided by the golden ratio, odd: the increment of SplitMix64's counter.
cdef uint64_t GAMMA = 0x9E3779B97F4A7C15U

# The factors of SplitMix64.
cdef uint64_t MIXER = 0xBF58476D1CE4E5B9U
cdef uint64_t OTHER_MIXER = 0x94D049BB133111EBU


cdef inline uint64_t _mixed(uint64_t word) noexcept:
    """Return the output function of SplitMix64."""
    word = (word ^ (word >> 30)) * MIXER
    word = (word ^ (word >> 27)) * OTHER_MIXER
    return word ^ (word >> 31)


cdef double deviate(Int seed, Int stream, Int number) noexcept:
    """Return random number `number` (from 0) of stream `stream` (from 0): nearly normal with
    standard deviation 1, by the sum of twelve uniform numbers."""
    cdef Int k, part
    cdef uint64_t key, total, word
    key = _mixed(seed + (stream + 1) * GAMMA)
    total = 0
    for k in range(1, 4):
        word = _mixed(key + (3 * number + k) * GAMMA)
        for part in range(4):
            total += (word >> (16 * part)) & 0xFFFF
    return (float(total) - 6.0 * 65535.0) / 65536.0


# The play of an axis (backlash), and what the controller issues against it.
#
# The slide sits between two flanks of the nut: with the motor at m (mm) it can only be in
# [m + low, m + high], high − low = play, and it moves only when a flank takes it along:
#
#     s_k = min(max(s_{k−1}, m_k + low), m_k + high)          (the play operator)
#
# Before the first motion s = m. "preloaded" in + : the flank that pushes towards + touches, low =
# 0, high = play; in − : low = −play, high = 0. "centred": low = −play/2, high = +play/2. The two
# differ by half the play, and by nothing else.
#
# Compensation is the controller's own policy: whenever the commanded direction of an axis changes,
# it issues so much more in the new direction before the step itself; that moves the motor, not the
# controller's position. A first motion against the direction that the axis is believed to be
# engaged in counts as a change. (Thesis of the PIC18F8720, L1707-1709, L1774-1778.)
#
# An axis has reversed when it came back by half a coded step from the furthest that it went in its
# direction: rounding of positions in mm must not make a reversal, and any step does.
#
# Positions, compensation and the half step are in one unit, mm or steps; `scale` makes it mm.
#
# Exact, because the slide is either left alone or set to (position + added) · scale + flank, where
# `added` is 0 or one compensation, in the direction that is not the first one: nothing is summed
# up, and cutting the samples into blocks changes no bit. The operator does not depend on the rate,
# so a monotone burst of compensation steps acts as its last one. Compiled, because every position
# depends on the one before.


def play_limits(play_mm: float, convention: str, direction: int) -> tuple[float, float]:
    """Return the limits (low, high) of the play, mm, for "preloaded" in `direction` ±1 or
    "centred"."""
    if convention == "centred":
        return -0.5 * play_mm, 0.5 * play_mm
    return (0.0, play_mm) if direction > 0 else (-play_mm, 0.0)


def play_start(position: float, scale: float, direction: int) -> Floats:
    """Return the state (6,) of an axis at rest at `position`, engaged in `direction` ±1.

    Furthest position in the present direction, that direction, compensation added so far, slide
    in mm; reversals so far and shift in mm, where the axis scatters.
    """
    return np.array([position, direction, 0.0, position * scale, 0.0, 0.0], dtype=np.float64)


cdef inline (double, double, bint) turned(
    double position, double furthest, double direction, double threshold
) noexcept:
    """Return the new furthest position and direction, and whether the axis has reversed."""
    ahead = (position - furthest) * direction
    if ahead >= 0.0:
        return position, direction, False
    if ahead <= -threshold:
        return position, -direction, True
    return furthest, direction, False


cdef inline double taken_along(double slide, double motor, double low, double high) noexcept:
    """Return the position of the slide after the motor has gone to `motor` mm in one direction
    (the play operator)."""
    return min(max(slide, motor + low), motor + high)


cpdef void play_fill(
    const double[:, ::1] positions, Int[::1] offsets, double[:, ::1] axes, double[:, ::1] states,
    double[:, ::1] out, Int[:, ::1] turns
) noexcept:
    """Fill `out` (n, 3) with the positions of the slides, mm, for commanded `positions` (n, 3),
    and count the reversals of each run.

    `axes` (3, 5): scale, low and high in mm, compensation, and how far back counts as a reversal.
    `states` (3, 6), each of `play_start`, are changed in place, so that the next call continues.
    Run r is offsets[r]:offsets[r+1]; `turns` (R, 3) are its reversals.
    """
    cdef Int axis, run, count, k
    cdef bint reversed_
    for axis in range(3):
        scale, low, high = axes[axis, 0], axes[axis, 1], axes[axis, 2]
        compensation, threshold = axes[axis, 3], axes[axis, 4]
        furthest, direction = states[axis, 0], states[axis, 1]
        added, slide = states[axis, 2], states[axis, 3]
        for run in range(len(turns)):
            count = 0
            for k in range(offsets[run], offsets[run + 1]):
                position = positions[k, axis]
                furthest, direction, reversed_ = turned(position, furthest, direction, threshold)
                if reversed_:
                    added += direction * compensation
                    count += 1
                slide = taken_along(slide, (position + added) * scale, low, high)
                out[k, axis] = slide
            turns[run, axis] = count
        states[axis, 0], states[axis, 1] = furthest, direction
        states[axis, 2], states[axis, 3] = added, slide


cpdef void play_varied_fill(
    const double[:, ::1] positions, Int[::1] offsets, double[:, ::1] axes, double[:, ::1] states,
    double[:, ::1] plays, double[::1] shares, double[::1] scatter, Int seed, double[:, ::1] out,
    Int[:, ::1] turns
) noexcept:
    """Fill `out` as `play_fill` does, with a play for each sample and axes that scatter.

    `plays` (n, 3) mm replace low and high in `axes`, which have `shares` (2,) of them. At each
    reversal both flanks of an axis move to a new random place, with the standard deviation
    `scatter` (3,) mm; the first ones are at 0.
    """
    cdef Int axis, run, number, before, k
    cdef bint reversed_
    for axis in range(3):
        scale, compensation, threshold = axes[axis, 0], axes[axis, 3], axes[axis, 4]
        furthest, direction = states[axis, 0], states[axis, 1]
        added, slide = states[axis, 2], states[axis, 3]
        number, shift = int(states[axis, 4]), states[axis, 5]
        for run in range(len(turns)):
            before = number
            for k in range(offsets[run], offsets[run + 1]):
                position = positions[k, axis]
                furthest, direction, reversed_ = turned(position, furthest, direction, threshold)
                if reversed_:
                    added += direction * compensation
                    shift = scatter[axis] * deviate(seed, axis, number)
                    number += 1
                play = plays[k, axis]
                motor = (position + added) * scale + shift
                slide = taken_along(slide, motor, shares[0] * play, shares[1] * play)
                out[k, axis] = slide
            turns[run, axis] = number - before
        states[axis, 0], states[axis, 1] = furthest, direction
        states[axis, 2], states[axis, 3] = added, slide
        states[axis, 4], states[axis, 5] = number, shift


# The play of an axis over blocks of positions that mostly run one way.
#
# While the motor runs one way, the play operator of `play_fill` has no memory but where
# the slide stood at first: with rising motor positions m_k
#
#     s_k = min(max(s_{k−1}, m_k + low), m_k + high) = max(s_0, m_k + low),
#
# since m_k + low rises too, and s_{k−1} ≤ m_{k−1} + high ≤ m_k + high; falling the same with the
# other flank. Exact to the last bit, since max and min only choose. A reversal comes with the
# first sample that moves, in a block that turns nowhere else; blocks that do are taken step by
# step.


cpdef Int way_of(Int before, Int[::1] positions) noexcept:
    """Return RISING, FALLING, STILL or TURNING for the positions (n,) that follow `before`."""
    cdef Int smallest, largest, k, change
    smallest = largest = positions[0] - before
    for k in range(1, len(positions)):
        change = positions[k] - positions[k - 1]
        smallest = min(smallest, change)
        largest = max(largest, change)
    if smallest >= 0:
        return RISING if largest > 0 else STILL
    return FALLING if largest <= 0 else TURNING


cpdef Int play_block(
    Int trend, double[::1] positions, double[::1] axis, double[::1] state, double[::1] out
) noexcept:
    """Compute the slide `out` (n,) mm for positions (n,) that run in the direction `trend`; return
    the number of reversals.

    `axis` (5,) and `state` (4,) as in `play_fill`; steps are wider than axis[4].
    """
    cdef Int reversals
    _fill_block(trend, positions, axis, state, out, &reversals)
    return reversals


cdef wide _fill_block(
    Int trend, double[::1] positions, double[::1] axis, double[::1] state, double[::1] out,
    Int* result
) noexcept:
    cdef Int count, begin, reversals, k
    cdef double motor
    if trend == TURNING or len(positions) == 0:
        result[0] = _step_by_step(positions, axis, state, out)
        return
    scale, low, high = axis[0], axis[1], axis[2]
    begin, reversals = 0, 0
    if trend != STILL and trend != state[1]:
        while positions[begin] == state[0]:
            begin += 1
        if begin > 0:
            state[3] = taken_along(state[3], (state[0] + state[2]) * scale, low, high)
        for k in range(begin):
            out[k] = state[3]
        state[1] = trend
        state[2] += trend * axis[3]
        reversals = 1
    added = state[2]
    slide = taken_along(state[3], (positions[begin] + added) * scale, low, high)
    count = len(positions)
    if trend == STILL:
        for k in range(begin, count):
            out[k] = slide
    elif trend == RISING:
        for k in range(begin, count):
            motor = (positions[k] + added) * scale + low
            out[k] = slide if slide > motor else motor
    else:
        for k in range(begin, count):
            motor = (positions[k] + added) * scale + high
            out[k] = slide if slide < motor else motor
    state[0], state[3] = positions[count - 1], out[count - 1]
    result[0] = reversals


cdef Int _step_by_step(
    double[::1] positions, double[::1] axis, double[::1] state, double[::1] out
) noexcept:
    cdef Int reversals, k
    cdef bint reversed_
    reversals = 0
    for k in range(len(positions)):
        state[0], state[1], reversed_ = turned(positions[k], state[0], state[1], axis[4])
        if reversed_:
            state[2] += state[1] * axis[3]
            reversals += 1
        state[3] = taken_along(state[3], (positions[k] + state[2]) * axis[0], axis[1], axis[2])
        out[k] = state[3]
    return reversals
