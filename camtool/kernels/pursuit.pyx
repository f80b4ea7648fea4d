"""Clear a pocket by a tool that pursues the edge of the stock, step by step.

A *piece* is a line or an arc of the path of the tool's centre. A grid of points keeps, of each
point, the piece nearest to it so far. A place is cleared where one of the pieces of the four grid
points around it is nearer than the tool's radius: other pieces may be nearer still, so the stock is
never taken to be less than it is, and thin walls between grid points are seen.

    pose ─the curvature, as far to the right as the engagement and the walls allow─▶ piece, pose, …

The engagement is the angle of the front half of the tool's circle that is not cleared. The stock
is on the right of the tool. The walls keep the whole circle of the tightest turn to the left within
the region of tool centres: so the tool can always turn away from a wall, and comes to walls and
leaves them along tangents. Compiled.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Bools, Floats

cpdef enum:
    # Columns of a piece: start, end, centre, signed radius (0: line; above 0: turns to the left), and
    # the heading at its end; how far the tool had travelled at its end.
    AX = 0, AY, BX, BY, CX, CY, TURN, HEADING, MARK
    COLUMNS = 9
    # Places of the front half of the tool's circle that are looked at, less one.
    FRONT = 48
    # Ends of a stroke.
    CLEARED = 0, BLOCKED

cdef double PI = math.pi
cdef double FAR = 1e30

# All that follows is in radii of the tool, or in parts of the limit.
cdef double STEP = 0.12
cdef double FINEST_STEP = 0.008
# What the tool cut on so much of its way is not taken to be wider.
cdef double RECENT = 0.4
# The tightest turn to the right.
cdef double RIGHT_TURN = 0.7
# The engagement rises by all of the limit along this way at least.
cdef double RISE = 0.5
# A stroke ends when nothing was cut along this way.
cdef double IDLE = 0.6
# Directions, from the right, in which a place is held against the walls where a stroke may begin.
cdef double ASIDE = 1.2
cdef double WALL = 5e-5
cdef int HALVINGS = 7
# Arcs that are less than this beside their chords are lines, mm.
cdef double FLAT_MM = 1e-6


cdef struct Spot:
    # A pose of the tool.
    double x, y, heading


cdef class Pursuit:
    """The pieces cut so far, and the walls, each in a grid."""

    cdef double radius, cell, low_x, low_y, thick, limit, turn, margin, travelled
    cdef double wall_cell, skin
    cdef Int cleared
    cdef Int columns, rows, count, wall_columns, wall_rows, logged
    cdef Int[::1] near, wall_first, wall_item, log_at, log_near
    cdef double[::1] distance, log_distance
    cdef double[:, ::1] pieces, walls
    cdef Int[::1] before
    cdef signed char[::1] dead
    cdef Int[::1] live
    cdef Int live_count

    def __init__(
        self, walls: Floats, margin_mm: float, extents: Floats, radius_mm: float, limit: float,
        thick_mm: float, skin_mm: float, cell_mm: float,
    ) -> None:
        """Take the walls and sort them into cells.

        `walls` (W, 9): pieces of the border of the region of tool centres grown by `margin_mm`;
        `extents` (2, 2): its least and greatest place; chips thinner than `thick_mm` do not count,
        and stock thinner than `skin_mm` is left."""
        (low_x, low_y), (high_x, high_y) = extents.tolist()
        cdef double reach = 1.3 * radius_mm
        self.radius, self.cell, self.margin = radius_mm, cell_mm, margin_mm
        self.limit, self.thick, self.skin = limit, thick_mm, skin_mm
        self.low_x, self.low_y = low_x - reach, low_y - reach
        self.columns = int((high_x - low_x + 2.0 * reach) / cell_mm) + 2
        self.rows = int((high_y - low_y + 2.0 * reach) / cell_mm) + 2
        self.near = np.full(self.columns * self.rows, -1, dtype=np.int64)
        self.distance = np.full(self.columns * self.rows, FAR)
        self.pieces, self.before = np.empty((1024, COLUMNS)), np.empty(1024, dtype=np.int64)
        self.dead = np.zeros(1024, dtype=np.int8)
        self.live = np.empty(1024, dtype=np.int64)
        self.log_at, self.log_near = np.empty(4096, dtype=np.int64), np.empty(4096, dtype=np.int64)
        self.log_distance = np.empty(4096)
        self.count = self.logged = self.live_count = 0
        self.travelled = 0.0
        self.cleared = 0
        self.turn = radius_mm
        self.walls = np.ascontiguousarray(walls)
        _sort_walls(self)

    @property
    def size(self) -> int:
        """Return the number of pieces."""
        return self.count

    @property
    def cleared_mm2(self) -> float:
        """Return the area that is cleared, mm², as the grid points have it."""
        return self.cleared * self.cell * self.cell

    def add(self, vertices: Floats) -> None:
        """Add an open path (n, 3) of x, y, bulge that has cut."""
        cdef double[:, ::1] rows = np.ascontiguousarray(vertices, dtype=np.float64)
        cdef Int i
        cdef Int before = -1
        for i in range(rows.shape[0] - 1):
            before = _add_bulge(self, &rows[i, 0], &rows[i + 1, 0], before)
        self.logged = 0

    def ends(self) -> Floats:
        """Return the places (n, 2) at the ends of all pieces."""
        return np.array(self.pieces[:self.count, BX:CX])

    def leave_out(self, is_out: Bools) -> None:
        """Begin no stroke about those of all pieces that are out: walls are seen from within the
        region alone."""
        cdef Int i
        for i in range(self.count):
            if is_out[i]:
                self.dead[i] = 2

    def begin_level(self, turn_mm: float) -> None:
        """Turn by this radius at least, and look everywhere for strokes again."""
        cdef Int i
        self.turn = turn_mm
        self.live = np.resize(self.live, self.pieces.shape[0])
        self.live_count = 0
        for i in range(self.count):
            if self.dead[i] < 2:
                self.dead[i] = 0
                self.live[self.live_count] = i
                self.live_count += 1

    def begin(self, x: float, y: float) -> tuple[int, int] | None:
        """Return the piece nearest to a place at whose end stock begins on the right, and the one
        at whose end a stroke along it may begin; None where there is none."""
        cdef Int i, k, live_count = 0, best = -1
        cdef Int before
        cdef double away, min_away = FAR, run = 0.0
        for k in range(self.live_count):
            i = self.live[k]
            if self.dead[i]:
                continue
            if not _is_open(self, i):
                continue
            self.live[live_count] = i
            live_count += 1
            away = math.hypot(self.pieces[i, BX] - x, self.pieces[i, BY] - y)
            if away < min_away:
                min_away, best = away, i
        self.live_count = live_count
        if best < 0:
            return None
        for k in range(self.count):
            before = self.before[best]
            if before < 0 or self.dead[before] or not _is_open(self, before):
                break
            best = before
        i = best
        while self.before[i] >= 0 and run < 0.5 * self.radius:
            i = self.before[i]
            run += _length(&self.pieces[i + 1 if i + 1 < self.count else i, 0])
        return best, i

    def give_up(self, piece: int) -> None:
        """Begin no stroke about a piece again, at this level."""
        cdef Int k, i
        cdef double x = self.pieces[piece, BX], y = self.pieces[piece, BY]
        self.dead[piece] = 1
        for k in range(self.live_count):
            i = self.live[k]
            if math.hypot(self.pieces[i, BX] - x, self.pieces[i, BY] - y) < 0.2 * self.radius:
                self.dead[i] = max(self.dead[i], 1)

    def pose(self, piece: int) -> tuple[float, float, float]:
        """Return x, y and the heading at the end of a piece."""
        return self.pieces[piece, BX], self.pieces[piece, BY], self.pieces[piece, HEADING]

    def pursue(self, piece: int, share: float, wall_share: float, max_share: float) -> tuple[int, int, int]:
        """Cut a stroke from the end of a piece, engaged by a share of the limit, or by another one
        beside walls, and never by more than `max_share`. Return the piece from where on it cuts, the
        one behind its last, and how it ended. It is undone by `undo`."""
        cdef Spot at, next_at, middle
        cdef Int first = self.count, before = piece, last_cut = self.count, first_cut = -1
        cdef double curve = 0.0, idle = 0.0, engaged = 0.0, step, target, angle, low, high, mid
        cdef double tightest, rise
        cdef double least_step = FINEST_STEP * self.radius
        cdef double whole_step = min(STEP * self.radius, 0.5 * self.turn)
        cdef int end = CLEARED, tries
        cdef bint is_beside
        self.logged = 0
        at.x, at.y, at.heading = self.pieces[piece, BX], self.pieces[piece, BY], self.pieces[piece, HEADING]
        self.travelled += 4.0 * self.radius
        tightest = 1.0 / self.turn
        step = whole_step
        while self.count - first < 200000:
            is_beside = _room(self, at, self.turn) < self.turn + 0.1 * self.radius
            target = (wall_share if is_beside else share) * self.limit
            rise = engaged + share * self.limit * step / (RISE * self.radius)
            target = min(target, rise)
            # All the way to the left?
            next_at = _pose_along(at, tightest, step)
            angle = _engagement(self, next_at.x, next_at.y, next_at.heading, self.thick)
            if angle > target and angle > max_share * self.limit:
                if step > least_step:
                    step = max(0.5 * step, least_step)
                    continue
                end = BLOCKED
                break
            if angle >= target:
                curve = tightest
            else:
                low, high = -1.0 / (RIGHT_TURN * self.radius), tightest
                # Near to the last curvature first.
                for tries in range(2):
                    mid = curve + (0.15 if tries else -0.15) / self.radius
                    if low < mid < high:
                        if _fits(self, at, mid, step, target):
                            high = mid
                        else:
                            low = mid
                if not _fits(self, at, low, step, target):
                    for tries in range(HALVINGS):
                        mid = 0.5 * (low + high)
                        if _fits(self, at, mid, step, target):
                            high = mid
                        else:
                            low = mid
                    curve = high
                else:
                    curve = low
            middle = _pose_along(at, curve, 0.5 * step)
            angle = _engagement(self, middle.x, middle.y, middle.heading, self.thick)
            if angle > max_share * self.limit:
                if step > least_step:
                    step = max(0.5 * step, least_step)
                    continue
                end = BLOCKED
                break
            next_at = _pose_along(at, curve, step)
            # Behind it the circle is the edge of what the piece has cleared.
            engaged = _engagement(self, next_at.x, next_at.y, next_at.heading, self.thick)
            before = _append(self, at, next_at, curve, before)
            at = next_at
            if engaged > 0.02:
                idle, last_cut = 0.0, self.count
                if first_cut < 0:
                    first_cut = self.count - 1
            else:
                idle += step
                if idle > IDLE * self.radius and (first_cut >= 0 or idle > 0.9 * self.radius):
                    break
            step = min(2.0 * step, whole_step)
        _undo(self, last_cut)
        return (first if first_cut < 0 else max(first, first_cut - 2)), last_cut, end

    def undo(self, last: int) -> None:
        """Take back the pieces from this one on, of the last stroke."""
        _undo(self, last)

    def keep(self, first: int) -> None:
        """Keep the last stroke: strokes may begin along it."""
        cdef Int i
        self.logged = 0
        if self.live.shape[0] < self.pieces.shape[0]:
            self.live = np.resize(self.live, self.pieces.shape[0])
        for i in range(first, self.count):
            self.live[self.live_count] = i
            self.live_count += 1

    def engagement(self, x: float, y: float, heading: float, thick_mm: float) -> float:
        """Return the angle of the front half of the tool's circle that is not cleared, rad."""
        return _engagement(self, x, y, heading, thick_mm)

    def room(self, x: float, y: float) -> float:
        """Return the distance of a place from the border of the region of tool centres, mm."""
        return _wall_distance(self, x, y)

    def stock_at(self, points: Floats, skin_mm: float) -> Bools:
        """Return which of some points (P, 2) are farther from all that is cleared than a skin."""
        cdef double[:, ::1] rows = np.ascontiguousarray(points, dtype=np.float64)
        result = np.zeros(len(points), dtype=np.bool_)
        cdef unsigned char[::1] is_stock = result.view(np.uint8)
        cdef Int i
        for i in range(rows.shape[0]):
            is_stock[i] = _outside_distance(self, rows[i, 0], rows[i, 1], 0.0) > skin_mm
        return result

    def stock_beside(self, skin_mm: float) -> Floats:
        """Return the points (n, 2) beside all pieces, a skin beyond what they clear, that are stock
        which the tool could reach."""
        cdef Int i, j
        cdef int side
        cdef double c, s, far = self.radius + skin_mm
        cdef double* piece
        cdef Spot start, at
        cdef double long_mm, curve
        points = []
        for i in range(self.count):
            piece = &self.pieces[i, 0]
            long_mm = _length(piece)
            curve = 1.0 / piece[TURN] if piece[TURN] != 0.0 else 0.0
            start.x, start.y, start.heading = piece[AX], piece[AY], piece[HEADING] - curve * long_mm
            for j in range(1, 4):
                at = _pose_along(start, curve, long_mm * j / 3.0)
                c, s = math.cos(at.heading), math.sin(at.heading)
                for side in range(-1, 2, 2):
                    if (
                        _outside_distance(self, at.x + side * far * s, at.y - side * far * c, 0.0) > 0.0
                        and _wall_distance(self, at.x + side * skin_mm * s, at.y - side * skin_mm * c)
                        >= -0.3 * skin_mm
                    ):
                        points.append((at.x + side * far * s, at.y - side * far * c))
        return np.array(points).reshape(-1, 2)

    def link(
        self, start: tuple[float, float, float], end: tuple[float, float, float], widest_mm: float,
        share: float, thick_mm: float,
    ) -> Floats | None:
        """Return (k, 3) x, y, bulge of an arc, a line and an arc from pose to pose, along which the
        tool is engaged by no more than a share of the limit; None where all that are tried are
        engaged more."""
        cdef Spot one, other
        cdef double radius
        cdef double lengths[4]
        cdef double ways[12][6]
        cdef int count = 0, turns, k, pick, tries
        self.travelled += RECENT * self.radius
        one.x, one.y, one.heading = start
        other.x, other.y, other.heading = end
        for tries in range(4):
            radius = widest_mm * (1.0, 0.5, 0.25, 0.1)[tries]
            for turns in range(3):
                if _tangent(one, other, radius, 1 if turns < 2 else -1, -1 if turns == 1 else 1, lengths):
                    ways[count][0], ways[count][1], ways[count][2] = lengths[0], lengths[1], lengths[2]
                    ways[count][3] = radius
                    ways[count][4] = turns
                    ways[count][5] = radius * (lengths[0] + lengths[2]) + lengths[1]
                    if tries == 3:
                        ways[count][5] += 1e3 * self.radius
                    count += 1
        for tries in range(count):
            # The shortest way first, and those of the smallest turns last.
            pick = -1
            for k in range(count):
                if ways[k][5] < FAR and (pick < 0 or ways[k][5] < ways[pick][5]):
                    pick = k
            radius, turns = ways[pick][3], <int> ways[pick][4]
            if _is_free_way(
                self, one, ways[pick][0], ways[pick][1], ways[pick][2], radius,
                1 if turns < 2 else -1, -1 if turns == 1 else 1, share * self.limit, thick_mm,
            ):
                rows = []
                _arc_rows(rows, &one, ways[pick][0], radius, 1 if turns < 2 else -1)
                if ways[pick][1] > 1e-6:
                    rows.append((one.x, one.y, 0.0))
                one = _pose_along(one, 0.0, ways[pick][1])
                _arc_rows(rows, &one, ways[pick][2], radius, -1 if turns == 1 else 1)
                rows.append((other.x, other.y, 0.0))
                return np.array(rows)
            ways[pick][5] = FAR
        return None

    def stays_within(self, vertices: Floats, slack_mm: float) -> bool:
        """Return True if an open path (n, 3) leaves the region by no more than a slack."""
        cdef double[:, ::1] rows = np.ascontiguousarray(vertices, dtype=np.float64)
        cdef double piece[COLUMNS]
        cdef double long_mm, curve, step, room, reach
        cdef Spot start, at
        cdef Int i
        for i in range(rows.shape[0] - 1):
            _of_bulge(&rows[i, 0], &rows[i + 1, 0], piece)
            long_mm = _length(piece)
            curve = 1.0 / piece[TURN] if piece[TURN] != 0.0 else 0.0
            start.x, start.y, start.heading = rows[i, 0], rows[i, 1], piece[HEADING] - curve * long_mm
            # Between two places an arc leaves the chord by a fifth of the slack.
            step = math.sqrt(1.6 * slack_mm / (math.fabs(curve) + 1e-6 / self.radius))
            reach = 0.0
            while True:
                at = _pose_along(start, curve, reach)
                room = _wall_distance(self, at.x, at.y)
                if room < -slack_mm:
                    return False
                if reach >= long_mm:
                    break
                reach = min(long_mm, reach + max(step, room))
        return True

    def fitted(self, first: int, last: int, tolerance_mm: float) -> Floats:
        """Return (n, 3) x, y, bulge of arcs, tangent to each other, near the pieces from one to
        another: as long ones as the tolerance allows."""
        rows = []
        cdef double joint[6]
        cdef Int low = first, high, good, wide
        start = self.pieces[first, AX], self.pieces[first, AY]
        while low < last:
            good, wide = low + 1, 2
            while low + wide <= last and _spanned(self, low, low + wide, tolerance_mm, joint):
                good = low + wide
                wide *= 2
            high = min(low + wide, last + 1)
            while high - good > 1:
                wide = (good + high) // 2
                if _spanned(self, low, wide, tolerance_mm, joint):
                    good = wide
                else:
                    high = wide
            _biarc(self, low, good, joint)
            rows.append((
                self.pieces[low, AX], self.pieces[low, AY],
                _bent(joint[0] - self.pieces[low, AX], joint[1] - self.pieces[low, AY], joint[2]),
            ))
            rows.append((
                joint[0], joint[1],
                _bent(self.pieces[good - 1, BX] - joint[0], self.pieces[good - 1, BY] - joint[1], joint[3]),
            ))
            low = good
        rows.append((self.pieces[last - 1, BX], self.pieces[last - 1, BY], 0.0))
        return np.array(rows)


