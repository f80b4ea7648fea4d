"""Exact heights of the stock after straight moves of tools, and bounds of them over squares.

Arrays in, arrays out; mm. The height that a move leaves over a point is the least of z + profile
(distance) along it, and the height of the stock is the least over all moves and its top. Three
facts make bounds over a square:

- Over a disc the least height that a move leaves is exactly the height at its middle under a tool
  whose profile begins so much farther out.
- The height of a move is a convex function of the point, so over a square its greatest value is at
  a corner.
- So is every mean of the heights of two moves, and the stock lies below each such mean. Between
  two passes the slopes of both cancel in it, so the bound errs by the square of the square's size
  instead of by the size itself.
- The mean of a convex function over a square is at most that of its values at the corners, and
  that of a concave one at least (Hermite and Hadamard). A convex function lies above its tangent
  planes, and the least of several planes is concave.
- At a wall no single move covers a square. The tool of each lies on one side of its tangent, so
  beyond the farthest of these lines nothing is cut; and all before the chord of the edge of one
  move is. Between both lies an area as thin as the square of the square's size.

`tests/oracles/stock_heights.py` is the twin.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Floats, Ints

cdef enum:
    FAN = 8  # children of a node, and moves of a leaf
    DEPTH = 24  # levels of a tree, at most: 8 to the 24 is more than any computer holds
    MAX_CORNERS = 8  # of a polygon

# Columns of a move: start, unit direction in the plane, length in the plane, slope.
cdef enum:
    AX, AY, AZ, UX, UY, LONG, SLOPE, COLUMNS

# Columns of a node: box of the tips, lowest tip, widest tool, first move in the order of cutting,
# and the least and the greatest tool, which are one where the node has one tool.
cdef enum:
    LOW_X, LOW_Y, HIGH_X, HIGH_Y, LOWEST, WIDEST, EARLIEST, TOOL, LAST_TOOL, NODE_COLUMNS

# Columns of a tool.
cdef enum:
    RADIUS, FLAT, CORNER, RISE, TOOL_COLUMNS

# A sloping move of a bull nose: halvings of the place on the move at which it is lowest.
cdef int HALVINGS = 54

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
QUARTERS = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])

cdef double BEND_MM = 1e-9  # a place of a cone nearer than this to its tip or flat lies on its bend


cdef inline double profile(const double* tool, double distance, double grow) noexcept nogil:
    """Return the height of a tool's surface over its tip at a distance from its axis."""
    cdef double out = distance - tool[FLAT] - grow
    if out <= 0.0:
        return 0.0
    if tool[CORNER] > 0.0:
        if out >= tool[CORNER]:
            return tool[CORNER]
        return tool[CORNER] - math.sqrt(tool[CORNER] * tool[CORNER] - out * out)
    return out * tool[RISE]


cdef inline double downhill(
    const double* tool, double aside, double steep, double limit, double grow
) noexcept nogil:
    """Return the distance downhill from the place on a sloping line nearest to a point `aside` mm
    beside it to the place where the tool is lowest over the point; at most `limit`."""
    cdef double flat = tool[FLAT] + grow, corner = tool[CORNER]
    cdef double low, high, middle, distance, out
    cdef int k
    low = math.sqrt(flat * flat - aside * aside) if aside < flat else 0.0
    if corner <= 0.0:
        if tool[RISE] <= 0.0 or steep >= tool[RISE]:
            return limit
        middle = aside * steep / math.sqrt(tool[RISE] * tool[RISE] - steep * steep)
        return min(max(low, middle), limit)
    if flat == 0.0:
        middle = max(corner * corner - aside * aside, 0.0) / (1.0 + steep * steep)
        return min(steep * math.sqrt(middle), limit)
    high = limit
    for k in range(HALVINGS):
        middle = 0.5 * (low + high)
        distance = math.sqrt(aside * aside + middle * middle)
        out = distance - flat
        # The slope of the profile there against that of the line, without a division by zero.
        if out > 0.0 and (
            out >= corner
            or out * middle > steep * distance * math.sqrt(corner * corner - out * out)
        ):
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


