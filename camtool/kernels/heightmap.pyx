"""Height maps of the stock: straight moves of a tool cut a grid of heights.

A cell is cut to the least of z + profile(distance) over the moves, at its centre. Along a move of
length L that rises by m for each millimetre, let `along` be the foot of the centre on the move's
line and a its distance from it. The tip at s leaves z(s) + profile(√(a² + (along − s)²)), which is
convex in s (`camtool.stock.cutters`), so its least value lies at

    s = along − u sign(m),  clipped to 0 … L and to where the tool covers the centre,

with u where the profile rises as steeply as the move. For a level move u is 0, and the distance
is that from the segment: along a row of cells it is √(c² + (p + q i)²) in each of three parts.

      flat      u = √(R² − a²): the rim
      cone      u = a |m| / √(rise² − m²), no less than √(flat² − a²), no more than the rim
      ball      u = √((r² − a²) m² / (1 + m²))
      bull      by Newton's steps in a bracket, the last one below NEAR_SHARE of the corner: u errs
                by about the square of that, the height by the square of the error; where moves
                are not very gentle, from a table for each move by √(R² − a²), with u linear
                between its rows: the height errs by less than 1e-6 mm

A move that begins where the one before ended, with the same tool, cuts nothing new behind its
start: these cells are left out. The move before leaves out the cells beyond its end, except these.
Loops hold no state but the heights, so equal moves give equal bytes on every processor.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int
from camtool.kernels.wide cimport wide


cdef enum:
    RADIUS, FLAT, CORNER, RISE
    MAX_STEPS = 60
    ROWS = 128  # of the table of a sloping bull nose


cdef double LEVEL_MM = 1e-7  # a smaller change of height is none
cdef double SHORT_MM = 1e-9  # a shorter move is a plunge
cdef double NEAR_SHARE = 3e-4
cdef double GENTLE_SHARE = 0.01  # where slope · flat is less of the corner, no table is exact enough


cdef struct Cutter:
    double radius, flat, corner, rise
    double reach  # distance up to which the move in hand can cut below the top
    double* table  # of a bull nose on it: the u by √(R² − a²); NULL without


cdef struct Move:
    # Start, direction and length in the plane, slope; cells whose foot lies before `skip` are cut
    # by the move before, as `joined` ones are.
    double ax, ay, az, ux, uy, run, slope, skip
    bint joined


cdef struct Row:
    # A row of cells; the centre of cell i lies at x0 + i · cell. `owner` is NULL where not wanted.
    float* height
    int* owner
    double x0, cell
    int move


cpdef void cut_heights(
    float[:, ::1] heights, int[:, ::1] owner, tuple origin, double[:, ::1] starts,
    double[:, ::1] ends, Int[::1] tool, double[:, ::1] cutters, Int first
) noexcept:
    """Lower `heights` (NY, NX) to what the moves leave; row 0 is the lowest in Y.

    `origin`: x and y, mm, of the centre of cell (0, 0), and the width of a cell. Moves run from
    `starts` (M, 3) to `ends` (M, 3), with the tool `tool` (M,) of `cutters` (T, 4), columns as
    `camtool.stock.cutters.CutterProfile.columns`. `owner` (NY, NX), or (0, 0), gets `first` plus
    the number of the move that cut a cell deepest, the earliest of several.
    """
    cdef double x0, y0, cell, low_y, high_y
    cdef Int k, ny, nx
    cdef bint keeps_owners, cuts, following_cuts
    cdef double[ROWS + 2] table
    cdef Cutter cutter, following_cutter
    cdef Move move, following
    cdef Row row
    x0, y0, cell = origin
    ny, nx = heights.shape[0], heights.shape[1]
    keeps_owners = owner.shape[0] > 0
    row.owner = NULL
    row.x0, row.cell = x0, cell
    cuts = _take(&move, &cutter, starts, ends, tool, cutters, 0)
    for k in range(tool.shape[0]):
        following.joined = False
        following_cuts = _take(&following, &following_cutter, starts, ends, tool, cutters, k + 1)
        if cuts:
            row.move = <int> (first + k)
            cutter.table = NULL
            if (
                cutter.flat > 0.0
                and abs(move.slope) * cutter.flat > GENTLE_SHARE * cutter.corner > 0.0
            ):
                cutter.table = table
                _tabulate(&cutter, abs(move.slope))
            low_y, high_y = move.ay, move.ay + move.run * move.uy
            low_y, high_y = min(low_y, high_y), max(low_y, high_y)
            low = _index(math.ceil((low_y - cutter.reach - y0) / cell), ny)
            high = _index(math.floor((high_y + cutter.reach - y0) / cell) + 1.0, ny)
            for j in range(low, high):
                row.height = &heights[j, 0]
                if keeps_owners:
                    row.owner = &owner[j, 0]
                if move.slope == 0.0:
                    _cut_level(&row, nx, &cutter, &move, &following, y0 + j * cell)
                else:
                    _cut_slope(&row, nx, &cutter, &move, &following, y0 + j * cell)
        move, cutter, cuts = following, following_cutter, following_cuts


cdef bint _take(
    Move* move, Cutter* cutter, double[:, ::1] starts, double[:, ::1] ends, Int[::1] tool,
    double[:, ::1] cutters, Int k
) noexcept:
    """Store move k and its cutter; return False if there is no such move or it cuts nothing."""
    cdef double dx, dy, dz
    if k >= tool.shape[0] or not _reaches(
        cutter, cutters, tool[k], min(starts[k, 2], ends[k, 2])
    ):
        return False
    move.ax, move.ay, move.az = starts[k, 0], starts[k, 1], starts[k, 2]
    dx, dy, dz = ends[k, 0] - move.ax, ends[k, 1] - move.ay, ends[k, 2] - move.az
    move.joined = k > 0 and tool[k] == tool[k - 1] and (
        ends[k - 1, 0] == move.ax and ends[k - 1, 1] == move.ay and ends[k - 1, 2] == move.az
    )
    move.run, move.ux, move.uy, move.slope = math.sqrt(dx * dx + dy * dy), 1.0, 0.0, 0.0
    if move.run >= SHORT_MM:
        move.ux, move.uy = dx / move.run, dy / move.run
    else:
        move.run = 0.0
    if move.run > 0.0 and abs(dz) > LEVEL_MM:
        move.slope = dz / move.run
    else:
        move.joined = move.joined and dz >= 0.0
        move.az = min(move.az, ends[k, 2])
    move.skip = _behind(cutter, move.slope) if move.joined else -math.INFINITY
    return True


cdef bint _reaches(Cutter* cutter, double[:, ::1] cutters, Int tool, double z) noexcept:
    """Store the cutter, and the distance from its axis within which it cuts below the top when its
    tip is at z; return False if it cuts nothing."""
    cdef double below
    cutter.radius, cutter.flat = cutters[tool, RADIUS], cutters[tool, FLAT]
    cutter.corner, cutter.rise = cutters[tool, CORNER], cutters[tool, RISE]
    cutter.reach = cutter.radius
    if not z < 0.0 or not cutter.radius > 0.0:
        return False
    if cutter.corner > 0.0:
        below = max(cutter.corner + z, 0.0)
        cutter.reach = cutter.flat + math.sqrt(cutter.corner * cutter.corner - below * below)
    elif cutter.rise > 0.0:
        cutter.reach = min(cutter.radius, cutter.flat - z / cutter.rise)
    return True


cdef double _behind(Cutter* cutter, double slope) noexcept:
    """Return the place along a joined move (mm, below 0: before its start) before which cells are
    cut deepest at its start; the move before has cut these already."""
    cdef double offset = cutter.radius
    if slope >= 0.0:
        return 0.0
    if cutter.corner > 0.0:
        offset = cutter.flat - slope / math.sqrt(1.0 + slope * slope) * cutter.corner
    elif -slope < cutter.rise:
        offset = max(
            cutter.flat,
            -slope / math.sqrt(cutter.rise * cutter.rise - slope * slope) * cutter.radius,
        )
    return -min(offset, cutter.radius)


cdef inline Int _index(double place, Int count) noexcept:
    """Return the number of a cell, limited to 0 … count; 0 for NaN."""
    if not place > 0.0:
        return 0
    return count if place >= count else <Int> place


cdef inline Int _from(Row* row, Int nx, double x) noexcept:
    """Return the first cell whose centre is not to the left of x."""
    return _index(math.ceil((x - row.x0) / row.cell), nx)


cdef (double, double) _span(
    double ax, double ay, double run, double ux, double uy, double y, double reach
) noexcept:
    """Return the part of the line at height y that lies within `reach` of a move; (inf, −inf) if
    there is none."""
    cdef double left, right, half, off, low, high
    left, right = math.INFINITY, -math.INFINITY
    off = y - ay
    if abs(off) <= reach:
        half = math.sqrt(reach * reach - off * off)
        left, right = ax - half, ax + half
    off = y - (ay + run * uy)
    if abs(off) <= reach:
        half = math.sqrt(reach * reach - off * off)
        left, right = min(left, ax + run * ux - half), max(right, ax + run * ux + half)
    if uy != 0.0:  # the two sides: where they begin and end beside the ends
        # Points of the sides: a ± reach · (−uy, ux) + s · u; at height y this is one s each.
        low, high = y - ay - reach * ux, y - ay + reach * ux
        if 0.0 <= low / uy <= run:
            half = ax - reach * uy + low / uy * ux
            left, right = min(left, half), max(right, half)
        if 0.0 <= high / uy <= run:
            half = ax + reach * uy + high / uy * ux
            left, right = min(left, half), max(right, half)
    return left, right


cdef void _cut_level(
    Row* row, Int nx, Cutter* cutter, Move* move, Move* following, double y
) noexcept:
    """Cut a row of cells by a level move; of a joined move, only the cells before its start."""
    cdef double left, right, half, off, x, bx, by, other
    cdef double ax = move.ax, ay = move.ay, z = move.az, run = move.run
    cdef double ux = move.ux, uy = move.uy
    cdef bint joined = move.joined
    cdef Int low, high, begin, end
    left, right = _span(ax, ay, run, ux, uy, y, cutter.reach)
    low, high = _from(row, nx, left), _from(row, nx, right)
    if left > right or low >= high:
        return
    if cutter.corner == 0.0 and cutter.rise == 0.0:
        off = y - ay
        if not joined or abs(off) >= cutter.reach:
            _lower_flat(row, low, high, z)
            return
        half = math.sqrt(cutter.reach * cutter.reach - off * off)
        _lower_flat(row, low, _from(row, high, ax - half), z)
        _lower_flat(row, max(low, _from(row, high, ax + half)), high, z)
        return
    # The cells begin … end have their feet between the ends of the move.
    bx, by = ax + run * ux, ay + run * uy
    begin, end = low, high
    if abs(ux) > SHORT_MM:
        x = ax - (y - ay) * uy / ux
        other = x + run / ux
        begin = max(low, _from(row, high, min(x, other)))
        end = max(begin, _from(row, high, max(x, other)))
        if ux < 0.0:
            if not joined:
                _lower(row, end, high, cutter, z, y - ay, row.x0 - ax, row.cell)
            _lower_end(row, low, begin, cutter, z, bx, by, following, y)
        else:
            if not joined:
                _lower(row, low, begin, cutter, z, y - ay, row.x0 - ax, row.cell)
            _lower_end(row, end, high, cutter, z, bx, by, following, y)
    elif (y - ay) * uy < 0.0:
        if not joined:
            _lower(row, low, high, cutter, z, y - ay, row.x0 - ax, row.cell)
        return
    elif (y - ay) * uy > run:
        _lower_end(row, low, high, cutter, z, bx, by, following, y)
        return
    _lower(row, begin, end, cutter, z, 0.0, (y - ay) * ux - (row.x0 - ax) * uy, -row.cell * uy)


cdef void _lower_end(
    Row* row, Int low, Int high, Cutter* cutter, double z, double bx, double by, Move* following,
    double y
) noexcept:
    """Lower the cells low:high beyond the end (bx, by) of a move, except those, to within a cell,
    that the following move, which starts there, cuts as deep."""
    cdef double off = (y - following.ay) * following.uy, x
    # A flat tool on a level move leaves out all that lies round its start.
    cdef bint is_left = following.joined and (
        following.slope != 0.0 or cutter.corner > 0.0 or cutter.rise > 0.0
    )
    if is_left and abs(following.ux) > SHORT_MM:
        x = following.ax + (following.skip - off) / following.ux
        if following.ux > 0.0:
            high = min(high, _from(row, high, x) + 1)
        else:
            low = max(low, _from(row, high, x) - 1)
    elif is_left and off >= following.skip:
        return
    _lower(row, low, high, cutter, z, y - by, row.x0 - bx, row.cell)


cdef void _lower_flat(Row* row, Int low, Int high, double z) noexcept:
    """Lower the cells low:high to z."""
    cdef float* height = row.height
    cdef int* owner = row.owner
    cdef float cut = <float> z
    cdef int move = row.move
    cdef Int i
    if owner != NULL:
        for i in range(low, high):
            owner[i] = move if cut < height[i] else owner[i]
            height[i] = cut if cut < height[i] else height[i]
    else:
        for i in range(low, high):
            height[i] = cut if cut < height[i] else height[i]


cdef wide _lower(
    Row* row, Int low, Int high, Cutter* cutter, double z, double c, double p, double q
) noexcept:
    """Lower the cells low:high to z plus the profile at the distance √(c² + (p + q i)²)."""
    cdef float* height = row.height
    cdef int* owner = row.owner
    cdef int move = row.move
    cdef double corner = cutter.corner, flat = cutter.flat, rise = cutter.rise
    cdef double square = corner * corner, d, w
    cdef double cc = c * c
    cdef float cut
    cdef int i, begin = <int> low, stop = <int> high
    if corner > 0.0 and flat == 0.0:
        for i in range(begin, stop):
            d = p + q * i
            w = square - (cc + d * d)
            cut = <float> (z + corner - math.sqrt(w if w > 0.0 else 0.0))
            if owner != NULL:
                owner[i] = move if cut < height[i] else owner[i]
            height[i] = cut if cut < height[i] else height[i]
    elif corner > 0.0:
        for i in range(begin, stop):
            d = p + q * i
            w = math.sqrt(cc + d * d) - flat
            w = w if w > 0.0 else 0.0
            w = square - w * w
            cut = <float> (z + corner - math.sqrt(w if w > 0.0 else 0.0))
            if owner != NULL:
                owner[i] = move if cut < height[i] else owner[i]
            height[i] = cut if cut < height[i] else height[i]
    else:
        for i in range(begin, stop):
            d = p + q * i
            w = math.sqrt(cc + d * d) - flat
            cut = <float> (z + rise * (w if w > 0.0 else 0.0))
            if owner != NULL:
                owner[i] = move if cut < height[i] else owner[i]
            height[i] = cut if cut < height[i] else height[i]


cdef wide _cut_slope(
    Row* row, Int nx, Cutter* cutter, Move* move, Move* following, double y
) noexcept:
    """Cut a row of cells by a sloping move."""
    cdef double left, right, ahead, along, aside, square, rim, u, s, near = -1.0
    cdef double ux = move.ux, uy = move.uy, run = move.run, z = move.az, slope = move.slope
    cdef double radius = cutter.radius, flat = cutter.flat, corner = cutter.corner
    cdef double rise = cutter.rise, steep = abs(slope), ratio = math.INFINITY
    cdef double sign = 1.0 if slope > 0.0 else -1.0
    cdef float* height = row.height
    cdef int* owner = row.owner
    cdef double x0 = row.x0 - move.ax, cell = row.cell, off = y - move.ay, best
    cdef double end_x = move.ax + run * ux, end_y = move.ay + run * uy
    cdef float cut
    cdef int i, low, high, number = row.move
    left, right = _span(move.ax, move.ay, run, ux, uy, y, cutter.reach)
    if not left <= right:
        return
    low, high = <int> _from(row, nx, left), <int> _from(row, nx, right)
    # Cells whose foot lies beyond this place are cut deepest at the end.
    ahead = run - _behind(cutter, -slope)
    if abs(ux) > SHORT_MM:
        left, right = move.ax + (move.skip - off * uy) / ux, move.ax + (ahead - off * uy) / ux
        if ux > 0.0:
            low, i = max(low, <int> _from(row, high, left)), <int> _from(row, high, right)
            i = max(low, i)
            _lower_end(row, i, high, cutter, z + slope * run, end_x, end_y, following, y)
            high = i
        else:
            high, i = min(high, <int> _from(row, high, left) + 1), <int> _from(row, high, right)
            i = min(max(low, i), high)
            _lower_end(row, low, i, cutter, z + slope * run, end_x, end_y, following, y)
            low = i
    elif off * uy < move.skip:
        return
    elif off * uy > ahead:
        _lower_end(row, low, high, cutter, z + slope * run, end_x, end_y, following, y)
        return
    if corner > 0.0:
        ratio = steep / math.sqrt(1.0 + steep * steep)
    elif steep < rise:
        ratio = steep / math.sqrt(rise * rise - steep * steep)
    if corner > 0.0 and flat == 0.0 or corner == 0.0 and rise == 0.0:
        # A ball, or a flat tool, whose ratio is 1. In one branch, and so several cells at once.
        ratio = sign * ratio if corner > 0.0 else sign
        for i in range(low, high):
            along = (x0 + i * cell) * ux + off * uy
            aside = off * ux - (x0 + i * cell) * uy
            square = radius * radius - aside * aside
            square = square if square > 0.0 else 0.0
            s = along - ratio * math.sqrt(square)
            s = s if s > 0.0 else 0.0
            s = s if s < run else run
            square = square - (along - s) * (along - s)
            square = square if square > 0.0 and corner > 0.0 else 0.0
            cut = <float> (z + slope * s + corner - math.sqrt(square))
            if owner != NULL:
                owner[i] = number if cut < height[i] else owner[i]
            height[i] = cut if cut < height[i] else height[i]
        return
    if cutter.table != NULL:
        _lower_bull(row, low, high, cutter, z, run, ux, uy, slope, x0, off)
        return
    for i in range(low, high):
        along = (x0 + i * cell) * ux + off * uy
        aside = off * ux - (x0 + i * cell) * uy
        square = aside * aside
        rim = math.sqrt(max(radius * radius - square, 0.0))
        if corner > 0.0:
            best = z + slope * min(max(along - sign * rim, 0.0), run) + _profile(cutter, square)
            if best >= height[i]:  # no place on the move could cut it deeper
                continue
            u = near = _bull(corner, flat, steep, square, rim, near)
        else:
            u = ratio * abs(aside) if ratio < math.INFINITY else rim
            if square < flat * flat:
                u = max(u, math.sqrt(flat * flat - square))
            u = min(u, rim)
        s = min(max(along - sign * u, 0.0), run)
        u = along - s
        cut = <float> (z + slope * s + _profile(cutter, square + u * u))
        if cut < height[i]:
            height[i] = cut
            if owner != NULL:
                owner[i] = number


cdef wide _lower_bull(
    Row* row, int low, int high, Cutter* cutter, double z, double run, double ux, double uy,
    double slope, double x0, double off
) noexcept:
    """Lower the cells low:high by a bull nose on a sloping move, several cells at once."""
    cdef float* height = row.height
    cdef int* owner = row.owner
    cdef double* table = cutter.table
    cdef double flat = cutter.flat, corner = cutter.corner, radius = cutter.radius
    cdef double corner2 = corner * corner, radius2 = radius * radius, cell = row.cell
    cdef double sign = 1.0 if slope > 0.0 else -1.0, scale = ROWS / radius
    cdef double along, aside, square, place, s, w
    cdef float cut
    cdef int i, k, move = row.move
    for i in range(low, high):
        along = (x0 + i * cell) * ux + off * uy
        aside = off * ux - (x0 + i * cell) * uy
        square = aside * aside
        place = radius2 - square
        place = scale * math.sqrt(place if place > 0.0 else 0.0)
        k = <int> place
        s = along - sign * (table[k] + (place - k) * (table[k + 1] - table[k]))
        s = s if s > 0.0 else 0.0
        s = s if s < run else run
        w = math.sqrt(square + (along - s) * (along - s)) - flat
        w = w if w > 0.0 else 0.0
        w = corner2 - w * w
        cut = <float> (z + slope * s + corner - math.sqrt(w if w > 0.0 else 0.0))
        if owner != NULL:
            owner[i] = move if cut < height[i] else owner[i]
        height[i] = cut if cut < height[i] else height[i]


cdef void _tabulate(Cutter* cutter, double steep) noexcept:
    """Fill the table (ROWS + 2,) of a bull nose: its u where √(R² − a²) is k R / ROWS."""
    cdef double rim, radius = cutter.radius, near = 0.0, before = 0.0
    cdef int k
    for k in range(ROWS + 1):
        rim = radius * k / ROWS
        cutter.table[k] = _bull(
            cutter.corner, cutter.flat, steep, radius * radius - rim * rim, rim, 2.0 * near - before
        )
        before, near = near, cutter.table[k]
    cutter.table[ROWS + 1] = near


cdef inline double _profile(Cutter* cutter, double square) noexcept:
    """Return the height of the tool's surface over its tip at the distance √square from the axis,
    within its radius."""
    cdef double w = max(math.sqrt(square) - cutter.flat, 0.0)
    if cutter.corner > 0.0:
        w = max(cutter.corner * cutter.corner - w * w, 0.0)
        return cutter.corner - math.sqrt(w)
    return w * cutter.rise


cdef double _bull(
    double corner, double flat, double steep, double square, double rim, double near
) noexcept:
    """Return the distance u along the move at which a bull nose is as steep as the move: w u =
    steep · d · q, with d² = a² + u², w = d − flat and q² = corner² − w². `near`: the first
    guess."""
    cdef double low, high, u, d, w, q, off, rate, estimate
    cdef int k
    low = math.sqrt(max(flat * flat - square, 0.0))
    high = max(rim, low)
    u = near if low < near < high else 0.5 * (low + high)
    for k in range(MAX_STEPS):
        d = math.sqrt(square + u * u)
        w = max(d - flat, 0.0)
        q = math.sqrt(max(corner * corner - w * w, 0.0))
        off = w * u - steep * d * q
        if off < 0.0:
            low = u
        else:
            high = u
        rate = w + u * u / d - steep * u * (q / d - w / q)
        estimate = u - off / rate
        if not low < estimate < high:  # NaN as well
            estimate = 0.5 * (low + high)
        if abs(estimate - u) <= NEAR_SHARE * corner:
            return estimate
        u = estimate
    return u


cpdef void project(
    float[:, ::1] heights, tuple grid, tuple camera, double wall, int[:, ::1] cell,
    float[:, ::1] level
) noexcept:
    """Find the cell that each pixel shows, seen from afar along one direction.

    `grid`: x and y, mm, of the centre of cell (0, 0) of `heights` (NY, NX), and the width of a
    cell. `camera`: the horizontal direction of the view (fx, fy) of length 1, the sine and the
    cosine of its elevation, the picture's u and v, mm, in the middle of pixel (0, 0), and mm from
    pixel to pixel. On the picture u = x fy − y fx and v = z cosine + (x fx + y fy) sine. `cell`
    (H, W) gets the number of the cell, NX · row + column, or −1 beside the map; for a point of a
    wall, higher than `wall` mm, ~(the number of the cell before it). `level` (H, W) gets the
    height of the point, mm. Row 0 is the lowest.

    Each column of pixels is a walk away from the viewer, from cell to cell; a cell is visible
    where it is higher on the picture than all before it.
    """
    cdef double x0, y0, size, fx, fy, sine, cosine, u0, v0, pixel, u, t, last, next_x, next_y
    cdef double foot, low, high, before, z
    cdef Int ny, nx, i, j, row, rows, column, cell_before, cell_of, row_end, until
    x0, y0, size = grid
    fx, fy, sine, cosine, u0, v0, pixel = camera
    ny, nx = heights.shape[0], heights.shape[1]
    x0, y0 = x0 - 0.5 * size, y0 - 0.5 * size
    rows = cell.shape[0]
    for column in range(cell.shape[1]):
        for row in range(rows):
            cell[row, column] = -1
            level[row, column] = 0.0
        u = u0 + column * pixel
        # The walk is at u (fy, −fx) + t (fx, fy), within the map between t and last.
        t, last = -math.INFINITY, math.INFINITY
        t, last = _within(u * fy, fx, x0, x0 + nx * size, t, last)
        t, last = _within(-u * fx, fy, y0, y0 + ny * size, t, last)
        if not t < last:
            continue
        i = _index((u * fy + t * fx - x0) / size, nx - 1)
        j = _index((t * fy - u * fx - y0) / size, ny - 1)
        row_end, cell_before = 0, -1  # pixels below `row_end` are seen already
        before = 0.0
        while t < last and 0 <= i < nx and 0 <= j < ny:
            cell_of = j * nx + i
            z = heights[j, i]
            # Where the walk leaves the cell.
            next_x = _border(x0, size, i, fx, u * fy)
            next_y = _border(y0, size, j, fy, -u * fx)
            foot = t * sine
            t = max(t, min(next_x, next_y, last))
            low = (foot + z * cosine - v0) / pixel
            high = (t * sine + z * cosine - v0) / pixel
            if cell_before >= 0 and z > before:  # what rises between the cell before and this one
                until = _index(math.ceil(low), rows)
                for row in range(row_end, until):
                    cell[row, column] = ~<int> cell_before if z - before > wall else <int> cell_of
                    level[row, column] = <float> min(
                        max((v0 + row * pixel - foot) / cosine, before), z
                    )
                row_end = max(row_end, until)
            elif cell_before < 0:
                row_end = _index(math.ceil(low), rows)
            until = _index(math.ceil(high), rows)
            for row in range(row_end, until):
                cell[row, column] = <int> cell_of
                level[row, column] = <float> z
            row_end = max(row_end, until)
            cell_before, before = cell_of, z
            if next_x <= next_y:
                i += 1 if fx > 0.0 else -1
            else:
                j += 1 if fy > 0.0 else -1


cdef inline double _border(double first, double size, Int k, double rate, double start) noexcept:
    """Return the t at which start + t · rate leaves the cell k; inf if it never does."""
    if abs(rate) < 1e-12:
        return math.INFINITY
    return (first + (k + 1 if rate > 0.0 else k) * size - start) / rate


cdef (double, double) _within(
    double start, double rate, double low, double high, double first, double last
) noexcept:
    """Return the part of the interval first … last in which start + t · rate lies between low and
    high."""
    cdef double one, other
    if abs(rate) < 1e-12:
        return (first, last) if low <= start < high else (1.0, 0.0)
    one, other = (low - start) / rate, (high - start) / rate
    return max(first, min(one, other)), min(last, max(one, other))
