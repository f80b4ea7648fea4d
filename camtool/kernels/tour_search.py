"""Steps that make a tour shorter, until none does; then kicks, kept where they lead to more.

From each item that waits in the queue the best step is taken that brings it beside one of its
neighbours, or gives it another row; what the step touches waits again. A kick lets two short
parts of the tour change places somewhere, and everything is undone when the tour is not shorter
after the steps that follow. The places of the kicks are pseudo-random and the same in each run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel
from camtool.kernels.tour import (
    Step,
    Tour,
    gain_of_reversal,
    gain_of_swap,
    gap,
    may_swap,
    row_at,
    take,
    turning,
    undo,
)

Ints = npt.NDArray[np.int64]

LEAST_GAIN_MM = 1e-9
"""A step that gains less is not taken: it could be rounding alone."""

LONGEST_MOVED = 3
"""So many items are moved together elsewhere."""

ROWS_TRIED = 12
"""A moved item of more rows tries only so many of them, evenly spread; which is best is decided
exactly later."""

KICK_REACH = 50
"""The parts that a kick exchanges have at most this many items."""

LOG = 8192
"""So many changes after a kick can be undone; no more are made."""


@inner
def shorten(
    tour: Tour, queue: Ints, waits: Ints, count: int, log: Ints, logged: int
) -> tuple[float, int]:
    """Take steps until no item waits: how much shorter the tour is, and how much is logged.

    `queue` (M,) holds the `count` items that wait, `waits` (M,) 1 for each of them. With
    `logged` < 0 nothing need be undone.
    """
    head, gained, size = 0, 0.0, len(queue)
    while count > 0:
        item = queue[head]
        head, count = (head + 1) % size, count - 1
        waits[item] = 0
        while logged < len(log) - 4:
            step = best_step(tour, item)
            if step.gain <= LEAST_GAIN_MM:
                break
            logged = (
                take(tour, step, log, logged) if logged >= 0 else min(take(tour, step, log, 0), -1)
            )
            gained += step.gain
            for position in _touched(tour, step):
                count = _wait(tour, queue, waits, head, count, position)
    return gained, logged


@inner
def _wait(tour: Tour, queue: Ints, waits: Ints, head: int, count: int, position: int) -> int:
    """Let the item at a position wait, unless it does; how many wait then."""
    item = tour.item[position]
    if position < 1 or position > len(queue) or waits[item]:
        return count
    queue[(head + count) % len(queue)] = item
    waits[item] = 1
    return count + 1


@inner
def _touched(tour: Tour, step: Step) -> tuple[int, int, int, int, int, int, int, int]:
    """Positions beside a gap that a step has changed."""
    last = step.high if step.other < 0 else step.other
    middle = step.low if step.other < 0 else step.low + step.other - step.high
    at = step.low if step.who < 0 else tour.place[step.who]
    return step.low - 1, step.low, middle - 1, middle, last, last + 1, at, at + 1


@inner
def best_step(tour: Tour, item: int) -> Step:
    """The step that gains most of those that concern this item; gain 0 when there is none."""
    at, last = tour.place[item], len(tour.item) - 2
    row, left, right = tour.row[item], row_at(tour, at - 1), row_at(tour, at + 1)
    into, out = gap(tour, left, row), gap(tour, row, right)
    turned = tour.turned[row]
    best = _other_row(tour, item, Step(LEAST_GAIN_MM, 0, -1, -1, 0, -1, -1))
    best = _reversal(tour, 1, at, best)
    best = _reversal(tour, at, last, best)
    lifted = into + out - gap(tour, left, right)
    # A place gains nowhere more than by being lifted out, and little beside a far neighbour.
    alone = tour.first[item + 1] - tour.first[item] == 1 and not tour.one_way
    reach = max(into, out) if alone else np.inf
    for k in range(tour.near_first[item], tour.near_first[item + 1]):
        near = tour.near[k]
        spot, other = tour.place[near], tour.row[near]
        if gap(tour, other, row) < into:
            best = _part(tour, at, 1, spot, False, best)
        if gap(tour, turned, other) < into:
            best = _part(tour, at, 1, spot - 1, True, best)
            best = _reversal(tour, min(at, spot), max(at, spot) - 1, best)
        if gap(tour, row, other) < out:
            best = _part(tour, at, -1, spot - 1, False, best)
        if gap(tour, other, turned) < out:
            best = _part(tour, at, -1, spot, True, best)
            best = _reversal(tour, min(at, spot) + 1, max(at, spot), best)
        if gap(tour, row, other) < reach and (lifted > best.gain or not alone):
            best = _single(tour, item, spot - 1, lifted, best)
            best = _single(tour, item, spot, lifted, best)
    return best


@inner
def _other_row(tour: Tour, item: int, best: Step) -> Step:
    """The best row of an item where it is."""
    at, row = tour.place[item], tour.row[item]
    left, right = row_at(tour, at - 1), row_at(tour, at + 1)
    now = gap(tour, left, row) + gap(tour, row, right)
    for other in range(tour.first[item], tour.first[item + 1]):
        gain = now - gap(tour, left, other) - gap(tour, other, right)
        if gain > best.gain:
            best = Step(gain, at, at - 1, -1, 0, item, other)
    return best


@inner
def _reversal(tour: Tour, low: int, high: int, best: Step) -> Step:
    if low > high:
        return best
    gain = gain_of_reversal(tour, low, high)
    if gain > best.gain:
        gain -= turning(tour, low, high)
        if gain > best.gain:
            return Step(gain, low, high, -1, 0, -1, -1)
    return best


@inner
def _part(tour: Tour, at: int, way: int, spot: int, turn: bool, best: Step) -> Step:
    """Parts of two and more items that begin (way 1) or end (way −1) at a position, moved between
    the positions `spot` and `spot` + 1."""
    for length in range(2, LONGEST_MOVED + 1):
        low = at if way > 0 else at - length + 1
        high = low + length - 1
        if low < 1 or high > len(tour.item) - 2 or low - 1 <= spot <= high:
            break
        if spot > high:
            best = _swap(tour, low, high, spot, 1 if turn else 0, best)
        else:
            best = _swap(tour, spot + 1, low - 1, high, 2 if turn else 0, best)
    return best


@inner
def _swap(tour: Tour, low: int, high: int, other: int, flip: int, best: Step) -> Step:
    gain = gain_of_swap(tour, low, high, other, flip)
    if gain > best.gain and may_swap(tour, low, high, other):
        if flip == 1:
            gain -= turning(tour, low, high)
        elif flip == 2:
            gain -= turning(tour, high + 1, other)
        if gain > best.gain:
            return Step(gain, low, high, other, flip, -1, -1)
    return best


@inner
def _single(tour: Tour, item: int, spot: int, lifted: float, best: Step) -> Step:
    """One item moved between the positions `spot` and `spot` + 1, cut in the best way there."""
    at = tour.place[item]
    if at - 1 <= spot <= at:
        return best
    left, right = row_at(tour, spot), row_at(tour, spot + 1)
    there = lifted + gap(tour, left, right)
    row, gain = -1, best.gain
    first, count = tour.first[item], tour.first[item + 1] - tour.first[item]
    for k in range(min(count, ROWS_TRIED)):
        other = first + (k if count <= ROWS_TRIED else k * count // ROWS_TRIED)
        found = there - gap(tour, left, other) - gap(tour, other, right)
        if found > gain:
            row, gain = other, found
    if row < 0:
        return best
    low, high, end = (at, at, spot) if spot > at else (spot + 1, at - 1, at)
    if not may_swap(tour, low, high, end):
        return best
    return Step(gain, low, high, end, 0, item, row)


def settled(tour: Tour) -> float:
    """How much shorter the tour is when no step gains any more."""
    return float(kicked(tour, 0, 1))


@kernel
def kicked(tour: Tour, kicks: int, seed: int) -> float:
    """How much shorter the tour is when no step gains any more, and after so many kicks."""
    items = len(tour.item) - 2
    queue, waits = tour.item[1:-1].copy(), np.ones(items, np.int64)
    log = np.empty((LOG, 2), np.int64)
    waiting, may_undo, step = items, -1, Step(0.0, 0, -1, -1, 0, -1, -1)
    gained, kick = 0.0, -1
    while kick < kicks:
        gain, logged = shorten(tour, queue, waits, waiting, log, may_undo)
        if kick < 0 or gain + step.gain > LEAST_GAIN_MM:
            gained += gain + step.gain
        else:
            undo(tour, log, logged)
        waiting = 0
        while waiting == 0 and kick < kicks:
            kick += 1
            if items < 2 or kick == kicks:
                return gained
            seed = seed * 48271 % 2147483647
            low = 1 + seed % (items - 1)
            seed = seed * 48271 % 2147483647
            high = min(low + seed % KICK_REACH, items - 1)
            seed = seed * 48271 % 2147483647
            other = min(high + 1 + seed % KICK_REACH, items)
            if not may_swap(tour, low, high, other):
                continue
            gain = gain_of_swap(tour, low, high, other, 0)
            step = Step(gain, low, high, other, 0, -1, -1)
            may_undo = take(tour, step, log, 0)
            for position in _touched(tour, step):
                waiting = _wait(tour, queue, waits, 0, waiting, position)
    return gained
