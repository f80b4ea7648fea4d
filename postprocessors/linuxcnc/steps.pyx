"""LinuxCNC's naive cam detector, which merges lines that lie on one line but for a tolerance; and
samples on the blends of corners.

Points wait in a chain that begins at `base`. A new end joins it when every waiting point lies
within the tolerance of the line from the base to the new end (as a line of that length);
otherwise the chain is cut as one line to its last point, and a new one begins there
(`see_segment`, `linkable` and `flush_segments` of emccanon.cc). Chains take `MAX_CHAIN_POINTS`
points, and one never comes back to its base.

Compiled, because what joins depends on all that joined before.
"""

from __future__ import annotations

from libc.math cimport sin
from libc.stdint cimport uint8_t
from camtool.kernels.motion cimport Ways
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
    """Return True if point `new` may be the end of the chain that begins at point `base`."""
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
    double[:, ::1] projected
) noexcept:
    """Fill `chain` (N,) with the chain of each of N moves, numbered from 0, and `projected` (N, 3)
    with the new ends of the moves: on the chain's line, never going back.

    `points` (N+1, 3): the start and all ends; `breaks` (N,): moves that do not join the one
    before; `tolerance` (N,): within which a move joins.
    """
    cdef Int k, base, number, axis, j
    cdef double reached, travel
    number, base = -1, 0
    for k in range(len(breaks)):
        if k == 0 or breaks[k] or not _joins(points, base, k + 1, tolerance[k]):
            number, base = number + 1, k
        chain[k] = number
        for axis in range(3):
            projected[k, axis] = points[k + 1, axis]
    base = 0
    for k in range(len(breaks)):
        if k + 1 == len(breaks) or chain[k + 1] != chain[k]:
            reached = 0.0
            for j in range(base, k):
                reached = max(reached, _share(points, base, k + 1, j + 1))
                for axis in range(3):
                    travel = points[k + 1, axis] - points[base, axis]
                    projected[j, axis] = points[base, axis] + reached * travel
            base = k + 1


# Samples near blended corners.
#
# Each sample is some way along its move, and what is left of the move lies before the next corner.
# The first half of a blend stands for the end of the move before its corner, the second half for
# the start of the move behind it. An arc blend turns the spoke to its start into the spoke to its
# end; where moves overlap, the tool is where both are, one on top of the other.

cpdef enum:
    # Columns of a corner: how far it reaches into the move before and the move behind it; how far
    # an overlap does, `ramp` and the part of its time at which one move ends and the other begins;
    # of an arc blend its angle and the sine of that, centre and both spokes.
    REACH = 0, REACH_ON = 1, BEFORE = 2, BEHIND = 3, RAMP = 4, TURN = 5, ANGLE = 6, SINE = 7
    CENTRE = 8, FIRST = 11, LAST = 14, CORNER_COLUMNS = 17


cdef class Blends:
    """The corners (M + 1, 17) at the starts of M moves and behind the last; of each move
    the `length` (M,) mm, the unit tangent at its start (M, 3) and the first row (M,) of it. Of
    each row of `ways` its move (N,), and how far into that it begins and how long it is (N,),
    mm."""

    cdef Ways ways
    cdef double[:, ::1] corners, tangent
    cdef double[::1] length, into, row_length
    cdef Int[::1] first, move

    def __init__(
        self,
        Ways ways,
        double[:, ::1] corners,
        moves: tuple[Floats, Floats, Ints],
        rows: tuple[Ints, Floats, Floats],
    ) -> None:
        self.ways, self.corners = ways, corners
        self.length, self.tangent, self.first = moves
        self.move, self.into, self.row_length = rows

    cdef void _turned(self, Int corner, double share, double *point) noexcept:
        """Write the point (3,) mm at the fraction `share` of an arc blend."""
        cdef Int axis
        cdef double turn = share * self.corners[corner, ANGLE]
        cdef double one = sin(self.corners[corner, ANGLE] - turn) / self.corners[corner, SINE]
        cdef double other = sin(turn) / self.corners[corner, SINE]
        for axis in range(3):
            point[axis] = self.corners[corner, CENTRE + axis]
            point[axis] += one * self.corners[corner, FIRST + axis]
            point[axis] += other * self.corners[corner, LAST + axis]

    cdef void _unblended(self, Int move, double along, double *point) noexcept:
        """Write the point (3,) mm at the arc length `along` of a move, corners not blended."""
        cdef Int row = self.first[move]
        cdef Int axis
        cdef double begin
        if self.ways.arm[row] >= 0:
            self.ways.put(row, along / self.length[move], point)
            return
        for axis in range(3):
            begin = self.ways.end[row - 1, axis] if row else self.ways.start[axis]
            point[axis] = begin + along * self.tangent[move, axis]

    cdef void _overlapped(self, Int corner, double x, double *point) noexcept:
        """Write the point (3,) mm where two moves overlap, at the fraction x of the time: while
        the first slows down evenly over its last `BEFORE` mm, the second speeds up in the first
        part `RAMP` of that time, and then continues, over its first `BEHIND` mm."""
        cdef double other[3]
        cdef double corner_point[3]
        cdef Int axis
        cdef double ramp = self.corners[corner, RAMP]
        cdef double covered = x * x / (2.0 * ramp) if x < ramp else x - 0.5 * ramp
        covered /= 1.0 - 0.5 * ramp
        self._unblended(
            corner - 1,
            self.length[corner - 1] - (1.0 - x) * (1.0 - x) * self.corners[corner, BEFORE],
            point,
        )
        self._unblended(corner, covered * self.corners[corner, BEHIND], other)
        self._unblended(corner, 0.0, corner_point)
        for axis in range(3):
            point[axis] += other[axis] - corner_point[axis]

    cpdef void put(
        self, const Int[::1] row, const double[::1] share, double[:, ::1] points
    ) noexcept:
        """Write the points (K, 3) mm at fractions `share` (K,) of the lengths of rows (K,), on the
        blends beside them."""
        cdef Int k, move
        cdef double along, rest, turn
        cdef double[:, ::1] corners = self.corners
        for k in range(len(row)):
            move = self.move[row[k]]
            along = self.into[row[k]] + share[k] * self.row_length[row[k]]
            rest = max(self.length[move] - along, 0.0)
            if rest < corners[move + 1, REACH]:
                self._turned(move + 1, 0.5 - 0.5 * rest / corners[move + 1, REACH], &points[k, 0])
            if along < corners[move, REACH_ON]:
                self._turned(move, 0.5 + 0.5 * along / corners[move, REACH_ON], &points[k, 0])
            if rest < corners[move + 1, BEFORE]:
                turn = corners[move + 1, TURN]
                self._overlapped(
                    move + 1, turn * (1.0 - rest / corners[move + 1, BEFORE]), &points[k, 0]
                )
            if along < corners[move, BEHIND]:
                turn = corners[move, TURN]
                self._overlapped(
                    move, turn + (1.0 - turn) * along / corners[move, BEHIND], &points[k, 0]
                )
