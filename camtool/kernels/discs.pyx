"""The largest disc in a region that touches its boundary at a given point.

A boundary element starts at A with the unit tangent T and the inner normal N (T turned by +90°),
and turns by `sweep` along its `length`; its curvature is κ = sweep / length. One of no length is
a reflex corner: there the normal turns while the point stays. The function

    g(p) = N·(p − A) − κ/2 |p − A|²

is 0 on the element's line or circle, positive on its inner side, and its gradient m has the
length 1 there. A disc that touches the boundary at p with the inner normal n, and whose middle
is p + ρ n, touches that line or circle too when

    ρ = g(p) / (1 − n·m(p)),          and a point q when   ρ = |q − p|² / (2 n·(q − p)).

Exact: the least of these over all elements whose touching point is theirs is the radius. Blocks
of elements are left out by their true distance only: a disc of radius ρ ends 2ρ from p.

Neighbours: two elements that join smoothly are never touched by one disc of the region (their
circles touch each other already, one within the other or on two sides of their tangent), so a
smooth neighbour is left out, and with it the quotient 0/0. A neighbour behind a reflex corner
counts only where p is clearly on its inner side.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

from camtool.arrays import Floats, Ints

Place = tuple[float, float, float, float, float, float]
"""A point x, y, its inner normal, and the point as seen from the nearer end of its element."""

cpdef enum:
    # Columns of an element: its start, tangent there, length, sweep, end, and tangent there.
    AX = 0, AY, TX, TY, LENGTH, SWEEP, BX, BY, UX, UY
    # How an element is joined to the one before it.
    SMOOTH = 0, CONVEX, REFLEX
    # Elements that are left out together.
    BLOCK = 16


# Nearer than this a neighbour behind a reflex corner is not seen, and touching points may be off
# the ends of an element by this, and by as much as the turn of a smooth joint moves them.
cdef double TOUCH_MM = 1e-9

# A convex corner that turns by less is none: a disc of radius ρ reaches ρ/8 · turn² less far.
cdef double _SMOOTH_RAD = 1e-5
SMOOTH_RAD = _SMOOTH_RAD


cpdef void largest_discs(
    boundary, Int[::1] row, double[::1] t, Int[:, ::1] guess, double[:, ::1] result,
    Int[::1] partner
) noexcept:
    """Fill `result` (N, 4) with the largest discs: x, y of the centre, radius, and the fraction (0
    … 1) of the second element at which the disc touches it; and `partner` (N,) with that element.

    `boundary` is the table (E, 10) as the columns say; links (E, 3): the element before and
    behind, and the joint to the one before; boxes (⌈E/BLOCK⌉, 4). Disc i touches the element
    row[i] at the fraction t[i] of its length, or of its turn. `guess` (N, 2): elements that may be
    the partner, tried first. A disc that touches only its own arc, in whose centre it lies, has
    itself as partner.
    """
    cdef (double, double, double, double, double, double) pose
    cdef Int k, own, corner, best
    cdef Int[:, ::1] links
    cdef double x, y, nx, ny, sx, sy, radius
    cdef double[:, ::1] table, boxes
    table, links, boxes = boundary
    for k in range(len(row)):
        own = row[k]
        x, y, nx, ny = frame(table, own, t[k])
        corner = _at_convex_corner(links, own, t[k])
        if corner >= 0:
            result[k, 0], result[k, 1], result[k, 2] = x, y, 0.0
            result[k, 3] = 1.0 - t[k]
            partner[k] = corner
            continue
        if t[k] < 0.5:
            sx, sy = _from_corner(table[own, TX], table[own, TY], table, own, t[k])
        else:
            sx, sy = _from_corner(-table[own, UX], -table[own, UY], table, own, t[k] - 1.0)
        pose = (x, y, nx, ny, sx, sy)
        radius, best = _largest(
            table, links, boxes, own, guess[k, 0], guess[k, 1], pose, t[k] < 0.5
        )
        cx, cy = x + radius * nx, y + radius * ny
        result[k, 0], result[k, 1], result[k, 2] = cx, cy, radius
        result[k, 3] = _place(table, best, cx, cy)
        partner[k] = best


cpdef (double, double, double, double) frame(double[:, ::1] table, Int own, double t) noexcept:
    """Return the point x, y of an element at the fraction t of it, and the inner normal there."""
    cdef double chord, half
    tx, ty, length = table[own, TX], table[own, TY], table[own, LENGTH]
    turned = table[own, SWEEP] * t
    sine, cosine = math.sin(turned), math.cos(turned)
    nx, ny = -ty * cosine - tx * sine, tx * cosine - ty * sine
    if t == 1.0:
        return table[own, BX], table[own, BY], nx, ny
    chord = length * t
    half = 0.5 * turned
    if half != 0.0:
        chord *= math.sin(half) / half
    hc, hs = math.cos(half), math.sin(half)
    x = table[own, AX] + chord * (tx * hc - ty * hs)
    y = table[own, AY] + chord * (ty * hc + tx * hs)
    return x, y, nx, ny


cdef (double, double) _from_corner(
    double tx, double ty, double[:, ::1] table, Int own, double t
) noexcept:
    """Return a point of an element relative to its start (t > 0), or relative to its end (t < 0,
    and t_x, t_y the direction back from there): without the rounding of far coordinates."""
    cdef double half, chord
    half = 0.5 * table[own, SWEEP] * t
    chord = table[own, LENGTH] * abs(t)
    if half != 0.0:
        chord *= math.sin(half) / half
    cosine, sine = math.cos(half), math.sin(half)
    return chord * (tx * cosine - ty * sine), chord * (ty * cosine + tx * sine)


cdef Int _at_convex_corner(Int[:, ::1] links, Int own, double t) noexcept:
    """Return the other element of the convex corner at which the point lies; −1 elsewhere."""
    if t == 0.0 and links[own, 2] == CONVEX:
        return int(links[own, 0])
    if t == 1.0 and links[links[own, 1], 2] == CONVEX:
        return int(links[own, 1])
    return -1


cdef (double, Int) _largest(
    double[:, ::1] table, Int[:, ::1] links, double[:, ::1] boxes, Int own, Int guess,
    Int other_guess, (double, double, double, double, double, double) pose, bint at_start
) noexcept:
    """Return the radius of the largest disc at a point with its normal, and the element that
    limits it."""
    cdef Int neighbour, home, turn, block, best
    cdef double x, y, radius, limit, dx, dy
    x, y = pose[0], pose[1]
    radius, best = math.INFINITY, own
    if table[own, LENGTH] > 0.0 and table[own, SWEEP] > 0.0:
        radius = table[own, LENGTH] / table[own, SWEEP]
    for turn in range(2):
        neighbour = guess if turn == 0 else other_guess
        if neighbour != own:
            limit = _limit(table, links, own, neighbour, pose, radius, at_start)
            if limit < radius:
                radius, best = limit, neighbour
    home = own // BLOCK
    for turn in range(len(boxes)):
        block = (home + turn) % len(boxes)
        dx = max(boxes[block, 0] - x, 0.0, x - boxes[block, 2])
        dy = max(boxes[block, 1] - y, 0.0, y - boxes[block, 3])
        if math.hypot(dx, dy) > 2.0 * radius:
            continue
        for neighbour in range(block * BLOCK, min((block + 1) * BLOCK, len(table))):
            if neighbour == own:
                continue
            limit = _limit(table, links, own, neighbour, pose, radius, at_start)
            if limit < radius:
                radius, best = limit, neighbour
    return radius, best


cdef double _limit(
    double[:, ::1] table, Int[:, ::1] links, Int own, Int neighbour,
    (double, double, double, double, double, double) pose, double radius, bint at_start
) noexcept:
    """Return the radius to which the element `neighbour` limits the disc; inf where it does not,
    or not below `radius`."""
    cdef (double, double) turns
    cdef (double, double, double, double) sight
    cdef bint precedes, follows, corner, as_point
    cdef double limit
    wx, wy = pose[0] - table[neighbour, AX], pose[1] - table[neighbour, AY]
    precedes, follows = links[own, 0] == neighbour, links[own, 1] == neighbour
    limit = math.INFINITY
    # Its corner, or the smooth joint at its start, as a point; not one of our own ends.
    corner = table[neighbour, LENGTH] == 0.0
    ahead = -(pose[2] * wx + pose[3] * wy)
    if (
        (corner or links[neighbour, 2] == SMOOTH)
        and not (follows or (precedes and corner))
        and ahead > 0.0
    ):
        limit = 0.5 * (wx * wx + wy * wy) / ahead
    if corner:
        return limit
    if (precedes and links[own, 2] == SMOOTH) or (follows and links[neighbour, 2] == SMOOTH):
        return math.INFINITY
    if table[own, LENGTH] == 0.0 and (precedes or follows):
        return math.INFINITY
    tx, ty = table[neighbour, TX], table[neighbour, TY]
    tilt = _turn(table, links, own if at_start else links[own, 1])
    turns = tilt + _turn(table, links, neighbour), tilt + _turn(table, links, links[neighbour, 1])
    upper = min(radius, limit)
    # A neighbour behind a convex corner is seen from that corner.
    if precedes and at_start and links[own, 2] == CONVEX:
        sight = (table[neighbour, UX], table[neighbour, UY], pose[4], pose[5])
        return min(limit, _touching(table, neighbour, sight, pose, upper, -1.0, turns))
    if follows and not at_start and links[neighbour, 2] == CONVEX:
        sight = (tx, ty, pose[4], pose[5])
        return min(limit, _touching(table, neighbour, sight, pose, upper, -1.0, turns))
    min_distance = _min_distance(table, links, own, neighbour)
    return min(
        limit,
        _touching(table, neighbour, (tx, ty, wx, wy), pose, upper, min_distance, turns),
    )


cdef double _turn(double[:, ::1] table, Int[:, ::1] links, Int own) noexcept:
    """Return the angle, rad, by which a smooth joint to the element before turns in fact; 0 at
    other joints."""
    cdef Int previous
    if links[own, 2] != SMOOTH:
        return 0.0
    previous = links[own, 0]
    ux, uy = table[previous, UX], table[previous, UY]
    return float(abs(ux * table[own, TY] - uy * table[own, TX]))


cdef double _min_distance(
    double[:, ::1] table, Int[:, ::1] links, Int own, Int neighbour
) noexcept:
    """Return the distance, mm, from `neighbour` above which a point counts as on its inner side:
    0, or more if a reflex corner lies between."""
    cdef Int previous, following
    cdef bint is_over
    previous, following = links[own, 0], links[own, 1]
    is_over = (table[previous, LENGTH] == 0.0 and links[previous, 0] == neighbour) or (
        table[following, LENGTH] == 0.0 and links[following, 1] == neighbour
    )
    return TOUCH_MM if is_over else 0.0


cdef double _touching(
    double[:, ::1] table, Int own, (double, double, double, double) sight,
    (double, double, double, double, double, double) pose, double radius, double min_distance,
    (double, double) turns
) noexcept:
    """Return the radius at which the disc touches the line or arc `own` between its ends; inf if
    it touches beyond the ends or the radius is not below `radius`.

    `sight`: the tangent at a point of the element, and the disc's point of contact relative to
    that point. With `min_distance` below 0 that is a shared corner, and rounding may not hide the
    element. Nor may it hide one that is touched at its end: beside an arc the disc at the joint
    touches what follows the arc just there, and without it would seem to have room far beyond the
    arc's own radius.
    """
    cdef bint is_past_start, is_before_end
    cdef double g, reach
    tx, ty, wx, wy = sight
    kappa = table[own, SWEEP] / table[own, LENGTH]
    g = wy * tx - wx * ty - 0.5 * kappa * (wx * wx + wy * wy)
    if min_distance < 0.0:
        g = max(g, 0.0)
    elif g <= min_distance:
        return math.INFINITY
    mx, my = -ty - kappa * wx, tx - kappa * wy
    # 1 − n·m without cancellation: |n − m|²/2 + (1 − |m|²)/2, and |m|² = 1 − 2κg.
    ex, ey = pose[2] - mx, pose[3] - my
    below = 0.5 * (ex * ex + ey * ey) + kappa * g
    if below <= 0.0 or g >= radius * below:
        return math.INFINITY
    reach = g / below
    cx, cy = pose[0] + reach * pose[2], pose[1] + reach * pose[3]
    past_start = (cx - table[own, AX]) * table[own, TX] + (cy - table[own, AY]) * table[own, TY]
    past_end = (cx - table[own, BX]) * table[own, UX] + (cy - table[own, BY]) * table[own, UY]
    is_past_start = past_start >= -TOUCH_MM - turns[0] * reach
    is_before_end = past_end <= TOUCH_MM + turns[1] * reach
    return reach if is_past_start and is_before_end else math.INFINITY


cdef double _place(double[:, ::1] table, Int element, double cx, double cy) noexcept:
    """Return the fraction of an element at which a disc with this centre touches it."""
    wx, wy = cx - table[element, AX], cy - table[element, AY]
    tx, ty, length, sweep = (
        table[element, TX],
        table[element, TY],
        table[element, LENGTH],
        table[element, SWEEP],
    )
    if length > 0.0 and sweep == 0.0:
        part = (wx * tx + wy * ty) / length
    else:
        along, across = wx * tx + wy * ty, wy * tx - wx * ty
        if length == 0.0:  # the direction from the corner to the middle, off the first normal
            turned = math.atan2(-along, across)
        else:  # and that from the centre to the foot, off the one to the start
            kappa = sweep / length
            turned = math.atan2(kappa * along, 1.0 - kappa * across)
        part = turned / sweep
    return float(min(max(part, 0.0), 1.0))
