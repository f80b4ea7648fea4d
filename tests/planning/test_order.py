"""In which order items are cut, and where each begins."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Ints
from camtool.errors import OptionError
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines, begin_at, reverse
from camtool.planning import order
from camtool.planning.items import Contour, CutRun, Feeds, Fixed, Item, Setting, contours_of
from camtool.planning.job import Operation
from camtool.planning.order import (
    Choices,
    best_order,
    choices_of,
    chosen_paths,
    drawn_order,
    must_precede,
    travel_mm,
)
from camtool.planning.paths import joints
from camtool.records import replace
from tests.oracles import tours
from tests.strategies import coordinates, polylines

SETTING = Setting(Operation(), Feeds(60.0, 30.0), (-1.0,), 2.0)
NONE: Ints = np.empty((0, 2), dtype=np.int64)
ZERO = (0.0, 0.0)
QUARTER = float(np.tan(np.pi / 8))
Way = tuple[float, float, float, float]


def closed(*rows: tuple[float, ...]) -> Contour:
    path = Polyline(np.array([(*row, 0.0)[:3] for row in rows]), closed=True)
    return Contour(path, SETTING, "closed", 0)


def line(*numbers: float, reversible: bool = True) -> Contour:
    path = Polyline(np.array([[*numbers[:2], 0.0], [*numbers[2:], 0.0]]))
    return Contour(path, SETTING, "line", 0, reversible)


def circle(x: float, y: float, radius: float) -> Contour:
    return closed((x - radius, y, 1.0), (x + radius, y, 1.0))


def box(x0: float, y0: float, x1: float, y1: float) -> Contour:
    return closed((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def hole(x: float, y: float) -> Fixed:
    run = CutRun(np.array([[x, y, 0.0, 0.0], [x, y, -1.0, 0.0]]), np.array([30.0]), 30.0, "hole")
    return Fixed((run,), SETTING, "hole")


def of_ways(items: list[list[Way]]) -> Choices:
    owner = np.repeat(np.arange(len(items)), [len(ways) for ways in items])
    ends = np.array([way for ways in items for way in ways], dtype=float).reshape(-1, 4)
    return Choices(owner, ends[:, :2], ends[:, 2:])


def cut(items: list[Item], **points: tuple[float, float] | None) -> list[int]:
    choices = choices_of(items)
    return choices.owner[best_order(choices, must_precede(items), **points)].tolist()


def points() -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(coordinates(), coordinates())


@st.composite
def ways(draw: st.DrawFn) -> list[Way]:
    """All ways of one item: closed, a line to be cut both ways or one way, or anything."""
    one, other = draw(points()), draw(points())
    kind = draw(st.sampled_from(["closed", "both", "one", "any"]))
    if kind == "closed":
        return [(*p, *p) for p in draw(st.lists(points(), min_size=1, max_size=5))]
    if kind == "both":
        return [(*one, *other), (*other, *one)]
    if kind == "one":
        return [(*one, *other)]
    return draw(st.lists(st.tuples(points(), points()).map(lambda p: (*p[0], *p[1])), min_size=1,
                         max_size=3))  # fmt: skip


@st.composite
def pairs(draw: st.DrawFn, count: int) -> list[tuple[int, int]]:
    """Draw precedences without cycles, from earlier to later in a random order."""
    order = draw(st.permutations(range(count)))
    ranks = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    drawn_pairs = draw(st.lists(ranks, max_size=2 * count)) if count else []
    return [(order[min(p)], order[max(p)]) for p in drawn_pairs if p[0] != p[1]]


def test_an_order_is_better_than_always_the_nearest() -> None:
    # 1, −2, 4, −8, 16, −32: the nearest first runs to and fro, one side first does not.
    items: list[Item] = [circle(float((-2) ** k), 0, 0.25) for k in range(6)]
    choices = choices_of(items)
    rows = best_order(choices, NONE, to_point=None)
    assert {*choices.owner[rows[:3]].tolist()} == {0, 2, 4}
    assert travel_mm(choices, rows, ZERO, None) == 15.75 + 15.75 + 31.75


def test_what_lies_within_comes_before_what_holds_it() -> None:
    # The frame's corner is where the tool stands, yet it is the last to be cut.
    items: list[Item] = [box(0, 0, 50, 50), circle(20, 20, 8), circle(20, 20, 1), hole(40, 40)]
    assert must_precede(items).tolist() == [[1, 0], [2, 1], [3, 0]]
    way = cut(items)
    assert way[-1] == 0
    assert way.index(2) < way.index(1)


def test_only_contours_wait_for_what_they_hold() -> None:
    ring = box(0, 0, 9, 9).path
    pocket = Fixed(hole(5, 5).runs, SETTING, "pocket", outline=ring)
    assert must_precede([pocket, hole(4, 4), box(-1, -1, 10, 10)]).tolist() == [[0, 2], [1, 2]]
    assert must_precede([line(0, 0, 9, 0), hole(4, 0)]).tolist() == []
    assert must_precede([]).shape == (0, 2)


def before_by_pairs(items: list[Item]) -> list[list[int]]:
    """Return the pairs of items of which one must precede the other, item by item."""
    shapes = {id(shape): shape for shape in map(shape_of, items)}
    rank = {key: k for k, key in enumerate(shapes)}
    parent = Nesting(Polylines.of(shapes.values())).levels.parent if shapes else []
    return sorted(
        [one, other]
        for one, item in enumerate(items)
        for other, holder in enumerate(items)
        if parent[rank[id(shape_of(item))]] == rank[id(shape_of(holder))]
    )


def shape_of(item: Item) -> Polyline:
    """Return the path that a contour is a part of, or its own."""
    assert isinstance(item, Contour)
    return item.outline or item.path


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(1, 6), st.integers(1, 3)), max_size=9))
def test_many_contours_wait_as_each_of_them_does(boxes: list[tuple[int, int, int]]) -> None:
    items: list[Item] = []
    for rank, (low, size, parts) in enumerate(boxes):
        whole = box(low + rank / 64, low, low + size, low + size)
        ends = pairwise(np.linspace(0, 4, parts + 1).astype(int).tolist())
        around = np.concatenate([whole.path.vertices, whole.path.vertices[:1]])
        divided = [
            replace(whole, path=Polyline(around[begin : end + 1]), outline=whole.path)
            for begin, end in ends
        ]
        items += divided if parts > 1 else [whole]
    wanted = before_by_pairs(items)
    assert must_precede(items).tolist() == wanted


def test_an_arc_of_a_run_is_seen_as_an_arc() -> None:
    # Down, then half round: its chord lies within the box, the arc does not.
    rows = np.array([[1.0, 5, 0, 0], [1, 5, -1, -1.0], [1, 1, -1, 0]])
    across = Fixed((CutRun(rows, np.full(2, 30.0), 30.0, "arc"),), SETTING, "arc")
    assert must_precede([across, box(0.5, 0, 9, 9)]).tolist() == [[0, 1]]
    rows[1, 3] = 1.0
    assert must_precede([across, box(0.5, 0, 9, 9)]).tolist() == []


def test_open_paths_are_travelled_from_the_nearer_end() -> None:
    items: list[Item] = [line(9, 0, 1, 0), line(9, 1, 1, 1)]
    choices = choices_of(items)
    first, second = chosen_paths(contours_of(items), choices, best_order(choices, NONE))
    assert (first.start.tolist(), first.end.tolist()) == ([1, 0], [9, 0])
    assert (second.start.tolist(), second.end.tolist()) == ([9, 1], [1, 1])


def test_what_may_not_be_turned_runs_as_drawn() -> None:
    items: list[Item] = [line(9, 0, 1, 0, reversible=False)]
    choices = choices_of(items)
    (path,) = chosen_paths(contours_of(items), choices, best_order(choices, NONE))
    assert path.start.tolist() == [9, 0]


def test_to_and_fro_in_two_passes_ends_at_the_start() -> None:
    twice = replace(line(0, 0, 9, 0), setting=replace(SETTING, levels_mm=(-1.0, -2.0)))
    choices = choices_of([twice])
    assert choices.entry.tolist() == choices.exit.tolist() == [[0, 0], [9, 0]]


def test_closed_paths_begin_at_the_nearest_place_allowed() -> None:
    square = box(-9, -9, -1, -1)
    for item, start in ((square, [-1, -1]), (replace(square, starts=np.array([1, 3])), [-1, -9])):
        choices = choices_of([item])
        (path,) = chosen_paths([item], choices, best_order(choices, NONE))
        assert path.start.tolist() == start


def test_no_path_begins_within_an_arc_that_was_split() -> None:
    # A slot whose right cap is two quarters; the vertex between them is nearest to the tool.
    slot = closed((-5, -1), (-2, -1, QUARTER), (-1, 0, QUARTER), (-2, 1), (-5, 1, 1))
    choices = choices_of([slot])
    (path,) = chosen_paths([slot], choices, best_order(choices, NONE))
    assert path.start.tolist() == [-2, -1]


@given(st.lists(st.tuples(polylines(), st.booleans(), st.booleans()), max_size=6))
def test_each_variant_of_many_items_is_that_of_the_item(
    drawn_items: list[tuple[Polyline, bool, bool]],
) -> None:
    items: list[Item] = []
    for path, reversible, begins in drawn_items:
        starts = np.arange(begins and path.closed, dtype=np.int64)
        one = Contour(path, SETTING, "one", 0, reversible and not path.closed, starts)
        items += [one, hole(*path.start.tolist())] if begins else [one]
    choices = choices_of(items)
    rows = [
        row
        for row, owner in enumerate(choices.owner.tolist())
        if isinstance(items[owner], Contour)
    ]
    wanted: list[Polyline] = []
    for item in items:
        if not isinstance(item, Contour):
            continue
        if item.path.closed:
            own = np.flatnonzero(joints(Polylines.of([item.path])))
            own = item.starts if len(item.starts) else own
            wanted += [begin_at(item.path, k) for k in own.tolist()]
        else:
            wanted += [item.path, reverse(item.path)] if item.reversible else [item.path]
    contours = contours_of(items)
    own = choices_of(contours)
    found = chosen_paths(contours, own, np.arange(len(own.owner))[::-1])
    assert len(found) == len(wanted)
    for one, other in zip(found, reversed(wanted), strict=True):
        assert one.closed == other.closed
        assert one.vertices.tolist() == other.vertices.tolist()
    assert choices.entry[rows].tolist() == [path.start.tolist() for path in wanted]
    assert choices.exit[rows].tolist() == [path.end.tolist() for path in wanted]


def test_drawn_is_each_item_in_turn_in_its_first_way() -> None:
    choices = choices_of([box(1, 0, 2, 1), line(2, 0, 3, 0)])
    assert drawn_order(choices).tolist() == [0, 4]
    assert travel_mm(choices, drawn_order(choices), ZERO, None) == pytest.approx(2.0)
    assert travel_mm(choices, drawn_order(choices), ZERO, ZERO) == pytest.approx(5.0)


def test_nothing_needs_no_order() -> None:
    nothing = choices_of([])
    assert best_order(nothing, NONE).tolist() == []
    assert travel_mm(nothing, drawn_order(nothing), (0.0, 0.0), (3.0, 4.0)) == 5.0


def test_a_circle_of_items_is_refused() -> None:
    choices = choices_of([hole(k, 0) for k in range(5)])
    with pytest.raises(OptionError, match=r"3 items each have to be cut before another.* 1, 2, 3"):
        best_order(choices, np.array([[1, 2], [2, 3], [3, 1], [0, 4]]))
    with pytest.raises(ValueError, match="none of 5"):
        best_order(choices, np.array([[0, 5]]))


@pytest.mark.parametrize("owner", [[0, 2], [1, 2], [1, 0]])
def test_owners_ascend(owner: list[int]) -> None:
    with pytest.raises(ValueError, match="ascend"):
        Choices(np.array(owner), np.zeros((2, 2)), np.zeros((2, 2)))


def test_ways_are_finite() -> None:
    with pytest.raises(ValueError, match="exit"):
        Choices(np.array([0]), np.zeros((1, 2)), np.full((1, 2), np.nan))


@given(st.data(), st.lists(ways(), max_size=6), points(), st.none() | points())
def test_few_items_against_all_orders(
    data: st.DataObject,
    items: list[list[Way]],
    start: tuple[float, float],
    goal: tuple[float, float] | None,
) -> None:
    before = data.draw(pairs(len(items)))
    choices = of_ways(items)
    rows = best_order(choices, np.array(before, dtype=np.int64).reshape(-1, 2), start, goal)
    assert tours.keeps(choices, rows.tolist(), before)
    found = travel_mm(choices, rows, start, goal)
    assert found == pytest.approx(tours.length(choices, rows.tolist(), start, goal), abs=1e-9)
    least = tours.shortest(choices, before, start, goal) if items else found
    assert found >= least - 1e-9
    order = choices.owner[rows].tolist()
    assert found <= tours.best_ways(choices, order, start, goal) + 1e-9


def random_layout(seed: int, count: int) -> tuple[Choices, list[tuple[int, int]]]:
    """Items of all kinds, every third in a forest of what comes before what."""
    rng = np.random.default_rng(seed)
    items: list[list[Way]] = []
    for k in range(count):
        x, y, dx, dy = *rng.uniform(0, 100, 2), *rng.uniform(-8, 8, 2)
        corners = [(x, y), (x + dx, y), (x + dx, y + dy), (x, y + dy)]
        both = [(x, y, x + dx, y + dy), (x + dx, y + dy, x, y)]
        items.append([[(x, y, x, y)], [(*c, *c) for c in corners], both, both[:1]][k % 4])
    before = [(k, int(rng.integers(k + 1, count))) for k in range(0, count - 1, 3)]
    return of_ways(items), before


def test_seven_items_mostly_come_out_as_short_as_can_be() -> None:
    excess = []
    for seed in range(25):
        choices, before = random_layout(seed, 7)
        rows = best_order(choices, np.array(before))
        least = tours.shortest(choices, before, (0.0, 0.0), (0.0, 0.0))
        excess.append(travel_mm(choices, rows, ZERO, ZERO) / least - 1.0)
    assert max(excess) < 0.05
    assert np.mean(np.array(excess) < 1e-9) >= 0.9


@pytest.mark.parametrize("seed", range(4))
def test_many_items_are_never_cut_before_their_time(seed: int) -> None:
    choices, before = random_layout(seed, 300)
    rows = best_order(choices, np.array(before))
    assert tours.keeps(choices, rows.tolist(), before)
    again = best_order(choices, np.array(before))
    assert rows.tolist() == again.tolist()
    free = best_order(choices, NONE)
    assert travel_mm(choices, free, ZERO, ZERO) < travel_mm(choices, rows, ZERO, ZERO)


def test_a_chain_of_pairs_leaves_no_choice() -> None:
    choices, _ = random_layout(3, 40)
    chain = np.random.default_rng(5).permutation(40)
    rows = best_order(choices, np.column_stack([chain[:-1], chain[1:]]))
    assert choices.owner[rows].tolist() == chain.tolist()


@pytest.mark.parametrize("seed", range(3))
def test_places_within_three_percent_of_what_no_tour_can_be_under(seed: int) -> None:
    places = np.random.default_rng(seed).uniform(0, 100, (150, 2))
    choices = Choices(np.arange(150), places, places)
    found = travel_mm(choices, best_order(choices, NONE), ZERO, ZERO)
    bound = tours.least_length(np.concatenate([np.zeros((1, 2)), places]), found)
    assert bound - 1e-9 <= found <= 1.03 * bound


def test_the_bound_is_met_on_a_ring() -> None:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    around = 24 * 2 * np.sin(np.pi / 24)
    assert tours.least_length(ring, around) == pytest.approx(around)
    choices = Choices(np.arange(23), ring[1:], ring[1:])
    rows = best_order(choices, NONE, tuple(ring[0]), tuple(ring[0]))
    assert travel_mm(choices, rows, tuple(ring[0]), tuple(ring[0])) == pytest.approx(around)


@given(
    st.lists(st.lists(st.tuples(*[st.integers(0, 2)] * 4), min_size=1, max_size=5), max_size=6),
    st.integers(1, 4),
)
def test_turned_variants_that_are_found_some_items_at_a_time(
    items: list[list[tuple[int, int, int, int]]], at_once: int
) -> None:
    owner = np.repeat(np.arange(len(items)), [len(each) for each in items]).astype(np.int64)
    ends = np.array([row for each in items for row in each], dtype=float).reshape(-1, 4)
    choices = Choices(owner, ends[:, :2], ends[:, 2:])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(order, "ITEMS_AT_ONCE", at_once)
        turned = order._reversed_rows(choices)
    first = np.searchsorted(owner, np.arange(len(items)))
    for row, (of, each) in enumerate(zip(owner.tolist(), ends.tolist(), strict=True)):
        others = items[of]
        back = (*each[2:], *each[:2])
        stays = each[:2] == each[2:]
        wanted = row if stays or back not in others else int(first[of]) + others.index(back)
        assert turned[row] == wanted
