"""Orders of cutting by slow and obvious ways, and a length that no order can be under."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from camtool.planning.order import Choices

Pairs = Sequence[tuple[int, int]]
Point = tuple[float, float]


def length(choices: Choices, rows: Sequence[int], start: Point, goal: Point | None) -> float:
    """Length of the travel between the cuts, step by step."""
    at, total = np.array(start), 0.0
    for row in rows:
        total += float(np.hypot(*(choices.entry[row] - at)))
        at = choices.exit[row]
    return total if goal is None else total + float(np.hypot(*(np.array(goal) - at)))


def keeps(choices: Choices, rows: Sequence[int], before: Pairs) -> bool:
    """True if each item comes once, and none before one that must precede it."""
    items = [int(choices.owner[row]) for row in rows]
    rank = {item: k for k, item in enumerate(items)}
    once = sorted(items) == sorted(set(choices.owner.tolist()))
    return once and all(rank[one] < rank[other] for one, other in before)


def shortest(choices: Choices, before: Pairs, start: Point, goal: Point | None) -> float:
    """The shortest length there is, by subsets (Held and Karp 1962); inf when there is no order.

    cost(done, row): the shortest way through the items `done` that ends with `row`.
    """
    count = len(choices)
    needs = [sum(1 << one for one, other in {*before} if other == item) for item in range(count)]
    rows_of = [np.flatnonzero(choices.owner == item).tolist() for item in range(count)]
    cost: dict[tuple[int, int], float] = {(0, -1): 0.0}
    for _ in range(count):
        longer: dict[tuple[int, int], float] = {}
        for (done, last), so_far in cost.items():
            at = np.array(start) if last < 0 else choices.exit[last]
            for item in range(count):
                if done >> item & 1 or needs[item] & ~done:
                    continue
                for row in rows_of[item]:
                    key = (done | 1 << item, row)
                    found = so_far + float(np.hypot(*(choices.entry[row] - at)))
                    if found < longer.get(key, np.inf):
                        longer[key] = found
        cost = longer
    ends = [
        so_far + (0.0 if goal is None else float(np.hypot(*(np.array(goal) - choices.exit[last]))))
        for (_, last), so_far in cost.items()
        if last >= 0
    ]
    return min(ends, default=np.inf)


def best_ways(choices: Choices, order: Sequence[int], start: Point, goal: Point | None) -> float:
    """The shortest length in this order, trying all ways."""
    ways = [np.flatnonzero(choices.owner == item).tolist() for item in order]
    return min(length(choices, rows, start, goal) for rows in itertools.product(*ways))


def least_length(points: np.ndarray, aim: float, rounds: int = 400) -> float:
    """A length that no closed tour of the points (N, 2) can be under.

    A tour is a tree of all points but the first and two edges of the first, with two edges at
    each point; a shortest such tree is no longer (Held and Karp 1970). Weights on the points,
    which cost a tour twice their sum, make it longer where it has more than two edges. They are
    found by subgradient steps towards `aim`, halved when they lead nowhere; whatever they are,
    the bound holds.
    """
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    weight, best, stride, idle = np.zeros(len(points)), 0.0, 2.0, 0
    past = np.zeros(len(points))
    for _ in range(rounds):
        total, degree = _one_tree(apart + weight[:, None] + weight[None])
        total -= 2.0 * float(weight.sum())
        idle = 0 if total > best else idle + 1
        best = max(best, total)
        if idle == IDLE_ROUNDS:
            stride, idle = 0.5 * stride, 0
        slope = degree - 2.0
        if not slope.any():
            break
        past = 0.7 * slope + 0.3 * past
        weight += stride * max(aim - total, 0.0) / float(slope @ slope) * past
    return best


IDLE_ROUNDS = 20


def _one_tree(cost: np.ndarray) -> tuple[float, np.ndarray]:
    """Length and degrees (N,) of the shortest tree of all but point 0, and its two edges."""
    count = len(cost)
    degree, reach = np.zeros(count), cost[1].copy()
    came = np.ones(count, dtype=int)
    left = np.ones(count, dtype=bool)
    left[:2] = False
    total = 0.0
    for _ in range(count - 2):
        nearest = int(np.where(left, reach, np.inf).argmin())
        total += float(reach[nearest])
        degree[nearest] += 1
        degree[came[nearest]] += 1
        left[nearest] = False
        nearer = cost[nearest] < reach
        came[nearer], reach = nearest, np.minimum(reach, cost[nearest])
    two = np.argsort(cost[0, 1:], kind="stable")[:2] + 1
    degree[0] = 2
    degree[two] += 1
    return total + float(cost[0, two].sum()), degree