cdef double _bent(double x, double y, double bulge) noexcept nogil:
    """Return a bulge over a chord, 0 where it is no arc to speak of."""
    return bulge if 0.5 * math.fabs(bulge) * math.hypot(x, y) > FLAT_MM else 0.0


cdef double _length(double* piece) noexcept nogil:
    cdef double chord = math.hypot(piece[BX] - piece[AX], piece[BY] - piece[AY])
    cdef double sine
    if piece[TURN] == 0.0:
        return chord
    sine = 0.5 * chord / math.fabs(piece[TURN])
    return 2.0 * math.fabs(piece[TURN]) * math.asin(sine if sine < 1.0 else 1.0)


cdef Spot _pose_along(Spot at, double curve, double step) noexcept nogil:
    """Return the pose farther along an arc of this curvature."""
    cdef Spot end
    cdef double turn = curve * step, middle = at.heading + 0.5 * turn
    cdef double chord = step if math.fabs(turn) < 1e-9 else 2.0 * math.sin(0.5 * turn) / curve
    end.x, end.y = at.x + chord * math.cos(middle), at.y + chord * math.sin(middle)
    end.heading = at.heading + turn
    return end


cdef double _distance(double x, double y, double* piece) noexcept nogil:
    """Return the distance of a place from a piece."""
    cdef double ex, ey, square, part, ux, uy, side
    if piece[TURN] == 0.0:
        ex, ey = piece[BX] - piece[AX], piece[BY] - piece[AY]
        square = ex * ex + ey * ey
        part = 0.0
        if square > 0.0:
            part = ((x - piece[AX]) * ex + (y - piece[AY]) * ey) / square
            part = 0.0 if part < 0.0 else (1.0 if part > 1.0 else part)
        ux, uy = x - piece[AX] - part * ex, y - piece[AY] - part * ey
        return math.sqrt(ux * ux + uy * uy)
    side = 1.0 if piece[TURN] > 0.0 else -1.0
    ux, uy = x - piece[CX], y - piece[CY]
    if (
        side * ((piece[AX] - piece[CX]) * uy - (piece[AY] - piece[CY]) * ux) >= 0.0
        and side * (ux * (piece[BY] - piece[CY]) - uy * (piece[BX] - piece[CX])) >= 0.0
    ):
        return math.fabs(math.sqrt(ux * ux + uy * uy) - side * piece[TURN])
    ux, uy = x - piece[AX], y - piece[AY]
    ex, ey = x - piece[BX], y - piece[BY]
    return math.sqrt(min(ux * ux + uy * uy, ex * ex + ey * ey))


