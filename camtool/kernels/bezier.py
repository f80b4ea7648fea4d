"""Points, tangents and nodes of rational Bézier pieces.

A curve is `pieces` (m, p + 1, 3) of control points x·w, y·w, w, joined end to end, and its
parameter runs from 0 to m: the whole part says which piece, the rest where in it.
`camtool.geometry.fit` says the same for any curve, and the tests hold the two together;
`tests/oracles/curves.py` measures both.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.biarc import Bools, Floats, biarc, distance_to_biarc
from camtool.kernels.compiled import inner, kernel
from camtool.kernels.fit_limits import (
    ASIDE_FROM,
    ASIDE_TO,
    CORNER_ANGLE_RAD,
    GOLDEN_ROUNDS,
    MAX_NODES,
    POSITION_EPS_MM,
    SLOW_SHARE,
    STEP_ERROR_SHARE,
    STEP_TURN_RAD,
    VANISHING_TANGENT,
)

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
"""A search for a least value by golden sections keeps this share of its bracket."""


@inner
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
        above *= (degree - i + 1) / i * u
        slope *= (degree - i) / i * u
        last *= u
        ax, ay, aw = pieces[k, i, 0], pieces[k, i, 1], pieces[k, i, 2]
        dx = dx * v + slope * (pieces[k, i + 1, 0] - ax)
        dy = dy * v + slope * (pieces[k, i + 1, 1] - ay)
        dw = dw * v + slope * (pieces[k, i + 1, 2] - aw)
        x, y, w = (x + above * ax) * v, (y + above * ay) * v, (w + above * aw) * v
    x += last * pieces[k, degree, 0]
    y += last * pieces[k, degree, 1]
    w += last * pieces[k, degree, 2]
    share = degree / (w * w)
    return x / w, y / w, share * (dx * w - x * dw), share * (dy * w - y * dw)


@kernel
def points_at(pieces: Floats, t: Floats) -> Floats:
    """(n, 2) positions at parameters t (n,) in 0..m."""
    out = np.empty((len(t), 2))
    for i in range(len(t)):
        k = min(int(t[i]), len(pieces) - 1)
        out[i, 0], out[i, 1], _, _ = evaluate(pieces, k, t[i] - k)
    return out


@inner
def speed(pieces: Floats, k: int, u: float) -> float:
    """The length of the derivative by u."""
    _, _, dx, dy = evaluate(pieces, k, u)
    return math.sqrt(dx * dx + dy * dy)


@inner
def aside(pieces: Floats, k: int, u: float, side: float, least: float) -> tuple[float, float]:
    """Unit tangent a little before (side −1) or after (+1) u, where the piece is faster than
    `least`."""
    if u <= 0.0 or u >= 1.0:
        side = 1.0 if u <= 0.0 else -1.0  # at the ends of a piece look inside
    for exponent in range(ASIDE_FROM, ASIDE_TO):
        beside = min(max(u + side * math.pow(10.0, exponent), 0.0), 1.0)
        _, _, dx, dy = evaluate(pieces, k, beside)
        length = math.sqrt(dx * dx + dy * dy)
        if length > least:
            return dx / length, dy / length
    return 1.0, 0.0  # the curve stands still here: such nodes are merged


@inner
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


@inner
def first_steps(pieces: Floats, k: int, each: int) -> tuple[Floats, float]:
    """The u (≥ each + 1,) that piece k is cut at first, tips and cusps among them; its speed."""
    speeds = np.empty(each + 1)
    fastest = 0.0
    for i in range(each + 1):
        speeds[i] = speed(pieces, k, i / each)
        fastest = max(fastest, speeds[i])
    out = np.empty(2 * each + 2)
    count = 0
    for i in range(each + 1):
        tip = i / each
        before, after = max(i - 1, 0), min(i + 1, each)
        if speeds[i] <= min(speeds[before], speeds[after]) and speeds[i] < SLOW_SHARE * fastest:
            tip = slowest(pieces, k, before / each, after / each)
        for u in (min(tip, i / each), max(tip, i / each)):
            if count == 0 or out[count - 1] < u <= 1.0:
                out[count] = u
                count += 1
    out[0] = 0.0
    return out[:count], fastest


@inner
def too_coarse(pieces: Floats, k: int, left: Floats, right: Floats, tolerance: float) -> bool:
    """Whether the step between two rows (u, x, y, arrive x, y, leave x, y) must be halved."""
    middle = 0.5 * (left[0] + right[0])
    if not left[0] < middle < right[0]:
        return False
    pair = biarc(left[1:3], left[5:7], right[1:3], right[3:5])
    bends = left[5] * right[3] + left[6] * right[4] < math.cos(STEP_TURN_RAD)
    reach = 0.0
    for i in (2, 1, 3):
        x, y, _, _ = evaluate(pieces, k, left[0] + 0.25 * i * (right[0] - left[0]))
        reach = max(reach, abs(x - left[1]), abs(y - left[2]), abs(x - right[1]))
        reach = max(reach, abs(y - right[2]))
        if not bends:
            off = distance_to_biarc(x, y, left[1:3], right[1:3], pair)
            bends = off > STEP_ERROR_SHARE * tolerance
        if bends and reach > POSITION_EPS_MM:
            return True
    return False


@inner
def copied(rows: Floats, count: int, room: int) -> Floats:
    """The first `count` rows in a new array of `room` rows."""
    out = np.empty((room, rows.shape[1]))
    for i in range(count):
        for column in range(rows.shape[1]):
            out[i, column] = rows[i, column]
    return out


@inner
def piece_rows(pieces: Floats, k: int, each: int, tolerance: float, most: int) -> Floats:
    """Nodes (n, 7) of piece k: u, x, y, tangents before and after; begun with `each` steps.

    Steps are halved from left to right; the stack holds the right ends of those still to do.
    """
    grid, fastest = first_steps(pieces, k, each)
    least = VANISHING_TANGENT * fastest
    stack = np.empty((64, 7))
    out = np.empty((512, 7))
    fill_row(pieces, k, 0.0, least, out[0])
    count = 1
    for i in range(1, len(grid)):
        fill_row(pieces, k, grid[i], least, stack[0])
        depth = 1
        while depth > 0:
            left, right = out[count - 1], stack[depth - 1]
            fine = depth < len(stack) and count < most
            if fine and too_coarse(pieces, k, left, right, tolerance):
                fill_row(pieces, k, 0.5 * (left[0] + right[0]), least, stack[depth])
                depth += 1
                continue
            if count == len(out):
                out = copied(out, count, 2 * count)
            for column in range(7):
                out[count, column] = right[column]
            count += 1
            depth -= 1
    return out[:count]


@inner
def fill_row(pieces: Floats, k: int, u: float, least: float, row: Floats) -> None:
    """Write u, x, y, tangent before and tangent after into `row` (7,)."""
    x, y, dx, dy = evaluate(pieces, k, u)
    length = math.sqrt(dx * dx + dy * dy)
    row[0], row[1], row[2] = u, x, y
    if length > least:
        row[3], row[4] = dx / length, dy / length
        row[5], row[6] = row[3], row[4]
    else:
        row[3], row[4] = aside(pieces, k, u, -1.0, least)
        row[5], row[6] = aside(pieces, k, u, 1.0, least)


@kernel
def curve_rows(pieces: Floats, steps: int, tolerance: float) -> tuple[Floats, Bools]:
    """Nodes (n, 7) of all pieces, t in 0..m in place of u, and which of them are corners.

    Nodes no farther apart than `POSITION_EPS_MM` become one: it arrives as the first and leaves
    as the last of them.
    """
    each = max(4, math.ceil(steps / len(pieces)))
    out = np.empty((256, 7))
    count = 0
    for k in range(len(pieces)):
        rows = piece_rows(pieces, k, each, tolerance, max(MAX_NODES - count, 2))
        if count + len(rows) > len(out):
            out = copied(out, count, 2 * (count + len(rows)))
        for i in range(len(rows)):
            row, last = rows[i], out[max(count - 1, 0)]
            if count == 0 or math.hypot(row[1] - last[1], row[2] - last[2]) > POSITION_EPS_MM:
                out[count, 0] = row[0] + k
                for column in range(1, 7):
                    out[count, column] = row[column]
                count += 1
            else:
                last[5], last[6] = row[5], row[6]
    out[count - 1, 1], out[count - 1, 2], _, _ = evaluate(pieces, len(pieces) - 1, 1.0)
    if count > 1:
        out[count - 1, 0] = len(pieces)
    corner = np.zeros(count, dtype=np.bool_)
    for i in range(count):
        cross = out[i, 3] * out[i, 6] - out[i, 4] * out[i, 5]
        dot = out[i, 3] * out[i, 5] + out[i, 4] * out[i, 6]
        corner[i] = abs(math.atan2(cross, dot)) > CORNER_ANGLE_RAD
    corner[0] = corner[count - 1] = True
    return out[:count], corner
