"""The engagement angle of a tool along its moves: how much of its front edge is in the stock.

A tool of radius r at p that moves in the direction d cuts with the half of its circle that looks
along d. Of this half, what earlier moves at its depth have cleared is air: a straight move of a
tool of radius R clears all points nearer than R to it, which is a part of the circle that is known
exactly (two discs and a strip). What remains is the engagement angle.

Chips thinner than `thick` do not count, since slides that run beside a wall by a step would touch
it along a wide angle: what was cleared counts as wider by that. (What the tool has cleared on the
last of its way, a hundred times that, does not: the chip before the tool is as thin as its
advance.)

From that comes a bound for a stretch of the move: wherever the tool is in a stretch of half length
h, its edge is within h of where it would be in the middle. What is engaged there is also engaged
in the middle, with all cleared places taken narrower by h. A stretch whose bound is too high is
halved, until h is a sixteenth of `thick`. Compiled.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Bools, Floats

cpdef enum:
    # Columns of a move: start, end, radius of its tool, lowest and highest z, mm; and the angles, rad,
    # by which the tool heads to the left of the move at its start and at its end: a move may stand
    # for an arc, and slides go by steps beside their path.
    AX = 0, AY, BX, BY, RADIUS, LOW, HIGH, ASKEW, ASKEW_END
    COLUMNS = 9
    # Intervals of angles that are not cleared.
    SLOTS = 32
    # Stretches of one move that wait.
    WAITING = 128

cdef double PI = math.pi
cdef double INFINITY = float("inf")
# The last of the tool's way is so many times `thick`.
cdef double RECENT = 100.0
# A stretch of so many times `thick` is not halved.
cdef double FINEST = 1.0 / 16.0
# Angles smaller than this are no engagement, rad: rounding of sines at a tangent.
cdef double NO_ANGLE = 1e-7
# Cuts as deep as this tool or deeper, up to this, have cleared what it meets, mm.
cdef double LEVEL_MM = 1e-6


cdef struct Arcs:
    # Intervals of angles about the direction of motion, within −π/2 … π/2, that are not cleared;
    # and the middle of all of them on the tool's circle, with the greatest distance from it.
    int count
    double low[SLOTS]
    double high[SLOTS]
    double x, y, reach


cdef class Cleared:
    """Return the moves that have cut so far, in a grid of cells, each with the list of those
    that come near enough to a tool in it."""

    cdef double low_x, low_y, cell, reach, x, y, travelled
    cdef Int columns, rows, count, used
    cdef bint from_right
    cdef Int[::1] head, following, item
    cdef double[:, ::1] moves
    cdef double[::1] box, marks

    def __init__(
        self, extents: Floats, reach_mm: float, box: Floats, *, from_right: bool = False
    ) -> None:
        """`extents` (2, 2): least and greatest place of tools; `reach_mm`: the radius of the
        widest tool; `box` (4,): low x, low y, high x, high y of the stock, outside of which
        nothing is cut (infinite: not known); `from_right`: angles are those from the right end of
        the front half to the farthest place in the stock, with all that is air between."""
        self.from_right = from_right
        (low_x, low_y), (high_x, high_y) = extents.tolist()
        size = max(high_x - low_x, high_y - low_y, reach_mm)
        self.cell = max(reach_mm, size / 512.0)
        self.low_x, self.low_y, self.reach = low_x, low_y, reach_mm
        self.columns = int((high_x - low_x) / self.cell) + 1
        self.rows = int((high_y - low_y) / self.cell) + 1
        self.head = np.full(self.columns * self.rows, -1, dtype=np.int64)
        self.following, self.item = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
        self.moves, self.marks = np.empty((256, COLUMNS)), np.empty(256)
        self.box = np.array(box, dtype=np.float64)
        self.count = self.used = 0
        self.x = self.y = self.travelled = 0.0

    def add(self, moves: Floats) -> None:
        """Add moves (K, 9) that have cut."""
        cdef Int i
        cdef double[:, ::1] rows = np.ascontiguousarray(moves)
        for i in range(rows.shape[0]):
            _go_to(self, &rows[i, 0])
            _add(self, &rows[i, 0])

    def judge(
        self, moves: Floats, cuts: Bools, thick_mm: float, enough_rad: float, fine_rad: float, *,
        adds: bool = True, coarse_rad: float = float("inf"), known_rad: float = float("inf"),
    ) -> Floats:
        """Return a bound of the greatest engagement angle (K,) rad of moves (K, 9) in their order,
        0 for those that do not cut, and for those straight down the part of the whole circle; each
        that cuts is added behind its own turn (if `adds`).

        Chips thinner than `thick_mm` do not count. Bounds above `enough_rad` are within `fine_rad`
        of an angle that there is, or of one of chips thinner by a sixteenth; where that is infinite,
        the first angle above is returned. Bounds up to `enough_rad` are not refined, unless
        `known_rad` is finite: then they are within `coarse_rad`, and where that is 0 or more only
        the greatest is looked for: bounds up to it, or up to those of moves before, are not
        refined."""
        cdef Int i
        cdef double[:, ::1] rows = np.ascontiguousarray(moves)
        cdef unsigned char[::1] is_cut = np.ascontiguousarray(cuts).view(np.uint8)
        result = np.zeros(len(moves))
        cdef double[::1] bound = result
        cdef double thick = thick_mm, enough = enough_rad, fine = fine_rad
        cdef double coarse = coarse_rad, greatest = known_rad
        for i in range(rows.shape[0]):
            if is_cut[i]:
                _go_to(self, &rows[i, 0])
                bound[i] = _greatest(
                    self, &rows[i, 0], thick, enough, fine, coarse,
                    greatest if greatest < INFINITY else enough,
                )
                if greatest >= 0.0:
                    greatest = max(greatest, bound[i])
                if adds:
                    _add(self, &rows[i, 0])
        return result


cdef void _go_to(Cleared self, double* move):
    """Begin a move: where the one before it ended, or elsewhere after a jump."""
    if move[AX] != self.x or move[AY] != self.y:
        self.travelled += 4.0 * self.reach
        self.x, self.y = move[AX], move[AY]


cdef void _add(Cleared self, double* move):
    """Put a move into the lists of all cells from which a tool may reach what it clears."""
    cdef Int i, j, i0, i1, j0, j1, k
    cdef double far = move[RADIUS] + self.reach + 1e-9
    cdef double half = 0.5 * self.cell, diagonal = 0.5 * math.sqrt(2.0) * self.cell
    if self.count == self.moves.shape[0]:
        self.moves = np.resize(self.moves, (2 * self.count, COLUMNS))
        self.marks = np.resize(self.marks, 2 * self.count)
    for k in range(COLUMNS):
        self.moves[self.count, k] = move[k]
    self.travelled += math.hypot(move[BX] - move[AX], move[BY] - move[AY])
    self.x, self.y = move[BX], move[BY]
    self.marks[self.count] = self.travelled
    i0 = _cell(min(move[AX], move[BX]) - far - self.low_x, self.cell, self.columns)
    i1 = _cell(max(move[AX], move[BX]) + far - self.low_x, self.cell, self.columns)
    j0 = _cell(min(move[AY], move[BY]) - far - self.low_y, self.cell, self.rows)
    j1 = _cell(max(move[AY], move[BY]) + far - self.low_y, self.cell, self.rows)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            if _distance(
                self.low_x + i * self.cell + half, self.low_y + j * self.cell + half, move
            ) > far + diagonal:
                continue
            if self.used == self.item.shape[0]:
                self.item = np.resize(self.item, 2 * self.used)
                self.following = np.resize(self.following, 2 * self.used)
            k = j * self.columns + i
            self.item[self.used] = self.count
            self.following[self.used] = self.head[k]
            self.head[k] = self.used
            self.used += 1
    self.count += 1


cdef Int _cell(double distance, double cell, Int count) noexcept nogil:
    cdef double place = math.floor(distance / cell)
    if place < 0.0:
        return 0
    return <Int> place if place < count else count - 1


cdef double _distance(double x, double y, double* move) noexcept nogil:
    """Return the distance of a point from a move."""
    cdef double ex = move[BX] - move[AX], ey = move[BY] - move[AY]
    cdef double square = ex * ex + ey * ey
    cdef double part = 0.0
    if square > 0.0:
        part = ((x - move[AX]) * ex + (y - move[AY]) * ey) / square
        part = 0.0 if part < 0.0 else (1.0 if part > 1.0 else part)
    return math.hypot(x - move[AX] - part * ex, y - move[AY] - part * ey)


cdef double _greatest(
    Cleared self, double* move, double thick, double enough, double fine, double coarse,
    double greatest,
) noexcept nogil:
    """Return a bound of the engagement over all of a move; one up to `greatest` is not refined."""
    cdef double length = math.hypot(move[BX] - move[AX], move[BY] - move[AY])
    cdef double best = 0.0, bound, value, low, high, half, slack
    cdef double lows[WAITING]
    cdef double highs[WAITING]
    cdef int waiting = 1
    if length == 0.0:
        return _all_round(self, move, thick)
    lows[0], highs[0] = 0.0, length
    while waiting:
        waiting -= 1
        low, high = lows[waiting], highs[waiting]
        half = 0.5 * (high - low)
        bound = _open_angle(self, move, length, low, high, thick - half, thick)
        if bound <= best:
            continue
        if bound <= greatest or half <= FINEST * thick or waiting + 2 > WAITING:
            best = bound
            continue
        value = _open_angle(self, move, length, low, high, thick, thick)
        slack = coarse if bound <= enough else fine
        if bound - value <= slack < INFINITY:
            best = bound
            continue
        if value > enough and fine == INFINITY:
            return value
        lows[waiting], highs[waiting] = low, low + half
        lows[waiting + 1], highs[waiting + 1] = low + half, high
        waiting += 2
    return best


cdef double _all_round(Cleared self, double* move, double thick) noexcept nogil:
    """Return the angle of the whole circle of a tool that goes straight down in which it cuts.
    What the tool has cleared on the last of its way counts as wider too: it may go down where
    it was."""
    cdef double aside[COLUMNS]
    cdef double angle = 0.0
    cdef int k, side
    for side in range(-1, 2, 2):
        for k in range(COLUMNS):
            aside[k] = move[k]
        aside[BX], aside[BY] = move[AX] + side, move[AY]
        aside[ASKEW] = aside[ASKEW_END] = 0.0
        angle += _open_angle(self, aside, 1.0, 0.0, 0.0, 2.0 * thick, thick)
    return angle


cdef double _open_angle(
    Cleared self, double* move, double length, double low, double high, double grow, double thick
) noexcept nogil:
    """Return the angle of the front half of the tool's circle, in the middle of a stretch of a
    move, that no earlier move has cleared with a tool wider by `grow`, or by `grow` less
    `thick` on the last of its way."""
    cdef Arcs arcs
    cdef double ex = (move[BX] - move[AX]) / length, ey = (move[BY] - move[AY]) / length
    cdef double middle = 0.5 * (low + high)
    cdef double x = move[AX] + middle * ex, y = move[AY] + middle * ey
    cdef double askew = move[ASKEW] + middle / length * (move[ASKEW_END] - move[ASKEW])
    cdef double c = math.cos(askew), s = math.sin(askew)
    cdef double dx = c * ex - s * ey, dy = s * ex + c * ey
    cdef double recent = self.travelled + middle - RECENT * thick
    cdef double wider
    cdef double* other
    cdef Int k
    arcs.count, arcs.low[0], arcs.high[0] = 1, -0.5 * PI, 0.5 * PI
    _outside(self.box, x, y, dx, dy, move[RADIUS], grow, &arcs)
    _hull(x, y, dx, dy, move[RADIUS], &arcs)
    k = self.head[
        _cell(y - self.low_y, self.cell, self.rows) * self.columns
        + _cell(x - self.low_x, self.cell, self.columns)
    ]
    while k >= 0 and arcs.count:
        other = &self.moves[self.item[k], 0]
        if other[HIGH] <= move[LOW] + LEVEL_MM:
            wider = grow - thick if self.marks[self.item[k]] > recent else grow
            if _distance(arcs.x, arcs.y, other) < other[RADIUS] + wider + arcs.reach:
                _clear(other, x, y, dx, dy, move[RADIUS], wider, &arcs)
                _hull(x, y, dx, dy, move[RADIUS], &arcs)
        k = self.following[k]
    cdef double angle = 0.0
    cdef int i
    for i in range(arcs.count):
        angle += arcs.high[i] - arcs.low[i]
    if self.from_right and arcs.count:
        angle = arcs.high[arcs.count - 1] + 0.5 * PI
    return angle if angle > NO_ANGLE else 0.0


cdef void _hull(double x, double y, double dx, double dy, double r, Arcs* arcs) noexcept nogil:
    """Find the middle of all that is not cleared, and how far it reaches from there."""
    cdef double low, high, c, s
    if arcs.count == 0:
        return
    low, high = arcs.low[0], arcs.high[arcs.count - 1]
    c, s = math.cos(0.5 * (low + high)), math.sin(0.5 * (low + high))
    arcs.x, arcs.y = x + r * (c * dx - s * dy), y + r * (c * dy + s * dx)
    arcs.reach = 2.0 * r * math.sin(0.25 * (high - low)) + 1e-9


cdef void _outside(
    double[::1] box, double x, double y, double dx, double dy, double r, double grow, Arcs* arcs
) noexcept nogil:
    """Take out the angles at which the tool's circle is outside of the stock, less `grow` all round."""
    cdef double turn = math.atan2(dy, dx)
    _cosines_above((box[2] - grow - x) / r, -turn, arcs)
    _cosines_above((box[3] - grow - y) / r, 0.5 * PI - turn, arcs)
    _cosines_above((x - box[0] - grow) / r, PI - turn, arcs)
    _cosines_above((y - box[1] - grow) / r, -0.5 * PI - turn, arcs)


