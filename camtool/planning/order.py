"""In which order items are cut, and where each begins: short rapids, nothing before its time.

An item may be cut in several ways (`Choices`): a closed contour from each of its vertices, an
open one from either end. The order and the ways are searched together: nearest neighbours first,
then reversals and moves of parts of the order as long as they make it shorter, and the best ways
for that order, exactly, layer by layer (`camtool.kernels.tour`). What must be cut before what is
kept by every step of the search. The same input always gives the same order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camtool.errors import OptionError
from camtool.geometry.nest import nesting
from camtool.geometry.polylines import Bools, Floats, Ints, Polyline, Polylines
from camtool.geometry.transform import reverse, rolled
from camtool.planning.arcs import joints
from camtool.planning.items import Contour, Item

Point = tuple[float, float]

SHOWN_ITEMS = 5
"""An error message names no more items than this."""


@dataclass(frozen=True, eq=False)
class Choices:
    """The ways in which M items may be cut, one row each: `owner` (S,), the item, ascending from
    0, none left out; `entry`, `exit` (S, 2) mm, where the tool goes down and where it comes up.
    The first row of an item is as it is drawn. ValueError for other arrays."""

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
        """How many items."""
        return int(self.owner[-1]) + 1 if len(self.owner) else 0

    @property
    def first(self) -> Ints:
        """(M + 1,): item i owns the rows from first[i] to first[i + 1]."""
        return np.searchsorted(self.owner, np.arange(len(self) + 1))


def choices_of(items: Sequence[Item]) -> Choices:
    """The ways in which the items may be cut, by where the tool goes down and comes up.

    A closed contour may begin at its `starts` or at any joint, and ends there; its direction
    changes nothing. An open one runs as drawn, or from its end too when reversible.
    """
    ends = [_ends(item) for item in items]
    owner = np.repeat(np.arange(len(items)), [len(each) for each in ends])
    both = np.concatenate([np.empty((0, 4)), *ends])
    return Choices(owner, both[:, :2], both[:, 2:])


def chosen_path(items: Sequence[Item], choices: Choices, row: int) -> Polyline:
    """The path of the contour that owns this row, begun where it says and in that direction.

    TypeError when the row is of an item that is cut as it is.
    """
    index = int(choices.owner[row])
    item, rank = items[index], row - int(choices.first[index])
    if not isinstance(item, Contour):
        raise TypeError(f"{item.name} is cut as it is")
    if item.path.closed:
        return rolled(item.path, int(_begins(item)[rank]))
    return reverse(item.path) if rank else item.path


def drawn(choices: Choices) -> Ints:
    """Rows (M,): all items in the order in which they come, each in its first way."""
    return choices.first[:-1]


def best_order(
    choices: Choices,
    before: Ints,
    from_point: Point = (0.0, 0.0),
    to_point: Point | None = (0.0, 0.0),
) -> Ints:
    """Rows (M,), one of each item, in the order of cutting.

    `before` (P, 2): the first item of a pair is cut before the second. The tool comes from
    `from_point` and goes to `to_point` at last (None: it stays where it is). OptionError when
    items would have to be cut before themselves.
    """
    if len(choices) == 0:
        return np.empty(0, dtype=np.int64)
    from camtool.kernels.tour_start import nearest_first

    after_first, after = _followers(before, len(choices))
    waits = np.bincount(after, minlength=len(choices))
    ends = np.column_stack([choices.entry, choices.exit])
    rows = nearest_first(
        ends, choices.first, after_first, after, waits, np.array(from_point, dtype=np.float64)
    )
    if len(rows) < len(choices):
        raise _circle(set(range(len(choices))) - set(choices.owner[rows].tolist()))
    return rows


def travel_mm(
    choices: Choices,
    rows: Ints,
    from_point: Point = (0.0, 0.0),
    to_point: Point | None = (0.0, 0.0),
) -> float:
    """How far the tool travels between items cut in this order, and from and to the points, mm."""
    leave = np.concatenate([np.array([from_point]), choices.exit[rows]])
    arrive = choices.entry[rows]
    if to_point is None:
        leave = leave[:-1]
    else:
        arrive = np.concatenate([arrive, np.array([to_point])])
    step = arrive - leave
    return float(np.hypot(step[:, 0], step[:, 1]).sum())


def _followers(before: Ints, count: int) -> tuple[Ints, Ints]:
    """What comes after item i: after[first[i] : first[i + 1]], each once."""
    pairs = np.unique(np.asarray(before, dtype=np.int64).reshape(-1, 2), axis=0)
    if len(pairs) and not (pairs.min() >= 0 and pairs.max() < count):
        raise ValueError(f"a pair names an item that is none of {count}")
    return np.searchsorted(pairs[:, 0], np.arange(count + 1)), pairs[:, 1].copy()


def _circle(left: set[int]) -> OptionError:
    names = ", ".join(str(item) for item in sorted(left)[:SHOWN_ITEMS])
    return OptionError(
        f"{len(left)} items wait for each other to be cut, among them {names}",
        mend="let one of them be cut before the others",
    )


def _ends(item: Item) -> Floats:
    """(R, 4): x and y where the tool goes down and where it comes up, way by way."""
    if not isinstance(item, Contour):
        start, end = item.runs[0].vertices[0, :2], item.runs[-1].vertices[-1, :2]
        return np.concatenate([start, end])[None]
    if item.path.closed:
        places = item.path.vertices[_begins(item), :2]
        return np.column_stack([places, places])
    way = np.concatenate([item.path.start, item.path.end])
    # Passes to and fro leave the tool where it went down when their number is even.
    back = item.reversible and len(item.setting.levels_mm) % 2 == 0
    way = np.tile(way[:2], 2) if back else way
    turned = np.tile(item.path.end, 2) if back else np.roll(way, 2)
    return np.stack([way, turned] if item.reversible else [way])


def _begins(item: Contour) -> Ints:
    """Vertices at which a closed contour may begin."""
    return item.starts if len(item.starts) else np.flatnonzero(joints(item.path))


# What follows goes when plan.py asks `best_order`.


@dataclass(frozen=True, eq=False)
class Order:
    """In order of cutting, for M paths: `path` (M,), its index; `start` (M,), the vertex where it
    begins; for an open path the last vertex says that it is travelled from its end."""

    path: Ints
    start: Ints


def order(lines: Polylines, from_point: tuple[float, float] = (0.0, 0.0)) -> Order:
    """The order of cutting for a tool that stands at `from_point` (mm)."""
    parent = nesting(lines).parent
    held = np.bincount(parent[parent >= 0], minlength=len(lines))
    points, owner, vertex = _starts(lines)
    first = np.searchsorted(owner, np.arange(len(lines) + 1))
    # Starts that may not be taken now lie infinitely far away.
    x, y = np.where((held[owner] == 0)[:, None], points, np.inf).T.copy()
    path = np.empty(len(lines), dtype=np.int64)
    start = np.empty(len(lines), dtype=np.int64)
    at = np.array(from_point)
    for rank in range(len(lines)):
        row = int(((x - at[0]) ** 2 + (y - at[1]) ** 2).argmin())
        chosen, holder = int(owner[row]), int(parent[owner[row]])
        path[rank], start[rank] = chosen, vertex[row]
        x[first[chosen] : first[chosen + 1]] = np.inf
        at = _end(lines, chosen, points[row])
        if holder >= 0:
            held[holder] -= 1
            if held[holder] == 0:
                rows = slice(first[holder], first[holder + 1])
                x[rows], y[rows] = points[rows].T
    return Order(path, start)


def ordered(lines: Polylines, way: Order) -> list[Polyline]:
    """The paths in this order, each from its start."""
    return [
        _from_start(lines[path], start)
        for path, start in zip(way.path.tolist(), way.start.tolist(), strict=True)
    ]


def _from_start(path: Polyline, start: int) -> Polyline:
    if path.closed:
        return rolled(path, start)
    return reverse(path) if start else path


def _starts(lines: Polylines) -> tuple[Floats, Ints, Ints]:
    """Points (S, 2) where a path may begin, the path (S,) and the vertex (S,) of each."""
    may = _may_begin(lines)
    owner = np.repeat(np.arange(len(lines)), np.diff(lines.offsets))
    rows = np.flatnonzero(may)
    return lines.vertices[rows, :2], owner[rows], rows - lines.offsets[owner[rows]]


def _may_begin(lines: Polylines) -> Bools:
    may = np.zeros(len(lines.vertices), dtype=np.bool_)
    for index in range(len(lines)):
        low, high = int(lines.offsets[index]), int(lines.offsets[index + 1])
        if lines.closed[index]:
            may[low:high] = joints(lines[index])
        else:
            may[low] = may[high - 1] = True
    return may


def _end(lines: Polylines, path: int, start: Floats) -> Floats:
    """Where the tool is when it has followed the path from this start."""
    if lines.closed[path]:
        return start
    low, high = (
        lines.vertices[lines.offsets[path], :2],
        lines.vertices[lines.offsets[path + 1] - 1, :2],
    )
    return high if (start == low).all() else low
