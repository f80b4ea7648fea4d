"""In which order items are cut, and where each begins: short rapids, nothing before its time.

An item may be cut in several variants (`Choices`): a closed contour from each of its vertices, an
open one from either end. The order and the variants are searched together: nearest neighbours
first, then reversals and moves of parts of the order as long as they make it shorter, and the best
variants for that order, exactly, layer by layer (`camtool.kernels.tours`). Every step of the
search keeps what must be cut before what (`must_precede`: a part is cut free after everything
within it has been cut). The same input always gives the same order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct_rows
from camtool.errors import OptionError
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines, begin_lines_at, reverse_lines
from camtool.kernels.tours import (
    Tour,
    best_rows,
    kicked,
    nearest_first,
    neighbours,
    settled,
    tree_of,
)
from camtool.planning.items import Contour, Fixed, Items, contours_of
from camtool.planning.paths import flat_path, joints

Point = tuple[float, float]

KICKS_EACH = 20
"""Number of kicks (random changes of the search) for each item: more take longer and give shorter
travel."""

MIN_KICKS = 700
"""Least number of kicks, for few items: the search still takes no noticeable time."""

MAX_KICKS = 4000
"""Greatest number of kicks, for many items: less than a second of work."""

SEED = 20_011

MAX_PLACES_EACH = 8
"""Number of evenly spread variants that stand for the positions of an item with more of them."""

MAX_NAMED_ITEMS = 5

ITEMS_AT_ONCE = 1 << 14

SPECK_MM = 1e-4
"""For the order, a run that stays at one place (a drilled hole) is a line of this length: long
enough to be a line, far shorter than any tool is wide."""


class Choices(Struct, frozen=True, eq=False):
    """The variants in which M items may be cut, one row each: `owner` (S,), the item, ascending
    from 0, none left out; `entry`, `exit` (S, 2), mm, where the tool goes down and comes up. The
    first row of an item is as it is drawn. ValueError for other arrays."""

    owner: Ints
    entry: Floats
    exit: Floats

    def __post_init__(self) -> None:
        step = np.diff(self.owner, prepend=-1)
        if len(self.owner) and (step[0] != 1 or not np.isin(step, (0, 1)).all()):
            raise ValueError("owners do not ascend from 0 by steps of 1")
        for name, ends in (("entry", self.entry), ("exit", self.exit)):
            if ends.shape != (len(self.owner), 2) or not np.isfinite(ends).all():
                raise ValueError(f"{name} is not (S, 2) of finite numbers")

    def __len__(self) -> int:
        """Return the number of items."""
        return int(self.owner[-1]) + 1 if len(self.owner) else 0

    @property
    def first(self) -> Ints:
        """First rows (M + 1,): item i owns the rows from first[i] to first[i + 1]."""
        return np.searchsorted(self.owner, np.arange(len(self) + 1))


def choices_of(items: Items) -> Choices:
    """Return the variants in which the items may be cut, with the places where the tool goes down
    and comes up.

    A closed contour may begin at its `starts` or at any joint, and ends there; its direction
    changes nothing. An open one runs as drawn, and if reversible also from its end."""
    columns = [_fixed_ends(items), *_contour_ends(items)]
    owner, ends = (np.concatenate(each) for each in zip(*columns, strict=True))
    order = np.argsort(owner, kind="stable")
    return Choices(owner[order], ends[order, :2], ends[order, 2:])


def chosen_paths(contours: Sequence[Contour], choices: Choices, rows: Ints) -> Polylines:
    """Return the path of the contour for each of these rows (R,) of `choices`, from the start and
    in the direction of the row."""
    owners = choices.owner[rows]
    rank = rows - choices.first[owners]
    # The places in each closed path where it may begin, the first, the second, and so on.
    lines = _lines_of(contours)
    begins = np.flatnonzero(_start_mask(contours, lines))
    first = np.searchsorted(begins, lines.offsets[:-1])[owners]
    closed = lines.closed[owners]
    start = np.where(closed, begins[first + np.where(closed, rank, 0)] - lines.offsets[owners], 0)
    lines = lines.select(owners.tolist())
    return reverse_lines(begin_lines_at(lines, start), ~closed & (rank > 0))


def drawn_order(choices: Choices) -> Ints:
    """Return rows (M,): all items in their own order, each in its first variant."""
    return choices.first[:-1]


def best_order(
    choices: Choices,
    before: Ints,
    from_point: Point = (0.0, 0.0),
    to_point: Point | None = (0.0, 0.0),
) -> Ints:
    """Return rows (M,), one for each item, in the order of cutting.

    `before` (P, 2): the first item of a pair is cut before the second. The tool comes from
    `from_point` and goes to `to_point` at last (None: it stays where it is). OptionError when
    items would have to be cut before themselves."""
    if len(choices) == 0:
        return np.empty(0, dtype=np.int64)

    start = np.array(from_point, dtype=np.float64)
    goal = np.array((np.nan, np.nan) if to_point is None else to_point, dtype=np.float64)
    ends, first = np.column_stack([choices.entry, choices.exit]), choices.first
    if len(choices) == 1 and not len(before):
        return best_rows(ends, first, np.zeros(1, dtype=np.int64), start, goal)

    after_first, after = _followers(before, len(choices))
    waits = np.bincount(after, minlength=len(choices))
    tree = tree_of(choices.entry)
    rows = nearest_first(tree, ends, first, after_first, after, waits, start)
    if len(rows) < len(choices):
        raise _cycle_error(set(range(len(choices))) - set(choices.owner[rows].tolist()))
    tour = tour_of(choices, before, rows, start, goal)
    settled(tour)
    kicks = min(max(KICKS_EACH * len(choices), MIN_KICKS), MAX_KICKS)
    kicked(tour, kicks, SEED)
    while True:
        order = tour.item[1:-1]
        tour.row[order] = best_rows(ends, first, order, start, goal)
        if settled(tour) <= 0.0:
            return tour.row[order]


def tour_of(choices: Choices, before: Ints, rows: Ints, start: Floats, goal: Floats) -> Tour:
    """Return the tour of these rows with the tables that the compiled search needs."""
    count, variants = len(choices), len(choices.owner)
    reversed_rows = _reversed_rows(choices)
    stays = bool(np.isnan(goal).any())
    goal = start if stays else goal
    outside = [np.tile(start, 2), np.tile(goal, 2)]
    ends = np.concatenate([np.column_stack([choices.entry, choices.exit]), outside])
    places, owner = _places(choices)
    neighbour_rows, near_first = neighbours(tree_of(places), owner, count)
    after_first, after = _followers(before, count)
    earlier_first, earlier = _followers(np.asarray(before).reshape(-1, 2)[:, ::-1], count)
    item = np.concatenate([[count], choices.owner[rows], [count + 1]])
    row = np.empty(count + 2, dtype=np.int64)
    row[item] = np.concatenate([[variants], rows, [variants + 1]])
    one_way = (reversed_rows == np.arange(variants)) & (choices.entry != choices.exit).any(axis=1)
    return Tour(
        ends,
        np.concatenate([reversed_rows, [variants, variants + 1]]),
        choices.first,
        neighbour_rows,
        near_first,
        after,
        after_first,
        earlier,
        earlier_first,
        variants + 1 if stays else -1,
        bool(one_way.any()),
        item,
        np.argsort(item),
        row,
    )


def _reversed_rows(choices: Choices) -> Ints:
    """Return, for each row (S,), the row of the same item with entry and exit exchanged; the row
    itself if there is none."""
    reversed_rows = np.arange(len(choices.owner))
    rows = np.flatnonzero((choices.entry != choices.exit).any(axis=1))
    owners = choices.owner[rows]
    for item in range(0, len(choices), ITEMS_AT_ONCE):
        batch = rows[slice(*np.searchsorted(owners, [item, item + ITEMS_AT_ONCE]).tolist())]
        reversed_rows[batch] = _reversed_rows_among(choices, batch)
    return reversed_rows


def _reversed_rows_among(choices: Choices, rows: Ints) -> Ints:
    """Return the same for these rows (R,), which must be all rows of their items whose exit is not
    their entry."""
    if len(rows) == 0:
        return rows
    owner, entry, leave = choices.owner[rows, None], choices.entry[rows], choices.exit[rows]
    table = np.concatenate([np.hstack([owner, entry, leave]), np.hstack([owner, leave, entry])])
    _, first_rows, group = np.unique(table, axis=0, return_index=True, return_inverse=True)
    other = first_rows[group.reshape(-1)[len(rows) :]]
    return np.where(other < len(rows), rows[np.minimum(other, len(rows) - 1)], rows)


def _places(choices: Choices) -> tuple[Floats, Ints]:
    """Return places (N, 2) that represent the items in the search for neighbours, and the item
    (N,) of each."""
    first, variants = choices.first, np.diff(choices.first)
    step = -(-variants // MAX_PLACES_EACH)
    rank = np.arange(len(choices.owner)) - first[choices.owner]
    rows = np.flatnonzero(rank % step[choices.owner] == 0)
    two_ended = rows[(choices.entry[rows] != choices.exit[rows]).any(axis=1)]
    owner = np.concatenate([choices.owner[rows], choices.owner[two_ended]])
    places = np.concatenate([choices.entry[rows], choices.exit[two_ended]])
    by_owner = np.argsort(owner, kind="stable")
    return places[by_owner], owner[by_owner]


def travel_mm(choices: Choices, rows: Ints, from_point: Point, to_point: Point | None) -> float:
    """Return the length of the tool's travel between items cut in this order, mm, including the
    ways from `from_point` and to `to_point`."""
    leave = np.concatenate([np.array([from_point]), choices.exit[rows]])
    arrive = choices.entry[rows]
    if to_point is None:
        leave = leave[:-1]
    else:
        arrive = np.concatenate([arrive, np.array([to_point])])
    step = arrive - leave
    return float(np.hypot(step[:, 0], step[:, 1]).sum())


def _followers(before: Ints, count: int) -> tuple[Ints, Ints]:
    """Return first (count + 1,) and after: the items that must follow item i are after[first[i] :
    first[i + 1]], each once."""
    pairs = distinct_rows(np.asarray(before, dtype=np.int64).reshape(-1, 2))
    if len(pairs) and not (pairs.min() >= 0 and pairs.max() < count):
        raise ValueError(f"a pair names an item that is none of {count}")
    return np.searchsorted(pairs[:, 0], np.arange(count + 1)), pairs[:, 1].copy()


def _cycle_error(waiting: set[int]) -> OptionError:
    names = ", ".join(str(item) for item in sorted(waiting)[:MAX_NAMED_ITEMS])
    return OptionError(
        f"{len(waiting)} items each have to be cut before another of them, among them {names}",
        mend="let one of them be cut before the others",
    )


Ends = tuple[Ints, Floats]
"""Rows of variants: the item (R,) of each, ascending, and (R, 4) x, y where the tool goes down and
x, y where it comes up."""


def _fixed_ends(items: Items) -> Ends:
    """Return entry and exit of the Fixed items, which have a single variant each."""
    fixed = [(k, item.runs) for k, item in _fixed_items(items)]
    ends = [[runs[0].vertices[0, :2], runs[-1].vertices[-1, :2]] for _, runs in fixed]
    return np.array([k for k, _ in fixed], dtype=np.int64), np.array(ends).reshape(-1, 4)


def _fixed_items(items: Items) -> Iterator[tuple[int, Fixed]]:
    """Yield index and item of each Fixed item."""
    return ((k, item) for k, item in enumerate(items) if isinstance(item, Fixed))


def _contour_rows(items: Items) -> Ints:
    """Return the indices of the contours among the items."""
    rows = [k for k, item in enumerate(items) if isinstance(item, Contour)]
    return np.array(rows, dtype=np.int64)


def _lines_of(contours: Sequence[Contour]) -> Polylines:
    """Return the paths of the contours as columns."""
    return Polylines.of(contour.path for contour in contours)


def _contour_ends(items: Items) -> Iterator[Ends]:
    """Yield the variants of contours: closed ones, open ones as they run, and reversible ones
    turned."""
    contours, owner = contours_of(items), _contour_rows(items)
    lines = _lines_of(contours)
    begins = _start_mask(contours, lines) & np.repeat(lines.closed, np.diff(lines.offsets))
    owners = np.repeat(owner, np.diff(lines.offsets))
    yield owners[begins], np.tile(lines.vertices[begins, :2], 2)
    opens = np.flatnonzero(~lines.closed)
    start, end = (
        lines.vertices[lines.offsets[opens], :2],
        lines.vertices[lines.offsets[opens + 1] - 1, :2],
    )
    is_reversible = [contours[k].reversible for k in opens.tolist()]
    turns = np.array(is_reversible, dtype=np.bool_)
    # Passes to and fro leave the tool where it went down when their number is even.
    even = [len(contours[k].setting.levels_mm) % 2 == 0 for k in opens.tolist()]
    is_reversed = (turns & np.array(even, dtype=np.bool_))[:, None]
    yield owner[opens], np.hstack([start, np.where(is_reversed, start, end)])
    yield owner[opens[turns]], np.hstack([end, np.where(is_reversed, end, start)])[turns]


def _start_mask(contours: Sequence[Contour], lines: Polylines) -> Bools:
    """Return the mask (N,) of the vertices of `lines`, the paths of the contours, at which a
    contour may begin."""
    is_joint, offsets = joints(lines), lines.offsets
    for k, contour in enumerate(contours):
        if len(contour.starts):
            begin, end = offsets[k : k + 2].tolist()
            is_joint[begin:end] = False
            is_joint[begin + contour.starts] = True
    return is_joint


def must_precede(items: Items) -> Ints:
    """Return pairs (P, 2) of items, ascending; the first must be cut before the second.

    An item goes before the smallest closed Contour, or slot, that holds it or any of its runs;
    there are no other conditions. Contours that cross do not hold each other."""
    shapes, shape, item = _shapes(items)
    parent = Nesting(shapes).levels.parent
    order = np.argsort(shape, kind="stable")
    shape, item = shape[order], item[order]
    first = np.searchsorted(shape, np.arange(len(shapes) + 1))
    inner_rows = np.flatnonzero(parent[shape] >= 0)
    holder = parent[shape[inner_rows]]
    counts = first[holder + 1] - first[holder]
    steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    one, other = (
        np.repeat(item[inner_rows], counts),
        item[np.repeat(first[holder], counts) + steps],
    )
    return distinct_rows(np.column_stack([one, other])[one != other])


def _shapes(items: Items) -> tuple[Polylines, Ints, Ints]:
    """Return paths that show where items lie, and pairs (J,), (J,) of a path and the item that it
    belongs to.

    Only the path of a Contour, or the one round a slot, is closed and can hold items."""
    contours, owner = contours_of(items), _contour_rows(items)
    lines, shape = _lines_of(contours), np.arange(len(contours))
    outlines = [contour.outline for contour in contours]
    if any(outline is not None for outline in outlines):
        # The runs that a contour was divided into share its outline: they hold and lie as it does.
        numbers: dict[int, int] = {}
        keys = [-k if path is None else id(path) for k, path in enumerate(outlines, 1)]
        shape = np.array([numbers.setdefault(key, len(numbers)) for key in keys])
        first = np.unique(shape, return_index=True)[1].tolist()
        lines = Polylines.of(outlines[k] or contours[k].path for k in first)
    fixed_places = [(k, path) for k, item in _fixed_items(items) for path in _places_of(item)]
    return (
        Polylines.joined([lines, Polylines.of(path for _, path in fixed_places)]),
        np.concatenate([shape, len(lines) + np.arange(len(fixed_places))]),
        np.concatenate([owner, np.array([k for k, _ in fixed_places], dtype=np.int64)]),
    )


def _places_of(item: Fixed) -> Iterator[Polyline]:
    """Yield paths that show where a Fixed item lies: its outline, or its runs seen from above."""
    if item.outline is not None:
        yield Polyline(item.outline.vertices, closed=item.centre_lines is not None)
        return
    for run in item.runs:
        x, y = run.vertices[0, :2]
        speck = np.array([[x - SPECK_MM / 2, y, 0.0], [x + SPECK_MM / 2, y, 0.0]])
        yield flat_path(run.vertices) or Polyline(speck)