cdef void _cosines_above(double cosine, double middle, Arcs* arcs) noexcept nogil:
    """Take out the angles about `middle` whose cosine is greater."""
    cdef double half
    if cosine < 1.0:
        half = PI if cosine <= -1.0 else math.acos(cosine)
        _put(middle - half, middle + half, arcs)


cdef void _clear(
    double* other, double x, double y, double dx, double dy, double r, double grow, Arcs* arcs
) noexcept nogil:
    """Take out the angles of the circle of radius r about (x, y) that are nearer to a move than the
    radius of its tool and `grow`."""
    cdef double wide = other[RADIUS] + grow
    cdef double ex = other[BX] - other[AX], ey = other[BY] - other[AY]
    cdef double length, ax, ay, along, across, turn, c0, c1, s0, s1
    cdef double cos_low[2]
    cdef double cos_high[2]
    cdef double sin_low[2]
    cdef double sin_high[2]
    cdef double low, high
    cdef int i, j
    if wide <= 0.0 or _distance(x, y, other) >= wide + r:
        return
    _disc(other[AX], other[AY], wide, x, y, dx, dy, r, arcs)
    length = math.hypot(ex, ey)
    if length == 0.0:
        return
    _disc(other[BX], other[BY], wide, x, y, dx, dy, r, arcs)
    ex, ey = ex / length, ey / length
    ax, ay = x - other[AX], y - other[AY]
    along, across = ax * ex + ay * ey, ay * ex - ax * ey
    # In the frame of the move: cos ψ within c0 … c1 and sin ψ within s0 … s1.
    c0, c1 = -along / r, (length - along) / r
    s0, s1 = (-wide - across) / r, (wide - across) / r
    if c0 >= 1.0 or c1 <= -1.0 or s0 >= 1.0 or s1 <= -1.0:
        return
    cos_low[0] = 0.0 if c1 >= 1.0 else math.acos(c1)
    cos_high[0] = PI if c0 <= -1.0 else math.acos(c0)
    cos_low[1], cos_high[1] = -cos_high[0], -cos_low[0]
    low = -0.5 * PI if s0 <= -1.0 else math.asin(s0)
    high = 0.5 * PI if s1 >= 1.0 else math.asin(s1)
    sin_low[0], sin_high[0] = low, high
    sin_low[1], sin_high[1] = PI - high, PI - low
    turn = math.atan2(ey, ex) - math.atan2(dy, dx)
    for i in range(2):
        for j in range(2):
            _both(cos_low[i], cos_high[i], sin_low[j], sin_high[j], turn, arcs)
            _both(
                cos_low[i], cos_high[i], sin_low[j] - 2.0 * PI, sin_high[j] - 2.0 * PI, turn, arcs
            )