cdef void _of_bulge(double* start, double* end, double* piece) noexcept nogil:
    """Fill a piece from two vertices x, y, bulge, of half a circle at most."""
    cdef double ex = end[0] - start[0], ey = end[1] - start[1], bulge = start[2]
    cdef double away
    piece[AX], piece[AY], piece[BX], piece[BY] = start[0], start[1], end[0], end[1]
    piece[CX] = piece[CY] = piece[TURN] = 0.0
    piece[HEADING] = math.atan2(ey, ex)
    if math.fabs(bulge) > 1e-9:
        away = 0.25 * (1.0 / bulge - bulge)
        piece[CX], piece[CY] = 0.5 * (start[0] + end[0]) - away * ey, 0.5 * (start[1] + end[1]) + away * ex
        piece[TURN] = 0.25 * math.hypot(ex, ey) * (1.0 / bulge + bulge)
        piece[HEADING] += 2.0 * math.atan(bulge)


cdef Int _add_bulge(Pursuit self, double* start, double* end, Int before):
    """Add a line or an arc in short pieces; return the last one."""
    cdef double piece[COLUMNS]
    cdef double long_mm, curve
    cdef Spot at, after
    cdef Int i, count
    _of_bulge(start, end, piece)
    long_mm = _length(piece)
    if long_mm == 0.0:
        return before
    curve = 4.0 * math.atan(start[2]) / long_mm if piece[TURN] != 0.0 else 0.0
    if piece[TURN] != 0.0:
        long_mm = math.fabs(4.0 * math.atan(start[2]) * piece[TURN])
        curve = 1.0 / piece[TURN]
    at.x, at.y, at.heading = start[0], start[1], piece[HEADING] - curve * long_mm
    count = max(1, <Int> math.ceil(long_mm / (STEP * self.radius)))
    for i in range(count):
        after = _pose_along(at, curve, long_mm / count)
        before = _append(self, at, after, curve, before)
        at = after
    return before