cdef inline double height_of(
    const double* move, const double* tool, double x, double y, double grow
) noexcept nogil:
    """Return the least height to which a move cuts a point, with the profile begun `grow` farther
    out; inf where the tool does not reach."""
    cdef double wide = tool[RADIUS] + grow
    cdef double px = x - move[AX], py = y - move[AY]
    cdef double along, aside, s, distance, reach, low, high
    if wide <= 0.0:
        return math.INFINITY
    if move[LONG] == 0.0:
        distance = math.sqrt(px * px + py * py)
        return move[AZ] + profile(tool, distance, grow) if distance <= wide else math.INFINITY
    aside = math.fabs(px * move[UY] - py * move[UX])
    if aside > wide:
        return math.INFINITY
    along = px * move[UX] + py * move[UY]
    if move[SLOPE] == 0.0:
        s = min(max(along, 0.0), move[LONG]) - along
        distance = math.sqrt(aside * aside + s * s)
        return move[AZ] + profile(tool, distance, grow) if distance <= wide else math.INFINITY
    reach = math.sqrt(wide * wide - aside * aside)
    low, high = max(0.0, along - reach), min(move[LONG], along + reach)
    if low > high:
        return math.INFINITY
    s = downhill(tool, aside, math.fabs(move[SLOPE]), reach, grow)
    s = along - s if move[SLOPE] > 0.0 else along + s
    s = min(max(s, low), high)
    distance = math.sqrt(aside * aside + (s - along) * (s - along))
    return move[AZ] + move[SLOPE] * s + profile(tool, min(distance, wide), grow)


cdef inline double tangent_of(
    const double* move, const double* tool, double x, double y, double* slope
) noexcept nogil:
    """Return the height to which a move cuts a point, and set the slope in x and y of a plane
    through it below which the move's height nowhere lies; inf where there is none or it is not
    known: beyond the tool, and where the tool's edge cuts deepest."""
    cdef double px = x - move[AX], py = y - move[AY], wide = tool[RADIUS]
    cdef double along, aside, s, distance, reach, dx, dy, out, steep
    slope[0], slope[1] = 0.0, 0.0
    along = px * move[UX] + py * move[UY]
    s = min(max(along, 0.0), move[LONG])
    if move[SLOPE] != 0.0:
        aside = math.fabs(px * move[UY] - py * move[UX])
        if aside >= wide:
            return math.INFINITY
        reach = math.sqrt(wide * wide - aside * aside)
        s = downhill(tool, aside, math.fabs(move[SLOPE]), reach, 0.0)
        if s >= reach:
            return math.INFINITY
        s = along - s if move[SLOPE] > 0.0 else along + s
        s = min(max(s, 0.0), move[LONG])
    dx, dy = px - s * move[UX], py - s * move[UY]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance >= wide:
        return math.INFINITY
    out = distance - tool[FLAT]
    if out <= BEND_MM and tool[CORNER] <= 0.0:
        # At a bend of a cone: along the move the height rises as the move does, unless an end of
        # it is deepest.
        if (s <= 0.0 and move[SLOPE] > 0.0) or (s >= move[LONG] and move[SLOPE] < 0.0):
            return move[AZ] + move[SLOPE] * s
        slope[0], slope[1] = move[SLOPE] * move[UX], move[SLOPE] * move[UY]
        along = (dx * move[UX] + dy * move[UY]) / distance if distance > BEND_MM else 1.0
        if distance > BEND_MM and along != 0.0:
            slope[0], slope[1] = (
                move[SLOPE] / along * dx / distance, move[SLOPE] / along * dy / distance
            )
        return move[AZ] + move[SLOPE] * s
    if out > 0.0:
        if tool[CORNER] > 0.0:
            if out >= tool[CORNER]:
                return math.INFINITY
            steep = out / math.sqrt(tool[CORNER] * tool[CORNER] - out * out)
        else:
            steep = tool[RISE]
        slope[0], slope[1] = steep * dx / distance, steep * dy / distance
    return move[AZ] + move[SLOPE] * s + profile(tool, distance, 0.0)


