"""The first tour, by nearest neighbours, and which items are near to which.

An item may be taken when everything before it has been taken; its rows lie in the tree all the
time, and are switched on then.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel
from camtool.kernels.tour_tree import ANYWHERE, Tree, nearest_owners, nearest_row, switch

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

NEAR = 7
"""Neighbours of an item of one place: work against length."""

NEAR_EACH = 3
"""Neighbours of each place of an item of many, at least."""

NEAR_QUARTER = 1
"""Neighbours in each quarter of the plane round an item's first place: without them the items of
a cluster, such as the strokes of a letter, would know of no other cluster."""


@kernel
def nearest_first(
    tree: Tree,
    ends: Floats,
    first: Ints,
    after_first: Ints,
    after: Ints,
    waits: Ints,
    start: Floats,
) -> Ints:
    """Rows (M,) in order: from `start` (2,) always to the nearest row that may be taken.

    `tree` is that of the entries, and is used up. `ends` (S, 4): entry x, y and exit x, y; item i
    owns the rows from first[i] to first[i + 1]; after[after_first[i] : after_first[i + 1]] may
    come after item i only, and `waits` (M,) counts for each item what must come before it.
    Shorter than M when items wait for each other.
    """
    count, x, y = len(first) - 1, start[0], start[1]
    rows, owner = np.empty(count, np.int64), np.empty(first[-1], np.int64)
    on, waiting = np.ones(first[-1], np.int64), waits.copy()
    for i in range(count):
        owner[first[i] : first[i + 1]] = i
        if waiting[i] > 0:
            for row in range(first[i], first[i + 1]):
                on[row] = 0
                switch(tree, row, -1)
    for rank in range(count):
        chosen = nearest_row(tree, on, x, y)
        if chosen < 0:
            return rows[:rank]
        rows[rank], item = chosen, owner[chosen]
        x, y = ends[chosen, 2], ends[chosen, 3]
        for row in range(first[item], first[item + 1]):
            on[row] = 0
            switch(tree, row, -1)
        for k in range(after_first[item], after_first[item + 1]):
            later = after[k]
            waiting[later] -= 1
            if waiting[later] == 0:
                for row in range(first[later], first[later + 1]):
                    on[row] = 1
                    switch(tree, row, 1)
    return rows


@kernel
def neighbours(tree: Tree, owner: Ints, count: int) -> tuple[Ints, Ints]:
    """Neighbours of item i: near[near_first[i] : near_first[i + 1]], by a tree of N places.

    `owner` (N,) ascends. Each place brings its nearest items, the first one those in each quarter
    too; what several bring comes once.
    """
    place_first = np.zeros(count + 1, np.int64)
    for item in owner:
        place_first[item + 1] += 1
    for item in range(count):
        place_first[item + 1] += place_first[item]
    near_first = np.zeros(count + 1, np.int64)
    most_of_item = NEAR + NEAR_EACH + 4 * NEAR_QUARTER
    near = np.empty(len(owner) * NEAR_EACH + count * most_of_item, np.int64)
    seen, total = np.full(count, -1), 0
    for i in range(count):
        places = place_first[i + 1] - place_first[i]
        most = max(NEAR_EACH, (NEAR + places - 1) // max(places, 1))
        for place in range(place_first[i], place_first[i + 1]):
            for other in nearest_owners(tree, owner, place, most, ANYWHERE):
                if seen[other] != i:
                    seen[other] = i
                    near[total] = other
                    total += 1
        for quarter in range(4 if places > 0 else 0):
            for other in nearest_owners(tree, owner, place_first[i], NEAR_QUARTER, quarter):
                if seen[other] != i:
                    seen[other] = i
                    near[total] = other
                    total += 1
        near_first[i + 1] = total
    return near[:total].copy(), near_first