cdef Int _append(Pursuit self, Spot at, Spot after, double curve, Int before):
    """Add a piece behind another one (or −1), and mark the grid points near it."""
    cdef Int row = self.count
    cdef double* piece
    if row == self.pieces.shape[0]:
        self.pieces = np.resize(self.pieces, (2 * row, COLUMNS))
        self.before = np.resize(self.before, 2 * row)
        self.dead = np.resize(self.dead, 2 * row)
    piece = &self.pieces[row, 0]
    piece[AX], piece[AY], piece[BX], piece[BY] = at.x, at.y, after.x, after.y
    piece[CX] = piece[CY] = piece[TURN] = 0.0
    if math.fabs(curve) * self.radius > 1e-5:
        piece[TURN] = 1.0 / curve
        piece[CX] = at.x - math.sin(at.heading) / curve
        piece[CY] = at.y + math.cos(at.heading) / curve
    piece[HEADING] = after.heading
    self.travelled += _length(piece)
    piece[MARK] = self.travelled
    self.before[row] = before
    self.dead[row] = 0
    self.count += 1
    _mark(self, row)
    return row


cdef void _mark(Pursuit self, Int row):
    """Let the grid points near a piece know it."""
    cdef double* piece = &self.pieces[row, 0]
    cdef double reach = self.radius + self.thick + 1.6 * self.cell
    cdef double enough = self.radius - 1.5 * self.cell
    cdef double wide = 0.0, x, y, d, part, dx, dy, span, mx, my, half
    cdef Int i, j, i0, i1, j0, j1, k
    if self.logged + 40000 > self.log_at.shape[0]:
        k = 2 * self.logged + 80000
        self.log_at, self.log_near = np.resize(self.log_at, k), np.resize(self.log_near, k)
        self.log_distance = np.resize(self.log_distance, k)
    # A disc about the middle of the chord holds all that is near.
    mx, my = 0.5 * (piece[AX] + piece[BX]), 0.5 * (piece[AY] + piece[BY])
    half = 0.5 * math.hypot(piece[BX] - piece[AX], piece[BY] - piece[AY])
    if piece[TURN] != 0.0:
        half *= 1.3
    span = reach + half
    j0 = max(0, <Int> math.ceil((my - span - self.low_y) / self.cell))
    j1 = min(self.rows - 1, <Int> math.floor((my + span - self.low_y) / self.cell))
    for j in range(j0, j1 + 1):
        y = self.low_y + j * self.cell
        dy = y - my
        wide = span * span - dy * dy
        if wide <= 0.0:
            continue
        wide = math.sqrt(wide)
        i0 = max(0, <Int> math.ceil((mx - wide - self.low_x) / self.cell))
        i1 = min(self.columns - 1, <Int> math.floor((mx + wide - self.low_x) / self.cell))
        for i in range(i0, i1 + 1):
            k = j * self.columns + i
            if self.distance[k] < enough:
                continue
            d = _distance(self.low_x + i * self.cell, y, piece)
            if d < self.distance[k] and d < reach:
                if self.logged == self.log_at.shape[0]:
                    self.log_at = np.resize(self.log_at, 2 * self.logged)
                    self.log_near = np.resize(self.log_near, 2 * self.logged)
                    self.log_distance = np.resize(self.log_distance, 2 * self.logged)
                self.log_at[self.logged] = k
                self.log_near[self.logged] = self.near[k]
                self.log_distance[self.logged] = self.distance[k]
                self.logged += 1
                self.cleared += d < self.radius <= self.distance[k]
                self.distance[k], self.near[k] = d, row


