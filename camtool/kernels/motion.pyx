"""Legs of whole steps, samples along lines and arcs, and the speeds at which a planner enters its
blocks.
"""

from __future__ import annotations

from libc.math cimport cos, fabs, sin
from libc.stdint cimport int32_t
from camtool.kernels.types cimport Int

from camtool.arrays import Floats, Ints

# Straight legs of whole steps by a counter: one pulse of the axis with most steps per pass.
#
# A leg of d = (dx, dy, dz) steps has M = max |d| passes. In each of them every axis adds |d| to
# its count; a count that reaches M gives a step and loses M. So after pass k an axis has made
# ⌊k·|d| / M⌋ steps: the axis of M one in every pass, all of them |d| in the end. (ValCNC's CUENTA,
# its Tabla 8; a leg along an axis or a diagonal is the same with any controller.)
#
# Exact, because counts are int64 and k·|d| stays below 2⁶³ for legs below 2³¹ steps; any window
# can be filled by itself. Compiled, because positions by division are five times slower.


cpdef void legs_fill(
    Int first_pass, Int[:, ::1] begin, Int[:, ::1] travel, double[::1] step_mm, double[:, ::1] out
) noexcept:
    """Fill `out` (n, 3) mm with the positions after the passes of legs, from pass `first_pass` of the
    first leg on.

    Each leg starts at `begin` (L, 3) steps and goes by `travel` (L, 3) steps, not all of them 0;
    `step_mm` (3,). `out` may end within a leg, not behind the last one.
    """
    cdef Int leg, filled, passes, run, axis, position, k, size, sense, count
    leg, filled = 0, 0
    while filled < len(out):
        passes = max(abs(travel[leg, 0]), abs(travel[leg, 1]), abs(travel[leg, 2]))
        run = min(passes - first_pass, len(out) - filled)
        for axis in range(3):
            size, sense = abs(travel[leg, axis]), 1 if travel[leg, axis] > 0 else -1
            position = begin[leg, axis] + sense * (first_pass * size // passes)
            count, step = first_pass * size % passes, step_mm[axis]
            for k in range(filled, filled + run):
                count += size
                if count >= passes:
                    count -= passes
                    position += sense
                out[k, axis] = float(position) * step
        filled += run
        leg += 1
        first_pass = 0


# Samples along the rows of a toolpath.
#
# A sample stands at a share of the length of its row, along a line or an arc whose radius and
# height change evenly (a spiral, a helix); at the share 1 it is the end itself. Compiled, because
# each of a million samples would be written and read in ten columns of its own.

cpdef enum:
    # Columns of an arc: its centre, the radius at its start and how much that grows, the angle at
    # its start, the sweep, its first height and how much that rises.
    CENTRE_X = 0, CENTRE_Y = 1, RADIUS = 2, GROWTH = 3, ANGLE = 4, SWEEP = 5, Z = 6, RISE = 7
    ARM_COLUMNS = 8


cdef class Ways:
    """The paths of N rows: the `start` (3,) mm of the first and the `end` (N, 3) of each;
    the `arms` (A, 8) of arcs, and which of them each row has, `arm` (N,), −1 for lines."""

    def __init__(
        self,
        const double[::1] start,
        const double[:, ::1] end,
        const int32_t[::1] arm,
        const double[:, ::1] arms,
    ) -> None:
        self.start, self.end, self.arm, self.arms = start, end, arm, arms

    cdef void put(self, Int row, double share, double *point) noexcept:
        """Write the point (3,) mm at the fraction `share` of the length of a row."""
        cdef Int arm = self.arm[row]
        cdef Int axis
        cdef double angle, radius, begin
        if share == 1.0:
            for axis in range(3):
                point[axis] = self.end[row, axis]
        elif arm >= 0:
            angle = self.arms[arm, ANGLE] + share * self.arms[arm, SWEEP]
            radius = self.arms[arm, RADIUS] + share * self.arms[arm, GROWTH]
            point[0] = self.arms[arm, CENTRE_X] + radius * cos(angle)
            point[1] = self.arms[arm, CENTRE_Y] + radius * sin(angle)
            point[2] = self.arms[arm, Z] + share * self.arms[arm, RISE]
        else:
            for axis in range(3):
                begin = self.end[row - 1, axis] if row else self.start[axis]
                point[axis] = begin + share * (self.end[row, axis] - begin)

    def fill(
        self, const Int[::1] row, const double[::1] share, double[:, ::1] points
    ) -> None:
        """Write the points (K, 3) mm at fractions `share` (K,) of the lengths of rows (K,)."""
        cdef Int k
        for k in range(len(row)):
            self.put(row[k], share[k], &points[k, 0])


cpdef void count_steps(
    const double[:, ::1] points, double[::1] step_mm, double guard, Int[:, ::1] counts
) noexcept:
    """Write `counts` (K, 3): the steps that each axis has made at each of the points (K, 3) mm
    since the first one, if it stands at its nearest step (`camtool.kernels.lattice.to_steps`, with
    its `guard`)."""
    cdef Int k, axis, steps, before, total
    cdef double quotient
    for axis in range(3):
        before, total = 0, 0
        for k in range(len(points)):
            quotient = points[k, axis] / step_mm[axis]
            steps = <Int>(fabs(quotient) + (0.5 + guard))
            if quotient < 0.0:
                steps = -steps
            if k:
                total += abs(steps - before)
            before = steps
            counts[k, axis] = total


# How fast a planner that sees only so many blocks ahead enters each of them.
#
# A planner may enter block j no faster than its limit (squared: limit_j), and never so fast that
# it could not stop at the end of the last block that it knows of. With e the square of a speed, a
# the acceleration and d the length of a block:
#
#     backward over the known blocks, from rest:   e ← min(limit_j, e + 2 a_j d_j)
#     forward, from what was reached before:       entry_i² = min(e_i, entry_{i−1}² + 2 a d)
#
# When block i is entered the block before it is still in the buffer, which holds `window` blocks:
# it knows blocks i to i + window − 2. Exact, because the windows are those of a buffer that is
# always full; what the planner does again at each new block ends at the same numbers.
#
# Compiled, because every speed depends on the one before.


cpdef void entry_speeds(
    double[::1] gain, double[::1] limit, Int window, double reached, double[::1] entry
) noexcept:
    """Fill `entry` (N,) with the squares of the speeds at the starts of N blocks.

    `gain` (N,): the greatest change of the square of the speed within a block, 2 a d; `limit`
    (N,): its highest value at the start of the block, 0 where the machine stands before it.
    `reached`: the square that the blocks before allow at the start of the first, 0 where there are
    none.
    """
    cdef Int i, j
    for i in range(len(gain)):
        planned = 0.0
        for j in range(min(i + window - 1, len(gain)) - 1, i - 1, -1):
            planned = min(limit[j], planned + gain[j])
        reached = min(planned, reached)
        entry[i] = reached
        reached += gain[i]
