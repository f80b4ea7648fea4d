"""The Toolpath: canonical moves and events, in columns, in the order of execution.

A row is either a move (RAPID, LINE, ARC_CW, ARC_CCW) or an event (spindle, dwell, ...). Arcs turn
in the XY plane; G02 is ARC_CW seen from +Z. A full circle is an arc whose end is its start. An arc
that ends at another height is a helix of one turn at most, Z in proportion to the angle.
Frame: work frame (part zero), mm; feeds in mm/min. Row i starts where row i−1 ended; row 0 starts
at `start`. Planning builds it, a target writes it and reads it back, simulation runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Literal, TypeVar, cast

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Floats, Indices, Ints, columns_of
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.wanted import DrawnEdges, Operations

Column = TypeVar("Column", bound=np.ndarray[Any, Any])

COLUMNS: dict[str, tuple[type[np.generic], tuple[int, ...]]] = {
    "kind": (np.int8, ()),
    "end": (np.float64, (3,)),
    "centre": (np.float64, (2,)),
    "feed": (np.float64, ()),
    "value": (np.float64, ()),
    "source": (np.int32, ()),
    "block": (np.int32, ()),
    "mode": (np.int64, ()),
}
"""The columns of a Toolpath: their types, and the shape of one row."""

STOCK_TOP_MM = 0.0
"""Z of the stock top: part zero lies on it."""

LEVEL_MM = 1e-6
"""Moves less than this below the stock top count as on it."""

ROWS_AT_ONCE = 1 << 15
"""Rows computed at a time, for columns that follow from each row and its start alone."""


class Kind(IntEnum):
    """Kind of a row; `value` (unit) is the argument of an event, if it has one."""

    RAPID = 0
    LINE = 1
    ARC_CW = 2
    ARC_CCW = 3
    DWELL = 10  # seconds
    SPINDLE_CW = 11  # rev/min
    SPINDLE_CCW = 12  # rev/min
    SPINDLE_OFF = 13
    TOOL_CHANGE = 14  # tool number
    MESSAGE = 15  # index into `texts`
    SET_ZERO = 16  # this position is part zero
    HOME_XY = 17  # return to machine zero in X and Y
    HOME_Z = 18  # return to machine zero in Z
    END = 19  # end of program
    COOLANT_MIST = 20
    COOLANT_FLOOD = 21
    COOLANT_OFF = 22


EVENTS_AT_REST = (
    Kind.DWELL,
    Kind.SPINDLE_CW,
    Kind.SPINDLE_CCW,
    Kind.SPINDLE_OFF,
    Kind.TOOL_CHANGE,
    Kind.COOLANT_MIST,
    Kind.COOLANT_FLOOD,
    Kind.COOLANT_OFF,
    Kind.END,
)
"""Events before which a controller of G-code stops the slides."""

Corners = Literal["blend", "exact-path", "exact-stop"]


class PathMode(Struct, frozen=True):
    """A program's request for the treatment of corners.

    "blend": rounded within `tolerance_mm` (0: as far as the moves allow), lines in a row taken for
    one within `merging_mm` (0: never); "exact-path": met, without a stop where they hardly bend;
    "exact-stop": met with a stop."""

    corners: Corners
    tolerance_mm: float = 0.0
    merging_mm: float = 0.0


class Move(Struct, frozen=True):
    """One row as a record: `end` and `start` (x, y, z) mm, `centre` (x, y) mm or None for rows
    that are no arcs, `feed` mm/min or None, `value` the event's argument or None."""

    index: int
    kind: Kind
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    centre: tuple[float, float] | None
    feed: float | None
    value: float | None
    source: str
    block: int