cdef void _undo(Pursuit self, Int last):
    """Take back the pieces from `last` on."""
    cdef Int k
    while self.logged:
        k = self.log_at[self.logged - 1]
        if self.near[k] < last:
            break
        self.logged -= 1
        self.cleared -= self.distance[k] < self.radius <= self.log_distance[self.logged]
        self.near[k], self.distance[k] = self.log_near[self.logged], self.log_distance[self.logged]
    if last < self.count:
        self.count = last
        if last:
            self.travelled = self.pieces[last - 1, MARK]


cdef double _outside_distance(Pursuit self, double x, double y, double thick) noexcept nogil:
    """Return how far a place is beyond what is cleared; a quick bound where it is deep within."""
    cdef double u = (x - self.low_x) / self.cell, v = (y - self.low_y) / self.cell
    cdef Int i = <Int> math.floor(u), j = <Int> math.floor(v)
    cdef Int k, n, row, seen0 = -1, seen1 = -1, seen2 = -1
    cdef double best = FAR, d, away, recent = self.travelled - RECENT * self.radius
    if i < 0 or j < 0 or i >= self.columns - 1 or j >= self.rows - 1:
        return FAR
    u, v = u - i, v - j
    k = j * self.columns + i
    if u > 0.5:
        k += 1
        u = 1.0 - u
    if v > 0.5:
        k += self.columns
        v = 1.0 - v
    d = self.distance[k] + (u + v) * self.cell - self.radius
    if d < 0.0:
        return d
    for n in range(4):
        k = (j + (n >> 1)) * self.columns + i + (n & 1)
        row = self.near[k]
        if row < 0 or row == seen0 or row == seen1 or row == seen2:
            continue
        seen2 = seen1
        seen1 = seen0
        seen0 = row
        d = _distance(x, y, &self.pieces[row, 0]) - self.radius
        if self.pieces[row, MARK] < recent:
            d -= thick
        best = min(best, d)
    return best


