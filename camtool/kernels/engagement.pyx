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
in the middle, with all cleared places taken narrower by h, on a front wider at both ends by the
angle through which the tool turns within h, and with all that was cleared on the last of the way to
the begin of the stretch. So the bound of a stretch is never below that of a part of it. A stretch
whose bound is too high is halved, until h is a sixteenth of `thick` and the tool hardly turns.

Of all earlier moves only those matter that come within R of a place of the circle which is still
open. Moves lie in a grid of cells, each in those that it crosses; the open angles are taken in
pieces, and around the middle of each piece the moves of near cells are looked at until nothing is
open, or no cell is near enough. Where a stretch before was open, the moves that bounded it come
first: they mostly bound this one too. What is left does not depend on the order.
`tests/oracles/open_angles.py` is the twin. Compiled.
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
    # Moves that are looked at first: the last ones that took open angles away.
    BOUNDING = 4

cdef double PI = math.pi
cdef double INFINITY = float("inf")
# The last of the tool's way is so many times `thick`.
cdef double RECENT = 100.0
# A stretch of so many times `thick` is not halved, where the tool turns by less than the angle, rad.
cdef double FINEST = 1.0 / 16.0
cdef double FINEST_TURN = 1e-3
# Angles smaller than this are no engagement, rad: rounding of sines at a tangent.
cdef double NO_ANGLE = 1e-7
# Cuts as deep as this tool or deeper, up to this, have cleared what it meets, mm.
cdef double LEVEL_MM = 1e-6
# Open angles are looked at in pieces of this size, rad.
cdef double PIECE = 0.25 * math.pi
# Rounding of places never exceeds this, mm.
cdef double SLACK_MM = 1e-9
# Moves lie in cells that they miss by this, mm: where a row of cells ends is rounded.
cdef double OVERLAP_MM = 1e-6
# Cells are this part of the widest tool's radius wide, but there are not more than so many a side.
cdef double CELL_SHARE = 0.4
cdef double CELLS = 2048.0


cdef struct Arcs:
    # Intervals of angles about the direction of motion, within −π/2 … π/2, that are not cleared,
    # and how often one of them was changed.
    int count, changes
    double low[SLOTS]
    double high[SLOTS]


cdef struct Cut:
    # A move that has cut: start, end, direction (x, y; its angle, rad) and length; the radius of its
    # tool, its highest z, and how far the tool had gone at its end.
    double ax, ay, ux, uy, length, radius, high, mark, bx, by, heading


CUT = np.dtype([
    (name, np.float64)
    for name in ("ax", "ay", "ux", "uy", "length", "radius", "high", "mark", "bx", "by", "heading")
])


cdef struct Front:
    # The front half of the tool's circle: its middle, direction (x, y; its angle, rad) and radius;
    # moves that end above `level` have not cleared it; what was cleared counts as wider by `grow`,
    # or by `grow_recent` where the tool was there after it had gone `recent`.
    double x, y, dx, dy, angle, radius, level, grow, grow_recent, recent


cdef struct Window:
    # A piece of the tool's circle, from `begin` to `end`: the first and the last place of it that
    # are open, the middle between them, with the greatest distance from it; and the first and last
    # column and row of cells that are near enough.
    double begin, end, first_x, first_y, last_x, last_y, x, y, reach
    Int i0, i1, j0, j1


