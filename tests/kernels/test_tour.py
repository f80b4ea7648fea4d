"""The kernels of the order search, against what they replace."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels.tours import (
    Branches,
    Route,
    Tour,
    best_rows,
    gain_of_reversal,
    gain_of_swap,
    kicked,
    may_swap,
    nearest_owners,
    nearest_row,
    neighbours,
    reverse,
    settled,
    switch,
    tree_of,
    turning,
)
from camtool.planning.order import Choices, tour_of, travel_mm
from tests.oracles import tours

pytestmark = pytest.mark.checked


def places(count: int, reach: int = 4) -> st.SearchStrategy[list[tuple[int, int]]]:
    """Places with many equal distances among them."""
    each = st.tuples(st.integers(-reach, reach), st.integers(-reach, reach))
    return st.lists(each, min_size=1, max_size=count)


@given(places(40), st.integers(-5, 5), st.integers(-5, 5), st.sets(st.integers(0, 39)))
def test_the_nearest_of_those_that_are_on(
    points: list[tuple[int, int]], x: int, y: int, off: set[int]
) -> None:
    array = np.array(points, dtype=float)
    tree, on = Branches(tree_of(array)), np.ones(len(array), dtype=np.int64)
    for row in off & set(range(len(array))):
        on[row] = 0
        switch(tree, row, -1)
    found = nearest_row(tree, on, float(x), float(y))
    apart = [(np.hypot(*(array[k] - (x, y))) ** 2, k) for k in range(len(array)) if on[k]]
    assert found == (min((round(d), k) for d, k in apart)[1] if apart else -1)


@given(places(40), st.integers(1, 9), st.integers(1, 6), st.integers(0, 39), st.integers(-1, 3))
def test_the_nearest_owners(
    points: list[tuple[int, int]], most: int, owners: int, row: int, quarter: int
) -> None:
    array, row = np.array(points, dtype=float), row % len(points)
    owner = np.arange(len(array)) % owners
    apart: dict[int, int] = {}
    for k in np.flatnonzero(owner != owner[row]).tolist():
        x, y = (array[k] - array[row]).tolist()
        angle = math.atan2(y, x) % (2.0 * math.pi)
        if quarter >= 0 and ((x, y) == (0.0, 0.0) or int(angle // (0.5 * math.pi)) != quarter):
            continue
        squared = round(float(((array[k] - array[row]) ** 2).sum()))
        apart[int(owner[k])] = min(squared, apart.get(int(owner[k]), squared))
    wanted = sorted(apart, key=lambda each: (apart[each], each))[:most]
    found, squared_mm = np.empty(most, np.int64), np.empty(most)
    tree = Branches(tree_of(array))
    count = nearest_owners(tree, owner, row, most, quarter, found, squared_mm)
    assert found[:count].tolist() == wanted


def test_a_cluster_knows_of_other_clusters() -> None:
    # Failed once: neighbours were those of the same letter alone, and a page of letters was 13 %
    # longer than need be.
    rng = np.random.default_rng(5)
    centres = np.array([[0.0, 0], [100, 0], [0, 100], [100, 100]])
    points = (centres[:, None] + rng.uniform(-1, 1, (4, 30, 2))).reshape(-1, 2)
    near, near_first = neighbours(tree_of(points), np.arange(120), 120)
    for cluster in range(4):
        low, high = near_first[30 * cluster], near_first[30 * (cluster + 1)]
        assert len(set((near[low:high] // 30).tolist())) >= 3


def layout(seed: int, count: int) -> tuple[Choices, np.ndarray, np.ndarray]:
    """Items of one way, of two or of three, what comes before what, and an order that keeps it."""
    rng = np.random.default_rng(seed)
    owner = np.repeat(np.arange(count), 1 + np.arange(count) % 3)
    entry, leave = rng.uniform(0, 9, (2, len(owner), 2))
    leave[owner % 3 == 2] = entry[owner % 3 == 2]
    second = np.flatnonzero(owner % 3 == 1)[1::2]
    entry[second], leave[second] = leave[second - 1], entry[second - 1]
    rows = np.searchsorted(owner, np.arange(count))
    before = np.array([(k, k + 1 + int(rng.integers(5))) for k in range(0, count - 6, 4)])
    return Choices(owner, entry, leave), before.reshape(-1, 2), rows


def made(seed: int, count: int, *, stays: bool = False) -> tuple[Choices, np.ndarray, Tour]:
    choices, before, rows = layout(seed, count)
    goal = np.full(2, np.nan) if stays else np.ones(2)
    return choices, before, tour_of(choices, before, rows, np.zeros(2), goal)


def length(choices: Choices, tour: Tour) -> float:
    goal = None if tour.free >= 0 else (1.0, 1.0)
    return travel_mm(choices, tour.row[tour.item[1:-1]], (0.0, 0.0), goal)


@given(st.integers(0, 99), st.integers(1, 12), st.integers(1, 12), st.booleans())
def test_the_gain_of_a_reversal_is_what_it_gains(seed: int, a: int, b: int, stays: bool) -> None:
    choices, before, tour = made(seed, 12, stays=stays)
    low, high, was = min(a, b), max(a, b), length(choices, tour)
    route = Route(tour)
    gain, longer = gain_of_reversal(route, low, high), turning(route, low, high)
    rows = tour.row.copy()
    reverse(route, low, high)
    kept = tours.keeps(choices, tour.row[tour.item[1:-1]].tolist(), before.tolist())
    assert np.isfinite(longer) == kept
    if kept:
        assert was - length(choices, tour) == pytest.approx(gain - longer, abs=1e-9)
    reverse(route, low, high)
    assert (tour.row == rows).all()
    assert (tour.item[tour.place] == np.arange(14)).all()


@given(st.integers(0, 99), st.sets(st.integers(1, 13), min_size=3, max_size=3), st.integers(0, 2))
def test_the_gain_of_a_swap_is_what_it_gains(seed: int, cuts: set[int], flip: int) -> None:
    choices, before, tour = made(seed, 12)
    low, second, end = sorted(cuts)
    route = Route(tour)
    gain, may = (
        gain_of_swap(route, low, second - 1, end - 1, flip),
        may_swap(route, low, second - 1, end - 1),
    )
    longer = {0: 0.0, 1: turning(route, low, second - 1), 2: turning(route, second, end - 1)}[flip]
    order, was = tour.item.copy(), length(choices, tour)
    one, two = order[low:second], order[second:end]
    turned = {0: [], 1: one, 2: two}[flip]
    row = tour.row.copy()
    row[turned] = tour.turned[row[turned]]
    order[low:end] = [*(two[::-1] if flip == 2 else two), *(one[::-1] if flip == 1 else one)]
    kept = tours.keeps(choices, row[order[1:-1]].tolist(), before.tolist())
    assert kept == (may and np.isfinite(longer))
    if kept:
        now = travel_mm(choices, row[order[1:-1]], (0.0, 0.0), (1.0, 1.0))
        assert was - now == pytest.approx(gain - longer, abs=1e-9)


@pytest.mark.parametrize("stays", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 60])
def test_the_search_gains_what_it_says(count: int, stays: bool) -> None:
    for seed in range(5):
        choices, before, tour = made(seed, count, stays=stays)
        for work in (settled, lambda tour: kicked(tour, 200, 7)):
            was = length(choices, tour)
            gain = work(tour)
            assert gain >= 0.0
            assert was - length(choices, tour) == pytest.approx(gain, abs=1e-6)
            rows = tour.row[tour.item[1:-1]].tolist()
            assert tours.keeps(choices, rows, before.tolist())
        rounds = 0
        while settled(tour) > 0.0:
            rounds += 1
        assert rounds < 10


@given(st.integers(0, 500), st.booleans())
def test_the_best_rows_for_an_order(seed: int, stays: bool) -> None:
    choices, _, _ = layout(seed, 6)
    order = np.random.default_rng(seed).permutation(6)
    ends, goal = np.column_stack([choices.entry, choices.exit]), (2.0, 3.0)
    end = np.full(2, np.nan) if stays else np.array(goal)
    rows = best_rows(ends, choices.first, order, np.zeros(2), end)
    assert choices.owner[rows].tolist() == order.tolist()
    end_at = None if stays else goal
    found = travel_mm(choices, rows, (0.0, 0.0), end_at)
    assert found == pytest.approx(tours.best_ways(choices, order.tolist(), (0.0, 0.0), end_at))