cdef double _engagement(
    Pursuit self, double x, double y, double heading, double thick
) noexcept nogil:
    """Return the angle of the front half of the tool's circle that is not cleared."""
    cdef double right_x = math.sin(heading), right_y = -math.cos(heading)
    cdef double ahead_x = -right_y, ahead_y = right_x
    cdef double c = math.cos(PI / FRONT), s = math.sin(PI / FRONT), a = 1.0, b = 0.0, e
    cdef double value, last = 0.0, total = 0.0, low, high, mid, low_value, high_value, mid_value
    cdef int i, k
    for i in range(FRONT + 1):
        value = _outside_distance(
            self, x + self.radius * (a * right_x + b * ahead_x),
            y + self.radius * (a * right_y + b * ahead_y), thick,
        )
        if i > 0:
            if value > 0.0 and last > 0.0:
                total += 1.0
            elif (value > 0.0) != (last > 0.0):
                low, high, low_value, high_value = 0.0, 1.0, last, value
                for k in range(4):
                    if k < 2 or low_value > 1e20 or high_value > 1e20:
                        mid = 0.5 * (low + high)
                    else:
                        mid = low + (high - low) * low_value / (low_value - high_value)
                    e = -0.5 * PI + (i - 1 + mid) * PI / FRONT + heading
                    mid_value = _outside_distance(self, x + self.radius * math.cos(e), y + self.radius * math.sin(e), thick)
                    if (mid_value > 0.0) == (last > 0.0):
                        low, low_value = mid, mid_value
                    else:
                        high, high_value = mid, mid_value
                mid = 0.5 * (low + high)
                if low_value < 1e20 and high_value < 1e20:
                    mid = low + (high - low) * low_value / (low_value - high_value)
                total += mid if last > 0.0 else 1.0 - mid
        last = value
        e = a * c - b * s
        b = b * c + a * s
        a = e
    return total * PI / FRONT


cdef bint _fits(Pursuit self, Spot at, double curve, double step, double target) noexcept nogil:
    """Return True if a step keeps to the walls and to an engagement."""
    cdef Spot after = _pose_along(at, curve, step)
    cdef double min_room = self.turn - WALL * self.radius
    cdef int k
    # Farther on along the same arc too: otherwise the tool swings about the wall.
    for k in range(5, 0, -1):
        if _room(self, _pose_along(at, curve, 0.35 * k * step), self.turn) < min_room:
            return False
    return _engagement(self, after.x, after.y, after.heading, self.thick) <= target


cdef double _room(Pursuit self, Spot at, double turn) noexcept nogil:
    """Return how far the middle of the tightest turn to the left is from the walls."""
    return _wall_distance(
        self, at.x - turn * math.sin(at.heading), at.y + turn * math.cos(at.heading)
    )