cdef class Cleared:
    """The moves that have cut so far, in a grid of cells, each with a list of those that cross it,
    the newest first."""

    cdef double low_x, low_y, cell, reach, x, y, travelled
    cdef Int columns, rows, count, used, turn
    cdef bint from_right
    # Of each cell one more than its newest item, 0: none. Of each item its move, its cell, and
    # before which of the same cell (−1: none) it came: the next one, and the next deeper one.
    cdef Int[::1] head, item, cell_of, older, deeper
    # Of each move: in which turn all that it has cleared was taken away.
    cdef Int[::1] cleared_in
    cdef Cut[::1] cuts
    cdef double[::1] box
    cdef Int bounding[BOUNDING]

    def __init__(
        self, extents: Floats, reach_mm: float, box: Floats, *, from_right: bool = False
    ) -> None:
        """Begin without moves.

        `extents` (2, 2): least and greatest place of tools; `reach_mm`: the radius of the
        widest tool; `box` (4,): low x, low y, high x, high y of the stock, outside of which
        nothing is cut (infinite: not known); `from_right`: angles are those from the right end of
        the front half to the farthest place in the stock, with all that is air between."""
        self.from_right = from_right
        (low_x, low_y), (high_x, high_y) = extents.tolist()
        size = max(high_x - low_x, high_y - low_y, reach_mm)
        self.cell = max(CELL_SHARE * reach_mm, size / CELLS)
        self.low_x, self.low_y, self.reach = low_x, low_y, reach_mm
        self.columns = int((high_x - low_x) / self.cell) + 1
        self.rows = int((high_y - low_y) / self.cell) + 1
        self.head = np.zeros(self.columns * self.rows, dtype=np.int64)
        self.item, self.cell_of = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
        self.older, self.deeper = np.empty(1024, dtype=np.int64), np.empty(1024, dtype=np.int64)
        self.cuts, self.cleared_in = np.empty(256, dtype=CUT), np.zeros(256, dtype=np.int64)
        self.box = np.array(box, dtype=np.float64)
        self.count = self.used = self.turn = 0
        self.x = self.y = self.travelled = 0.0
        for i in range(BOUNDING):
            self.bounding[i] = -1

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

    def try_moves(
        self, moves: Floats, thick_mm: float, limit_rad: float, *,
        coarse_rad: float = float("inf"),
    ) -> tuple[float, int, float]:
        """Judge moves (K, 9) that cut one behind the other, and forget them again. Return a bound
        of their greatest engagement angle, rad, and the first place where it may exceed a limit:
        the number of the move, and the part of it that lies before; K and 0 if it never does.

        What lies before that place keeps the limit, with chips thinner than `thick_mm` left out;
        where chips thinner by a sixteenth are, it is exceeded there or just behind. The bound is
        that of all moves up to the place. Where it keeps the limit it is within `coarse_rad` of an
        angle that there is (infinite: it is not refined)."""
        cdef Int i, count = self.count, used = self.used, number
        cdef double x = self.x, y = self.y, travelled = self.travelled
        cdef double[:, ::1] rows = np.ascontiguousarray(moves)
        cdef double thick = thick_mm, limit = limit_rad, coarse = coarse_rad
        cdef double bound, greatest = 0.0, share = 0.0
        number = rows.shape[0]
        for i in range(rows.shape[0]):
            _go_to(self, &rows[i, 0])
            bound = _greatest(self, &rows[i, 0], thick, limit, INFINITY, INFINITY, limit)
            if bound > limit:
                number, share = i, _first_above(self, &rows[i, 0], thick, limit)
                greatest = bound
                break
            if coarse < INFINITY and bound > greatest:
                bound = min(bound, _greatest(
                    self, &rows[i, 0], thick, limit, INFINITY, coarse, greatest
                ))
            greatest = max(greatest, bound)
            _add(self, &rows[i, 0])
        _forget(self, count, used)
        self.x, self.y, self.travelled = x, y, travelled
        return greatest, number, share


cdef void _go_to(Cleared self, double* move):
    """Begin a move: where the one before it ended, or elsewhere after a jump."""
    if move[AX] != self.x or move[AY] != self.y:
        self.travelled += 4.0 * self.reach
        self.x, self.y = move[AX], move[AY]