cdef class StockTree:
    """The moves (M, 7) in the order of a curve through the plane, the tool (M,) and the
    number in the order of cutting (M,) of each; tools (T, 4); the nodes (N, 7) of all levels,
    the root's last, where level l begins at levels[l]. `top`: the height of what is not cut."""

    cdef double[:, ::1] moves, nodes, tools
    cdef Int[::1] tool, number, levels
    cdef readonly double top
    cdef int height

    def __init__(
        self, moves: Floats, tool: Ints, number: Ints, tools: Floats, top: float
    ) -> None:
        self.moves, self.tool, self.number, self.tools = moves, tool, number, tools
        self.top = top
        nodes, levels = _nodes(
            np.asarray(moves), np.asarray(tool), np.asarray(number), np.asarray(tools)
        )
        self.nodes, self.levels = nodes, levels
        self.height = len(levels) - 1

    def heights(self, points: Floats, before: Ints | None = None, double grow=0.0):
        """Return (J,) the heights of the stock over points (J, 2), and (J,) the move that is
        lowest there, in the order of cutting, −1 for none; after the first `before` (J,) moves
        only. Profiles begin `grow` farther out, or nearer where it is below 0."""
        cdef double[:, ::1] at = np.ascontiguousarray(points, dtype=np.float64)
        cdef Py_ssize_t k, count = at.shape[0]
        cdef double[::1] lowest_z = np.empty(count)
        cdef Int[::1] which = np.empty(count, dtype=np.int64)
        cdef Int[::1] until
        cdef bint timed = before is not None
        cdef Int last = -1, row
        if timed:
            until = np.ascontiguousarray(before, dtype=np.int64)
        with nogil:
            for k in range(count):
                row = -1
                lowest_z[k] = self.lowest(
                    at[k, 0], at[k, 1], grow, self.top, until[k] if timed else -1, &row, last
                )
                last = row
                which[k] = self.number[row] if row >= 0 else -1
        return np.asarray(lowest_z), np.asarray(which)

    def min_heights(self, squares: Floats, double grow=0.0):
        """Return (K,) the least height over the disc round each square, given by its middle and
        half a side (K, 3)."""
        cdef double[:, ::1] at = np.ascontiguousarray(squares, dtype=np.float64)
        cdef Py_ssize_t k, count = at.shape[0]
        cdef double[::1] lowest_z = np.empty(count)
        cdef Int last = -1, row
        with nogil:
            for k in range(count):
                row = -1
                lowest_z[k] = self.lowest(
                    at[k, 0], at[k, 1], at[k, 2] * math.sqrt(2.0) + grow, self.top, -1, &row, last
                )
                last = row
        return np.asarray(lowest_z)

    def max_heights(
        self,
        squares: Floats,
        tilt: Floats | None = None,
        double grow=0.0,
        before: Ints | None = None,
    ):
        """Return (K,) an upper bound of the heights over each square, given by its middle and half
        a side (K, 3); after the first `before` (K,) moves only. With `tilt` (K, 2) heights are
        measured from the plane that is 0 at the middle and rises by `tilt` per mm of x and y."""
        ways = squares[:, 2, None, None] * CORNERS
        values = np.zeros(ways.shape[:2])
        if tilt is not None:
            values = -(ways * tilt[:, None]).sum(axis=2)
        return self.max_heights_over(squares[:, None, :2] + ways, values, grow, before)

    def max_heights_over(
        self,
        corners: Floats,
        values: Floats,
        double grow=0.0,
        before: Ints | None = None,
        double enough=-math.INFINITY,
    ):
        """Return (K,) an upper bound of the height plus a linear function, which has `values`
        (K, C) at the corners (K, C, 2) of convex polygons or of chords, over each of them;
        after the first `before` (K,) moves only. Any bound no more than `enough` will do."""
        cdef double[:, :, ::1] at = np.ascontiguousarray(corners, dtype=np.float64)
        cdef double[:, ::1] more = np.ascontiguousarray(values, dtype=np.float64)
        cdef Py_ssize_t k, count = at.shape[0]
        cdef double[::1] bounds = np.empty(count)
        cdef Int[::1] until
        cdef bint timed = before is not None
        cdef Int last = -1
        cdef int c, corner_count
        cdef double[3][MAX_CORNERS] polygon
        if at.shape[1] > MAX_CORNERS:
            raise ValueError(f"{at.shape[1]} corners are more than {MAX_CORNERS}")
        if timed:
            until = np.ascontiguousarray(before, dtype=np.int64)
        with nogil:
            for k in range(count):
                corner_count = 0
                for c in range(at.shape[1]):
                    if c and at[k, c, 0] == at[k, c - 1, 0] and at[k, c, 1] == at[k, c - 1, 1]:
                        continue
                    polygon[0][corner_count] = at[k, c, 0]
                    polygon[1][corner_count] = at[k, c, 1]
                    polygon[2][corner_count] = more[k, c]
                    corner_count += 1
                bounds[k] = self.bound(
                    corner_count, polygon, grow, until[k] if timed else -1, enough, &last
                )
        return np.asarray(bounds)

    def quarter_means(self, squares: Floats, double bottom=-math.INFINITY):
        """Return (4 K,) lower and (4 K,) upper bounds of the mean height over the quarters of each
        square, in the order of `QUARTERS`; squares are middle and half a side (K, 3); the stock
        ends at `bottom`."""
        cdef double[:, ::1] at = np.ascontiguousarray(squares, dtype=np.float64)
        cdef double[:, ::1] signs = QUARTERS
        cdef Py_ssize_t k, q, count = at.shape[0]
        cdef double[::1] low = np.empty(4 * count)
        cdef double[::1] high = np.empty(4 * count)
        cdef Int[::1] near = np.empty(self.moves.shape[0], dtype=np.int64)
        cdef double[::1] heights = np.empty(self.moves.shape[0])
        cdef Int last = -1, gathered
        cdef double[3] quarter
        with nogil:
            for k in range(count):
                gathered = self.gather(&at[k, 0], near, &last)
                quarter[2] = 0.5 * at[k, 2]
                for q in range(4):
                    quarter[0] = at[k, 0] + signs[q, 0] * quarter[2]
                    quarter[1] = at[k, 1] + signs[q, 1] * quarter[2]
                    self.mean_of(
                        quarter, bottom, near, gathered, heights, &low[4 * k + q], &high[4 * k + q]
                    )
        return np.asarray(low), np.asarray(high)

    cdef Int gather(self, const double* square, Int[::1] near, Int* guess) noexcept nogil:
        """Store the moves that may be lowest somewhere over a square; return their number."""
        cdef Int stack[FAN * DEPTH]
        cdef int levels[FAN * DEPTH]
        cdef double x = square[0], y = square[1], room = square[2] * math.sqrt(2.0)
        cdef double best = self.top
        cdef double[MAX_CORNERS] now
        cdef double[3][MAX_CORNERS] polygon
        cdef int count = 1, depth
        cdef Int node, child, end, row = -1, cover = -1, gathered = 0
        if self.height == 0:
            return 0
        corners_of(square, polygon)
        self.lowest(x, y, 0.0, self.top, -1, &row, guess[0])
        if row >= 0:
            guess[0] = row
            best = min(best, self.corners(row, 4, polygon, 0.0, now))
        if best < self.top:  # one move covers all of it
            cover = near[0] = row
            gathered = 1
        stack[0], levels[0] = 0, self.height - 1
        while count:
            count -= 1
            node, depth = stack[count], levels[count]
            row = self.levels[depth] + node
            if not self.nearer(&self.nodes[row, 0], x, y, room, 0.0) < best:
                continue
            end = min(FAN * (node + 1), self.members(depth))
            for child in range(FAN * node, end):
                if depth:
                    stack[count], levels[count] = child, depth - 1
                    count += 1
                elif child != cover and self.moves[child, AZ] + min(
                    self.moves[child, SLOPE] * self.moves[child, LONG], 0.0
                ) < best and height_of(
                    &self.moves[child, 0], &self.tools[self.tool[child], 0], x, y, room
                ) < best:
                    near[gathered] = child
                    gathered += 1
        return gathered

    cdef void mean_of(
        self, const double* square, double bottom, Int[::1] near, Int count, double[::1] heights,
        double* low, double* high
    ) noexcept nogil:
        """Set bounds of the mean height over a square that `count` moves may cut; `heights` is a
        scratch buffer. From below: the least of the tangent planes of all moves that may be lowest
        there is concave, so its mean is at least that of the four corners. From above: the mean of
        the corners of the best move."""
        cdef double x = square[0], y = square[1], half = square[2]
        cdef double room = half * math.sqrt(2.0), best = self.top, z, average, lowest = self.top
        cdef double[2] slope
        cdef double[MAX_CORNERS] now
        cdef double[3][MAX_CORNERS] outline
        cdef double[4] lows
        cdef int k
        cdef Int i, row = -1
        cdef double[2] direction
        cdef double cover = -math.INFINITY, part, floor
        direction[0], direction[1] = 0.0, 0.0
        corners_of(square, outline)
        low[0], high[0] = self.top, self.top
        for i in range(count):
            heights[i] = height_of(
                &self.moves[near[i], 0], &self.tools[self.tool[near[i]], 0], x, y, 0.0
            )
            if heights[i] < lowest:
                lowest, row = heights[i], near[i]
        if row >= 0:
            z = self.corners(row, 4, outline, 0.0, now)
            if z <= best:
                best, high[0] = z, mean_above(now, bottom)
        if best == self.top:
            # No single move is known to cover the square: a wall may stand in it.
            if row < 0:
                for i in range(count):
                    z = height_of(
                        &self.moves[near[i], 0], &self.tools[self.tool[near[i]], 0], x, y, room
                    )
                    if z < lowest:
                        lowest, row = z, near[i]
            if row < 0:
                return
            part = self.reach_past(row, x, y, direction)
            if part == math.INFINITY:
                cover = part
            else:
                high[0] = min(high[0], self.covered(row, square, direction, part, bottom))
        # Moves that are nowhere lower than `best` are not looked at; they leave no less than it.
        floor = best
        for k in range(4):
            lows[k] = best
        for i in range(count):
            row = near[i]
            z = height_of(&self.moves[row, 0], &self.tools[self.tool[row], 0], x, y, room)
            if z >= best:
                continue
            floor = min(floor, z)
            if best == self.top:
                cover = max(cover, self.support(row, x, y, direction, room))
            average = tangent_of(
                &self.moves[row, 0], &self.tools[self.tool[row], 0], x, y, slope
            )
            if average == math.INFINITY:
                slope[0], slope[1] = 0.0, 0.0
            else:
                z = average
            for k in range(4):
                lows[k] = min(
                    lows[k],
                    z
                    + (half if k & 1 else -half) * slope[0]
                    + (half if k & 2 else -half) * slope[1],
                )
            # The mean of a convex function is no less than its value in the middle.
            if heights[i] < high[0] and self.corners(row, 4, outline, 0.0, now) < math.INFINITY:
                high[0] = min(high[0], mean_above(now, bottom))
        low[0] = max(0.25 * (lows[0] + lows[1] + lows[2] + lows[3]), floor, bottom)
        if best == self.top and cover < room:
            low[0] = max(low[0], half_plane_mean(half, direction, cover, lows, self.top))
        high[0] = max(high[0], low[0])

    cdef double reach_past(self, Int move, double x, double y, double* direction) noexcept nogil:
        """Return how far the tool of a move reaches beyond a point, along `direction`, which is
        set to that from the nearest place of its axis to the point; below 0 where the tool ends
        before the point, inf where the point lies on the axis."""
        cdef double* columns = &self.moves[move, 0]
        cdef double px = x - columns[AX], py = y - columns[AY], s, distance
        s = min(max(px * columns[UX] + py * columns[UY], 0.0), columns[LONG])
        px, py = px - s * columns[UX], py - s * columns[UY]
        distance = math.sqrt(px * px + py * py)
        if distance <= 0.0:
            return math.INFINITY
        direction[0], direction[1] = px / distance, py / distance
        return self.tools[self.tool[move], RADIUS] - distance

    cdef double support(
        self, Int move, double x, double y, const double* direction, double room
    ) noexcept nogil:
        """Return an upper bound of how far the tool of a move reaches along a direction from a
        point, within a disc of radius `room` round it. The tool lies on one side of its
        tangent."""
        cdef double[2] own
        cdef double far = self.reach_past(move, x, y, own), cosine
        if far >= room:
            return room
        if far <= -room:
            return -room
        cosine = own[0] * direction[0] + own[1] * direction[1]
        if cosine * room <= far:
            return room
        return far * cosine + math.sqrt(
            max(room * room - far * far, 0.0) * max(1.0 - cosine * cosine, 0.0)
        )

    cdef double covered(
        self, Int move, const double* square, const double* direction, double far, double bottom
    ) noexcept nogil:
        """Return an upper bound of the mean height over a square of which a move covers a part:
        all that lies before the chord of its edge."""
        cdef double* columns = &self.moves[move, 0]
        cdef double* tool = &self.tools[self.tool[move], 0]
        cdef double half = square[2], radius = tool[RADIUS], room = 2.0 * half * half
        cdef double[3][MAX_CORNERS] at
        cdef double[4] none
        cdef int count, k
        if room >= radius * radius:
            return self.top
        far -= radius - math.sqrt(radius * radius - room) + 1e-12 * radius
        for k in range(4):
            none[k] = 0.0
        count = clipped(half, direction, far, none, at)
        for k in range(count):
            at[2][k] = height_of(columns, tool, square[0] + at[0][k], square[1] + at[1][k], 0.0)
            if at[2][k] == math.INFINITY:
                return self.top
            at[2][k] = max(at[2][k], bottom) - self.top
        return self.top + fan_integral(count, at) / (4.0 * half * half)

    cdef inline double nearer(
        self, const double* node, double x, double y, double room, double grow
    ) noexcept nogil:
        """Return a lower bound of the heights that the moves of a node leave within `room` of a
        point; inf where none of them reaches."""
        cdef double dx = max(max(node[LOW_X] - x, x - node[HIGH_X]), 0.0)
        cdef double dy = max(max(node[LOW_Y] - y, y - node[HIGH_Y]), 0.0)
        cdef double wide = node[WIDEST] + grow + room
        if wide <= 0.0 or dx * dx + dy * dy > wide * wide:
            return math.INFINITY
        if node[TOOL] != node[LAST_TOOL]:
            return node[LOWEST]
        return node[LOWEST] + profile(
            &self.tools[<Int>node[TOOL], 0], math.sqrt(dx * dx + dy * dy), grow + room
        )

    cdef double lowest(
        self,
        double x,
        double y,
        double grow,
        double top,
        Int before,
        Int* which,
        Int guess,
    ) noexcept nogil:
        """Return the least height over a point, below `top`, and set the row of the move there.
        `guess`: a move that may be low there."""
        cdef Int stack[FAN * DEPTH]
        cdef int levels[FAN * DEPTH]
        cdef int count = 0, level
        cdef Int node, child, end, row
        cdef double best = top, z
        if self.height == 0:
            return best
        if guess >= 0 and (before < 0 or self.number[guess] < before):
            z = height_of(&self.moves[guess, 0], &self.tools[self.tool[guess], 0], x, y, grow)
            if z < best:
                best, which[0] = z, guess
        stack[0], levels[0], count = 0, self.height - 1, 1
        while count:
            count -= 1
            node, level = stack[count], levels[count]
            row = self.levels[level] + node
            if before >= 0 and self.nodes[row, EARLIEST] >= before:
                continue
            if not self.nearer(&self.nodes[row, 0], x, y, 0.0, grow) < best:
                continue
            end = min(FAN * (node + 1), self.members(level))
            if level == 0:
                for child in range(FAN * node, end):
                    if self.moves[child, AZ] + min(
                        self.moves[child, SLOPE] * self.moves[child, LONG], 0.0
                    ) >= best or (before >= 0 and self.number[child] >= before):
                        continue
                    z = height_of(
                        &self.moves[child, 0], &self.tools[self.tool[child], 0], x, y, grow
                    )
                    if z < best:
                        best, which[0] = z, child
            else:
                for child in range(FAN * node, end):
                    stack[count], levels[count] = child, level - 1
                    count += 1
        return best

    cdef inline Int members(self, int level) noexcept nogil:
        """Return the number of children that the nodes of a level have together."""
        if level == 0:
            return self.moves.shape[0]
        return self.levels[level] - self.levels[level - 1]

    cdef double bound(
        self,
        int corner_count,
        double[3][MAX_CORNERS] polygon,
        double grow,
        Int before,
        double enough,
        Int* guess,
    ) noexcept nogil:
        """Return an upper bound of the heights plus a linear function over a polygon: by the moves
        that are lowest at its corners and in its middle, by the means of two of these, and by any
        move that covers all of it."""
        cdef Int stack[FAN * DEPTH]
        cdef int levels[FAN * DEPTH]
        cdef double now[MAX_CORNERS]
        cdef double corner[MAX_CORNERS + 1][MAX_CORNERS]
        cdef Int[MAX_CORNERS + 1] rows
        cdef int count_kept = 0, k, j, count, level
        cdef Int row, node, child, end
        cdef double best = -math.INFINITY, x = 0.0, y = 0.0, z
        for k in range(corner_count):
            x += polygon[0][k] / corner_count
            y += polygon[1][k] / corner_count
            best = max(best, self.top + polygon[2][k])
        for k in range(-1, corner_count):
            if best <= enough:
                return best
            row = -1
            if k < 0:
                self.lowest(x, y, grow, self.top, before, &row, guess[0])
                if row >= 0:
                    guess[0] = row
            else:
                self.lowest(
                    polygon[0][k], polygon[1][k], grow, self.top, before, &row, guess[0]
                )
            for j in range(count_kept):
                if rows[j] == row:
                    row = -1
                    break
            if row < 0:
                continue
            rows[count_kept] = row
            z = self.corners(row, corner_count, polygon, grow, corner[count_kept])
            if z < math.INFINITY:
                best = min(best, z)
                count_kept += 1
        for k in range(count_kept):
            for j in range(k):
                if best <= enough:
                    return best
                best = mean_bound(corner_count, corner[k], corner[j], best)
        if best <= enough or self.height == 0:
            return best
        stack[0], levels[0], count = 0, self.height - 1, 1
        while count:
            count -= 1
            node, level = stack[count], levels[count]
            row = self.levels[level] + node
            if before >= 0 and self.nodes[row, EARLIEST] >= before:
                continue
            for k in range(corner_count):
                z = self.nearer(&self.nodes[row, 0], polygon[0][k], polygon[1][k], 0.0, grow)
                if z + polygon[2][k] >= best:
                    break
            else:
                end = min(FAN * (node + 1), self.members(level))
                for child in range(FAN * node, end):
                    if level:
                        stack[count], levels[count] = child, level - 1
                        count += 1
                    elif before < 0 or self.number[child] < before:
                        best = min(best, self.corners(child, corner_count, polygon, grow, now))
                        if best <= enough:
                            return best
        return best

    cdef inline double corners(
        self, Int move, int count, double[3][MAX_CORNERS] polygon, double grow, double* heights
    ) noexcept nogil:
        """Set the heights of a move plus the given values at the corners of a polygon, and return
        the greatest."""
        cdef double* tool = &self.tools[self.tool[move], 0]
        cdef double* columns = &self.moves[move, 0]
        cdef double highest = -math.INFINITY
        cdef int k
        for k in range(count):
            heights[k] = height_of(columns, tool, polygon[0][k], polygon[1][k], grow)
            heights[k] += polygon[2][k]
            highest = max(highest, heights[k])
            if highest == math.INFINITY:
                break
        return highest


