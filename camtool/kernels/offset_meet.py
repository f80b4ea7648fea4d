"""Where many lines and arcs meet: pairs from a tree of boxes, each pair met exactly.

The rules are those of camtool.geometry.intersect, which is the vectorised twin: the four ends and
the two common points of the whole curves are measured, and count when they are within eps of both
curves and of the range of both, and not within 2 eps of one that counted before; and, which is
more than there, when the curves part by more than eps on the way from one that counted before.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from camtool.kernels.box_tree import DEPTH, LEAF, touch
from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import (
    AX,
    AY,
    BEND,
    BX,
    BY,
    LENGTH,
    SWEEP,
    TX,
    TY,
    Floats,
    along,
    gap_to,
)

Ints = npt.NDArray[np.int64]
Numbers = npt.NDArray[Any]

X, Y, TA, TB = range(4)
"""The columns of a meeting: its place, and the fractions of both curves there."""

MOST_MEETINGS = 6
"""Two curves have four ends and two common points."""


@kernel
def pairs_of(boxes: Floats, tree: Floats, others: Floats, other_tree: Floats, own: bool) -> Ints:
    """(J, 2) rows of `boxes` and of `others` that touch; a tree stands over each.

    `own` says that both are the same: then each pair comes once, the lesser row first. Nodes of
    both trees are looked at in pairs, so that what two large boxes tell is told once.
    """
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
            for child in range(2 * a, 2 * a + 2) if a < leaves else range(a, a + 1):
                for far in range(2 * b, 2 * b + 2) if b < other_leaves else range(b, b + 1):
                    if not own or child <= far:
                        left[height], right[height] = child, far
                        height += 1
            continue
        low, far_low = (a - leaves) * LEAF, (b - other_leaves) * LEAF
        for i in range(low, min(low + LEAF, len(boxes))):
            for j in range(far_low, min(far_low + LEAF, len(others))):
                if (not own or i < j) and touch(boxes, i, others, j):
                    if count == len(pairs):
                        pairs = _grown(pairs, np.empty((2 * count, 2), np.int64))
                    pairs[count, 0], pairs[count, 1] = i, j
                    count += 1
    return pairs[:count]


@inner
def _grown(rows: Numbers, room: Numbers) -> Numbers:
    """`room` with these rows at its beginning."""
    for i in range(len(rows)):
        for k in range(rows.shape[1]):
            room[i, k] = rows[i, k]
    return room


@kernel
def meetings_of(a: Floats, b: Floats, pairs: Ints, eps: float) -> tuple[Ints, Floats]:
    """The rows (J, 2) of a and b, and the meetings (J, 4), of the pairs (P, 2) of rows."""
    room = len(pairs) + MOST_MEETINGS + 16
    rows, found = np.empty((room, 2), np.int64), np.empty((room, 4))
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        if count + MOST_MEETINGS > len(rows):
            rows = _grown(rows, np.empty((2 * len(rows), 2), np.int64))
            found = _grown(found, np.empty((2 * len(found), 4)))
        more = _meet(a, b, i, j, (eps, found[count : count + MOST_MEETINGS]))
        for m in range(count, count + more):
            rows[m, 0], rows[m, 1] = i, j
        count += more
    return rows[:count], found[:count]


@inner
def _meet(a: Floats, b: Floats, i: int, j: int, into: tuple[float, Floats]) -> int:
    """How many meetings row i of a and row j of b have; they are written into the rows given."""
    eps, found = into
    count = 0
    for k in range(4):
        curves, row = (a, i) if k < 2 else (b, j)
        x = curves[row, AX] if k % 2 == 0 else curves[row, BX]
        y = curves[row, AY] if k % 2 == 0 else curves[row, BY]
        count += _taken(a, b, i, j, (x, y, eps, found, count))
    first, second = _common_points(a, b, i, j)
    for x, y in (first, second):
        # No NaN passes: curves that miss each other by far have no common points.
        if gap_to(a, i, x, y) <= eps and not _known(a, b, i, j, (x, y, eps, found, count)):
            count += _taken(a, b, i, j, (x, y, eps, found, count))
    return count


@inner
def _known(
    a: Floats, b: Floats, i: int, j: int, at: tuple[float, float, float, Floats, int]
) -> bool:
    """Whether the curves stay within eps of each other from a common point to all of the shorter
    one, or to a meeting found before.

    At the angle θ and with curvatures that differ by k they are θ s + k s²/2 apart after s, at
    most. There rounding alone would place a crossing: where they are tangent at an end, anywhere
    within the root of its own rounding.
    """
    x, y, eps, found, count = at
    ax, ay = _tangent(a, i, along(a, i, x, y))
    bx, by = _tangent(b, j, along(b, j, x, y))
    way = -1.0 if ax * bx + ay * by < 0.0 else 1.0
    angle, bend = abs(ax * by - ay * bx), abs(a[i, BEND] - way * b[j, BEND])
    s = min(a[i, LENGTH], b[j, LENGTH])
    if angle * s + 0.5 * bend * s * s <= eps:
        return True
    for k in range(count):
        s = math.hypot(found[k, X] - x, found[k, Y] - y)
        if angle * s + 0.5 * bend * s * s <= eps:
            return True
    return False


@inner
def _taken(
    a: Floats, b: Floats, i: int, j: int, into: tuple[float, float, float, Floats, int]
) -> int:
    """1 when the point is a meeting, which is then written down, else 0."""
    x, y, eps, found, count = into
    if not (gap_to(a, i, x, y) <= eps and gap_to(b, j, x, y) <= eps):
        return 0
    on_a, on_b = along(a, i, x, y), along(b, j, x, y)
    if not (-eps <= on_a <= a[i, LENGTH] + eps and -eps <= on_b <= b[j, LENGTH] + eps):
        return 0
    for k in range(count):
        if math.hypot(found[k, X] - x, found[k, Y] - y) <= 2.0 * eps:
            return 0
    found[count, X], found[count, Y] = x, y
    found[count, TA] = _fraction(on_a, a[i, LENGTH], eps)
    found[count, TB] = _fraction(on_b, b[j, LENGTH], eps)
    return 1


@inner
def _fraction(length: float, whole: float, eps: float) -> float:
    """Fraction of the whole length, exactly 0 or 1 within eps of an end."""
    if length >= whole - eps:
        return 1.0
    return 0.0 if length <= eps else length / whole


@inner
def _tangent(curves: Floats, i: int, length: float) -> tuple[float, float]:
    turn = length * curves[i, SWEEP] / curves[i, LENGTH]
    cosine, sine = math.cos(turn), math.sin(turn)
    tx, ty = curves[i, TX], curves[i, TY]
    return cosine * tx - sine * ty, cosine * ty + sine * tx


@inner
def _common_points(
    a: Floats, b: Floats, i: int, j: int
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The two points that the whole curves share (intersect.py derives them); NaN if none.

    Where they miss each other, both are the point of the common line nearest to the rounder one.
    """
    if abs(b[j, BEND]) < abs(a[i, BEND]):
        a, b, i, j = b, a, j, i
    # Row j of b is the rounder one now; all is told from its start.
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
    two = gamma / stable if root > 0.0 or k_round == 0.0 else stable / k_round
    one = two if k_round == 0.0 else stable / k_round
    ox, oy = b[j, AX] + fx, b[j, AY] + fy
    return (ox - one * uy, oy + one * ux), (ox - two * uy, oy + two * ux)
