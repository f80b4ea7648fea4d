"""Offsets of paths of lines and arcs: trees of boxes, distances, meetings, slices and loops.

Arrays in, arrays out. Comments above each part say what it does.
"""

from __future__ import annotations

from libc cimport math
from libc.stdint cimport uint8_t
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Bools, Floats, Ints

# A binary tree of boxes over rows in their order: what is far away is left out at once.
#
# Nodes are in heap order, the root is 1; node i has the children 2i and 2i + 1, and each leaf
# holds `LEAF` rows that follow each other. Along a path neighbours in the list are neighbours in
# the plane, so no row needs to be moved; over paths that surround each other stands a tree of
# `camtool.kernels.move_tree`. What makes it exact: comparisons of the given numbers.


cpdef enum:
    # Rows in a leaf.
    LEAF = 4


cpdef tree_of(double[:, ::1] boxes):
    """Return the tree (2L, 4) of boxes over `boxes` (K, 4); the L leaves are the last nodes."""
    cdef Int leaves, node, row, k
    cdef double[:, ::1] tree
    leaves = 1
    while leaves * LEAF < len(boxes):
        leaves *= 2
    tree = np.empty((2 * leaves, 4))
    for node in range(2 * leaves):
        for k in range(2):
            tree[node, k], tree[node, k + 2] = math.INFINITY, -math.INFINITY
    for row in range(len(boxes)):
        _widen(tree, leaves + row // LEAF, boxes, row)
    for node in range(leaves - 1, 0, -1):
        _widen(tree, node, tree, 2 * node)
        _widen(tree, node, tree, 2 * node + 1)
    return np.asarray(tree)


cdef void _widen(double[:, ::1] tree, Int node, double[:, ::1] boxes, Int row) noexcept:
    cdef Int k
    for k in range(2):
        tree[node, k] = min(tree[node, k], boxes[row, k])
        tree[node, k + 2] = max(tree[node, k + 2], boxes[row, k + 2])


cdef (Int, Int) rows_under(double[:, ::1] tree, Int node, Int count) noexcept nogil:
    """Return the rows low … high − 1, of `count` in all, that a node of the tree contains."""
    cdef Int leaves, span, low
    leaves = len(tree) // 2
    span = LEAF
    while node < leaves:
        node *= 2
        span *= 2
    low = min((node - leaves) * LEAF, count)
    return low, min(low + span, count)


cdef inline double apart_square(double[:, ::1] tree, Int node, double x, double y) noexcept nogil:
    """Return the squared distance of a point from the box of a node."""
    dx = max(tree[node, 0] - x, 0.0, x - tree[node, 2])
    dy = max(tree[node, 1] - y, 0.0, y - tree[node, 3])
    return float(dx * dx + dy * dy)


cdef inline (Int, Int) next_leaf(
    double[:, ::1] tree, double x, double y, double square, Int[::1] stack, Int height
) noexcept:
    """Return the next leaf on a stack of `height` nodes whose box is no farther from a point than
    the root of `square`, and the new height; leaf −1 if there is none."""
    cdef Int node, leaves = len(tree) // 2
    while height > 0:
        height -= 1
        node = stack[height]
        if apart_square(tree, node, x, y) > square:
            continue
        if node >= leaves:
            return node - leaves, height
        stack[height], stack[height + 1] = 2 * node + 1, 2 * node
        height += 2
    return -1, 0


cdef Int wait_for_children(
    double[:, ::1] tree, Int node, double x, double y, Int[::1] stack, Int height
) noexcept nogil:
    """Put the children of a node on a stack of `height` nodes, the one nearer to a point on top;
    return the new height."""
    cdef Int left, right
    left, right = 2 * node, 2 * node + 1
    if apart_square(tree, left, x, y) < apart_square(tree, right, x, y):
        left, right = right, left
    stack[height], stack[height + 1] = left, right
    return height + 2


cdef inline bint touch(double[:, ::1] boxes, Int i, double[:, ::1] other_boxes, Int j) noexcept:
    """Return True if box i of one list and box j of another have a point in common."""
    return bool(
        boxes[i, 0] <= other_boxes[j, 2]
        and other_boxes[j, 0] <= boxes[i, 2]
        and boxes[i, 1] <= other_boxes[j, 3]
        and other_boxes[j, 1] <= boxes[i, 3]
    )


# Lines and arcs as rows of numbers that need no centre, for the kernels of offsets.
#
# A row holds A, B, the unit tangents t at A and u at B, the signed curvature k (left positive),
# the length and the sweep. With q = p − A and n, t turned by +90°, the distance of p from the
# whole line or circle is
#
#     |k q·q − 2 n·q| / (1 + |n − k q|),
#
# because n − k q is k times the way from p to the centre. What makes it exact: for a curvature of
# 0 it becomes the formula of the line, and no difference of large numbers is formed on the way
# there. The vectorised twins are camtool.geometry.measure, distance and measure.


cpdef enum:
    # The columns of a row.
    AX = 0, AY, BX, BY, TX, TY, UX, UY, BEND, LENGTH, SWEEP


cpdef curve_rows(double[:, ::1] start, double[:, ::1] end, double[::1] bulge):
    """Return (K, 11) rows of the segments from `start` to `end` (K, 2) with their bulges (K,)."""
    cdef double[:, ::1] rows
    cdef Int i
    rows = np.empty((len(bulge), 11))
    for i in range(len(bulge)):
        set_curve_row(rows, i, start[i, 0], start[i, 1], end[i, 0], end[i, 1], bulge[i])
    return np.asarray(rows)


cdef void set_curve_row(
    double[:, ::1] rows, Int i, double ax, double ay, double bx, double by, double b
) noexcept:
    """Set row i to the segment from (ax, ay) to (bx, by) with the bulge b."""
    cdef double dx, dy, chord, grown, cosine, sine, turn
    dx, dy = bx - ax, by - ay
    chord = math.hypot(dx, dy)
    # The tangents are the chord turned by ∓ sweep/2, and b = tan(sweep/4).
    grown = 1.0 + b * b
    cosine, sine = (1.0 - b * b) / (grown * chord), 2.0 * b / (grown * chord)
    rows[i, AX], rows[i, AY], rows[i, BX], rows[i, BY] = ax, ay, bx, by
    rows[i, TX], rows[i, TY] = cosine * dx + sine * dy, cosine * dy - sine * dx
    rows[i, UX], rows[i, UY] = cosine * dx - sine * dy, cosine * dy + sine * dx
    rows[i, BEND] = 4.0 * b / (chord * grown)
    rows[i, LENGTH], rows[i, SWEEP] = chord, 0.0
    if b != 0.0:
        turn = math.atan(b)
        rows[i, LENGTH], rows[i, SWEEP] = chord * grown * turn / b, 4.0 * turn


cpdef curve_boxes(double[:, ::1] curves, double margin):
    """Return the boxes (K, 4), xmin, ymin, xmax, ymax, that contain each curve with a margin on
    all sides.

    An arc lies between its chord and the parallel of it at its height, sin(sweep/4)² · 2/k.
    """
    cdef double[:, ::1] boxes
    cdef Int i
    boxes = np.empty((len(curves), 4))
    for i in range(len(curves)):
        ax, ay, bx, by = curves[i, AX], curves[i, AY], curves[i, BX], curves[i, BY]
        px = py = 0.0
        if curves[i, BEND] != 0.0:
            height = 2.0 * math.sin(0.25 * curves[i, SWEEP]) ** 2 / curves[i, BEND]
            chord = math.hypot(bx - ax, by - ay)
            px, py = height * (by - ay) / chord, -height * (bx - ax) / chord
        boxes[i, 0] = min(ax, bx) + min(px, 0.0) - margin
        boxes[i, 1] = min(ay, by) + min(py, 0.0) - margin
        boxes[i, 2] = max(ax, bx) + max(px, 0.0) + margin
        boxes[i, 3] = max(ay, by) + max(py, 0.0) + margin
    return np.asarray(boxes)


cdef inline double gap_to(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return the distance of a point from the infinite line or full circle of row i."""
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    nx, ny, bend = -curves[i, TY], curves[i, TX], curves[i, BEND]
    power = bend * (qx * qx + qy * qy) - 2.0 * (nx * qx + ny * qy)
    wx, wy = nx - bend * qx, ny - bend * qy
    return float(abs(power) / (1.0 + math.sqrt(wx * wx + wy * wy)))


cdef inline double distance_to(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return the distance of a point from row i; from its nearer end where the point lies beside
    it (|sweep| ≤ π)."""
    cdef bint ahead
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    rx, ry = x - curves[i, BX], y - curves[i, BY]
    ahead = qx * curves[i, TX] + qy * curves[i, TY] >= 0.0
    if ahead and rx * curves[i, UX] + ry * curves[i, UY] <= 0.0:
        return gap_to(curves, i, x, y)
    return math.sqrt(min(qx * qx + qy * qy, rx * rx + ry * ry))


cpdef double arc_length_at(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return the length along row i from its start to a point on its line or circle; negative
    before it.

    The chord to the point makes half the swept angle with the tangent; points before the start
    show as half angles beyond the middle of what remains of the circle.
    """
    cdef bint is_before
    cdef double half, chord
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    ahead = curves[i, TX] * qx + curves[i, TY] * qy
    if curves[i, BEND] == 0.0:
        return float(ahead)
    chord = math.sqrt(qx * qx + qy * qy)
    across = curves[i, TX] * qy - curves[i, TY] * qx
    half = math.atan2(math.copysign(1.0, curves[i, BEND]) * across, ahead)
    is_before = half > 0.5 * math.M_PI + 0.25 * abs(curves[i, SWEEP]) or half < -0.5 * math.M_PI
    half = math.M_PI - abs(half) if is_before else abs(half)
    if half != 0.0:
        chord *= half / math.sin(half)
    return float(-chord if is_before else chord)


cpdef inline (double, double) point_on(double[:, ::1] curves, Int i, double t) noexcept:
    """Return the point of row i at the fraction t of its length.

    After the length s the chord from A is turned by half = k s/2 and s · sin(half)/half long.
    """
    if t == 1.0:
        return curves[i, BX], curves[i, BY]
    s = t * curves[i, LENGTH]
    half = 0.5 * t * curves[i, SWEEP]
    if half != 0.0:
        s *= math.sin(half) / half
    cosine, sine = math.cos(half), math.sin(half)
    tx, ty = curves[i, TX], curves[i, TY]
    x = curves[i, AX] + s * (cosine * tx - sine * ty)
    return x, curves[i, AY] + s * (cosine * ty + sine * tx)


# How deep points are in what mitres cover.
#
# About a corner c with the normals n1 and n2 of both its sides, a mitre at the distance d covers
#
#     { c + q :  n1·q ≤ d,  n2·q ≤ d,  m·q ≤ far,  q ahead of side 1 and behind side 2 },
#
# with the middle m of both normals: a kite, or what is left of one that is cut off. It is convex,
# so a point is as deep in it as it is from the nearest of these five lines. The depth changes by
# no more than the way. What makes it exact: a tree of boxes leaves out only kites that a point is
# not in.


cpdef enum:
    # The columns of a kite.
    CX = 0, CY, N1X, N1Y, N2X, N2Y, MX, MY, DEEP, FAR


cpdef kite_boxes(double[:, ::1] kites):
    """Return the boxes (J, 4), xmin, ymin, xmax, ymax, that contain the kites (J, 10)."""
    cdef double[:, ::1] boxes
    cdef Int i
    boxes = np.empty((len(kites), 4))
    for i in range(len(kites)):
        cx, cy, deep = kites[i, CX], kites[i, CY], kites[i, DEEP]
        # From the corner to the tip, or to both ends of the cut: no farther than this.
        cosine = kites[i, N1X] * kites[i, MX] + kites[i, N1Y] * kites[i, MY]
        if kites[i, FAR] == math.INFINITY:
            wide = deep / cosine
        else:
            sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
            wide = math.hypot(deep, (kites[i, FAR] - deep * cosine) / sine)
        boxes[i, 0], boxes[i, 1] = cx - wide, cy - wide
        boxes[i, 2], boxes[i, 3] = cx + wide, cy + wide
    return np.asarray(boxes)


cdef inline double depth_in(double[:, ::1] kites, Int i, double x, double y) noexcept:
    """Return the depth (mm) of a point in kite i; below 0 outside it."""
    qx, qy = x - kites[i, CX], y - kites[i, CY]
    n1x, n1y, n2x, n2y = kites[i, N1X], kites[i, N1Y], kites[i, N2X], kites[i, N2Y]
    depth = min(kites[i, DEEP] - n1x * qx - n1y * qy, kites[i, DEEP] - n2x * qx - n2y * qy)
    depth = min(depth, kites[i, FAR] - kites[i, MX] * qx - kites[i, MY] * qy)
    return float(min(depth, n1y * qx - n1x * qy, n2x * qy - n2y * qx))


cpdef double deepest(
    double[:, ::1] kites, double[:, ::1] tree, double x, double y, double best, double enough,
    Int[::1] stack
) noexcept:
    """Return the largest depth (mm) of a point in a kite, or `best` if none is deeper.

    Any depth above `enough` will do. `stack` (`DEPTH`,) is a scratch buffer.
    """
    cdef Int leaf, height, row
    if len(kites) == 0:
        return best
    stack[0] = 1
    leaf, height = next_leaf(tree, x, y, 0.0, stack, 1)
    while leaf >= 0:
        for row in range(leaf * LEAF, min((leaf + 1) * LEAF, len(kites))):
            best = max(best, depth_in(kites, row, x, y))
        if best > enough:
            return best
        leaf, height = next_leaf(tree, x, y, 0.0, stack, height)
    return best


# How near points of raw elements are to the source: elements trimmed, slices judged.
#
# What makes it exact: a tree of boxes leaves out only what is too far away, by its true distance.
# The twins, with every distance to every segment, are in tests/oracles/offset_stages.py.


cpdef enum:
    # How often the end of an element is moved on, at most.
    TRIM_ROUNDS = 40

# An end that moves on by less than this share of its element is left where it is.
cdef double TRIM_STEP_SHARE = 0.02

Near = tuple[Floats, Floats, Floats, Floats]
"""The curves of a source and the tree over them; the kites of its mitres and their tree."""

cpdef enum:
    # Room for the curves that can be too near to an element; where there are more, all are asked.
    GATHERED = 32

# Where on a slice its distance is measured; the middle first, as it settles most of them.
PLACES = (0.5, 0.03, 0.97, 0.2, 0.8, 0.35, 0.65)


cdef double least_below(
    double[:, ::1] curves, double[:, ::1] tree, double x, double y, double best, double enough,
    Int[::1] stack, double[::1] squares
) noexcept:
    """Return the distance of a point from the nearest curve, or `best` when none is nearer than
    that.

    Any distance below `enough` will do. `stack` and `squares` (`DEPTH`,) are scratch buffers.
    """
    cdef Int leaves, height, node, low, row, near_node, far_node
    leaves = len(tree) // 2
    height, stack[0], squares[0] = 1, 1, apart_square(tree, 1, x, y)
    while height > 0:
        height -= 1
        node = stack[height]
        if squares[height] >= best * best:
            continue
        if node < leaves:
            near_node, far_node = 2 * node, 2 * node + 1
            to_near, to_far = (
                apart_square(tree, near_node, x, y), apart_square(tree, far_node, x, y)
            )
            if to_far < to_near:
                near_node, far_node, to_near, to_far = far_node, near_node, to_far, to_near
            stack[height], squares[height] = far_node, to_far
            stack[height + 1], squares[height + 1] = near_node, to_near
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(curves))):
            best = min(best, distance_to(curves, row, x, y))
        if best < enough:
            return best
    return best


cpdef nearest_distances(double[:, ::1] points, double[:, ::1] curves, double[:, ::1] tree):
    """Return (P,) distance of each point (P, 2) from the nearest curve."""
    cdef double[::1] distances, squares
    cdef Int i
    cdef Int[::1] stack
    distances = np.empty(len(points))
    stack, squares = np.empty(DEPTH, np.int64), np.empty(DEPTH)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        distances[i] = least_below(curves, tree, x, y, math.INFINITY, 0.0, stack, squares)
    return np.asarray(distances)


# Linear bounds of the distance from the nearest curve, along chords and over discs.
#
# What makes them exact: the distance from a line with ends is a convex function of the point, so
# it lies above its tangent; the distance from the circle of an arc is convex outside of it and
# concave inside, where it lies above its own chords. The distance from an arc is no less than that
# from its circle, and no distance changes by more than the way.


cdef bint faces(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return True if the point of the infinite line or full circle of row i that is nearest to (x,
    y) lies on the row itself."""
    return bool(
        (x - curves[i, AX]) * curves[i, TX] + (y - curves[i, AY]) * curves[i, TY] >= 0.0
        and (x - curves[i, BX]) * curves[i, UX] + (y - curves[i, BY]) * curves[i, UY] <= 0.0
    )


cdef inline double power_of(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return the power of a point over the full circle of row i times its curvature; for a line,
    twice the distance from it. It is negative on the left."""
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    return float(
        curves[i, BEND] * (qx * qx + qy * qy) - 2.0 * (qy * curves[i, TX] - qx * curves[i, TY])
    )


cdef (double, double, double) away_from(double[:, ::1] curves, Int i, double x, double y) noexcept:
    """Return the distance of a point from row i, and the unit direction from the nearest place to
    the point; 0, 0 where it lies there."""
    cdef double px, py, distance, bend = curves[i, BEND], qx, qy, rx, ry
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    rx, ry = x - curves[i, BX], y - curves[i, BY]
    if not faces(curves, i, x, y):
        if rx * rx + ry * ry < qx * qx + qy * qy:
            qx, qy = rx, ry
        distance = math.sqrt(qx * qx + qy * qy)
        return (distance, qx / distance, qy / distance) if distance > 0.0 else (0.0, 0.0, 0.0)
    # n − k q is k times the way from the point to the centre, and n on the line itself.
    px, py = -curves[i, TY] - bend * qx, curves[i, TX] - bend * qy
    rx, ry = -curves[i, TY], curves[i, TX]
    distance = math.sqrt(px * px + py * py)
    if distance > 0.0:
        rx, ry = px / distance, py / distance
    if power_of(curves, i, x, y) > 0.0:
        rx, ry = -rx, -ry
    return gap_to(curves, i, x, y), rx, ry


cdef (double, double) least_along(
    double[:, ::1] curves, Int i, double x, double y, double dx, double dy
) noexcept:
    """Return the values at both ends of a chord of a linear function that is nowhere on the chord
    more than the distance from row i. The chord has the middle (x, y) and the half vector (dx,
    dy)."""
    cdef double distance, nx, ny, low, high, ox, oy, radius, bend = curves[i, BEND], bound
    distance, nx, ny = away_from(curves, i, x, y)
    bound = distance - math.sqrt(dx * dx + dy * dy)
    if bend == 0.0:
        low = nx * dx + ny * dy
        return distance - low, distance + low
    radius = 1.0 / abs(bend)
    ox, oy = x - curves[i, AX] + curves[i, TY] / bend, y - curves[i, AY] - curves[i, TX] / bend
    distance = math.sqrt(ox * ox + oy * oy)
    if distance < radius:
        low = radius - math.sqrt((ox - dx) * (ox - dx) + (oy - dy) * (oy - dy))
        high = radius - math.sqrt((ox + dx) * (ox + dx) + (oy + dy) * (oy + dy))
    else:
        low = (ox * dx + oy * dy) / distance
        low, high = distance - radius - low, distance - radius + low
    return (low, high) if min(low, high) > bound else (bound, bound)


cdef (double, double) most_along(
    double[:, ::1] curves, Int i, double x, double y, double dx, double dy
) noexcept:
    """Return the values at both ends of a chord, as in `least_along`, of a linear function that is
    nowhere on the chord less than the distance from row i."""
    cdef double ox, oy, low, high, slope, distance, radius, bend = curves[i, BEND]
    if bend == 0.0:
        return distance_to(curves, i, x - dx, y - dy), distance_to(curves, i, x + dx, y + dy)
    if not (faces(curves, i, x - dx, y - dy) and faces(curves, i, x + dx, y + dy)):
        distance = distance_to(curves, i, x, y) + math.sqrt(dx * dx + dy * dy)
        return distance, distance
    radius = 1.0 / abs(bend)
    ox, oy = x - curves[i, AX] + curves[i, TY] / bend, y - curves[i, AY] - curves[i, TX] / bend
    distance = math.sqrt(ox * ox + oy * oy)
    slope = (ox * dx + oy * dy) / distance if distance > 0.0 else 0.0
    low = math.sqrt((ox - dx) * (ox - dx) + (oy - dy) * (oy - dy)) - radius
    high = math.sqrt((ox + dx) * (ox + dx) + (oy + dy) * (oy + dy)) - radius
    return max(low, radius - distance + slope), max(high, radius - distance - slope)


cdef void nearest_two(
    double[:, ::1] curves, double[:, ::1] tree, double x, double y, Int[::1] stack, Int[::1] row,
    double[::1] distances
) noexcept:
    """Store the two curves nearest to a point and their distances; −1 and inf where there is none."""
    cdef Int leaves = len(tree) // 2, height = 1, node, low, i
    cdef double distance
    row[0], row[1], distances[0], distances[1] = -1, -1, math.INFINITY, math.INFINITY
    stack[0] = 1
    while height > 0:
        height -= 1
        node = stack[height]
        if apart_square(tree, node, x, y) >= distances[1] * distances[1]:
            continue
        if node < leaves:
            height = wait_for_children(tree, node, x, y, stack, height)
            continue
        low = (node - leaves) * LEAF
        for i in range(low, min(low + LEAF, len(curves))):
            distance = distance_to(curves, i, x, y)
            if distance < distances[0]:
                row[1], distances[1] = row[0], distances[0]
                row[0], distances[0] = i, distance
            elif distance < distances[1]:
                row[1], distances[1] = i, distance


cpdef chord_distances(
    double[:, ::1] middles, double[:, ::1] halves, double[:, ::1] curves, double[:, ::1] tree
):
    """Return (K, 4) bounds of the distance from the nearest curve along chords, whose middles and
    half vectors from start to end are (K, 2): lower bounds at both ends, then upper bounds at both
    ends.

    Between the ends the distance lies between the lines through these. Along a chord that may meet
    a curve, the lower bound is that of the distance on either side of the curve, negative on the
    other side.
    """
    cdef double[:, ::1] bounds = np.empty((len(middles), 4))
    cdef Int[::1] stack = np.empty(DEPTH, np.int64), row = np.empty(2, np.int64)
    cdef double[::1] distances = np.empty(2)
    cdef Int k, i, leaf, height
    cdef double x, y, dx, dy, long_, limit, first_bound, second_bound
    for k in range(len(middles)):
        x, y, dx, dy = middles[k, 0], middles[k, 1], halves[k, 0], halves[k, 1]
        nearest_two(curves, tree, x, y, stack, row, distances)
        bounds[k, 2], bounds[k, 3] = most_along(curves, row[0], x, y, dx, dy)
        long_ = math.sqrt(dx * dx + dy * dy)
        if distances[0] <= long_:
            bounds[k, 0] = bounds[k, 1] = distances[0] - long_
            continue
        limit = distances[0] + 2.0 * long_
        bounds[k, 0], bounds[k, 1] = least_along(curves, row[0], x, y, dx, dy)
        if distances[1] > limit:
            continue
        stack[0] = 1
        leaf, height = next_leaf(tree, x, y, limit * limit, stack, 1)
        while leaf >= 0:
            for i in range(leaf * LEAF, min((leaf + 1) * LEAF, len(curves))):
                if i != row[0] and distance_to(curves, i, x, y) <= limit:
                    first_bound, second_bound = least_along(curves, i, x, y, dx, dy)
                    bounds[k, 0], bounds[k, 1] = (
                        min(bounds[k, 0], first_bound), min(bounds[k, 1], second_bound)
                    )
            leaf, height = next_leaf(tree, x, y, limit * limit, stack, height)
    return np.asarray(bounds)


cpdef enum:
    # The columns of `disc_tangents` for each of two curves: the distance, its slope in x and y, and
    # how much more than linear it may be, on the point's own side of the curve and on the other.
    APART, SLOPE_X, SLOPE_Y, MORE, MORE_BEYOND, TANGENT_COLUMNS


cpdef disc_tangents(
    double[:, ::1] points, double[::1] reach, double[:, ::1] curves, double[:, ::1] tree
):
    """Return (P, 2, 5) upper bounds of the distance from the two curves nearest to each point (P,
    2), within `reach` (P,) of it; inf for a second curve that does not exist."""
    cdef double[:, :, ::1] tangents = np.zeros((len(points), 2, TANGENT_COLUMNS))
    cdef Int[::1] stack = np.empty(DEPTH, np.int64), row = np.empty(2, np.int64)
    cdef double[::1] distances = np.empty(2)
    cdef double x, y, r, bend, gap, radius, margin
    cdef bint is_within
    cdef Int k, j, i
    for k in range(len(points)):
        x, y, r = points[k, 0], points[k, 1], reach[k]
        nearest_two(curves, tree, x, y, stack, row, distances)
        for j in range(2):
            i = row[j]
            tangents[k, j, APART] = distances[j]
            if i < 0:
                continue
            gap, tangents[k, j, SLOPE_X], tangents[k, j, SLOPE_Y] = away_from(curves, i, x, y)
            tangents[k, j, MORE], tangents[k, j, MORE_BEYOND] = bulge_of(gap, r), math.INFINITY
            bend = curves[i, BEND]
            if not faces(curves, i, x, y):
                continue
            gap = arc_length_at(
                curves, i, x - gap * tangents[k, j, SLOPE_X], y - gap * tangents[k, j, SLOPE_Y]
            )
            margin = min(gap, curves[i, LENGTH] - gap)
            if bend == 0.0:
                if margin >= r:
                    tangents[k, j, MORE] = tangents[k, j, MORE_BEYOND] = 0.0
                continue
            radius = 1.0 / abs(bend)
            is_within = (power_of(curves, i, x, y) < 0.0) == (bend > 0.0)
            gap = radius - distances[j] if is_within else radius + distances[j]
            if margin * gap < 0.5 * math.M_PI * r * radius:
                continue
            tangents[k, j, MORE] = 0.0 if is_within else bulge_of(gap, r)
            tangents[k, j, MORE_BEYOND] = bulge_of(gap, r) if is_within else 0.0
    return np.asarray(tangents)


cdef double bulge_of(double distance, double reach) noexcept:
    """Return the greatest excess over a linear function of the distance from a point that is
    `distance` away, within a disc of radius `reach`."""
    return reach * reach / (2.0 * distance) if reach <= 2.0 * distance else 2.0 * reach


cdef twice_the_room(Int[:, ::1] pairs):
    """Return the pairs (J, 2) in an array with room for twice as many."""
    cdef Int[:, ::1] more
    more = np.empty((2 * len(pairs), 2), np.int64)
    more[: len(pairs)] = pairs
    return more


cpdef curves_within(
    double[:, ::1] points, double[::1] reach, double[:, ::1] curves, double[:, ::1] tree
):
    """Return (J, 2) pairs of a point (P, 2) and a curve that is no farther from it than `reach`
    (P,), in the order of the points."""
    cdef Int[:, ::1] pairs
    cdef Int[::1] stack
    cdef Int i, count, leaf, height, row
    pairs = np.empty((len(points) + LEAF, 2), np.int64)
    stack = np.empty(DEPTH, np.int64)
    count = 0
    for i in range(len(points)):
        x, y, limit = points[i, 0], points[i, 1], reach[i]
        stack[0] = 1
        leaf, height = next_leaf(tree, x, y, limit * limit, stack, 1)
        while leaf >= 0:
            if count + LEAF > len(pairs):
                pairs = twice_the_room(pairs)
            for row in range(leaf * LEAF, min((leaf + 1) * LEAF, len(curves))):
                if distance_to(curves, row, x, y) <= limit:
                    pairs[count, 0], pairs[count, 1] = i, row
                    count += 1
            leaf, height = next_leaf(tree, x, y, limit * limit, stack, height)
    return np.asarray(pairs[:count])


cpdef Int gathered(
    double[:, ::1] curves, double[:, ::1] tree, double x, double y, double reach, Int[::1] rows,
    Int[::1] stack
) noexcept:
    """Write the curves nearer to a point than `reach` into `rows`, and return their number.

    −1 if `rows` is too short for them. `stack` (`DEPTH`,) is a scratch buffer.
    """
    cdef Int count, leaf, height, row
    count, stack[0] = 0, 1
    leaf, height = next_leaf(tree, x, y, reach * reach, stack, 1)
    while leaf >= 0:
        for row in range(leaf * LEAF, min((leaf + 1) * LEAF, len(curves))):
            if distance_to(curves, row, x, y) < reach:
                if count == len(rows):
                    return -1
                rows[count] = row
                count += 1
        leaf, height = next_leaf(tree, x, y, reach * reach, stack, height)
    return count


cdef double _violation(
    double[:, ::1] curves, double[:, ::1] tree, double[:, ::1] kites, double[:, ::1] kite_tree,
    Int[::1] rows, Int count, double x, double y, double distance, double spare, double enough,
    Int[::1] stack, double[::1] squares
) noexcept:
    """Return how far, mm, a point violates the offset distance beyond the slack `spare`.

    0 if it does not; the search stops at any number above `enough`. It is too near to the source,
    or too deep in a kite. `rows` are those of the curves that can be nearer than the distance,
    `count` their number, −1 for all. `stack`, `squares` (`DEPTH`,): scratch buffers.
    """
    cdef Int k
    min_distance = distance - spare
    if count < 0:
        short = (
            min_distance
            - least_below(curves, tree, x, y, min_distance, min_distance - enough, stack, squares)
        )
    else:
        short = 0.0
        for k in range(count):
            short = max(short, min_distance - distance_to(curves, rows[k], x, y))
    if short > enough or len(kites) == 0:
        return short
    return deepest(kites, kite_tree, x, y, short + spare, enough + spare, stack) - spare


cpdef trimmed_ends(double[:, ::1] elements, surroundings, (double, double) limits):
    """Return (K, 2) the fractions between which each element may be far enough from the source.

    The distance from the source, and the depth in a kite, change by no more than the length
    travelled along an element: where the distance is too small by s, it is too small for the
    length s from there. `limits` are the distance, and by how much the ends that stay may violate
    it. Low is not below high where nothing is left.
    """
    cdef double[:, ::1] ends, curves, tree, kites, kite_tree
    cdef Int i, count, side, _
    cdef Int[::1] rows, stack
    cdef double[::1] squares
    curves, tree, kites, kite_tree = surroundings
    distance, spare = limits
    ends = np.empty((len(elements), 2))
    rows, stack, squares = np.empty(GATHERED, np.int64), np.empty(DEPTH, np.int64), np.empty(DEPTH)
    for i in range(len(elements)):
        low, high, length = 0.0, 1.0, elements[i, LENGTH]
        x, y = point_on(elements, i, 0.5)
        count = gathered(curves, tree, x, y, distance + 0.5 * length, rows, stack)
        for side in range(2):
            for _ in range(TRIM_ROUNDS):
                x, y = point_on(elements, i, low if side == 0 else high)
                enough = (high - low) * length
                step = (
                    _violation(
                        curves,
                        tree,
                        kites,
                        kite_tree,
                        rows,
                        count,
                        x,
                        y,
                        distance,
                        spare,
                        enough,
                        stack,
                        squares,
                    )
                    / length
                )
                if step <= TRIM_STEP_SHARE * (high - low):
                    break
                if side == 0:
                    low += step
                else:
                    high -= step
                if low >= high:
                    break
            if low >= high:
                break
        ends[i, 0], ends[i, 1] = low, high
    return np.asarray(ends)


cpdef far_enough(
    double[:, ::1] elements, Int[::1] element, double[:, ::1] span, surroundings,
    (double, double) limits
):
    """Return a mask (S,), true for slices of which no measured point is too near to the source.

    Slice i runs on row element[i] from the fraction span[i, 0] to span[i, 1]. `limits` are the
    distance, and by how much a point may violate it.
    """
    cdef double[::1] places, squares
    cdef uint8_t[::1] valid
    cdef Int i, last, gathered_count, count, k, row
    cdef double[:, ::1] curves, tree, kites, kite_tree
    cdef Int[::1] rows, stack
    curves, tree, kites, kite_tree = surroundings
    distance, spare = limits
    places = np.array(PLACES)
    valid = np.ones(len(element), np.bool_)
    rows, stack, squares = np.empty(GATHERED, np.int64), np.empty(DEPTH, np.int64), np.empty(DEPTH)
    last, gathered_count = -1, -1
    for i in range(len(element)):
        row, t0, part = element[i], span[i, 0], span[i, 1] - span[i, 0]
        length = elements[row, LENGTH]
        if row != last:
            # No other curve is too near to any point of the element.
            x, y = point_on(elements, row, 0.5)
            last = row
            gathered_count = gathered(curves, tree, x, y, distance + 0.5 * length, rows, stack)
        count = gathered_count
        for k in range(len(places)):
            x, y = point_on(elements, row, t0 + places[k] * part)
            short = _violation(
                curves,
                tree,
                kites,
                kite_tree,
                rows,
                count,
                x,
                y,
                distance,
                spare,
                0.0,
                stack,
                squares,
            )
            if short > 0.0:
                valid[i] = False
                break
            if k == 0 and gathered_count < 0:
                reach = distance + 0.5 * part * length
                count = gathered(curves, tree, x, y, reach, rows, stack)
    return np.asarray(valid).view(np.bool_)


# Where many lines and arcs meet: pairs from a tree of boxes, each pair met exactly.
#
# The rules are those of camtool.geometry.intersect, which is the vectorised twin: the four ends
# and the two common points of the whole curves are measured, and count when they are within eps of
# both curves and of the range of both, and not within 2 eps of one that counted before; and, which
# is more than there, when the curves part by more than eps on the way from one that counted
# before.


cpdef enum:
    # The columns of a meeting: its place, and the fractions of both curves there.
    X = 0, Y, TA, TB
    # Two curves have four ends and two common points.
    MAX_MEETINGS = 6


cpdef pairs_of(
    double[:, ::1] boxes, double[:, ::1] tree, double[:, ::1] other_boxes,
    double[:, ::1] other_tree,
    bint own
):
    """Return (J, 2) the pairs of rows of `boxes` and of `other_boxes` that touch; each list has
    its tree.

    `own` says that both lists are the same: then each pair comes once, the lower row first. Nodes
    of both trees are compared in pairs, so that two large boxes are compared only once.
    """
    cdef Int first, last, other_first, other_last, leaves, other_leaves, count, height, i, a, b
    cdef Int child, low, far_low, j, other_child
    cdef Int[:, ::1] pairs
    cdef Int[::1] left, right
    pairs = np.empty((4 * len(boxes) + 16, 2), np.int64)
    leaves, other_leaves, count = len(tree) // 2, len(other_tree) // 2, 0
    left, right = np.empty(4 * DEPTH, np.int64), np.empty(4 * DEPTH, np.int64)
    height, left[0], right[0] = 1, 1, 1
    while height > 0:
        height -= 1
        a, b = left[height], right[height]
        if not touch(tree, a, other_tree, b):
            continue
        if a < leaves or b < other_leaves:
            # The children of each, or itself when it is a leaf.
            first, last = (2 * a, 2 * a + 2) if a < leaves else (a, a + 1)
            other_first, other_last = (2 * b, 2 * b + 2) if b < other_leaves else (b, b + 1)
            for child in range(first, last):
                for other_child in range(other_first, other_last):
                    if not own or child <= other_child:
                        left[height], right[height] = child, other_child
                        height += 1
            continue
        low, far_low = (a - leaves) * LEAF, (b - other_leaves) * LEAF
        for i in range(low, min(low + LEAF, len(boxes))):
            for j in range(far_low, min(far_low + LEAF, len(other_boxes))):
                if (not own or i < j) and touch(boxes, i, other_boxes, j):
                    if count == len(pairs):
                        pairs = np.concatenate([pairs, pairs])
                    pairs[count, 0], pairs[count, 1] = i, j
                    count += 1
    return np.asarray(pairs[:count])


cpdef meetings_of(double[:, ::1] a, double[:, ::1] b, Int[:, ::1] pairs, double eps):
    """Return the rows (J, 2) of a and b, and the intersections (J, 4), of the pairs (P, 2) of
    rows."""
    cdef Int room, count, k, more, m, i, j
    cdef Int[:, ::1] rows
    cdef double[:, ::1] points
    room = len(pairs) + MAX_MEETINGS + 16
    rows, points = np.empty((room, 2), np.int64), np.empty((room, 4))
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        if count + MAX_MEETINGS > len(rows):
            rows, points = np.concatenate([rows, rows]), np.concatenate([points, points])
        more = _meet(a, b, i, j, eps, points, count)
        for m in range(count, count + more):
            rows[m, 0], rows[m, 1] = i, j
        count += more
    return np.asarray(rows[:count]), np.asarray(points[:count])


cdef Int _meet(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double eps, double[:, ::1] points, Int offset
) noexcept:
    """Write the intersections of row i of a and row j of b into `points` from row `offset` on, and
    return their number."""
    cdef Int count, k
    count = 0
    for k in range(4):
        if k < 2:
            x, y = (a[i, AX], a[i, AY]) if k == 0 else (a[i, BX], a[i, BY])
        else:
            x, y = (b[j, AX], b[j, AY]) if k == 2 else (b[j, BX], b[j, BY])
        count += _store_intersection_if_new(a, b, i, j, x, y, eps, points, offset, count)
    # Row j of b is to be the rounder one.
    if abs(b[j, BEND]) < abs(a[i, BEND]):
        x, y, other_x, other_y = _common_points(b, a, j, i)
    else:
        x, y, other_x, other_y = _common_points(a, b, i, j)
    for _ in range(2):
        # No NaN passes: curves that miss each other by far have no common points.
        if (
            gap_to(a, i, x, y) <= eps
            and not _is_stored(a, b, i, j, x, y, eps, points, offset, count)
        ):
            count += _store_intersection_if_new(a, b, i, j, x, y, eps, points, offset, count)
        x, y = other_x, other_y
    return count


cdef bint _is_stored(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double x, double y, double eps,
    double[:, ::1] points, Int offset, Int count
) noexcept:
    """Return True if the curves stay within eps of each other from a common point to the end of
    the shorter one, or to an intersection found before: one of `count` in the rows of `points`
    from `offset` on.

    At the angle θ and with curvatures that differ by k they are at most θ s + k s²/2 apart after
    s. There rounding alone would place an intersection: where they are tangent at an end, anywhere
    within the root of its own rounding.
    """
    cdef Int k
    ax, ay = _tangent_after(a, i, arc_length_at(a, i, x, y))
    bx, by = _tangent_after(b, j, arc_length_at(b, j, x, y))
    direction = -1.0 if ax * bx + ay * by < 0.0 else 1.0
    angle, bend = abs(ax * by - ay * bx), abs(a[i, BEND] - direction * b[j, BEND])
    s = min(a[i, LENGTH], b[j, LENGTH])
    if angle * s + 0.5 * bend * s * s <= eps:
        return True
    for k in range(offset, offset + count):
        s = math.hypot(points[k, X] - x, points[k, Y] - y)
        if angle * s + 0.5 * bend * s * s <= eps:
            return True
    return False


cdef Int _store_intersection_if_new(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j, double x, double y, double eps,
    double[:, ::1] points, Int offset, Int count
) noexcept:
    """Store the point and return 1 if both curves pass within eps of it and it is not stored yet,
    else return 0; `count` intersections are in the rows of `points` from `offset` on."""
    cdef Int row, k
    if not (gap_to(a, i, x, y) <= eps and gap_to(b, j, x, y) <= eps):
        return 0
    on_a, on_b = arc_length_at(a, i, x, y), arc_length_at(b, j, x, y)
    if not (-eps <= on_a <= a[i, LENGTH] + eps and -eps <= on_b <= b[j, LENGTH] + eps):
        return 0
    for k in range(offset, offset + count):
        if math.hypot(points[k, X] - x, points[k, Y] - y) <= 2.0 * eps:
            return 0
    row = offset + count
    points[row, X], points[row, Y] = x, y
    points[row, TA] = _fraction(on_a, a[i, LENGTH], eps)
    points[row, TB] = _fraction(on_b, b[j, LENGTH], eps)
    return 1


cdef inline double _fraction(double length, double full_length, double eps) noexcept:
    """Return the length as a fraction of the full length, exactly 0 or 1 within eps of an end."""
    if length >= full_length - eps:
        return 1.0
    return 0.0 if length <= eps else length / full_length


cdef inline (double, double) _tangent_after(double[:, ::1] curves, Int i, double length) noexcept:
    turn = length * curves[i, SWEEP] / curves[i, LENGTH]
    cosine, sine = math.cos(turn), math.sin(turn)
    tx, ty = curves[i, TX], curves[i, TY]
    return cosine * tx - sine * ty, cosine * ty + sine * tx


cdef (double, double, double, double) _common_points(
    double[:, ::1] a, double[:, ::1] b, Int i, Int j
) noexcept:
    """Return the two points that the infinite lines or full circles share (intersect.py derives
    them); NaN if there are none. Row j of b has the larger curvature.

    Where they miss each other, both are the point of the common line nearest to the more curved
    one.
    """
    # All is told from the start of the rounder one.
    k_flat, k_round = a[i, BEND], b[j, BEND]
    nx, ny, mx, my = -b[j, TY], b[j, TX], -a[i, TY], a[i, TX]
    wx, wy = a[i, AX] - b[j, AX], a[i, AY] - b[j, AY]
    ratio = 0.0 if k_round == 0.0 else k_flat / k_round
    across_x, across_y = mx + k_flat * wx - ratio * nx, my + k_flat * wy - ratio * ny
    height = 0.5 * k_flat * (wx * wx + wy * wy) + mx * wx + my * wy
    size = math.hypot(across_x, across_y)
    ux, uy = across_x / size, across_y / size
    fx, fy = height / size * ux, height / size * uy
    # On the line foot + τ (−uy, ux):  k τ² − 2 β τ + γ = 0.
    beta = ny * ux - nx * uy
    gamma = k_round * (fx * fx + fy * fy) - 2.0 * (nx * fx + ny * fy)
    root = beta * beta - k_round * gamma
    stable = beta + math.copysign(math.sqrt(max(root, 0.0)), beta)
    second_shift = gamma / stable if root > 0.0 or k_round == 0.0 else stable / k_round
    first_shift = second_shift if k_round == 0.0 else stable / k_round
    ox, oy = b[j, AX] + fx, b[j, AY] + fy
    return (
        ox - first_shift * uy, oy + first_shift * ux, ox - second_shift * uy,
        oy + second_shift * ux
    )


# Raw elements cut at their meetings: nodes, slices between them, and slices that lead nowhere.
#
# What makes it exact: nothing is computed here but distances of points to be merged; the rest is
# counting. The twins are in tests/oracles/offset_stages.py.


cpdef enum:
    # A point looks for no more than this many points to merge with: where more than that come
    # together, as where a circle of chords collapses, they chain up all the same.
    MAX_MERGED = 64


cpdef merged(double[:, :] points, double[::1] skew, Int[::1] order, double eps):
    """Return the node (P,) of each point (P, 2), and the first point (N,) of each node.

    Points within `eps` of each other share a node, and so do chains of them. `order` sorts the
    points by `skew` (P,), which differs between two points by no more than their distance.
    """
    cdef Int[::1] group, first, node
    cdef Int i, count, j, root, base, hits, candidate, low, high
    group = np.empty(len(points), np.int64)
    for i in range(len(points)):
        group[i] = i
    for i in range(len(order)):
        base, hits = order[i], 0
        for j in range(i + 1, len(order)):
            candidate = order[j]
            if skew[candidate] - skew[base] > eps or hits == MAX_MERGED:
                break
            apart_x, apart_y = (
                points[base, 0] - points[candidate, 0], points[base, 1] - points[candidate, 1]
            )
            if apart_x * apart_x + apart_y * apart_y <= eps * eps:
                hits += 1
                low, high = _root(group, base), _root(group, candidate)
                group[max(low, high)] = min(low, high)
    first, node = np.empty(len(points), np.int64), np.empty(len(points), np.int64)
    count = 0
    for i in range(len(points)):
        root = _root(group, i)
        if root == i:
            first[count], node[i] = i, count
            count += 1
        else:
            # Every root is less than its members, and has its number already.
            node[i] = node[root]
    return np.asarray(node), np.asarray(first[:count])


cdef Int _root(Int[::1] group, Int i) noexcept:
    """Return the lowest member of the group of i."""
    while group[i] != i:
        group[i] = group[group[i]]
        i = group[i]
    return i


cdef grouped(Int[::1] keys, Int count):
    """Return the rows (R,) sorted by their key, which is below `count`, in their order within a
    key; and where each key begins."""
    cdef Int[::1] begins, rows
    cdef Int row, key
    begins = np.zeros(count + 1, np.int64)
    for row in range(len(keys)):
        begins[keys[row] + 1] += 1
    for key in range(count):
        begins[key + 1] += begins[key]
    rows = np.empty(len(keys), np.int64)
    # Each begin moves on to its end, which is where the next one begins.
    for row in range(len(keys)):
        rows[begins[keys[row]]] = row
        begins[keys[row]] += 1
    for key in range(count, 0, -1):
        begins[key] = begins[key - 1]
    begins[0] = 0
    return np.asarray(rows), np.asarray(begins)


cpdef in_order(Int[::1] keys, double[::1] t, Int count):
    """Return the rows (R,) sorted by their key, which is below `count`, then by t (R,), then as
    they come (a shell sort)."""
    cdef Int key, gap, i, row, j
    cdef Int[::1] rows, begins, some
    rows, begins = grouped(keys, count)
    for key in range(count):
        some = rows[begins[key] : begins[key + 1]]
        gap = len(some) // 2
        while gap > 0:
            for i in range(gap, len(some)):
                row, j = some[i], i
                while j >= gap and _is_after(t, some[j - gap], row):
                    some[j] = some[j - gap]
                    j -= gap
                some[j] = row
            gap //= 2
    return np.asarray(rows)


cdef bint _is_after(double[::1] t, Int first, Int second) noexcept:
    return bool(t[first] > t[second] or (t[first] == t[second] and first > second))


cpdef doubles_left(
    double[:, ::1] elements, Int[::1] element, double[::1] middle_t, ends, double eps
):
    """Return a mask (S,), false for repeated slices, and for both of a pair that runs the same way
    forth and back.

    `ends` holds the nodes (S,) that each slice runs from and to, and the number of nodes. Slices
    between the same nodes are the same when their middles are within `eps`.
    """
    cdef uint8_t[::1] keep
    cdef Int[::1] low_node, from_node, to_node, rows, begins
    cdef Int row, node, count, k, high_node, m, other_row
    from_node, to_node, count = ends
    keep = np.ones(len(element), np.bool_)
    low_node = np.empty(len(element), np.int64)
    for row in range(len(element)):
        low_node[row] = min(from_node[row], to_node[row])
    rows, begins = grouped(low_node, count)
    for node in range(count):
        for k in range(begins[node], begins[node + 1]):
            row = rows[k]
            high_node = max(from_node[row], to_node[row])
            for m in range(k + 1, begins[node + 1]):
                other_row = rows[m]
                if not keep[row]:
                    break
                if (
                    not keep[other_row]
                    or max(from_node[other_row], to_node[other_row]) != high_node
                ):
                    continue
                ax, ay = point_on(elements, element[row], middle_t[row])
                bx, by = point_on(elements, element[other_row], middle_t[other_row])
                if math.hypot(ax - bx, ay - by) <= eps:
                    keep[other_row] = False
                    keep[row] = from_node[row] == from_node[other_row]
    return np.asarray(keep).view(np.bool_)


cpdef leading_on(Int[::1] from_node, Int[::1] to_node, Int count):
    """Return a mask (S,), true for slices that remain after dead ends are removed, again and
    again: those to whose start another slice leads, and from whose end another one leads on."""
    cdef bint ends_here
    cdef Int first, last, node, height, k, row, end, side
    cdef uint8_t[::1] keep
    cdef Int[::1] stack, leaving, first_leaving, arriving, first_arriving, leave, arrive
    keep = np.ones(len(from_node), np.bool_)
    leaving, first_leaving = grouped(from_node, count)
    arriving, first_arriving = grouped(to_node, count)
    leave, arrive = np.empty(count, np.int64), np.empty(count, np.int64)
    for node in range(count):
        leave[node] = first_leaving[node + 1] - first_leaving[node]
        arrive[node] = first_arriving[node + 1] - first_arriving[node]
    stack = np.empty(2 * len(from_node) + count, np.int64)
    height = 0
    for node in range(count):
        if (leave[node] == 0) != (arrive[node] == 0):
            stack[height] = node
            height += 1
    while height > 0:
        height -= 1
        node = stack[height]
        ends_here = leave[node] == 0
        first = first_arriving[node] if ends_here else first_leaving[node]
        last = first_arriving[node + 1] if ends_here else first_leaving[node + 1]
        for k in range(first, last):
            row = arriving[k] if ends_here else leaving[k]
            if keep[row]:
                keep[row] = False
                leave[from_node[row]] -= 1
                arrive[to_node[row]] -= 1
                for side in range(2):
                    end = from_node[row] if side == 0 else to_node[row]
                    if (leave[end] == 0) != (arrive[end] == 0):
                        stack[height] = end
                        height += 1
    return np.asarray(keep).view(np.bool_)


# Kept slices followed to loops, and loops written down as clean vertices.
#
# The twins are in tests/oracles/offset_stages.py.


# A turn at a node this near to a full right turn is taken as a full left one.
cdef double U_TURN_EPS_RAD = 1e-3


cpdef traced(double[:, ::1] elements, Int[::1] element, double[:, ::1] span, ends):
    """Return the rows (R,) of the slices of all loops, loop by loop, and where each loop begins (L
    + 1,).

    Slice i runs on row element[i] from the fraction span[i, 0] to span[i, 1]; `ends` holds the
    nodes (S,) that each slice runs from and to, and the number of nodes. No loop passes a node
    twice. Where several slices leave a node, the leftmost one is taken.
    """
    cdef uint8_t[::1] unused
    cdef Int[::1] order_seen, from_node, to_node, leaving, first, path, rows, begins, ways
    cdef Int node, loops, start, count, length, last, next_row, low, k
    from_node, to_node, count = ends
    leaving, first = grouped(from_node, count)
    unused = np.ones(len(element), np.bool_)
    order_seen = np.empty(count, np.int64)
    for node in range(count):
        order_seen[node] = -1
    path, length = np.empty(len(element), np.int64), 0
    rows, begins = np.empty(len(element), np.int64), np.zeros(len(element) + 1, np.int64)
    loops = 0
    for start in range(len(element)):
        if not unused[start]:
            continue
        unused[start] = False
        path[0], length = start, 1
        order_seen[from_node[start]] = 0
        while length > 0:
            last = path[length - 1]
            node = to_node[last]
            if order_seen[node] >= 0:
                low = order_seen[node]
                begins[loops + 1] = begins[loops] + length - low
                for k in range(low, length):
                    rows[begins[loops] + k - low] = path[k]
                    # This node too: what is left of the path may leave it once more.
                    order_seen[from_node[path[k]]] = -1
                loops += 1
                length = low
                continue
            ways = leaving[first[node] : first[node + 1]]
            next_row = _leftmost(elements, element, span, last, unused, ways)
            if next_row < 0:
                order_seen[from_node[last]] = -1
                length -= 1
                continue
            order_seen[node] = length
            path[length] = next_row
            length += 1
            unused[next_row] = False
    return np.asarray(rows[: begins[loops]]), np.asarray(begins[: loops + 1])


cdef Int _leftmost(
    double[:, ::1] elements, Int[::1] element, double[:, ::1] span, Int last, uint8_t[::1] unused,
    Int[::1] ways
) noexcept:
    """Return the unused one of the slices `ways` that turns farthest to the left after `last`;
    turning right back counts as the farthest left. −1 when there is none."""
    cdef Int k, best, count, row
    best, max_turn, count = -1, -math.INFINITY, 0
    for k in range(len(ways)):
        row = ways[k]
        if unused[row]:
            best = row if count == 0 else best
            count += 1
    if count < 2:
        return best
    ax, ay = _tangent(elements, element[last], span[last, 1])
    for k in range(len(ways)):
        row = ways[k]
        if unused[row]:
            bx, by = _tangent(elements, element[row], span[row, 0])
            turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            if turn <= U_TURN_EPS_RAD - math.M_PI:
                turn = math.M_PI
            if turn > max_turn:
                best, max_turn = row, turn
    return best


cdef (double, double) _tangent(double[:, ::1] elements, Int i, double t) noexcept:
    turn = t * elements[i, SWEEP]
    cosine, sine = math.cos(turn), math.sin(turn)
    tx, ty = elements[i, TX], elements[i, TY]
    return cosine * tx - sine * ty, cosine * ty + sine * tx


cpdef written(slices, double[:, ::1] nodes, double[::1] sweeps, runs, double eps):
    """Return the vertices (V, 3) of runs of slices that follow each other, and where each run
    begins (L + 1,).

    `slices` are the element, span and both nodes (S,) of each slice, `sweeps` those of the
    elements. `runs` are the rows of all runs, where each begins, and whether it is closed. Slices
    of one element are joined again; segments up to `eps` are dropped. A run of which nothing is
    left has no vertices.
    """
    cdef double[:, ::1] vertices, span
    cdef Int[::1] offsets, element, from_node, to_node, rows, begins, ways
    cdef Int run, first, low, count, k, last, row
    cdef uint8_t[::1] closed
    element, span, from_node, to_node = slices
    rows, begins, closed = runs
    vertices = np.empty((len(rows) + len(closed), 3))
    offsets = np.zeros(len(closed) + 1, np.int64)
    for run in range(len(closed)):
        ways = rows[begins[run] : begins[run + 1]]
        first = _first(element, span, ways) if closed[run] else 0
        low = count = offsets[run]
        for k in range(len(ways)):
            row, last = (
                ways[(first + k) % len(ways)],
                ways[(first + k + len(ways) - 1) % len(ways)],
            )
            if k == 0 or not _goes_on(element, span, last, row):
                vertices[count, 0] = nodes[from_node[row], 0]
                vertices[count, 1] = nodes[from_node[row], 1]
                begin = span[row, 0]
                count += 1
            sweep = sweeps[element[row]] * (span[row, 1] - begin)
            vertices[count - 1, 2] = math.tan(0.25 * sweep)
        if not closed[run]:
            last = ways[len(ways) - 1]
            vertices[count, 0] = nodes[to_node[last], 0]
            vertices[count, 1] = nodes[to_node[last], 1]
            vertices[count, 2] = 0.0
            count += 1
        offsets[run + 1] = low + _cleaned(vertices[low:count], closed[run], eps)
    return np.asarray(vertices[: offsets[len(closed)]]), np.asarray(offsets)


cdef bint _goes_on(Int[::1] element, double[:, ::1] span, Int last, Int row) noexcept:
    """Return True if a slice continues along the element of the one before it."""
    return bool(element[last] == element[row] and span[row, 0] >= span[last, 1])


cdef Int _first(Int[::1] element, double[:, ::1] span, Int[::1] ways) noexcept:
    """Return the index at which a closed run may begin, so that it does not begin within an
    element."""
    cdef Int k
    for k in range(len(ways)):
        if not _goes_on(element, span, ways[k - 1 if k > 0 else len(ways) - 1], ways[k]):
            return k
    return 0


cdef Int _cleaned(double[:, ::1] vertices, bint closed, double eps):
    """Remove segments up to `eps`, and return the number of vertices that remain, which are the
    first ones.

    Each removed segment shrinks to its middle; the ends of an open path stay. 0 when nothing is
    left.
    """
    cdef Int count, remaining, row, place, height, following, earlier, k
    cdef uint8_t[::1] is_kept
    cdef Int[::1] next_rows, previous_rows, stack
    count = remaining = len(vertices)
    next_rows, previous_rows = np.empty(count, np.int64), np.empty(count, np.int64)
    stack, height = np.empty(3 * count, np.int64), count
    for row in range(count):
        next_rows[row], previous_rows[row], stack[row] = row + 1, row - 1, count - 1 - row
    next_rows[count - 1] = 0 if closed else -1
    previous_rows[0] = count - 1 if closed else -1
    is_kept = np.ones(count, np.bool_)
    while height > 0:
        height -= 1
        row = stack[height]
        following, earlier = next_rows[row], previous_rows[row]
        if not is_kept[row] or following < 0 or _length(vertices, row, following) > eps:
            continue
        if remaining <= 2:
            return 0
        # The first and the last vertex of an open path have none before and none after them.
        if next_rows[following] >= 0:
            part = 0.5 if earlier >= 0 else 0.0
            for k in range(2):
                vertices[following, k] += (1.0 - part) * (
                    vertices[row, k] - vertices[following, k]
                )
        is_kept[row] = False
        remaining -= 1
        previous_rows[following] = earlier
        stack[height] = following
        height += 1
        if earlier >= 0:
            next_rows[earlier] = following
            stack[height] = earlier
            height += 1
    place = 0
    for row in range(count):
        if is_kept[row]:
            for k in range(3):
                vertices[place, k] = vertices[row, k]
            place += 1
    return remaining


cdef double _length(double[:, ::1] vertices, Int first, Int second) noexcept:
    return (
        math.hypot(
            vertices[first, 0] - vertices[second, 0], vertices[first, 1] - vertices[second, 1]
        )
    )


# Which points a closed path of lines and arcs holds, by a ray to the right over a tree of boxes.
#
# A point is inside when it is inside the polygon of the chords, or between a chord and its arc,
# but not both. Only segments whose boxes the ray meets can say anything about either. A point
# exactly on a chord is taken as a hair up and to the right of it. What makes it exact: products of
# the given numbers, and their signs. `tests/oracles/inside.py` is the twin, over all segments.


cpdef enum:
    # What is said of a path: some of it is outside; inside; all of it is on the line itself.
    OUT = 0, HELD, ON_LINE


cpdef insides(
    double[:, ::1] points, double[:, ::1] curves, double[::1] bulge, double[:, ::1] tree
):
    """Return a mask (P,), true for points (P, 2) inside a closed path; on the line either value
    may result.

    `curves` (K, 11) and `tree` as in offset_curves and box_tree, `bulge` (K,).
    """
    cdef Int i
    cdef uint8_t[::1] inside
    cdef Int[::1] stack
    inside, stack = np.empty(len(points), np.bool_), np.empty(DEPTH, np.int64)
    for i in range(len(points)):
        inside[i] = is_inside(curves, bulge, tree, points[i, 0], points[i, 1], stack)
    return np.asarray(inside).view(np.bool_)


cdef bint is_inside(
    double[:, ::1] curves, double[::1] bulge, double[:, ::1] tree, double x, double y,
    Int[::1] stack
) noexcept:
    """Return True if a closed path encloses a point; `stack` (`DEPTH`,) is a scratch buffer."""
    cdef Int leaves, height, node, low, row
    cdef bint odd
    leaves, odd = len(tree) // 2, False
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        if tree[node, 2] < x or tree[node, 1] > y or tree[node, 3] < y:
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node + 1, 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(curves))):
            odd = odd != _counts(curves, row, bulge[row], x, y)
    return bool(odd)


cdef inline bint _counts(double[:, ::1] curves, Int i, double bulge, double x, double y) noexcept:
    """Return True if a ray from the point to the right crosses the chord, or the point lies
    between chord and arc, but not both."""
    cdef bint crosses, in_circle, on_left
    ax, ay, bx, by = curves[i, AX], curves[i, AY], curves[i, BX], curves[i, BY]
    dx, dy = bx - ax, by - ay
    side = dx * (y - ay) - dy * (x - ax)
    crosses = (ay > y) != (by > y) and (side > 0.0 if by > ay else side < 0.0)
    if bulge == 0.0:
        return bool(crosses)
    # A positive bulge lies to the right of its chord. Within the circle its power is negative.
    power = 4.0 * bulge * ((x - ax) * (x - bx) + (y - ay) * (y - by))
    power -= 2.0 * (1.0 - bulge * bulge) * side
    in_circle = power < 0.0 if bulge > 0.0 else power > 0.0
    hair = dx if dy == 0.0 else -dy
    on_left = (hair if side == 0.0 else side) > 0.0
    return bool(crosses != (in_circle and on_left == (bulge < 0.0)))


cpdef holds(double[:, ::1] points, Int[::1] begins, ring, Int[::1] paths, double eps):
    """Return (N,) OUT, HELD or ON_LINE for each of `paths` (N,): path k has the points begins[k] …
    of `points` (P, 2).

    `ring` holds curves, bulge and tree of a closed path; a path within `eps` of its line is
    neither outside nor inside.
    """
    cdef Int[::1] positions, stack
    cdef Int n, k
    cdef double[:, ::1] curves, tree
    cdef double[::1] bulge, squares
    curves, bulge, tree = ring
    positions = np.empty(len(paths), np.int64)
    stack, squares = np.empty(DEPTH, np.int64), np.empty(DEPTH)
    for n in range(len(paths)):
        positions[n] = ON_LINE
        for k in range(begins[paths[n]], begins[paths[n] + 1]):
            x, y = points[k, 0], points[k, 1]
            if least_below(curves, tree, x, y, 2.0 * eps, eps, stack, squares) <= eps:
                continue
            if not is_inside(curves, bulge, tree, x, y, stack):
                positions[n] = OUT
                break
            positions[n] = HELD
    return np.asarray(positions)