cdef inline void corners_of(const double* square, double[3][MAX_CORNERS] at) noexcept nogil:
    """Store the corners of a square, with the value 0."""
    cdef int k
    for k in range(4):
        at[0][k] = square[0] + (square[2] if k & 1 else -square[2])
        at[1][k] = square[1] + (square[2] if k & 2 else -square[2])
        at[2][k] = 0.0


cdef inline double mean_above(const double* corner, double bottom) noexcept nogil:
    """Return the mean of four heights, each raised to at least a bottom."""
    cdef double mean = 0.0
    cdef int k
    for k in range(4):
        mean += 0.25 * max(corner[k], bottom)
    return mean


cdef int clipped(
    double half, const double* direction, double far, const double* value,
    double[3][MAX_CORNERS] at
) noexcept nogil:
    """Store the corners of the part of a square about 0 that lies no farther than `far` along a
    direction: x, y and the value, which is given at the corners of the square and linear along its
    sides; return their number."""
    cdef int count = 0, k, corner, other_corner
    cdef double[4] off
    cdef double share
    cdef int[4] order
    order[0], order[1], order[2], order[3] = 0, 1, 3, 2
    for k in range(4):
        off[k] = (half if k & 1 else -half) * direction[0] - far
        off[k] += (half if k & 2 else -half) * direction[1]
    for k in range(4):
        corner, other_corner = order[k], order[(k + 1) & 3]
        if off[corner] <= 0.0:
            at[0][count] = half if corner & 1 else -half
            at[1][count] = half if corner & 2 else -half
            at[2][count] = value[corner]
            count += 1
        if (off[corner] < 0.0 < off[other_corner]) or (off[other_corner] < 0.0 < off[corner]):
            share = off[corner] / (off[corner] - off[other_corner])
            at[0][count] = (half if corner & 1 else -half) * (1.0 - share) + (
                half if other_corner & 1 else -half
            ) * share
            at[1][count] = (half if corner & 2 else -half) * (1.0 - share) + (
                half if other_corner & 2 else -half
            ) * share
            at[2][count] = value[corner] * (1.0 - share) + value[other_corner] * share
            count += 1
    return count