cdef double _wall_distance(Pursuit self, double x, double y) noexcept nogil:
    cdef Int i = <Int> math.floor((x - self.low_x) / self.wall_cell)
    cdef Int j = <Int> math.floor((y - self.low_y) / self.wall_cell)
    cdef Int k, n
    cdef double best = FAR
    if i < 0 or j < 0 or i >= self.wall_columns or j >= self.wall_rows:
        return -FAR
    k = j * self.wall_columns + i
    for n in range(self.wall_first[k], self.wall_first[k + 1]):
        best = min(best, _distance(x, y, &self.walls[self.wall_item[n], 0]))
    return best - self.margin


cdef void _sort_walls(Pursuit self):
    """Give each cell the walls that may be nearest to a place in it."""
    cdef Int i, j, k, n, used = 0, count = self.walls.shape[0]
    cdef double x, y, min_away, half
    cdef double[::1] away = np.empty(count)
    self.wall_cell = 0.5 * self.radius
    self.wall_columns = <Int> (self.columns * self.cell / self.wall_cell) + 1
    self.wall_rows = <Int> (self.rows * self.cell / self.wall_cell) + 1
    self.wall_first = np.zeros(self.wall_columns * self.wall_rows + 1, dtype=np.int64)
    self.wall_item = np.empty(4096, dtype=np.int64)
    half = 0.5 * math.sqrt(2.0) * self.wall_cell
    for j in range(self.wall_rows):
        for i in range(self.wall_columns):
            k = j * self.wall_columns + i
            self.wall_first[k] = used
            x = self.low_x + (i + 0.5) * self.wall_cell
            y = self.low_y + (j + 0.5) * self.wall_cell
            min_away = FAR
            for n in range(count):
                away[n] = _distance(x, y, &self.walls[n, 0])
                min_away = min(min_away, away[n])
            for n in range(count):
                if away[n] <= min_away + 2.0 * half:
                    if used == self.wall_item.shape[0]:
                        self.wall_item = np.resize(self.wall_item, 2 * used)
                    self.wall_item[used] = n
                    used += 1
    self.wall_first[self.wall_columns * self.wall_rows] = used


cdef bint _is_open(Pursuit self, Int row) noexcept nogil:
    """Return True if there is stock on the right of the end of a piece that the tool can cut without
    a tighter turn. Otherwise the piece is dead: for good where all is cleared, at this level by walls."""
    cdef double* piece = &self.pieces[row, 0]
    cdef double heading = piece[HEADING], c = math.cos(heading), s = math.sin(heading)
    cdef double far = self.radius + self.skin, x, y, angle
    cdef int i
    if _outside_distance(self, piece[BX] + far * s, piece[BY] - far * c, 0.0) <= 0.0:
        self.dead[row] = 2
        return False
    x, y = piece[BX] - self.turn * s, piece[BY] + self.turn * c
    for i in range(-2, 3):
        angle = heading - 0.5 * PI + 0.5 * i * ASIDE
        if _wall_distance(
            self, x + self.skin * math.cos(angle), y + self.skin * math.sin(angle)
        ) >= self.turn:
            return True
    self.dead[row] = 1
    return False


cdef bint _tangent(
    Spot one, Spot other, double radius, int turn, int last_turn, double* lengths
) noexcept nogil:
    """Fill the sweep of an arc, the length of a line and the sweep of an arc that lead from pose to
    pose; False where their circles overlap and turn differently."""
    cdef double ax = one.x - turn * radius * math.sin(one.heading)
    cdef double ay = one.y + turn * radius * math.cos(one.heading)
    cdef double bx = other.x - last_turn * radius * math.sin(other.heading)
    cdef double by = other.y + last_turn * radius * math.cos(other.heading)
    cdef double gap = math.hypot(bx - ax, by - ay), heading
    if turn == last_turn:
        heading = math.atan2(by - ay, bx - ax) if gap > 1e-9 else one.heading
        lengths[1] = gap
    else:
        if gap < 2.0 * radius:
            return False
        heading = math.atan2(by - ay, bx - ax) + turn * math.asin(2.0 * radius / gap)
        lengths[1] = math.sqrt(gap * gap - 4.0 * radius * radius)
    lengths[0] = _turned(turn * (heading - one.heading))
    lengths[2] = _turned(last_turn * (other.heading - heading))
    return True


cdef double _turned(double angle) noexcept nogil:
    """Return an angle from 0 up to a whole turn; one just below that is 0."""
    angle = math.fmod(angle, 2.0 * PI)
    if angle < 0.0:
        angle += 2.0 * PI
    return 0.0 if angle > 2.0 * PI - 1e-6 else angle


cdef bint _is_free_way(
    Pursuit self, Spot at, double sweep, double line, double last_sweep, double radius, int turn,
    int last_turn, double max_angle, double thick,
) noexcept nogil:
    """Return True if the tool is engaged by no more than an angle along an arc, a line and an arc."""
    if not _is_free_arc(self, &at, turn / radius, sweep * radius, max_angle, thick):
        return False
    if not _is_free_arc(self, &at, 0.0, line, max_angle, thick):
        return False
    return _is_free_arc(self, &at, last_turn / radius, last_sweep * radius, max_angle, thick)