cdef void _add(Cleared self, double* move):
    """Put a move into the lists of all cells that it crosses."""
    cdef Int i, j, i0, i1, j0, j1
    cdef double ex = move[BX] - move[AX], ey = move[BY] - move[AY]
    cdef double length = math.hypot(ex, ey), low, high, ax, bx
    cdef Cut* cut
    if self.count == self.cuts.shape[0]:
        self.cuts = np.resize(self.cuts, 2 * self.count)
        self.cleared_in = np.concatenate([self.cleared_in, np.zeros(self.count, dtype=np.int64)])
    self.travelled += length
    self.x, self.y = move[BX], move[BY]
    cut = &self.cuts[self.count]
    cut.ax, cut.ay, cut.bx, cut.by = move[AX], move[AY], move[BX], move[BY]
    cut.radius, cut.high, cut.length, cut.mark = move[RADIUS], move[HIGH], length, self.travelled
    cut.ux = cut.uy = cut.heading = 0.0
    if length > 0.0:
        cut.ux, cut.uy = ex / length, ey / length
        cut.heading = math.atan2(cut.uy, cut.ux)
    self.cleared_in[self.count] = 0
    j0 = _cell(min(move[AY], move[BY]) - self.low_y, self.cell, self.rows)
    j1 = _cell(max(move[AY], move[BY]) - self.low_y, self.cell, self.rows)
    for j in range(j0, j1 + 1):
        # The part of the move in this row, a little longer; outermost rows go on for ever.
        low, high = 0.0, 1.0
        if ey != 0.0 and j0 < j1:
            ax = (self.low_y + j * self.cell - move[AY]) / ey
            bx = (self.low_y + (j + 1) * self.cell - move[AY]) / ey
            if j > 0:
                low, high = (max(low, ax), high) if ey > 0.0 else (low, min(high, ax))
            if j < self.rows - 1:
                low, high = (low, min(high, bx)) if ey > 0.0 else (max(low, bx), high)
        ax, bx = move[AX] + low * ex, move[AX] + high * ex
        i0 = _cell(min(ax, bx) - OVERLAP_MM - self.low_x, self.cell, self.columns)
        i1 = _cell(max(ax, bx) + OVERLAP_MM - self.low_x, self.cell, self.columns)
        for i in range(i0, i1 + 1):
            _put_item(self, j * self.columns + i)
    self.count += 1


cdef void _put_item(Cleared self, Int cell):
    """Put the newest move before the list of a cell."""
    cdef Int before = self.head[cell] - 1, size = self.item.shape[0]
    if self.used == size:
        self.item, self.cell_of = np.resize(self.item, 2 * size), np.resize(self.cell_of, 2 * size)
        self.older, self.deeper = np.resize(self.older, 2 * size), np.resize(self.deeper, 2 * size)
    self.item[self.used], self.cell_of[self.used] = self.count, cell
    self.older[self.used] = before
    while before >= 0 and self.cuts[self.item[before]].high >= self.cuts[self.count].high:
        before = self.deeper[before]
    self.deeper[self.used] = before
    self.used += 1
    self.head[cell] = self.used


cdef void _forget(Cleared self, Int count, Int used):
    """Take the newest moves and their items out of all lists, down to so many."""
    cdef Int k
    while self.used > used:
        self.used -= 1
        self.head[self.cell_of[self.used]] = self.older[self.used] + 1
    for k in range(BOUNDING):
        if self.bounding[k] >= count:
            self.bounding[k] = -1
    self.count = count


cdef Int _cell(double distance, double cell, Int count) noexcept nogil:
    cdef double place = math.floor(distance / cell)
    if place < 0.0:
        return 0
    return <Int> place if place < count else count - 1


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
        bound = _bound(self, move, length, low, high, thick)
        if bound <= best:
            continue
        if bound <= greatest or _is_finest(move, length, half, thick) or waiting + 2 > WAITING:
            best = bound
            continue
        value = _value(self, move, length, low + half, thick)
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


cdef double _first_above(Cleared self, double* move, double thick, double limit) noexcept nogil:
    """Return the part of a move before its first place whose engagement may exceed a limit."""
    cdef double length = math.hypot(move[BX] - move[AX], move[BY] - move[AY])
    cdef double low, high, half, first = length
    cdef double ends[WAITING]
    cdef int waiting = 1
    if length == 0.0:
        return 0.0
    low, ends[0] = 0.0, length
    while waiting:
        high = ends[waiting - 1]
        half = 0.5 * (high - low)
        if _bound(self, move, length, low, high, thick) <= limit:
            waiting, low = waiting - 1, high
        elif _is_finest(move, length, half, thick) or waiting == WAITING:
            return low / length
        elif _value(self, move, length, low + half, thick) > limit:
            # It is exceeded in the middle: what lies behind does not matter.
            waiting, first, ends[0] = 1, low + half, low + half
        else:
            ends[waiting] = low + half
            waiting += 1
    return first / length


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
        angle += _open_angle(self, aside, 1.0, 0.0, 0.0, 0.0, 2.0 * thick, thick)
    return angle


