"""The nearest of many moves for points that follow each other: a short list serves many of them.

Around a point q whose nearest move is d away, the list holds every move within d + 2ρ of q. As
long as a point p stays within ρ of q the nearest move of p is in the list:

    |p s| ≤ |p s_q| ≤ |p q| + d ≤ ρ + d   for the nearest s of p,
    |q s| ≤ |q p| + |p s| ≤ d + 2ρ.

So what is found is exact whatever ρ is; ρ only trades the search for a new list against distances
to moves that are not the nearest: it doubles when the last list cost less than the search for it,
and halves when it cost more. The search goes down a tree of the moves' boxes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.box_tree import DEPTH, LEAF, apart_square, wait_for_children
from camtool.kernels.move_errors import COLUMNS, lower_errors
from camtool.kernels.move_tree import FIRST as FIRST_BELOW
from camtool.kernels.move_tree import LAST as LAST_BELOW
from camtool.kernels.wide import larger, wide

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

Only = tuple[int, int, float, float]
"""Moves that may be the nearest: first:last, as far as their heights overlap low … high."""

SEARCH_COST = 400.0
"""A search for a list costs about as much as so many distances."""

FIRST_REACH_MM = 0.05
"""ρ of the first list."""

MOST_REACH_MM = 1e6
"""ρ grows no further: a kilometre is all that a program can say."""

SLACK = 1e-12
"""Limits of a list are taken this part wider, plus `SLACK_MM`: rounding must not lose a move."""

SLACK_MM = 1e-12
"""See `SLACK`."""

QX, QY, REACH, FIRST, LAST, Z_LOW, Z_HIGH, COUNT, LEAST, USED, LOOKED = range(11)
"""The memo of a list, float64: the point q, ρ (−1: there is no list), which moves first:last and
heights it holds, how many moves are in it, how many of these are as near to q as any, for how
many points it was used, and how many nodes and moves the search for it looked at."""

MEMO = 11
"""Numbers in a memo."""

SPOT = 3 + DEPTH
"""Numbers that a search needs room for: a point with its error, and the nodes that wait."""


class Moves(NamedTuple):
    """K moves: their table (K, 16) of `move_errors`, heights (K, 2), and the nodes (2L, 6) and
    order (K,) of `move_tree`."""

    table: Floats
    heights: Floats
    nodes: Floats
    order: Ints


class Near(NamedTuple):
    """A list: the moves found (K,), how far from q each is (K,) mm, and its memo (11,)."""

    found: Ints
    apart: Floats
    memo: Floats


def no_list(moves: int) -> Near:
    """Room for a list of so many moves, that is none yet."""
    memo = np.zeros(MEMO)
    memo[REACH] = -1.0
    return Near(np.empty(moves, dtype=np.int64), np.empty(moves), memo)


@wide
def _apart(move: Floats, x: float, y: float, spot: Floats) -> float:
    """Distance of one point from a move; `spot` (≥ 3,) is room for it."""
    spot[0], spot[1] = x, y
    lower_errors(move, spot[:1], spot[1:2], spot[2:3], True)
    return float(abs(spot[2]))


@wide
def _is_there(table: Floats, found: Ints, move: int) -> bool:
    """Whether the move is one of those found: passes one below the other are the same in XY."""
    for other in found:
        k = 0
        while k < COLUMNS and table[other, k] == table[move, k]:
            k += 1
        if k == COLUMNS:
            return True
    return False


@wide
def _search(only: Only, moves: Moves, near: Near, spot: Floats) -> tuple[float, int]:
    """The least distance of q, and how many moves were found: all that are no farther than that
    and 2ρ, and some that are. `spot` (`SPOT`,) is room."""
    first, last, z_low, z_high = only
    memo = near.memo
    x, y, beyond = memo[QX], memo[QY], 2.0 * memo[REACH]
    nodes, order = moves.nodes, moves.order
    leaves = len(nodes) // 2
    best, limit, count = np.inf, np.inf, 0
    stack = spot[3 : 3 + DEPTH].view(np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        memo[LOOKED] += 1.0
        if nodes[node, FIRST_BELOW] >= last or nodes[node, LAST_BELOW] <= first:
            continue
        if apart_square(nodes, node, x, y) > limit * limit:
            continue
        if node < leaves:
            height = wait_for_children(nodes, node, (x, y), stack, height)
            continue
        low = (node - leaves) * LEAF
        for k in order[low : low + LEAF]:
            if k < first or k >= last:
                continue
            if moves.heights[k, 0] > z_high or moves.heights[k, 1] < z_low:
                continue
            apart = _apart(moves.table[k], x, y, spot)
            memo[LOOKED] += 1.0
            if apart < best:
                best, limit = apart, _looser(apart + beyond)
            if apart <= limit:
                near.found[count], near.apart[count] = k, apart
                count += 1
    return best, count


@wide
def _looser(limit: float) -> float:
    return limit * (1.0 + SLACK) + SLACK_MM


@wide
def _keep(nearest: float, count: int, table: Floats, near: Near) -> None:
    """Leave in the list, of the first `count` moves, those that must be in it, each once."""
    memo = near.memo
    limit, least = _looser(nearest + 2.0 * memo[REACH]), _looser(nearest)
    kept = 0
    memo[LEAST] = 0.0
    for k in range(count):
        move, apart = near.found[k], near.apart[k]
        if apart <= limit and not _is_there(table, near.found[:kept], move):
            near.found[kept] = move
            kept += 1
            if apart <= least:
                memo[LEAST] += 1.0
    memo[COUNT] = kept


@wide
def renew(x: float, y: float, only: Only, moves: Moves, near: Near, spot: Floats) -> None:
    """Make the list around q = (x, y) anew, with a ρ from how well the last one did."""
    memo = near.memo
    if memo[REACH] < 0.0:
        memo[REACH] = FIRST_REACH_MM
    elif memo[USED] * (memo[COUNT] - memo[LEAST]) > SEARCH_COST:
        memo[REACH] *= 0.5
    else:
        memo[REACH] = min(2.0 * memo[REACH], MOST_REACH_MM)
    memo[QX], memo[QY], memo[USED], memo[LOOKED] = x, y, 0.0, 0.0
    nearest, count = _search(only, moves, near, spot)
    if count == 0:  # nothing at this height: any height
        only = only[0], only[1], -np.inf, np.inf
        nearest, count = _search(only, moves, near, spot)
    _keep(nearest, count, moves.table, near)


@wide
def _within(memo: Floats, x: Floats, y: Floats) -> int:
    """How many of the points x, y (n,) from the first on lie within ρ of q."""
    qx, qy, square = memo[QX], memo[QY], memo[REACH] * memo[REACH]
    farthest = 0.0
    for k in range(len(x)):
        off_x, off_y = x[k] - qx, y[k] - qy
        farthest = larger(farthest, off_x * off_x + off_y * off_y)
    if farthest <= square:
        return len(x)
    k = 0
    while k < len(x) and (x[k] - qx) ** 2 + (y[k] - qy) ** 2 <= square:
        k += 1
    return k


@wide
def nearest_errors(
    x: Floats, y: Floats, only: Only, moves: Moves, near: Near, spot: Floats, out: Floats
) -> None:
    """The error of each of the points x, y (n,) against the nearest of the moves `only`, signed
    as `lower_errors` does; inf where there is none. The list serves the next call too."""
    first, last, z_low, z_high = only
    memo, found = near.memo, near.found
    same = memo[FIRST] == first and memo[LAST] == last
    same = same and memo[Z_LOW] == z_low and memo[Z_HIGH] == z_high and memo[REACH] >= 0.0
    memo[FIRST], memo[LAST], memo[Z_LOW], memo[Z_HIGH] = first, last, z_low, z_high
    done = 0
    while done < len(x):
        run = _within(memo, x[done:], y[done:]) if same else 0
        if run == 0:
            renew(x[done], y[done], only, moves, near, spot)
            run, same = max(1, _within(memo, x[done:], y[done:])), True
        here_x, here_y = x[done : done + run], y[done : done + run]
        here = out[done : done + run]
        if memo[COUNT] > 0.0:
            lower_errors(moves.table[found[0]], here_x, here_y, here, True)
        else:
            for k in range(len(here)):
                here[k] = np.inf
        for k in range(1, int(memo[COUNT])):
            lower_errors(moves.table[found[k]], here_x, here_y, here, False)
        memo[USED] += run
        done += run