cdef double fan_integral(int count, double[3][MAX_CORNERS] at) noexcept nogil:
    """Return the integral over a convex polygon of a function that is linear in each triangle of a
    fan."""
    cdef double integral = 0.0, area
    cdef int k
    for k in range(2, count):
        area = 0.5 * (
            (at[0][k - 1] - at[0][0]) * (at[1][k] - at[1][0])
            - (at[0][k] - at[0][0]) * (at[1][k - 1] - at[1][0])
        )
        integral += area * (at[2][0] + at[2][k - 1] + at[2][k]) / 3.0
    return integral


cdef double half_plane_mean(
    double half, const double* direction, double far, const double* value, double top
) noexcept nogil:
    """Return the mean over a square of the least concave function that has these values at the
    corners and is `top` beyond the line at the distance `far` along a direction."""
    cdef double[3][MAX_CORNERS] at
    cdef double[4] below
    cdef int count, k
    for k in range(4):
        below[k] = value[k] - top
    count = clipped(half, direction, far, below, at)
    return top + fan_integral(count, at) / (4.0 * half * half)


cdef inline double mean_bound(
    int count, const double* one, const double* other, double best
) noexcept nogil:
    """Return the least, over all weighted means of two moves, of the greatest value at the
    corners, or `best` where that is less: at an end or where the lines of two corners cross."""
    cdef double share, rise, highest, value
    cdef int k, j, c
    for k in range(count):
        for j in range(k):
            rise = (one[k] - other[k]) - (one[j] - other[j])
            if rise == 0.0:
                continue
            share = (other[j] - other[k]) / rise
            if not 0.0 < share < 1.0:
                continue
            highest = -math.INFINITY
            for c in range(count):
                value = other[c] + share * (one[c] - other[c])
                highest = max(highest, value)
            best = min(best, highest)
    return best


