"""Lines that lie on one line but for a tolerance, merged: LinuxCNC's naive cam detector.

Points wait in a chain that begins at `base`. A new end joins it when every waiting point lies
within the tolerance of the line from the base to the new end (as a line of that length);
otherwise the chain is cut as one line to its last point, and a new one begins there
(`see_segment`, `linkable` and `flush_segments` of emccanon.cc). Chains take `MAX_CHAIN_POINTS`
points, and one never comes back to its base.

Compiled, because what joins depends on all that joined before.
"""

from __future__ import annotations

from libc.stdint cimport uint8_t
from camtool.kernels.types cimport Int

from camtool.arrays import Bools, Floats, Ints

cpdef enum:
    # A chain that has so many points takes no more.
    MAX_CHAIN_POINTS = 101


cdef inline double _share(double[:, ::1] points, Int base, Int end, Int point) noexcept:
    """Return the parameter of the point of the line from base to end that is nearest to `point`."""
    cdef Int axis
    cdef double change, along, square
    along, square = 0.0, 0.0
    for axis in range(3):
        change = points[end, axis] - points[base, axis]
        along += change * (points[point, axis] - points[base, axis])
        square += change * change
    return min(max(along / square, 0.0), 1.0)


cdef bint _joins(double[:, ::1] points, Int base, Int new, double tolerance) noexcept:
    """True if point `new` may be the end of the chain that begins at point `base`."""
    cdef Int k, axis
    cdef bint same
    cdef double square
    same = (
        points[new, 0] == points[base, 0]
        and points[new, 1] == points[base, 1]
        and points[new, 2] == points[base, 2]
    )
    if new - base - 1 >= MAX_CHAIN_POINTS or same:
        return False
    for k in range(base + 1, new):
        share = _share(points, base, new, k)
        square = 0.0
        for axis in range(3):
            on_line = points[base, axis] + share * (points[new, axis] - points[base, axis])
            square += (points[k, axis] - on_line) * (points[k, axis] - on_line)
        if square > tolerance * tolerance:
            return False
    return True


cpdef void merge_lines(
    double[:, ::1] points, uint8_t[::1] breaks, double[:] tolerance, Int[::1] chain,
    double[:, ::1] moved
) noexcept:
    """The chain of each of N moves, `chain` (N,), numbered from 0, and where the moves then end,
    `moved` (N, 3): on the chain's line, never back.

    `points` (N+1, 3): the start and all ends; `breaks` (N,): moves that do not join the one before;
    `tolerance` (N,): within which a move joins.
    """
    cdef Int k, base, number, axis, j
    cdef double reached, travel
    number, base = -1, 0
    for k in range(len(breaks)):
        if k == 0 or breaks[k] or not _joins(points, base, k + 1, tolerance[k]):
            number, base = number + 1, k
        chain[k] = number
        for axis in range(3):
            moved[k, axis] = points[k + 1, axis]
    base = 0
    for k in range(len(breaks)):
        if k + 1 == len(breaks) or chain[k + 1] != chain[k]:
            reached = 0.0
            for j in range(base, k):
                reached = max(reached, _share(points, base, k + 1, j + 1))
                for axis in range(3):
                    travel = points[k + 1, axis] - points[base, axis]
                    moved[j, axis] = points[base, axis] + reached * travel
            base = k + 1
