"""The angles of ValCNC's arcs, each from where the one before has really left off.

With the start P, the centre P + (i, j), R = |(i, j)| and the chord C to the programmed end:

    α = 2·arcsin(C / 2R)     or, above 180°, 2π less that       (L1284-1288, L1326)
    θ = atan2(−j, −i)        the angle of the start             (L1290-1306)

The test that tells which α is not in the thesis; here it is the side of the arm to the start on
which the end lies (the cross product of the arms), which is what it must come to. A full circle
has C = 0 and takes 2π. Where the last piece goes to θ ± α (`computed`), that is where the next
block starts, a hair beside the programmed end.

Literal, in float64 and the order of the thesis. Compiled, because each arc may depend on the one
before; its points do not, and are made where they are needed.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

from camtool.arrays import Floats, Ints

# Part of an arc's diameter: a chord longer by less is a diameter.
cdef double CHORD_GUARD = 1e-9


cpdef Int arc_angles(
    Int[::1] turn, double[::1] begin, double[:, ::1] ends, double[:, ::1] offset, bint computed,
    double[:, ::1] out
) noexcept:
    """Fill `out` (N, 5): centre x and y, R, θ and signed α of each arc; 0 in other rows.

    `turn` (N,): 1 counter-clockwise, −1 clockwise, 0 no arc; `begin` (2,): where the first row
    really begins; `ends` (N + 1, 2): row n goes from ends[n] to ends[n + 1] as programmed;
    `offset` (N, 2): i and j. Returns the first row whose arcsine has no value, or −1.
    """
    cdef Int n, column
    cdef bint full
    cdef double x, y, end_x, end_y, alpha, theta, i, j
    x, y = begin[0], begin[1]
    for n in range(len(turn)):
        end_x, end_y = ends[n + 1, 0], ends[n + 1, 1]
        for column in range(5):
            out[n, column] = 0.0
        if turn[n] != 0:
            i, j = offset[n, 0], offset[n, 1]
            centre_x, centre_y, radius = x + i, y + j, math.hypot(i, j)
            chord = math.hypot(end_x - x, end_y - y)
            if radius == 0.0 or chord > 2.0 * radius * (1.0 + CHORD_GUARD):
                return n
            alpha = 2.0 * math.asin(min(1.0, chord / (2.0 * radius)))
            side = j * (end_x - centre_x) - i * (end_y - centre_y)
            full = end_x == ends[n, 0] and end_y == ends[n, 1]
            if full:
                alpha = 2.0 * math.M_PI
            elif side * float(turn[n]) < 0.0:
                alpha = 2.0 * math.M_PI - alpha
            theta, alpha = math.atan2(-j, -i), float(turn[n]) * alpha
            out[n, 0], out[n, 1], out[n, 2] = centre_x, centre_y, radius
            out[n, 3], out[n, 4] = theta, alpha
            if computed:
                end_x = centre_x + radius * math.cos(theta + alpha)
                end_y = centre_y + radius * math.sin(theta + alpha)
        x, y = end_x, end_y
    return -1