cdef double _bound(
    Cleared self, double* move, double length, double low, double high, double thick
) noexcept nogil:
    """Return a bound of the engagement wherever the tool is in a stretch of a move: nowhere more
    than half of the circle, which is all that faces where the tool goes."""
    cdef double half = 0.5 * (high - low), turn = _turn(move, length, half)
    return min(_open_angle(self, move, length, low + half, half, turn, thick - half, thick), PI)


cdef inline double _turn(double* move, double length, double part) noexcept nogil:
    """Return the angle, rad, by which the tool turns on a part of a move."""
    return part / length * math.fabs(move[ASKEW_END] - move[ASKEW])


cdef inline bint _is_finest(double* move, double length, double half, double thick) noexcept nogil:
    """Return True if a stretch of this half length is not halved."""
    return half <= FINEST * thick and _turn(move, length, half) <= FINEST_TURN


cdef double _value(
    Cleared self, double* move, double length, double place, double thick
) noexcept nogil:
    """Return the engagement at a place of a move."""
    return _open_angle(self, move, length, place, 0.0, 0.0, thick, thick)


cdef double _open_angle(
    Cleared self, double* move, double length, double middle, double before, double turn,
    double grow, double thick
) noexcept nogil:
    """Return the angle of the front half of the tool's circle, wider by `turn` at both ends, at a
    place of a move, that no earlier move has cleared with a tool wider by `grow`, or by `grow` less
    `thick` on the last of its way to a place that lies `before` that one."""
    cdef Arcs arcs
    cdef Front front
    cdef double ex = (move[BX] - move[AX]) / length, ey = (move[BY] - move[AY]) / length
    cdef double askew = move[ASKEW] + middle / length * (move[ASKEW_END] - move[ASKEW])
    cdef double c = math.cos(askew), s = math.sin(askew), half = min(0.5 * PI + turn, PI)
    cdef Window window
    cdef double piece_end = -PI
    cdef int i
    front.x, front.y = move[AX] + middle * ex, move[AY] + middle * ey
    front.dx, front.dy = c * ex - s * ey, s * ex + c * ey
    front.angle, front.radius = math.atan2(front.dy, front.dx), move[RADIUS]
    front.level, front.grow, front.grow_recent = move[LOW] + LEVEL_MM, grow, grow - thick
    front.recent = self.travelled + middle - before - RECENT * thick
    arcs.count, arcs.changes, arcs.low[0], arcs.high[0] = 1, 0, -half, half
    _outside(self.box, &front, &arcs)
    while True:
        i = 0
        while i < arcs.count and arcs.high[i] <= piece_end:
            i += 1
        if i == arcs.count:
            break
        window.begin = max(piece_end, arcs.low[i])
        window.end = piece_end = min(window.begin + PIECE, arcs.high[arcs.count - 1])
        _take_near(self, &front, &arcs, &window)
    cdef double angle = 0.0
    for i in range(arcs.count):
        angle += arcs.high[i] - arcs.low[i]
    if self.from_right and arcs.count:
        angle = arcs.high[arcs.count - 1] + half
    return angle if angle > NO_ANGLE else 0.0


cdef void _take_near(
    Cleared self, Front* front, Arcs* arcs, Window* window
) noexcept nogil:
    """Take out of the angles of a piece all that earlier moves have cleared: first by those that
    bounded the open angles before, then by cells, in square rings about the middle of the piece."""
    cdef Int i, j, k, middle_i, middle_j, step
    self.turn += 1
    if not _look(self, front, arcs, window):
        return
    for k in range(BOUNDING):
        i = self.bounding[k]
        if i >= 0 and self.cleared_in[i] < self.turn and self.cuts[i].high <= front.level:
            if not _take(self, i, front, arcs, window):
                return
    middle_i = _cell(window.x - self.low_x, self.cell, self.columns)
    middle_j = _cell(window.y - self.low_y, self.cell, self.rows)
    k = 0
    while (
        middle_i - k >= window.i0 or middle_i + k <= window.i1
        or middle_j - k >= window.j0 or middle_j + k <= window.j1
    ):
        for j in range(max(middle_j - k, window.j0), min(middle_j + k, window.j1) + 1):
            step = 1 if j == middle_j - k or j == middle_j + k else max(2 * k, 1)
            i = middle_i - k
            while i <= middle_i + k:
                if window.i0 <= i <= window.i1 and not _take_cell(
                    self, j * self.columns + i, front, arcs, window
                ):
                    return
                i += step
        k += 1


