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

import numpy as np
import numpy.typing as npt

from camtool.kernels.box_tree import DEPTH, apart_square, rows_under
from camtool.kernels.move_errors import COLUMNS, lower_errors
from camtool.kernels.wide import larger, wide

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

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

QX, QY, REACH, FIRST, LAST, Z_LOW, Z_HIGH, COUNT, LEAST, USED = range(10)
"""The memo of a list, float64: the point q, ρ (−1: there is no list), which moves first:last and
heights it holds, how many moves are in it, how many of these are as near to q as any, and for how
many points it was used."""

MEMO = 10
"""Numbers in a memo."""

SPOT = 3 + DEPTH
"""Numbers that a search needs room for: a point with its error, and the nodes that wait."""


def new_memo() -> Floats:
    """The memo of no list."""
    memo = np.zeros(MEMO)
    memo[REACH] = -1.0
    return memo


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
def _search(
    q: tuple[float, float],
    only: tuple[int, int, float, float],
    moves: tuple[Floats, Floats, Floats],
    limit: float,
    found: Ints,
    spot: Floats,
) -> tuple[float, int]:
    """With `limit` < 0 the least distance of q; else the number of moves within it, in `found`.

    `only`: the moves first:last whose heights overlap low … high. `moves`: table, heights (K, 2),
    tree. `spot` (`SPOT`,) is room.
    """
    x, y = q
    first, last, z_low, z_high = only
    table, heights, tree = moves
    leaves = len(tree) // 2
    best, count = (np.inf if limit < 0.0 else limit), 0
    stack = spot[3 : 3 + DEPTH].view(np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        low, high = rows_under(tree, node, len(table))
        if low >= last or high <= first or apart_square(tree, node, x, y) > best * best:
            continue
        if node < leaves:
            left, right = 2 * node, 2 * node + 1
            if apart_square(tree, left, x, y) < apart_square(tree, right, x, y):
                left, right = right, left
            stack[height], stack[height + 1] = left, right
            height += 2
            continue
        for k in range(max(low, first), min(high, last)):
            if heights[k, 0] > z_high or heights[k, 1] < z_low:
                continue
            apart = _apart(table[k], x, y, spot)
            if limit < 0.0:
                best = min(best, apart)
            elif apart <= limit and not _is_there(table, found[:count], k):
                found[count] = k
                count += 1
    return best, count


@wide
def _looser(limit: float) -> float:
    return limit * (1.0 + SLACK) + SLACK_MM


@wide
def renew(
    q: tuple[float, float],
    only: tuple[int, int, float, float],
    moves: tuple[Floats, Floats, Floats],
    found: Ints,
    memo: Floats,
    spot: Floats,
) -> None:
    """Make the list `found` (K,) around q anew, with a ρ from how well the last one did."""
    reach = memo[REACH]
    if reach < 0.0:
        reach = FIRST_REACH_MM
    elif memo[USED] * (memo[COUNT] - memo[LEAST]) > SEARCH_COST:
        reach *= 0.5
    else:
        reach = min(2.0 * reach, MOST_REACH_MM)
    nearest, _ = _search(q, only, moves, -1.0, found, spot)
    if nearest == np.inf:  # nothing at this height: any height
        only = only[0], only[1], -np.inf, np.inf
        nearest, _ = _search(q, only, moves, -1.0, found, spot)
    count, least = 0, 0
    if nearest < np.inf:
        _, least = _search(q, only, moves, _looser(nearest), found, spot)
        _, count = _search(q, only, moves, _looser(nearest + 2.0 * reach), found, spot)
    memo[QX], memo[QY], memo[REACH] = q[0], q[1], reach
    memo[COUNT], memo[LEAST], memo[USED] = count, least, 0.0


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
    points: tuple[Floats, Floats],
    only: tuple[int, int, float, float],
    moves: tuple[Floats, Floats, Floats],
    found: Ints,
    memo: Floats,
    spot: Floats,
    out: Floats,
) -> None:
    """The error of each of n points (x, y) against the nearest of the moves `only`, signed as
    `lower_errors` does; inf where there is none. The list and its memo serve the next call too."""
    x, y = points
    first, last, z_low, z_high = only
    same = memo[FIRST] == first and memo[LAST] == last
    same = same and memo[Z_LOW] == z_low and memo[Z_HIGH] == z_high and memo[REACH] >= 0.0
    memo[FIRST], memo[LAST], memo[Z_LOW], memo[Z_HIGH] = first, last, z_low, z_high
    done = 0
    while done < len(x):
        run = _within(memo, x[done:], y[done:]) if same else 0
        if run == 0:
            renew((x[done], y[done]), only, moves, found, memo, spot)
            run, same = max(1, _within(memo, x[done:], y[done:])), True
        here_x, here_y = x[done : done + run], y[done : done + run]
        here = out[done : done + run]
        if memo[COUNT] > 0.0:
            lower_errors(moves[0][found[0]], here_x, here_y, here, True)
        else:
            for k in range(len(here)):
                here[k] = np.inf
        for k in range(1, int(memo[COUNT])):
            lower_errors(moves[0][found[k]], here_x, here_y, here, False)
        memo[USED] += run
        done += run