@dataclass(frozen=True, eq=False)
class Toolpath:
    """N rows in columns; arrays are read-only.

    Whole numbers are as narrow as `COLUMNS` says: sums and products of them overflow. A column
    that is the same in all rows may be one row, seen as many (`np.broadcast_to`).

    kind (N,) of Kind; end (N, 3) mm (an event repeats the position); centre (N, 2) mm, NaN where
    no arc; feed (N,) mm/min, NaN for rapids and events; value (N,), NaN where none; source (N,)
    index into `texts` or −1 (provenance: layer and entity); block (N,) index, from 0, of the
    program block that the row was read from, −1 when planned; start (3,) mm; `tabs_mm` where
    tabs (x, y) were planned; `made_from` the name of the drawing, "" when unknown; `setup` which
    set-up of a part this is, in words, () for the only one; mode (N,) index into `modes`, or −1
    where the machine decides how to meet the corner behind the row (−1 in all rows without modes);
    `drawn` the edges that the rows cut, and `operations` the operation of each row: both None
    except for plans.
    ValueError when columns disagree."""

    kind: Codes
    end: Floats
    centre: Floats
    feed: Floats
    value: Floats
    source: Indices
    block: Indices
    start: Floats
    texts: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    made_from: str = ""
    setup: tuple[str, ...] = ()
    tabs_mm: tuple[tuple[float, float], ...] = ()
    mode: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    modes: tuple[PathMode, ...] = ()
    drawn: DrawnEdges | None = None
    operations: Operations | None = None

    def __post_init__(self) -> None:
        count = len(self.kind)
        if not self.modes:
            silent = np.broadcast_to(read_only(np.full(1, -1)), count)
            object.__setattr__(self, "mode", silent)
        for name, (dtype, row) in COLUMNS.items():
            object.__setattr__(
                self, name, _as_column(name, getattr(self, name), dtype, (count, *row))
            )
        object.__setattr__(self, "start", _as_column("start", self.start, np.float64, (3,)))
        if self.drawn is not None and len(self.drawn.edge) != count:
            raise ValueError(f"drawn is of {len(self.drawn.edge)} rows, not of {count}")
        if not (np.isfinite(self.end).all() and np.isfinite(self.start).all()):
            raise ValueError("a position is not finite")

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def starts(self) -> Floats:
        """Start points of all rows, (N, 3) mm."""
        return np.concatenate([self.start[None, :], self.end[:-1]])[: len(self.end)]

    def starts_of(self, rows: Ints | Indices) -> Floats:
        """Return the start points (K, 3) mm of these rows."""
        starts = self.end.take(rows - 1, axis=0)  # several times as fast as an index
        starts[rows == 0] = self.start
        return starts

    @property
    def is_arc(self) -> Bools:
        """Mask (N,) of the rows that are ARC_CW or ARC_CCW."""
        return are_arcs(self.kind)

    @property
    def is_motion(self) -> Bools:
        """Mask (N,) of the rows that are RAPID, LINE or arcs."""
        return np.asarray(self.kind <= Kind.ARC_CCW)

    @property
    def is_feed(self) -> Bools:
        """Mask (N,) of the moves at a feed: LINE and arcs."""
        return np.asarray((self.kind >= Kind.LINE) & (self.kind <= Kind.ARC_CCW))

    def sweeps(self) -> Floats:
        """Return the signed sweep (N,) in rad, CCW positive: 0 for rows that are no arc, ±2π for
        arcs that end at their start."""
        sweeps, arcs = np.zeros(len(self)), np.flatnonzero(self.is_arc)
        sweeps[arcs] = self.sweeps_of(arcs)
        return sweeps

    def sweeps_of(self, arcs: Ints | Indices) -> Floats:
        """Return the signed sweep (J,) in rad of these rows, all of them arcs.

        CCW: sweep = (angle(end) − angle(start)) mod 2π, taken in (0, 2π];  CW: mirrored."""
        full_turn = 2.0 * np.pi
        begin, end, centre = self.starts_of(arcs), self.end[arcs], self.centre[arcs]
        from_ = np.arctan2(begin[:, 1] - centre[:, 1], begin[:, 0] - centre[:, 0])
        end_angle = np.arctan2(end[:, 1] - centre[:, 1], end[:, 0] - centre[:, 0])
        sign = np.where(self.kind[arcs] == Kind.ARC_CW, -1.0, 1.0)
        turn = np.mod(sign * (end_angle - from_), full_turn)
        same_ends = columns_of(end[:, :2] == begin[:, :2]).all(axis=0)
        return np.asarray(sign * np.where(same_ends | (turn == 0.0), full_turn, turn))

    @property
    def executed_rows(self) -> int:
        """Number of rows up to and including the end of the program; later rows never run."""
        ends = np.flatnonzero(self.kind == Kind.END)
        return int(ends[0]) + 1 if len(ends) else len(self)

    def first(self, rows: int) -> Toolpath:
        """Return the first `rows` rows; the toolpath itself if it has no more."""
        return self if rows >= len(self) else self.part(0, rows)

    def part(self, low: int, high: int) -> Toolpath:
        """Return the rows low:high as views of the columns."""
        columns = {name: getattr(self, name)[low:high] for name in COLUMNS}
        drawn = None if self.drawn is None else self.drawn.picked(np.arange(low, high))
        start = self.start if low == 0 else read_only(self.end[low - 1].copy())
        operations = None if self.operations is None else self.operations.of_part(low, high)
        return replace(self, **columns, start=start, drawn=drawn, operations=operations)

    def by_parts(self, column: Callable[[Toolpath], Column]) -> Column:
        """Compute a column (N, …) for ROWS_AT_ONCE rows at a time; each value must follow from its
        row and the start of that row alone."""
        if len(self) <= ROWS_AT_ONCE:
            return column(self)
        plain_path = replace(self, drawn=None, operations=None)
        result: Any = None
        for low in range(0, len(self), ROWS_AT_ONCE):
            part = column(plain_path.part(low, low + ROWS_AT_ONCE))
            if result is None:
                result = np.empty((len(self), *part.shape[1:]), dtype=part.dtype)
            result[low : low + len(part)] = part
        return cast(Column, result)

    def picked(self, row: Ints, **others: Codes | Ints | Floats) -> Toolpath:
        """Select rows (M,) in the given order, with repetitions; `others` replaces columns of the
        result."""
        columns = {
            name: rows_of(getattr(self, name), row) for name in COLUMNS if name not in others
        }
        drawn = None if self.drawn is None else self.drawn.picked(row)
        operations = None if self.operations is None else self.operations.picked(row)
        return replace(self, **{**columns, **others}, drawn=drawn, operations=operations)

    def text(self, row: int) -> str:
        """Return the provenance of a row, "" if it has none."""
        index = int(self.source[row])
        return self.texts[index] if index >= 0 else ""

    def place(self, row: int) -> str:
        """Return the number of a row and its provenance for messages: `move 12 (CIRCLE 2F)`."""
        source = self.text(row)
        return f"move {row} ({source})" if source else f"move {row}"

    def __iter__(self) -> Iterator[Move]:
        starts = self.starts
        for row in range(len(self)):
            yield Move(
                index=row,
                kind=Kind(int(self.kind[row])),
                start=_triple(starts[row]),
                end=_triple(self.end[row]),
                centre=(
                    (float(self.centre[row, 0]), float(self.centre[row, 1]))
                    if self.is_arc[row]
                    else None
                ),
                feed=_or_none(self.feed[row]),
                value=_or_none(self.value[row]),
                source=self.text(row),
                block=int(self.block[row]),
            )