cdef bint _take_cell(
    Cleared self, Int cell, Front* front, Arcs* arcs, Window* window
) noexcept nogil:
    """Take out what the moves of a cell have cleared; return False where the piece is cleared."""
    cdef Int k = self.head[cell] - 1, row
    while k >= 0:
        row = self.item[k]
        if self.cuts[row].high > front.level:
            k = self.deeper[k]
            continue
        k = self.older[k]
        if self.cleared_in[row] < self.turn and not _take(self, row, front, arcs, window):
            return False
    return True


cdef bint _take(Cleared self, Int row, Front* front, Arcs* arcs, Window* window) noexcept nogil:
    """Take out what a move has cleared of a piece; return False where that is cleared."""
    cdef int changes = arcs.changes
    cdef Cut* other = &self.cuts[row]
    cdef double wide = other.radius + (
        front.grow_recent if other.mark > front.recent else front.grow
    )
    if wide <= 0.0 or not _may_clear(other, wide, front, window):
        return True
    self.cleared_in[row] = self.turn
    _disc(other.ax, other.ay, wide, front, arcs)
    if other.length > 0.0:
        _disc(other.bx, other.by, wide, front, arcs)
        _strip(other, wide, front, arcs)
    if arcs.changes == changes:
        return True
    _remember(self, row)
    return _look(self, front, arcs, window)


cdef void _remember(Cleared self, Int row) noexcept nogil:
    """Put a move before those that have bounded open angles."""
    cdef Int k = 0
    while k < BOUNDING - 1 and self.bounding[k] != row:
        k += 1
    while k > 0:
        self.bounding[k] = self.bounding[k - 1]
        k -= 1
    self.bounding[0] = row


cdef bint _may_clear(Cut* other, double wide, Front* front, Window* window) noexcept nogil:
    """Return True if a move may have cleared an open place of a piece.

    A move that has, has cleared the first or the last open place, or else it comes nearest to the
    circle between these two, and then it cannot lie on the outer side of either."""
    cdef double ax = other.ax - front.x, ay = other.ay - front.y
    cdef double bx = other.bx - front.x, by = other.by - front.y
    cdef double ux = window.first_x - front.x, uy = window.first_y - front.y
    cdef double vx = window.last_x - front.x, vy = window.last_y - front.y
    if not _is_nearer(window.x, window.y, wide + window.reach, other):
        return False
    if _is_nearer(window.first_x, window.first_y, wide + SLACK_MM, other):
        return True
    if _is_nearer(window.last_x, window.last_y, wide + SLACK_MM, other):
        return True
    return not (
        (ux * ay < uy * ax and ux * by < uy * bx) or (ax * vy < ay * vx and bx * vy < by * vx)
    )


cdef inline bint _is_nearer(double x, double y, double far, Cut* other) noexcept nogil:
    """Return True if a point is nearer to a move than a distance."""
    cdef double px = x - other.ax, py = y - other.ay
    cdef double along = px * other.ux + py * other.uy, across = py * other.ux - px * other.uy
    if along < 0.0 or other.length == 0.0:
        return px * px + py * py < far * far
    along = max(along - other.length, 0.0)
    return across * across + along * along < far * far