def heights_of_moves(moves: Floats, tools: Floats, points: Floats, grow: Floats):
    """Return (K,) the least height to which each move (K, 7), its tool (K, 4) begun `grow` (K,)
    farther out, cuts its point (K, 2); inf where it does not reach."""
    cdef double[:, ::1] columns = np.ascontiguousarray(moves, dtype=np.float64)
    cdef double[:, ::1] tool = np.ascontiguousarray(tools, dtype=np.float64)
    cdef double[:, ::1] at = np.ascontiguousarray(points, dtype=np.float64)
    cdef double[::1] more = np.ascontiguousarray(grow, dtype=np.float64)
    cdef Py_ssize_t k, count = columns.shape[0]
    cdef double[::1] heights = np.empty(count)
    with nogil:
        for k in range(count):
            heights[k] = height_of(&columns[k, 0], &tool[k, 0], at[k, 0], at[k, 1], more[k])
    return np.asarray(heights)


def thinned(points: Floats, row: Ints, start: Floats, double tolerance):
    """Return (J,) the samples to keep of points (K, 3) of the rows (K,): the last one of each row,
    and so many between that every sample lies within `tolerance` of the straight move between
    those kept before and behind it. `start` (3,): the place before the first sample.

    From each kept sample the move is extended to twice the length again and again, as long as all
    samples between lie beside it; then the last doubling is bisected.
    """
    cdef double[:, ::1] at = np.ascontiguousarray(np.concatenate([start[None], points]))
    cdef Int[::1] of = np.ascontiguousarray(row, dtype=np.int64)
    cdef Py_ssize_t count = of.shape[0], anchor = 0, end, good, span, count_kept = 0, last
    cdef Int[::1] rows = np.empty(count, dtype=np.int64)
    with nogil:
        end = 0
        while anchor < count:
            # Sample k stands in row k + 1 of `at`; samples anchor to end - 1 are of one row.
            if end <= anchor:
                end = anchor + 1
                while end < count and of[end] == of[anchor]:
                    end += 1
            good, span = anchor + 1, 2
            while good < end:
                last = min(anchor + span, end)
                if not lies_beside(at, anchor, last, tolerance):
                    break
                good, span = last, 2 * span
            last = min(anchor + span, end)
            while last - good > 1:
                span = (good + last) // 2
                if lies_beside(at, anchor, span, tolerance):
                    good = span
                else:
                    last = span
            rows[count_kept] = good - 1
            count_kept += 1
            anchor = good
    return np.asarray(rows[:count_kept])