def are_arcs(kind: Codes | Ints) -> Bools:
    """Return the mask (K,) of the kinds that are ARC_CW or ARC_CCW."""
    return np.asarray((kind == Kind.ARC_CW) | (kind == Kind.ARC_CCW))


def are_below_top(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of rows that begin or end below the stock top."""
    heights = np.append(toolpath.start[2], toolpath.end[:, 2])
    is_low = heights < STOCK_TOP_MM - LEVEL_MM
    return np.asarray(is_low[:-1] | is_low[1:])


def feeds_below_top(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of moves at a feed that begin or end below the stock top."""
    return toolpath.is_feed & are_below_top(toolpath)


def read_only(column: Column) -> Column:
    """Make an array read-only in place and return it: a Toolpath takes it without a copy."""
    column.flags.writeable = False
    return column


def _as_column(
    name: str, values: Any, dtype: type[np.generic], shape: tuple[int, ...]
) -> np.ndarray[Any, Any]:
    """Return the column if it is read-only and of this type, else a read-only copy. ValueError for
    another shape."""
    column: np.ndarray[Any, Any] = values
    owner = getattr(values, "base", None)
    owner = (
        values if owner is None else owner
    )  # a view is as final as the array that owns its data
    is_final = isinstance(owner, np.ndarray) and owner.flags.owndata and not owner.flags.writeable
    is_column = isinstance(values, np.ndarray) and values.dtype == dtype
    if not (is_final and is_column and not values.flags.writeable):
        column = read_only(np.array(values, dtype=dtype))
    if column.shape != shape:
        raise ValueError(f"column {name} has shape {column.shape}, wanted {shape}")
    return column


def rows_of(column: Column, row: Ints) -> Column:
    """Select rows (M,) of a column; a column that is one row broadcast to many stays one row."""
    if len(column) and column.strides[0] == 0:
        return cast(Column, np.broadcast_to(column[:1], (len(row), *column.shape[1:])))
    return read_only(cast(Column, column[row]))


def _triple(row: Floats) -> tuple[float, float, float]:
    return float(row[0]), float(row[1]), float(row[2])


def _or_none(number: np.float64) -> float | None:
    return None if np.isnan(number) else float(number)


class CompensatedToolpath(Struct, frozen=True, eq=False):
    """A toolpath compensated for the machine's errors so that the slides follow the wanted one:
    `toolpath` is what is sent to the controller, `row` (N,) the wanted toolpath's row of each of
    its rows."""

    toolpath: Toolpath
    row: Ints


class PolarArcs:
    """The chosen arcs in polar coordinates: radius at start and end mm, angle at the start and
    signed sweep rad, each (J,), for the rows `row` (J,).

    An arc whose ends have different distances to its centre (rounded coordinates) is treated as
    a spiral: radius and, in a helix, Z change in proportion to the angle, so that both ends are
    met."""

    def __init__(self, toolpath: Toolpath, is_chosen: Bools) -> None:
        """Raise PostError for an arc without a centre."""
        self.row = np.flatnonzero(is_chosen)
        self.centre = toolpath.centre[self.row]
        is_bad = ~np.isfinite(self.centre).all(axis=1)
        if is_bad.any():
            raise PostError("an arc without a centre", where=f"move {self.row[is_bad.argmax()]}")
        self.begin, self.end = toolpath.starts_of(self.row), toolpath.end[self.row]
        start_arm, end_arm = self.begin[:, :2] - self.centre, self.end[:, :2] - self.centre
        self.radius = np.hypot(start_arm[:, 0], start_arm[:, 1])
        self.end_radius = np.hypot(end_arm[:, 0], end_arm[:, 1])
        self.angle = np.arctan2(start_arm[:, 1], start_arm[:, 0])
        self.sweep = toolpath.sweeps_of(self.row)

    def points(self, indices: Ints, share: Floats) -> Floats:
        """Compute the points (K, 3) mm of the arcs `indices` (K,) at `share` (K,) of their
        sweep."""
        angle = self.angle[indices] + share * self.sweep[indices]
        radius = self.radius[indices] + share * (self.end_radius - self.radius)[indices]
        rise = (self.end[:, 2] - self.begin[:, 2])[indices]
        return np.column_stack(
            [
                self.centre[indices, 0] + radius * np.cos(angle),
                self.centre[indices, 1] + radius * np.sin(angle),
                self.begin[indices, 2] + share * rise,
            ]
        )


def toolpath_extents(toolpath: Toolpath, *, rows: Bools | None = None) -> Floats:
    """Compute the lowest and highest X, Y and Z (3, 2) mm of all moves and the start, exact for
    arcs; with `rows` (N,) of these moves alone.

    An arc reaches centre ± radius where its sweep passes the direction of an axis."""
    if rows is None:
        points, arcs = [toolpath.start[None, :], toolpath.end], toolpath.is_arc
    else:
        chosen_rows = np.flatnonzero(rows)
        points, arcs = (
            [toolpath.starts_of(chosen_rows), toolpath.end[chosen_rows]],
            toolpath.is_arc & rows,
        )
    low = high = points[0][0]
    for ends in points:
        for first in range(0, len(ends), ROWS_AT_ONCE):
            columns = columns_of(ends[first : first + ROWS_AT_ONCE])
            low = np.minimum(low, columns.min(axis=1))
            high = np.maximum(high, columns.max(axis=1))
    tops = _arc_extremes(toolpath, np.flatnonzero(arcs))
    if len(tops):
        low[:2] = np.minimum(low[:2], tops.min(axis=0))
        high[:2] = np.maximum(high[:2], tops.max(axis=0))
    return np.column_stack([low, high])


def _arc_extremes(toolpath: Toolpath, arcs: Ints) -> Floats:
    """Compute the points (J, 2) mm of these arcs straight right, above, left or below of their
    centre."""
    centre, begin = toolpath.centre[arcs], toolpath.starts_of(arcs)[:, :2]
    arm = begin - centre
    radius = np.hypot(arm[:, 0], arm[:, 1])
    sign = np.where(toolpath.kind[arcs] == Kind.ARC_CW, -1.0, 1.0)
    sweep = np.abs(toolpath.sweeps_of(arcs))
    compass = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    from_start = np.arctan2(compass[:, 1], compass[:, 0]) - np.arctan2(arm[:, 1:], arm[:, :1])
    turn = np.mod(sign[:, None] * from_start, 2.0 * np.pi)
    arc, directions = np.nonzero(turn <= sweep[:, None])
    return np.asarray(centre[arc] + radius[arc, None] * compass[directions])


def mounted_before(toolpath: Toolpath) -> Bools:
    """Return the mask (N,) of tool changes before the first move at a feed: on a machine
    without a tool changer the operator mounts this tool before the program starts."""
    fed = np.cumsum(toolpath.is_feed) > 0
    return np.asarray((toolpath.kind == Kind.TOOL_CHANGE) & ~fed)


def changes_between_cuts(toolpath: Toolpath) -> Ints:
    """Return the rows of the tool changes after the first cut, at which the program has to wait
    for the operator."""
    return np.flatnonzero((toolpath.kind == Kind.TOOL_CHANGE) & ~mounted_before(toolpath))