cdef void _both(
    double low, double high, double other_low, double other_high, double turn, Arcs* arcs
) noexcept nogil:
    """Take out what two intervals have in common."""
    low, high = max(low, other_low), min(high, other_high)
    if low < high:
        _put(low + turn, high + turn, arcs)


cdef void _disc(
    double cx, double cy, double wide, double x, double y, double dx, double dy, double r,
    Arcs* arcs,
) noexcept nogil:
    """Take out the angles of the circle of radius r about (x, y) that lie in a disc."""
    cdef double gx = cx - x, gy = cy - y
    cdef double gap = math.hypot(gx, gy)
    cdef double cosine, half, middle
    if gap >= wide + r or gap + wide <= r:
        return
    if gap + r <= wide:
        _put(-PI, PI, arcs)
        return
    cosine = (gap * gap + r * r - wide * wide) / (2.0 * gap * r)
    half = PI if cosine <= -1.0 else math.acos(min(cosine, 1.0))
    middle = math.atan2(dx * gy - dy * gx, dx * gx + dy * gy)
    _put(middle - half, middle + half, arcs)


cdef void _put(double low, double high, Arcs* arcs) noexcept nogil:
    """Take an interval of angles, in any whole turn, out of those that are not cleared."""
    cdef double shift = math.remainder(low, 2.0 * PI) - low
    cdef int turn
    for turn in range(-1, 2):
        _cut(low + shift + turn * 2.0 * PI, high + shift + turn * 2.0 * PI, arcs)


cdef void _cut(double low, double high, Arcs* arcs) noexcept nogil:
    """Take an interval out; where there is no room for one more interval, it stays."""
    cdef int i = 0, j
    while i < arcs.count:
        if high <= arcs.low[i]:
            return
        if low >= arcs.high[i]:
            i += 1
        elif low <= arcs.low[i] and high >= arcs.high[i]:
            arcs.count -= 1
            for j in range(i, arcs.count):
                arcs.low[j], arcs.high[j] = arcs.low[j + 1], arcs.high[j + 1]
        elif low <= arcs.low[i]:
            arcs.low[i] = high
            return
        elif high >= arcs.high[i]:
            arcs.high[i] = low
            i += 1
        else:
            if arcs.count < SLOTS:
                for j in range(arcs.count, i, -1):
                    arcs.low[j], arcs.high[j] = arcs.low[j - 1], arcs.high[j - 1]
                arcs.count += 1
                arcs.high[i], arcs.low[i + 1] = low, high
            return