cdef inline bint lies_beside(
    double[:, ::1] at, Py_ssize_t begin, Py_ssize_t end, double tolerance
) noexcept nogil:
    """Return True if all points between two lie within `tolerance` of the line from one to the
    other."""
    cdef double[3] direction
    cdef double[3] off
    cdef double square = 0.0, share, distance
    cdef Py_ssize_t k
    cdef int c
    for c in range(3):
        direction[c] = at[end, c] - at[begin, c]
        square += direction[c] * direction[c]
    for k in range(begin + 1, end):
        share = 0.0
        for c in range(3):
            off[c] = at[k, c] - at[begin, c]
            share += off[c] * direction[c]
        share = min(max(share / square, 0.0), 1.0) if square > 0.0 else 0.0
        distance = 0.0
        for c in range(3):
            distance += (off[c] - share * direction[c]) * (off[c] - share * direction[c])
        if distance > tolerance * tolerance:
            return False
    return True


def _nodes(moves: Floats, tool: Ints, number: Ints, tools: Floats) -> tuple[Floats, Ints]:
    """Return the nodes of all levels, and where each level begins, with the end of the last."""
    count = len(moves)
    if not count:
        return np.empty((0, NODE_COLUMNS)), np.zeros(1, dtype=np.int64)
    end_x = moves[:, AX] + moves[:, UX] * moves[:, LONG]
    end_y = moves[:, AY] + moves[:, UY] * moves[:, LONG]
    level = np.column_stack(
        [
            np.minimum(moves[:, AX], end_x),
            np.minimum(moves[:, AY], end_y),
            np.maximum(moves[:, AX], end_x),
            np.maximum(moves[:, AY], end_y),
            moves[:, AZ] + np.minimum(moves[:, SLOPE] * moves[:, LONG], 0.0),
            tools[tool, RADIUS],
            number,
            tool,
            tool,
        ]
    )
    parts, begins, total = [], [0], 0
    while True:
        first = np.arange(0, len(level), FAN)
        low = np.minimum.reduceat(level, first)
        high = np.maximum.reduceat(level, first)
        level = np.column_stack(
            [low[:, :2], high[:, 2:4], low[:, 4], high[:, 5], low[:, 6:8], high[:, 8]]
        )
        parts.append(level)
        total += len(level)
        begins.append(total)
        if len(level) == 1:
            return np.ascontiguousarray(np.concatenate(parts)), np.array(begins, dtype=np.int64)
