"""Curves and points as arcs: Bézier pieces cut into nodes, biarcs and arcs over them, arcs found
in chains of chords, and the segments nearest to points.

Compiled, because each of many is measured against many; C types stand in the .pxd beside this
file. What each part does is said above it.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.offsets import DEPTH, apart_square, rows_under, tree_of, wait_for_children

# Every number that decides how curves become arcs.


POSITION_EPS_MM = 1e-6
"""Two positions nearer than this are one, as in `camtool.geometry.polylines`."""

SPAN_TURN_RAD = math.pi * (1.0 + 1e-9)
"""A biarc covers no more turning than a half circle (and rounding)."""

SINGLE_TURN_RAD = 4e-4
"""One arc or line takes the place of a biarc when both its ends leave the curve's own tangents by
no more; two of them make a joint of less than 1e-3 rad."""

STRAIGHT_SAGITTA_MM = 1e-7
"""An arc that leaves its chord by no more is a line."""

MAX_RADIUS_MM = 1e6
"""An arc of a larger radius is written as lines: a centre a kilometre away has no digits left."""

FLAT_SHARE = 0.02
"""Those lines leave the arc by no more than this share of the tolerance."""

MAX_LINES = 100_000
"""No arc is cut into more lines."""

SAME_ARC_MM = 1e-8
"""Neighbours that leave a common arc or line by no more become one."""

CANDIDATES = 2
"""Nodes kept for each number of arcs: the furthest, and others evenly short of it."""

SEARCH_SHARE = 0.97
"""The share of the tolerance that the search may use up: errors peak between nodes."""

MEASURE_STEPS = 8
"""Points per step between nodes at which the final error is measured."""

ACCEPTED_SHARE = 0.995
"""A fit is accepted when its measured error is within this share of the tolerance: what lies
between the points at which it is measured may be a little more."""

ATTEMPTS = 8
"""How often a fit whose measured error is too large is done again, each time finer."""

REFINING = 1.0 / 8.0
"""The share of its error that a step between nodes may keep at each further attempt."""

CORNER_ANGLE_RAD = 1e-6
"""Tangents before and after a node that differ by more make it a corner."""

STEP_TURN_RAD = 0.5
"""No step between two nodes turns by more, save at a corner."""

STEP_ERROR_SHARE = 1.0 / 4096.0
"""A step's biarc is off by no more than this share of the tolerance: some 16 steps an arc pair."""

VANISHING_TANGENT = 1e-9
"""Shorter than this share of the longest tangent, a tangent has no direction: look beside it."""

ASIDE_FROM = -9
"""Power of ten: how far aside (share of the way to the next break) to look for a direction."""

ASIDE_TO = -2
"""The power of ten at which that look aside gives up."""

MIN_STEPS = 32
"""Steps that every curve is cut into at first."""

MAX_NODES = 200_000
"""No more refining above this many nodes."""

SLOW_SHARE = 0.5
"""Where a piece moves at less than this share of its largest speed, its slowest point is looked
for: tips and cusps."""

GOLDEN_ROUNDS = 60
"""Rounds of that search: they shrink a bracket by 3e-13."""

# Points, tangents and nodes of rational Bézier pieces.
#
# A curve is `pieces` (m, p + 1, 3) of control points x·w, y·w, w, joined end to end, and its
# parameter runs from 0 to m: the whole part says which piece, the rest where in it.
# `camtool.geometry.fit` says the same for any curve, and the tests hold the two together;
# `tests/oracles/curves.py` measures both.


GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""A search for a least value by golden sections keeps this share of its bracket."""


def evaluate(pieces: Floats, k: int, u: float) -> tuple[float, float, float, float]:
    """Position and derivative by u of piece k at u in 0..1: x, y, x', y'.

    Bernstein sums by a Horner scheme for both the piece A and its hodograph A' = p Σ ΔA Bᵖ⁻¹; of
    the quotient (x, y) = A/w the derivative is (A'w − A w')/w².
    """
    degree = pieces.shape[1] - 1
    v = 1.0 - u
    x, y, w = pieces[k, 0, 0], pieces[k, 0, 1], pieces[k, 0, 2]
    dx, dy, dw = pieces[k, 1, 0] - x, pieces[k, 1, 1] - y, pieces[k, 1, 2] - w
    x, y, w = x * v, y * v, w * v
    above, slope, last = 1.0, 1.0, u
    for i in range(1, degree):
        above *= float(degree - i + 1) / float(i) * u
        slope *= float(degree - i) / float(i) * u
        last *= u
        ax, ay, aw = pieces[k, i, 0], pieces[k, i, 1], pieces[k, i, 2]
        dx = dx * v + slope * (pieces[k, i + 1, 0] - ax)
        dy = dy * v + slope * (pieces[k, i + 1, 1] - ay)
        dw = dw * v + slope * (pieces[k, i + 1, 2] - aw)
        x, y, w = (x + above * ax) * v, (y + above * ay) * v, (w + above * aw) * v
    x += last * pieces[k, degree, 0]
    y += last * pieces[k, degree, 1]
    w += last * pieces[k, degree, 2]
    share = float(degree) / (w * w)
    return x / w, y / w, share * (dx * w - x * dw), share * (dy * w - y * dw)


def samples_between(pieces: Floats, t: Floats) -> Floats:
    """((n − 1) · `MEASURE_STEPS` + 1, 2) positions: so many from each of the parameters t (n,) in
    0..m on to the next one, and that at the last."""
    out = np.empty(((len(t) - 1) * MEASURE_STEPS + 1, 2))
    for i in range(len(out)):
        row, j = i // MEASURE_STEPS, i % MEASURE_STEPS
        here = t[row]
        if j > 0:
            here += float(j) / float(MEASURE_STEPS) * (t[row + 1] - t[row])
        k = min(int(here), len(pieces) - 1)
        x, y, _, _ = evaluate(pieces, k, here - float(k))
        out[i, 0], out[i, 1] = x, y
    return np.asarray(out)


def speed(pieces: Floats, k: int, u: float) -> float:
    """The length of the derivative by u."""
    _, _, dx, dy = evaluate(pieces, k, u)
    return math.sqrt(dx * dx + dy * dy)


def aside(pieces: Floats, k: int, u: float, side: float, least: float) -> tuple[float, float]:
    """Unit tangent a little before (side −1) or after (+1) u, where the piece is faster than
    `least`."""
    if u <= 0.0 or u >= 1.0:
        side = 1.0 if u <= 0.0 else -1.0  # at the ends of a piece look inside
    for exponent in range(ASIDE_FROM, ASIDE_TO):
        beside = min(max(u + side * math.pow(10.0, float(exponent)), 0.0), 1.0)
        _, _, dx, dy = evaluate(pieces, k, beside)
        length = math.sqrt(dx * dx + dy * dy)
        if length > least:
            return dx / length, dy / length
    return 1.0, 0.0  # the curve stands still here: such nodes are merged


def slowest(pieces: Floats, k: int, low: float, high: float) -> float:
    """The u between low and high where the piece moves slowest: golden section."""
    one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_one, at_two = speed(pieces, k, one), speed(pieces, k, two)
    for _ in range(GOLDEN_ROUNDS):
        if at_one < at_two:
            high, two, at_two = two, one, at_one
            one = high - GOLDEN * (high - low)
            at_one = speed(pieces, k, one)
        else:
            low, one, at_one = one, two, at_two
            two = low + GOLDEN * (high - low)
            at_two = speed(pieces, k, two)
    return 0.5 * (low + high)


def first_steps(pieces: Floats, k: int, each: int) -> tuple[Floats, float]:
    """The u (≥ each + 1,) that piece k is cut at first, tips and cusps among them; its speed."""
    speeds = np.empty(each + 1)
    fastest = 0.0
    for i in range(each + 1):
        speeds[i] = speed(pieces, k, float(i) / float(each))
        fastest = max(fastest, speeds[i])
    out = np.empty(2 * each + 2)
    count = 0
    for i in range(each + 1):
        here = float(i) / float(each)
        tip = here
        before, after = max(i - 1, 0), min(i + 1, each)
        if speeds[i] <= min(speeds[before], speeds[after]) and speeds[i] < SLOW_SHARE * fastest:
            tip = slowest(pieces, k, float(before) / float(each), float(after) / float(each))
        for side in range(2):
            u = min(tip, here) if side == 0 else max(tip, here)
            if count == 0 or out[count - 1] < u <= 1.0:
                out[count] = u
                count += 1
    out[0] = 0.0
    return np.asarray(out[:count]), fastest


def too_coarse(
    pieces: Floats, k: int, before: Floats, i: int, behind: Floats, j: int, tolerance: float
) -> bool:
    """Whether the step between two rows (u, x, y, arrive x, y, leave x, y), row i of those before
    and row j of those behind, must be halved."""
    low, high = before[i, 0], behind[j, 0]
    middle = 0.5 * (low + high)
    if not low < middle < high:
        return False
    ax, ay, bx, by = before[i, 1], before[i, 2], behind[j, 1], behind[j, 2]
    leave_x, leave_y, arrive_x, arrive_y = before[i, 5], before[i, 6], behind[j, 3], behind[j, 4]
    pair = biarc(ax, ay, leave_x, leave_y, bx, by, arrive_x, arrive_y)
    bends = leave_x * arrive_x + leave_y * arrive_y < math.cos(STEP_TURN_RAD)
    reach = 0.0
    for turn in range(3):
        # Halfway first, then a quarter and three quarters.
        share = 0.5 if turn == 0 else 0.25 if turn == 1 else 0.75
        x, y, _, _ = evaluate(pieces, k, low + share * (high - low))
        reach = max(reach, abs(x - ax), abs(y - ay), abs(x - bx), abs(y - by))
        if not bends:
            off = distance_to_biarc(x, y, ax, ay, bx, by, pair)
            bends = off > STEP_ERROR_SHARE * tolerance
        if bends and reach > POSITION_EPS_MM:
            return True
    return False


def piece_rows(pieces: Floats, k: int, each: int, tolerance: float, most: int) -> Floats:
    """Nodes (n, 7) of piece k: u, x, y, tangents before and after; begun with `each` steps.

    Steps are halved from left to right; the stack holds the right ends of those still to do.
    """
    grid, fastest = first_steps(pieces, k, each)
    least = VANISHING_TANGENT * fastest
    stack = np.empty((64, 7))
    out = np.empty((512, 7))
    fill_row(pieces, k, 0.0, least, out, 0)
    count = 1
    for i in range(1, len(grid)):
        fill_row(pieces, k, grid[i], least, stack, 0)
        depth = 1
        while depth > 0:
            last, top = count - 1, depth - 1
            fine = depth < len(stack) and count < most
            if fine and too_coarse(pieces, k, out, last, stack, top, tolerance):
                middle = 0.5 * (out[last, 0] + stack[top, 0])
                fill_row(pieces, k, middle, least, stack, depth)
                depth += 1
                continue
            if count == len(out):
                out = np.concatenate([out, out])
            for column in range(7):
                out[count, column] = stack[top, column]
            count += 1
            depth -= 1
    return np.asarray(out[:count])


def fill_row(pieces: Floats, k: int, u: float, least: float, rows: Floats, i: int) -> None:
    """Write u, x, y, tangent before and tangent after into row i of `rows` (n, 7)."""
    x, y, dx, dy = evaluate(pieces, k, u)
    length = math.sqrt(dx * dx + dy * dy)
    rows[i, 0], rows[i, 1], rows[i, 2] = u, x, y
    if length > least:
        rows[i, 3], rows[i, 4] = dx / length, dy / length
        rows[i, 5], rows[i, 6] = rows[i, 3], rows[i, 4]
    else:
        dx, dy = aside(pieces, k, u, -1.0, least)
        rows[i, 3], rows[i, 4] = dx, dy
        dx, dy = aside(pieces, k, u, 1.0, least)
        rows[i, 5], rows[i, 6] = dx, dy


def curve_rows(pieces: Floats, steps: int, tolerance: float) -> tuple[Floats, Bools]:
    """Nodes (n, 7) of all pieces, t in 0..m in place of u, and which of them are corners.

    Nodes no farther apart than `POSITION_EPS_MM` become one: it arrives as the first and leaves
    as the last of them.
    """
    each = max(4, (steps + len(pieces) - 1) // len(pieces))
    out = np.empty((256, 7))
    count = 0
    for k in range(len(pieces)):
        rows = piece_rows(pieces, k, each, tolerance, max(MAX_NODES - count, 2))
        if count + len(rows) > len(out):
            grown = np.empty((2 * (count + len(rows)), 7))
            grown[:count] = out[:count]
            out = grown
        for i in range(len(rows)):
            last = max(count - 1, 0)
            apart = math.hypot(rows[i, 1] - out[last, 1], rows[i, 2] - out[last, 2])
            if count == 0 or apart > POSITION_EPS_MM:
                out[count, 0] = rows[i, 0] + float(k)
                for column in range(1, 7):
                    out[count, column] = rows[i, column]
                count += 1
            else:
                out[last, 5], out[last, 6] = rows[i, 5], rows[i, 6]
    x, y, _, _ = evaluate(pieces, len(pieces) - 1, 1.0)
    out[count - 1, 1], out[count - 1, 2] = x, y
    if count > 1:
        out[count - 1, 0] = float(len(pieces))
    corner = np.zeros(count, dtype=np.bool_)
    for i in range(count):
        cross = out[i, 3] * out[i, 6] - out[i, 4] * out[i, 5]
        dot = out[i, 3] * out[i, 5] + out[i, 4] * out[i, 6]
        corner[i] = abs(math.atan2(cross, dot)) > CORNER_ANGLE_RAD
    corner[0] = corner[count - 1] = True
    return np.asarray(out[:count]), np.asarray(corner).view(np.bool_)


# Biarcs, distances to arcs, and how far arcs and biarcs stray from nodes on a curve.
#
# What makes it exact: no centre is ever formed, so an arc may be as flat as it likes; for a bulge
# of 0 each formula becomes the one of the straight line. `tests/oracles/arcs.py` is the twin.


def distance_to_arc(
    px: float, py: float, ax: float, ay: float, bx: float, by: float, bulge: float
) -> float:
    """Distance from p to the arc from a to b, |bulge| ≤ 1, to its nearer end beside the arc.

    With w = p − a, u = b − a, n = u turned by +90°, the power of p over the circle and the vector
    from the centre, both times the bulge, need no centre:
        b·power = b(w·w − w·u) − (1 − b²)/2 w·n,   q = b(w − u/2) − (1 − b²)/4 n,
        distance to the circle = |b·power| / (|q| + |u|(1 + b²)/4).
    p lies beside the arc when it is behind the normal at one of its ends, whose tangents are
    (1 − b²) u ∓ 2b n.
    """
    wx, wy, vx, vy = px - ax, py - ay, px - bx, py - by
    ux, uy = bx - ax, by - ay
    rest = 1.0 - bulge * bulge
    forward = wx * (rest * ux + 2.0 * bulge * uy) + wy * (rest * uy - 2.0 * bulge * ux)
    behind = vx * (rest * ux - 2.0 * bulge * uy) + vy * (rest * uy + 2.0 * bulge * ux)
    square = ux * ux + uy * uy
    if square == 0.0 or forward < 0.0 or behind > 0.0:
        return math.sqrt(min(wx * wx + wy * wy, vx * vx + vy * vy))
    power = bulge * (wx * vx + wy * vy) - 0.5 * rest * (wy * ux - wx * uy)
    qx = bulge * (wx - 0.5 * ux) + 0.25 * rest * uy
    qy = bulge * (wy - 0.5 * uy) - 0.25 * rest * ux
    below = math.sqrt(qx * qx + qy * qy) + 0.25 * math.sqrt(square) * (1.0 + bulge * bulge)
    return abs(power) / below


def half_angle(ax: float, ay: float, bx: float, by: float) -> float:
    """tan(α/2) = sin α / (1 + cos α) for the angle α from a to b; NaN when |α| > 90°.

    An arc of sweep s leaves the direction of its chord by s/2, so its bulge tan(s/4) is tan(α/2)
    with α between tangent and chord.
    """
    cosine = ax * bx + ay * by
    below = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + cosine
    if below <= 0.0:
        return math.nan
    bulge = (ax * by - ay * bx) / below
    if abs(bulge) > 1.0 + 1e-12:
        return math.nan
    return min(max(bulge, -1.0), 1.0)


def biarc(
    start_x: float,
    start_y: float,
    leave_x: float,
    leave_y: float,
    end_x: float,
    end_y: float,
    arrive_x: float,
    arrive_y: float,
) -> tuple[float, float, float, float]:
    """Joint x, y and both bulges of the biarc with equal handles; all NaN where there is none.

    Handles of length d reach Q0 = start + d·leave and Q1 = end − d·arrive; the arcs meet in the
    middle of Q0Q1 when |Q1 − Q0| = 2d. With v = end − start, s = leave + arrive, c = leave·arrive:
        d²(2 − 2c) + 2d v·s − v·v = 0   ⇒   d = v·v / (v·s + √((v·s)² + 2(1 − c) v·v)).
    None where no d > 0 does it, or where an arc would be more than a half circle.
    """
    vx, vy = end_x - start_x, end_y - start_y
    square = vx * vx + vy * vy
    along = vx * (leave_x + arrive_x) + vy * (leave_y + arrive_y)
    cosine = leave_x * arrive_x + leave_y * arrive_y
    below = along + math.sqrt(along * along + 2.0 * max(1.0 - cosine, 0.0) * square)
    if square == 0.0 or below <= 0.0:
        return math.nan, math.nan, math.nan, math.nan
    handle = square / below
    jx = 0.5 * (start_x + end_x + handle * (leave_x - arrive_x))
    jy = 0.5 * (start_y + end_y + handle * (leave_y - arrive_y))
    first = half_angle(leave_x, leave_y, jx - start_x, jy - start_y)
    second = half_angle(end_x - jx, end_y - jy, arrive_x, arrive_y)
    if math.isnan(first) or math.isnan(second):
        return math.nan, math.nan, math.nan, math.nan
    return jx, jy, first, second


def distance_to_biarc(
    px: float,
    py: float,
    start_x: float,
    start_y: float,
    end_x: float,
    end_y: float,
    pair: tuple[float, float, float, float],
) -> float:
    """Distance from p to the nearer of both arcs; infinite when there is no biarc."""
    jx, jy, first, second = pair
    if math.isnan(jx):
        return math.inf
    one = distance_to_arc(px, py, start_x, start_y, jx, jy, first)
    two = distance_to_arc(px, py, jx, jy, end_x, end_y, second)
    return min(one, two)


def over(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int
) -> tuple[float, float, float, float]:
    """The `biarc` over the nodes low..high."""
    return biarc(
        point[low, 0],
        point[low, 1],
        leave[low, 0],
        leave[low, 1],
        point[high, 0],
        point[high, 1],
        arrive[high, 0],
        arrive[high, 1],
    )


def step_errors(
    point: Floats, leave: Floats, arrive: Floats, rows: Ints, probes: Floats
) -> Floats:
    """For each step from node rows[i] (k,) to the next: the largest distance of its probes
    (j, k, 2) from the biarc over the step, infinite when there is none."""
    out = np.empty(len(rows))
    for i in range(len(rows)):
        a, b = rows[i], rows[i] + 1
        pair = over(point, leave, arrive, a, b)
        ax, ay, bx, by = point[a, 0], point[a, 1], point[b, 0], point[b, 1]
        out[i] = 0.0
        for j in range(len(probes)):
            off = distance_to_biarc(probes[j, i, 0], probes[j, i, 1], ax, ay, bx, by, pair)
            out[i] = max(out[i], off)
    return np.asarray(out)


def span_error(point: Floats, leave: Floats, arrive: Floats, low: int, high: int) -> float:
    """The largest distance of the nodes between from the biarc over nodes low..high."""
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    pair = over(point, leave, arrive, low, high)
    largest = math.inf if math.isnan(pair[0]) else 0.0
    for i in range(low + 1, high):
        off = distance_to_biarc(point[i, 0], point[i, 1], ax, ay, bx, by, pair)
        largest = max(largest, off)
    return largest


def span_holds(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int, target: float
) -> bool:
    """Whether `span_error` is within the target; it stops at the first node that is not."""
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    pair = over(point, leave, arrive, low, high)
    if math.isnan(pair[0]):
        return False
    for i in range(high - 1, low, -1):
        if distance_to_biarc(point[i, 0], point[i, 1], ax, ay, bx, by, pair) > target:
            return False
    return True


def arc_error(point: Floats, low: int, high: int, bulge: float) -> float:
    """The largest distance of the nodes between from the arc or line over nodes low..high."""
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    largest = 0.0
    for i in range(low + 1, high):
        off = distance_to_arc(point[i, 0], point[i, 1], ax, ay, bx, by, bulge)
        largest = max(largest, off)
    return largest


# The search for the longest arcs and biarcs along nodes on a curve.
#
# The error of a biarc grows with the third power of its length, which tells how far to reach next;
# bisection settles the rest. One arc or line in place of two is taken where the curve is one.


def longest_span(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    low: int,
    furthest: int,
    guess: int,
    target: float,
) -> int:
    """The end node of the longest biarc from node `low` whose error is within `target`.

    error ∝ length³   ⇒   the length that fits is about length · (target / error)^(1/3).
    That rule leads for a few tries, bisection then; at least one step is taken.
    """
    best, beyond, high, tries = low + 1, furthest + 1, guess, 0
    while beyond - best > 1:
        high = min(max(high, best + 1), beyond - 1)
        error = span_error(point, leave, arrive, low, high)
        ratio = 4.0 if error == 0.0 else min(4.0, (target / error) ** (1.0 / 3.0))
        ahead = int(0.98 * ratio * float(high - low))
        reach = low + ahead
        if error <= target:
            best = high
        else:
            beyond = high
        tries += 1
        high = reach if tries <= 4 and ratio > 0.0 else (best + beyond) // 2
    return best


def single_bulge(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int, target: float
) -> float:
    """The bulge of the one arc or line that stands for the nodes low..high; NaN for none.

    With α from the first tangent to the chord and β from the chord to the last one, an arc of
    sweep α + β leaves both tangents by |α − β| / 2.
    """
    ux, uy = point[high, 0] - point[low, 0], point[high, 1] - point[low, 1]
    # |sin α − sin β| ≤ |α − β|: most nodes are told here, without a root.
    askew = (leave[low, 0] + arrive[high, 0]) * uy - (leave[low, 1] + arrive[high, 1]) * ux
    if askew * askew > 4.0 * SINGLE_TURN_RAD * SINGLE_TURN_RAD * (ux * ux + uy * uy):
        return math.nan
    first = half_angle(leave[low, 0], leave[low, 1], ux, uy)
    second = half_angle(ux, uy, arrive[high, 0], arrive[high, 1])
    first, second = 2.0 * math.atan(first), 2.0 * math.atan(second)
    if not abs(first - second) <= 2.0 * SINGLE_TURN_RAD:
        return math.nan
    half = 0.5 * (first + second)
    if math.sqrt(ux * ux + uy * uy) > 2.0 * MAX_RADIUS_MM * abs(math.sin(half)):
        # Radius = chord / (2 sin(sweep/2)): too flat for an arc, so a line or nothing.
        level = max(abs(first), abs(second)) <= SINGLE_TURN_RAD
        return 0.0 if level and arc_error(point, low, high, 0.0) <= target else math.nan
    bulge = min(max(math.tan(0.5 * half), -1.0), 1.0)
    return bulge if arc_error(point, low, high, bulge) <= target else math.nan


def longest_single(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    low: int,
    least: int,
    most: int,
    guess: int,
    target: float,
) -> tuple[int, float]:
    """End node and bulge of the longest single arc or line from `low` that ends after `least`
    and not after `most`; NaN when there is none.

    Tangents may suit far off and not before (about an axis of symmetry), so all nodes are tried,
    from the far end of a window of 2 · `guess` nodes that grows as long as its end is reached.
    """
    beyond, best, bulge = least, least, math.nan
    while best == beyond and beyond < most:
        least = beyond
        beyond = min(max(low + 2 * guess, 2 * beyond - low), most)
        for high in range(beyond, least, -1):
            found = single_bulge(point, leave, arrive, low, high, target)
            if not math.isnan(found):
                best, bulge = high, found
                break
        if beyond == least:
            break
    return best, bulge


def furthest_nodes(leave: Floats, arrive: Floats, corner: Bools) -> Ints:
    """(n,) the last node that a span from each node may reach: the next corner, or where the curve
    has turned by `SPAN_TURN_RAD`, to either side."""
    count = len(leave)
    turned = np.zeros(count)
    for i in range(1, count):
        cross = leave[i - 1, 0] * arrive[i, 1] - leave[i - 1, 1] * arrive[i, 0]
        dot = leave[i - 1, 0] * arrive[i, 0] + leave[i - 1, 1] * arrive[i, 1]
        turned[i] = turned[i - 1] + abs(math.atan2(cross, dot))
    out = np.zeros(count, dtype=np.int64)
    last = 0
    for i in range(count - 1):
        last = max(last, i + 1)
        while not corner[last] and turned[last + 1] - turned[i] <= SPAN_TURN_RAD:
            last += 1
        out[i] = last
    return np.asarray(out)


def furthest_state(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    limit: Ints,
    states: Ints,
    now: int,
    guess: int,
    target: float,
) -> tuple[int, int, float]:
    """The furthest node at the price that begins at row `now` of `states` (node −1: none), the row
    whence it is reached, and the bulge of the single arc or line that does it (NaN: a biarc)."""
    best, whence, bulge = states[now - CANDIDATES], now - CANDIDATES, math.nan
    for row in range(max(now - 2 * CANDIDATES, 0), now):
        low = states[row]
        if low < 0 or limit[low] <= best:
            continue
        if row >= now - CANDIDATES:
            high, found = longest_single(
                point, leave, arrive, low, best, limit[low], guess, target
            )
            if high > best:
                best, whence, bulge = high, row, found
            continue
        first = row == now - 2 * CANDIDATES
        if first or span_holds(point, leave, arrive, low, best + 1, target):
            begin = low + guess if first else best + 2
            high = longest_span(point, leave, arrive, low, limit[low], begin, target)
            if high > best:
                best, whence, bulge = high, row, math.nan
    return best, whence, bulge


def longest_spans(
    point: Floats, leave: Floats, arrive: Floats, corner: Bools, target: float
) -> tuple[Ints, Floats]:
    """Nodes (s + 1,) between the spans of a chain of few arcs; joint and bulges (s, 4) of each.

    `point`, `leave`, `arrive` (n, 2), `corner` (n,). A span of one arc or line has its bulge in
    the third column and NaN elsewhere. No span runs past a corner or turns by more than
    `SPAN_TURN_RAD`.

    Price by price (1, 2, 3 … arcs) the furthest node is found that one arc leads to from a node of
    the price before, or a biarc from two prices before. A few nodes short of it are kept as well:
    a span that takes a sharp tip in its middle may have to begin there.
    """
    count = len(point)
    limit = furthest_nodes(leave, arrive, corner)
    states = np.zeros(CANDIDATES * (2 * count + 2), dtype=np.int64)
    whence = np.zeros(len(states), dtype=np.int64)
    bulges = np.zeros(len(states))
    for row in range(1, len(states)):
        states[row] = -1
    now, guess = 0, count
    while states[now] < count - 1:
        now += CANDIDATES
        best, row, bulge = furthest_state(point, leave, arrive, limit, states, now, guess, target)
        before, low, guess = states[now - CANDIDATES], states[row], best - states[row]
        for m in range(CANDIDATES):
            place = best - m * (best - before) // CANDIDATES
            if m > 0:
                if place <= before or place == states[now + m - 1]:
                    continue
                if not math.isnan(bulge):
                    bulge = single_bulge(point, leave, arrive, low, place, target)
                    if math.isnan(bulge):
                        break
                elif not span_holds(point, leave, arrive, low, place, target):
                    continue
            states[now + m], whence[now + m], bulges[now + m] = place, row, bulge
    spans, row = 0, now
    while row > 0:
        spans += 1 if states[row] > states[whence[row]] else 0
        row = whence[row]
    ends = np.zeros(spans + 1, dtype=np.int64)
    pairs = np.empty((spans, 4))
    row = now
    while row > 0:
        low, high, bulge = states[whence[row]], states[row], bulges[row]
        row = whence[row]
        if low == high:
            continue
        jx, jy, first, second = math.nan, math.nan, bulge, math.nan
        if math.isnan(bulge):
            jx, jy, first, second = over(point, leave, arrive, low, high)
        spans -= 1
        pairs[spans, 0], pairs[spans, 1], pairs[spans, 3] = jx, jy, second
        pairs[spans, 2] = 0.0 if math.isnan(first) else first
        ends[spans + 1] = high
    return np.asarray(ends), np.asarray(pairs)


# Spans of biarcs, arcs and lines as one chain of segments, and its distance from the curve.
#
# Vertices are rows x, y, bulge; the last row is the end of the chain.


def lines_for(ax: float, ay: float, bx: float, by: float, bulge: float, off: float) -> int:
    """How many lines stand for an arc that is too flat to be written; 0 when it stays an arc.

    sagitta = |bulge| · chord / 2, radius = chord (1 + b²) / (4 |b|) and each of n lines leaves the
    arc by sagitta / n².
    """
    chord = math.hypot(bx - ax, by - ay)
    sagitta = 0.5 * abs(bulge) * chord
    if sagitta <= STRAIGHT_SAGITTA_MM:
        return 1
    if chord * (1.0 + bulge * bulge) <= 4.0 * abs(bulge) * MAX_RADIUS_MM:
        return 0
    return int(min(math.ceil(math.sqrt(sagitta / off)), float(MAX_LINES)))


def chain(point: Floats, ends: Ints, pairs: Floats, tolerance: float) -> tuple[Floats, Ints]:
    """Rows (n + 1, 3) of all spans and the number of the first row of each (s + 1,).

    Arcs that leave their chord by `STRAIGHT_SAGITTA_MM` or less, and flat ones, are lines.
    """
    spans = len(pairs)
    arcs = np.empty((2 * spans + 1, 3))
    owner = np.empty(2 * spans + 1, dtype=np.int64)
    count = 0
    for s in range(spans):
        k = ends[s]
        arcs[count, 0], arcs[count, 1], arcs[count, 2] = point[k, 0], point[k, 1], pairs[s, 2]
        owner[count] = s
        count += 1
        if not math.isnan(pairs[s, 0]):
            arcs[count, 0], arcs[count, 1], arcs[count, 2] = pairs[s, 0], pairs[s, 1], pairs[s, 3]
            owner[count] = s
            count += 1
    k = ends[spans]
    arcs[count, 0], arcs[count, 1], arcs[count, 2] = point[k, 0], point[k, 1], 0.0
    total = 0
    parts = np.empty(count, dtype=np.int64)
    for i in range(count):
        ax, ay, bulge = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        bx, by = arcs[i + 1, 0], arcs[i + 1, 1]
        parts[i] = lines_for(ax, ay, bx, by, bulge, FLAT_SHARE * tolerance)
        total += max(parts[i], 1)
    rows = np.empty((total + 1, 3))
    first = np.zeros(spans + 1, dtype=np.int64)
    made = 0
    for i in range(count):
        ax, ay, bulge = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        if i == 0 or owner[i] != owner[i - 1]:
            first[owner[i]] = made
        ux, uy = arcs[i + 1, 0] - ax, arcs[i + 1, 1] - ay
        for j in range(max(parts[i], 1)):
            # On a flat arc the point at the share h of the chord lies beside it by 2b·h(1 − h)·u.
            h = float(j) / float(max(parts[i], 1))
            off = 2.0 * bulge * h * (1.0 - h)
            rows[made, 0], rows[made, 1] = ax + h * ux + off * uy, ay + h * uy - off * ux
            rows[made, 2] = bulge if parts[i] == 0 else 0.0
            made += 1
    rows[made, 0], rows[made, 1], rows[made, 2] = point[k, 0], point[k, 1], 0.0
    first[spans] = made
    return np.asarray(rows), np.asarray(first)


def common_bulge(rows: Floats, one: int, end_x: float, end_y: float) -> float:
    """The bulge of the one arc or line that both segments lie on which begin at `one` and at the
    row after it and end there, or NaN."""
    two = one + 1
    ax, ay, a = rows[one, 0], rows[one, 1], rows[one, 2]
    bx, by, b = rows[two, 0], rows[two, 1], rows[two, 2]
    if a * b < 0.0 or (a == 0.0) != (b == 0.0):
        return math.nan
    sweep = 4.0 * (math.atan(a) + math.atan(b))
    if abs(sweep) > SPAN_TURN_RAD or (ax == end_x and ay == end_y):
        return math.nan
    bulge = min(max(math.tan(0.25 * sweep), -1.0), 1.0)
    # Halfway along each segment, where its sagitta is bulge · chord / 2, and at the joint.
    x, y = ax + 0.5 * (bx - ax + a * (by - ay)), ay + 0.5 * (by - ay - a * (bx - ax))
    if distance_to_arc(x, y, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.nan
    x, y = bx + 0.5 * (end_x - bx + b * (end_y - by)), by + 0.5 * (end_y - by - b * (end_x - bx))
    if distance_to_arc(x, y, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.nan
    if distance_to_arc(bx, by, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.nan
    return bulge


def joined(rows: Floats, size: float) -> tuple[Floats, Ints]:
    """Neighbours on one circle or line become one; also where each old segment is now.

    A segment no longer than `size` is none: its end takes the place of its begin.
    """
    out = np.empty((len(rows), 3))
    places = np.zeros(len(rows) - 1, dtype=np.int64)
    out[0, 0], out[0, 1], out[0, 2] = rows[0, 0], rows[0, 1], 0.0
    count = 1
    for i in range(len(rows) - 1):
        end_x, end_y = rows[i + 1, 0], rows[i + 1, 1]
        if math.hypot(end_x - out[count - 1, 0], end_y - out[count - 1, 1]) <= size:
            places[i] = max(count - 2, 0)
            continue
        out[count - 1, 2] = rows[i, 2]
        if count > 1 and math.hypot(end_x - out[count - 2, 0], end_y - out[count - 2, 1]) > size:
            bulge = common_bulge(out, count - 2, end_x, end_y)
            if not math.isnan(bulge):
                count -= 1
                out[count - 1, 2] = bulge
        places[i] = count - 1
        out[count, 0], out[count, 1], out[count, 2] = end_x, end_y, 0.0
        count += 1
    last = len(rows) - 1
    out[count - 1, 0], out[count - 1, 1], out[count - 1, 2] = rows[last, 0], rows[last, 1], 0.0
    return np.asarray(out[:count]), np.asarray(places)


def deviations(samples: Floats, ends: Ints, first: Ints, vertices: Floats, places: Ints) -> Floats:
    """Distances (n,) of samples (n, 2) of the curve from the segments of their own span.

    There are equally many samples in each step between nodes, and the last one at the end. Of
    the columns (spans + 1,) span s owns the nodes ends[s]..ends[s + 1] and the old segments
    first[s]..first[s + 1], which are now at `places`.
    """
    each = (len(samples) - 1) // ends[len(ends) - 1]
    out = np.empty(len(samples))
    for s in range(len(ends) - 1):
        low, high = places[first[s]], places[first[s + 1] - 1]
        last = ends[s + 1] * each + (1 if s == len(ends) - 2 else 0)
        for i in range(ends[s] * each, last):
            nearest = math.inf
            x, y = samples[i, 0], samples[i, 1]
            for row in range(low, high + 1):
                ax, ay, bulge = vertices[row, 0], vertices[row, 1], vertices[row, 2]
                bx, by = vertices[row + 1, 0], vertices[row + 1, 1]
                nearest = min(nearest, distance_to_arc(x, y, ax, ay, bx, by, bulge))
            out[i] = nearest
    return np.asarray(out)


def summary(samples: Floats, off: Floats) -> tuple[float, float, float]:
    """Largest deviation and rms, weighted by length, and length of the curve, mm.

    Between samples i and i + 1 the deviation peaks at or below the meeting of the lines through
    the two samples before and the two behind: it is concave on each side of a peak, and where the
    nearest arc changes it has an edge there.
    """
    squares, length = 0.0, 0.0
    largest = off[len(off) - 1]
    for i in range(len(off) - 1):
        step = math.hypot(samples[i + 1, 0] - samples[i, 0], samples[i + 1, 1] - samples[i, 1])
        squares += step * 0.5 * (off[i] * off[i] + off[i + 1] * off[i + 1])
        length += step
        largest = max(largest, off[i])
        if 0 < i < len(off) - 2:
            rise, fall = off[i] - off[i - 1], off[i + 1] - off[i + 2]
            if rise > 0.0 and fall > 0.0:
                share = min(max((off[i + 1] + fall - off[i]) / (rise + fall), 0.0), 1.0)
                largest = max(largest, min(off[i] + rise * share, off[i + 1] + fall))
    return largest, math.sqrt(squares / length) if length > 0.0 else 0.0, length


# Arcs over nodes on a curve in one call: spans, chain, measure.


def fit_nodes(
    nodes: tuple[Floats, Floats, Floats, Bools], samples: Floats, target: float, tolerance: float
) -> tuple[Floats, tuple[float, float, float]]:
    """The chain (n, 3) over `nodes` (points, arriving and leaving tangents (n, 2), corners (n,))
    and its largest and rms deviation from the samples, and their length, mm."""
    point, arrive, leave, corner = nodes
    ends, pairs = longest_spans(point, leave, arrive, corner, target)
    rows, first = chain(point, ends, pairs, tolerance)
    vertices, places = joined(rows, POSITION_EPS_MM)
    if len(vertices) == 1:
        return np.asarray(vertices), (0.0, 0.0, 0.0)
    off = deviations(samples, ends, first, vertices, places)
    return np.asarray(vertices), summary(samples, off)


# Runs of chords that lie on one circle, along a chain of points.
#
# A run grows from its first point by doubling and then bisection, so n points cost O(n log n);
# every test of a run is a least-squares circle about the run's own middle (Kåsa's, which is
# linear: minimise Σ (x² + y² − 2ax − 2by − c)²). `tests/oracles/recognise.py` explodes arcs and
# judges what comes back.


MIN_POINTS = 5
"""Points that an arc needs: four chords. Three always lie on a circle, four often do."""

MAX_TURN_RAD = 22.5 * (math.pi / 180.0) * (1.0 + 1e-3)
"""One chord of an arc turns by no more: polygons of fewer than sixteen sides stay polygons."""

MAX_LENGTH_RATIO = 1.5
"""The longest chord of an arc over its shortest one; the first and the last may be shorter."""

MIN_SWEEP_RAD = 0.02
"""Runs that turn by less in all stay chords."""

ROUGHNESS = 0.5
"""Points may lie off the circle by so many times the mean fourth difference of these distances.
Of noise it is 7 times the mean (√70 σ); of n points that are off smoothly, as another curve is,
about (3π/n)⁴ times the most."""

ROUGH_POINTS = 12
"""Fewer points than these do not tell noise from another curve: they must lie on the circle within
the noise that is known."""

MIN_SAGITTA_NOISES = 8.0
"""The sagitta of a run is at least so many times the noise, or the run is straight."""

FAIL, STRAIGHT, ARC = 0, 1, 2


def lengths_agree(points: Floats, low: int, high: int) -> bool:
    """Whether the chords low..high − 1 are alike; the first and the last may be shorter."""
    least, most = math.inf, 0.0
    for k in range(low, high):
        length = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
        most = max(most, length)
        if low < k < high - 1:
            least = min(least, length)
    return most <= MAX_LENGTH_RATIO * least


def is_straight(points: Floats, low: int, high: int, noise: float) -> bool:
    """Whether the points lie within `noise` of the chord from the first to the last."""
    ux, uy = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    length = math.hypot(ux, uy)
    for k in range(low + 1, high):
        wx, wy = points[k, 0] - points[low, 0], points[k, 1] - points[low, 1]
        if abs(ux * wy - uy * wx) > noise * length:
            return False
    return length > 0.0


def circle_of(points: Floats, low: int, high: int) -> tuple[float, float, float]:
    """Centre and radius of the least-squares circle; an infinite radius for points on a line."""
    count = high - low + 1
    mx, my = 0.0, 0.0
    for k in range(low, high + 1):
        mx, my = mx + points[k, 0] / float(count), my + points[k, 1] / float(count)
    uu, uv, vv, ru, rv = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(low, high + 1):
        u, v = points[k, 0] - mx, points[k, 1] - my
        square = u * u + v * v
        uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
        ru, rv = ru + 0.5 * square * u, rv + 0.5 * square * v
    below = uu * vv - uv * uv
    if not below > 0.0:
        return mx, my, math.inf
    a, b = (ru * vv - rv * uv) / below, (rv * uu - ru * uv) / below
    return mx + a, my + b, math.sqrt(a * a + b * b + (uu + vv) / float(count))


def judge(
    points: Floats, low: int, high: int, noise: float, tolerance: float, off: Floats
) -> tuple[int, float, float, float, float]:
    """FAIL, STRAIGHT or ARC for the points low..high; of an arc centre, radius, signed sweep.
    There is room in `off` (n,) for a number of each point."""
    if not lengths_agree(points, low, high):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if is_straight(points, low, high, noise):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    cx, cy, radius = circle_of(points, low, high)
    sweep, rough, largest = 0.0, 0.0, 0.0
    for k in range(low, high + 1):
        x, y = points[k, 0] - cx, points[k, 1] - cy
        off[k - low] = math.hypot(x, y) - radius
        largest = max(largest, abs(off[k - low]))
        if k < high:
            nx, ny = points[k + 1, 0] - cx, points[k + 1, 1] - cy
            turn = math.atan2(x * ny - y * nx, x * nx + y * ny)
            if abs(turn) > MAX_TURN_RAD or turn * sweep < 0.0:
                return FAIL, 0.0, 0.0, 0.0, 0.0
            sweep += turn
    if high - low + 1 >= ROUGH_POINTS:
        # Not at the ends: a point that no longer belongs to the arc would speak for itself.
        for k in range(3, high - low - 2):
            fourth = off[k - 2] - 4.0 * off[k - 1] + 6.0 * off[k] - 4.0 * off[k + 1] + off[k + 2]
            rough += abs(fourth) / float(high - low - 5)
    if abs(sweep) > 2.0 * math.pi + MAX_TURN_RAD:
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if not largest <= min(tolerance, max(noise, ROUGHNESS * rough)):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    sagitta = radius * (1.0 - math.cos(0.5 * min(abs(sweep), math.pi)))
    if abs(sweep) < MIN_SWEEP_RAD or sagitta < MIN_SAGITTA_NOISES * max(noise, largest):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    return ARC, cx, cy, radius, sweep


def longest_run(
    points: Floats, low: int, noise: float, tolerance: float, off: Floats
) -> tuple[int, int, float, float, float, float]:
    """The last point of the longest run from `low`, and what it is; `low` for none."""
    best, beyond, size = low, len(points), MIN_POINTS - 1
    is_, cx, cy, radius, sweep = FAIL, 0.0, 0.0, 0.0, 0.0
    while best < len(points) - 1 and low + size < len(points):
        found = judge(points, low, low + size, noise, tolerance, off)
        if found[0] != FAIL:
            best = low + size
            is_, cx, cy, radius, sweep = found
        elif size >= 2 * ROUGH_POINTS - 1:
            beyond = low + size
            break
        # A few points may fail by noise that more of them show to be noise.
        rest = len(points) - 1 - low
        doubled = 2 * size if size >= ROUGH_POINTS - 1 else max(2 * size, ROUGH_POINTS - 1)
        size = min(doubled, rest) if size < rest else size + 1
    while best > low and beyond - best > 1:
        high = (best + beyond) // 2
        found = judge(points, low, high, noise, tolerance, off)
        if found[0] == FAIL:
            beyond = high
        else:
            best = high
            is_, cx, cy, radius, sweep = found
    return best, is_, cx, cy, radius, sweep


def find_runs(points: Floats, noise: float, tolerance: float) -> Floats:
    """(r, 6) runs of chords on one circle: first and last point, centre, radius, signed sweep.

    A run that is straight so far is passed; the arc behind it begins within its last chords, and
    is extended backwards as far as it goes.
    """
    out, off = np.empty((len(points) // (MIN_POINTS - 1) + 1, 6)), np.empty(len(points))
    count, low, done = 0, 0, 0
    while low + MIN_POINTS <= len(points):
        high, is_, cx, cy, radius, sweep = longest_run(points, low, noise, tolerance, off)
        if is_ != ARC:
            low = max(low + 1, high - MIN_POINTS + 1)
            continue
        while low > done:
            longer = judge(points, low - 1, high, noise, tolerance, off)
            if longer[0] != ARC:
                break
            low -= 1
            is_, cx, cy, radius, sweep = longer
        out[count, 0], out[count, 1] = low, high
        out[count, 2], out[count, 3], out[count, 4], out[count, 5] = cx, cy, radius, sweep
        count += 1
        low = done = high
    return np.asarray(out[:count])


def furthest_off(points: Floats, arcs: Floats) -> float:
    """The largest distance of points (n, 2) from a chain of arcs (m, 3)."""
    largest = 0.0
    for i in range(len(points)):
        nearest = math.inf
        for row in range(len(arcs) - 1):
            ax, ay, bulge = arcs[row, 0], arcs[row, 1], arcs[row, 2]
            bx, by = arcs[row + 1, 0], arcs[row + 1, 1]
            off = distance_to_arc(points[i, 0], points[i, 1], ax, ay, bx, by, bulge)
            nearest = min(nearest, off)
        largest = max(largest, nearest)
    return largest


# The nearest segment to each of many points; the least distance from a vertex of any path to a
# segment of another path.
#
# A binary tree of boxes stands over the segments in their order; a path is one stretch of them, so
# a vertex leaves out the nodes that lie within its own path, and those farther than the best
# distance so far. What makes it exact: only boxes are left out, by their true distance.


def closest(
    start: Floats, end: Floats, bulge: Floats, boxes: Floats, path: Ints
) -> tuple[float, int, int]:
    """The distance, the row whose start is nearest to another path, and the row it is near to.

    `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4) and the ascending `path` (K,) of the
    segments. Rows are −1 when there is one path only.
    """
    tree = tree_of(boxes)
    count = len(bulge)
    stack = np.empty(DEPTH, np.int64)
    best, best_row, best_other = math.inf, -1, -1
    first, last = 0, -1
    for row in range(count):
        if row > last:
            first, last = row, row
            while last + 1 < count and path[last + 1] == path[row]:
                last += 1
        apart, other = _from_point(
            start[row, 0], start[row, 1], start, end, bulge, tree, first, last, best, stack
        )
        if other >= 0:
            best, best_row, best_other = apart, row, other
    return best, best_row, best_other


def nearest_rows(points: Floats, start: Floats, end: Floats, bulge: Floats, boxes: Floats) -> Ints:
    """(P,) rows of the segments nearest to points (P, 2); quick when neighbours in the list are
    near. `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4), K ≥ 1; where two are as near, the
    last one keeps its place."""
    tree = tree_of(boxes)
    found, stack = np.zeros(len(points), np.int64), np.empty(DEPTH, np.int64)
    row = 0
    for index in range(len(points)):
        x, y = points[index, 0], points[index, 1]
        ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
        apart = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
        _, other = _from_point(x, y, start, end, bulge, tree, 0, -1, apart, stack)
        row = other if other >= 0 else row
        found[index] = row
    return np.asarray(found)


def _from_point(
    x: float,
    y: float,
    start: Floats,
    end: Floats,
    bulge: Floats,
    tree: Floats,
    first: int,
    last: int,
    best: float,
    stack: Ints,
) -> tuple[float, int]:
    """The distance to the nearest segment outside first … last that is nearer than the best one
    so far, and its row; −1 when there is none. `stack` (`DEPTH`,) is room."""
    leaves = len(tree) // 2
    found = -1
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        low, high = rows_under(tree, node, len(bulge))
        own = low >= first and high <= last + 1
        if low >= high or own or apart_square(tree, node, x, y) >= best * best:
            continue
        if node < leaves:
            height = wait_for_children(tree, node, x, y, stack, height)
            continue
        for row in range(low, high):
            if first <= row <= last:
                continue
            ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
            apart = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
            if apart < best:
                best, found = apart, row
    return best, found