cdef bint _look(Cleared self, Front* front, Arcs* arcs, Window* window) noexcept nogil:
    """Find where the open angles of a piece are, and the cells near them; return False where none
    is open."""
    cdef double low = window.end, high = window.begin, c, s, ch, sh, far
    cdef int i
    for i in range(arcs.count):
        if arcs.high[i] > window.begin and arcs.low[i] < window.end:
            low, high = min(low, arcs.low[i]), max(high, arcs.high[i])
    window.begin, window.end = low, high = max(low, window.begin), min(high, window.end)
    if low >= high:
        return False
    c, s = math.cos(0.5 * (low + high)), math.sin(0.5 * (low + high))
    ch, sh = math.cos(0.5 * (high - low)), math.sin(0.5 * (high - low))
    ch, sh = front.radius * ch, front.radius * sh
    c, s = c * front.dx - s * front.dy, c * front.dy + s * front.dx
    window.first_x, window.first_y = front.x + ch * c + sh * s, front.y + ch * s - sh * c
    window.last_x, window.last_y = front.x + ch * c - sh * s, front.y + ch * s + sh * c
    window.x, window.y = front.x + front.radius * c, front.y + front.radius * s
    window.reach = SLACK_MM + math.sqrt(sh * sh + (front.radius - ch) * (front.radius - ch))
    far = self.reach + front.grow + window.reach
    window.i0 = _cell(window.x - far - self.low_x, self.cell, self.columns)
    window.i1 = _cell(window.x + far - self.low_x, self.cell, self.columns)
    window.j0 = _cell(window.y - far - self.low_y, self.cell, self.rows)
    window.j1 = _cell(window.y + far - self.low_y, self.cell, self.rows)
    return True


cdef void _outside(double[::1] box, Front* front, Arcs* arcs) noexcept nogil:
    """Take out the angles at which the tool's circle is outside of the stock, less `grow` all round."""
    cdef double r = front.radius, grow = front.grow, turn = front.angle
    _cosines_above((box[2] - grow - front.x) / r, -turn, arcs)
    _cosines_above((box[3] - grow - front.y) / r, 0.5 * PI - turn, arcs)
    _cosines_above((front.x - box[0] - grow) / r, PI - turn, arcs)
    _cosines_above((front.y - box[1] - grow) / r, -0.5 * PI - turn, arcs)


cdef void _cosines_above(double cosine, double middle, Arcs* arcs) noexcept nogil:
    """Take out the angles about `middle` whose cosine is greater."""
    cdef double half
    if cosine < 1.0:
        half = PI if cosine <= -1.0 else math.acos(cosine)
        _put(middle - half, middle + half, arcs)


cdef void _strip(Cut* other, double wide, Front* front, Arcs* arcs) noexcept nogil:
    """Take out the angles of the tool's circle that are beside a move, no farther than `wide`."""
    cdef double r = front.radius, length = other.length, ex = other.ux, ey = other.uy
    cdef double ax = front.x - other.ax, ay = front.y - other.ay
    cdef double along = ax * ex + ay * ey, across = ay * ex - ax * ey
    cdef double turn, c0, c1, s0, s1, low, high
    cdef double cos_low[2]
    cdef double cos_high[2]
    cdef double sin_low[2]
    cdef double sin_high[2]
    cdef int i, j
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
    turn = other.heading - front.angle
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
    double cx, double cy, double wide, Front* front, Arcs* arcs
) noexcept nogil:
    """Take out the angles of the tool's circle that lie in a disc."""
    cdef double gx = cx - front.x, gy = cy - front.y, dx = front.dx, dy = front.dy
    cdef double r = front.radius, gap = math.hypot(gx, gy)
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
    cdef double shift = 0.0 if -PI <= low <= PI else math.remainder(low, 2.0 * PI) - low
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
            arcs.count, arcs.changes = arcs.count - 1, arcs.changes + 1
            for j in range(i, arcs.count):
                arcs.low[j], arcs.high[j] = arcs.low[j + 1], arcs.high[j + 1]
        elif low <= arcs.low[i]:
            arcs.low[i], arcs.changes = high, arcs.changes + 1
            return
        elif high >= arcs.high[i]:
            arcs.high[i], arcs.changes = low, arcs.changes + 1
            i += 1
        else:
            if arcs.count < SLOTS:
                for j in range(arcs.count, i, -1):
                    arcs.low[j], arcs.high[j] = arcs.low[j - 1], arcs.high[j - 1]
                arcs.count, arcs.changes = arcs.count + 1, arcs.changes + 1
                arcs.high[i], arcs.low[i + 1] = low, high
            return