cdef bint _is_free_arc(
    Pursuit self, Spot* at, double curve, double long_mm, double max_angle, double thick
) noexcept nogil:
    """Return True if the tool is engaged by no more than an angle along an arc; moves the pose there."""
    cdef Spot start = at[0], place
    cdef Int j, k, count = <Int> math.ceil(long_mm / (0.1 * self.radius))
    cdef double room
    for j in range(1, count + 1):
        place = _pose_along(start, curve, long_mm * j / count)
        room = _wall_distance(self, place.x, place.y)
        if room < -WALL * self.radius:
            return False
        # Between two places an arc may leave the region by an eighth of what it turns.
        if curve != 0.0 and room < 0.1 * self.radius:
            for k in range(1, 10):
                place = _pose_along(start, curve, long_mm * (j - 0.1 * k) / count)
                if _wall_distance(self, place.x, place.y) < -WALL * self.radius:
                    return False
            place = _pose_along(start, curve, long_mm * j / count)
        if _engagement(self, place.x, place.y, place.heading, thick) > max_angle:
            return False
    at[0] = _pose_along(start, curve, long_mm)
    return True


cdef _arc_rows(rows, Spot* at, double sweep, double radius, int turn):
    """Append the vertices of an arc without its end, and move the pose there."""
    cdef int parts = <int> math.ceil(sweep / 2.5), k
    if sweep * radius * sweep < 8.0 * FLAT_MM:
        if sweep * radius > 1e-6:
            rows.append((at.x, at.y, 0.0))
        at[0] = _pose_along(at[0], turn / radius, sweep * radius)
        return
    for k in range(parts):
        rows.append((at.x, at.y, turn * math.tan(0.25 * sweep / parts)))
        at[0] = _pose_along(at[0], turn / radius, sweep * radius / parts)


cdef bint _spanned(
    Pursuit self, Int low, Int high, double tolerance, double* joint
) noexcept nogil:
    """Return True if two arcs stand for the pieces from `low` up to `high`."""
    cdef double start[3]
    cdef double middle[3]
    cdef double end[3]
    cdef double one[COLUMNS]
    cdef double other[COLUMNS]
    cdef Int i
    cdef Spot middle_of
    if not _biarc(self, low, high, joint):
        return False
    start[0], start[1], start[2] = self.pieces[low, AX], self.pieces[low, AY], joint[2]
    middle[0], middle[1], middle[2] = joint[0], joint[1], joint[3]
    end[0], end[1], end[2] = self.pieces[high - 1, BX], self.pieces[high - 1, BY], 0.0
    _of_bulge(start, middle, one)
    _of_bulge(middle, end, other)
    for i in range(low, high):
        if i < high - 1 and min(
            _distance(self.pieces[i, BX], self.pieces[i, BY], one),
            _distance(self.pieces[i, BX], self.pieces[i, BY], other),
        ) > tolerance:
            return False
        middle_of = _middle(&self.pieces[i, 0])
        if min(
            _distance(middle_of.x, middle_of.y, one), _distance(middle_of.x, middle_of.y, other)
        ) > tolerance:
            return False
    return True


cdef Spot _middle(double* piece) noexcept nogil:
    """Return the pose in the middle of a piece."""
    cdef double long_mm = _length(piece)
    cdef double curve = 1.0 / piece[TURN] if piece[TURN] != 0.0 else 0.0
    cdef Spot start
    start.x, start.y, start.heading = piece[AX], piece[AY], piece[HEADING] - curve * long_mm
    return _pose_along(start, curve, 0.5 * long_mm)


cdef bint _biarc(Pursuit self, Int low, Int high, double* joint) noexcept nogil:
    """Fill the place where two arcs meet, and their bulges, which lead from the pose before the
    piece `low` to that at the end of the one before `high`; False where they turn too far."""
    cdef double* first = &self.pieces[low, 0]
    cdef double* last = &self.pieces[high - 1, 0]
    cdef double turn = _length(first) / first[TURN] if first[TURN] != 0.0 else 0.0
    cdef double begin = first[HEADING] - turn, finish = last[HEADING]
    cdef double tx = math.cos(begin), ty = math.sin(begin)
    cdef double ux = math.cos(finish), uy = math.sin(finish)
    cdef double vx = last[BX] - first[AX], vy = last[BY] - first[AY]
    cdef double square = vx * vx + vy * vy, along = vx * (tx + ux) + vy * (ty + uy)
    cdef double flat = 2.0 * (1.0 - tx * ux - ty * uy), d, one, other
    if math.fabs(finish - begin) > 1.5 or along <= 0.0:
        return False
    d = square / (along + math.sqrt(along * along + flat * square))
    joint[0] = 0.5 * (first[AX] + d * tx + last[BX] - d * ux)
    joint[1] = 0.5 * (first[AY] + d * ty + last[BY] - d * uy)
    vx, vy = joint[0] - first[AX], joint[1] - first[AY]
    one = math.atan2(tx * vy - ty * vx, tx * vx + ty * vy)
    vx, vy = last[BX] - joint[0], last[BY] - joint[1]
    other = math.atan2(vx * uy - vy * ux, vx * ux + vy * uy)
    joint[2], joint[3] = math.tan(0.5 * one), math.tan(0.5 * other)
    return True
