"""A tour through items, as an array of positions, and the two steps that change it.

    position   0      1 … M    M + 1
    item       from   items    to

A part of the tour is reversed (2-opt), and each item in it is cut from its other end when it has
one; or two neighbouring parts change places (Or-opt when one of them is short), each reversed or
not. The second step is made of reversals too, and a reversal undoes itself.

What makes it exact: a step's gain counts the gaps that it opens and closes, and where items that
cannot be turned lie in a reversed part, the gaps between them too. Whether a step would bring an
item before one that must precede it is read from the positions, and such a step is never taken.
`tests/oracles/tours.py` is the twin.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class Tour(NamedTuple):
    """What is given: `ends` (S + 2, 4), entry and exit of each row, then those of from and to;
    `turned` (S + 2,), the row with both exchanged, or itself when there is none; item i owns the
    rows from first[i] to first[i + 1]; `near`, `after`, `earlier`: of each item its neighbours,
    what comes after it and what before it, with the firsts of each; `free` the row of `to` when
    the tool may stay anywhere, else −1; `one_way` whether some row cannot be turned.

    What changes: `item` (M + 2,) by position, `place` (M + 2,), the position by item, `row`
    (M + 2,), the chosen row by item.
    """

    ends: Floats
    turned: Ints
    first: Ints
    near: Ints
    near_first: Ints
    after: Ints
    after_first: Ints
    earlier: Ints
    earlier_first: Ints
    free: int
    one_way: bool
    item: Ints
    place: Ints
    row: Ints


class Step(NamedTuple):
    """A change of the tour that shortens it by `gain`.

    other < 0: the positions low … high are reversed. Otherwise they change places with those
    behind them up to `other`; `flip` says which of the two is reversed as well (1: the first,
    2: the second, 0: none). `row` ≥ 0: the row that item `who` takes then.
    """

    gain: float
    low: int
    high: int
    other: int
    flip: int
    who: int
    row: int


@inner
def gap(tour: Tour, one: int, other: int) -> float:
    """From the exit of a row to the entry of another one."""
    if other == tour.free:
        return 0.0
    x = tour.ends[other, 0] - tour.ends[one, 2]
    y = tour.ends[other, 1] - tour.ends[one, 3]
    return math.sqrt(x * x + y * y)


@inner
def row_at(tour: Tour, position: int) -> int:
    """The chosen row of the item at a position."""
    return int(tour.row[tour.item[position]])


@inner
def reverse(tour: Tour, low: int, high: int) -> None:
    """Reverse the positions low … high, and turn what lies there."""
    while low <= high:
        one, other = tour.item[low], tour.item[high]
        tour.item[low], tour.item[high] = other, one
        tour.place[one], tour.place[other] = high, low
        tour.row[one] = tour.turned[tour.row[one]]
        if one != other:
            tour.row[other] = tour.turned[tour.row[other]]
        low += 1
        high -= 1


@inner
def turning(tour: Tour, low: int, high: int) -> float:
    """How much longer the inside of low … high gets when it is reversed; inf: it must not be."""
    if len(tour.after) > 0:
        for position in range(low, high):
            item = tour.item[position]
            for k in range(tour.after_first[item], tour.after_first[item + 1]):
                if tour.place[tour.after[k]] <= high:
                    return np.inf
    longer = 0.0
    if tour.one_way:
        for position in range(low, high):
            one, other = row_at(tour, position), row_at(tour, position + 1)
            longer += gap(tour, tour.turned[other], tour.turned[one]) - gap(tour, one, other)
    return longer


@inner
def may_swap(tour: Tour, low: int, high: int, other: int) -> bool:
    """Whether nothing in low … high must come before anything in high + 1 … other."""
    if len(tour.after) == 0:
        return True
    if high - low < other - high:
        for position in range(low, high + 1):
            item = tour.item[position]
            for k in range(tour.after_first[item], tour.after_first[item + 1]):
                if high < tour.place[tour.after[k]] <= other:
                    return False
        return True
    for position in range(high + 1, other + 1):
        item = tour.item[position]
        for k in range(tour.earlier_first[item], tour.earlier_first[item + 1]):
            if low <= tour.place[tour.earlier[k]] <= high:
                return False
    return True


@inner
def gain_of_reversal(tour: Tour, low: int, high: int) -> float:
    """How much shorter the tour gets at both sides of a reversed part."""
    left, right = row_at(tour, low - 1), row_at(tour, high + 1)
    one, other = row_at(tour, low), row_at(tour, high)
    return (
        gap(tour, left, one)
        + gap(tour, other, right)
        - gap(tour, left, tour.turned[other])
        - gap(tour, tour.turned[one], right)
    )


@inner
def gain_of_swap(tour: Tour, low: int, high: int, other: int, flip: int) -> float:
    """How much shorter the tour gets at the sides of two parts that change places."""
    left, right = row_at(tour, low - 1), row_at(tour, other + 1)
    one, end_one = row_at(tour, low), row_at(tour, high)
    two, end_two = row_at(tour, high + 1), row_at(tour, other)
    before = gap(tour, left, one) + gap(tour, end_one, two) + gap(tour, end_two, right)
    if flip == 1:
        one, end_one = tour.turned[end_one], tour.turned[one]
    elif flip == 2:
        two, end_two = tour.turned[end_two], tour.turned[two]
    return before - gap(tour, left, two) - gap(tour, end_two, one) - gap(tour, end_one, right)


@inner
def take(tour: Tour, step: Step, log: Ints, logged: int) -> int:
    """Change the tour, write down how to undo it, and return how much is written."""
    low, high, other = step.low, step.high, step.other
    if other >= 0:
        middle = low + other - high
        logged = _reversed(tour, low, other, log, logged)
        if step.flip != 2:
            logged = _reversed(tour, low, middle - 1, log, logged)
        if step.flip != 1:
            logged = _reversed(tour, middle, other, log, logged)
    elif high >= low:
        logged = _reversed(tour, low, high, log, logged)
    if step.row >= 0:
        log[logged, 0], log[logged, 1] = -1 - step.who, tour.row[step.who]
        logged += 1
        tour.row[step.who] = step.row
    return logged


@inner
def _reversed(tour: Tour, low: int, high: int, log: Ints, logged: int) -> int:
    reverse(tour, low, high)
    log[logged, 0], log[logged, 1] = low, high
    return logged + 1


@inner
def undo(tour: Tour, log: Ints, logged: int) -> None:
    """Take back what is written down, the last first."""
    for k in range(logged - 1, -1, -1):
        if log[k, 0] < 0:
            tour.row[-1 - log[k, 0]] = log[k, 1]
        else:
            reverse(tour, log[k, 0], log[k, 1])
