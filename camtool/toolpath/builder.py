"""Building a Toolpath row by row, or many moves at a time by columns."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import repeat
from typing import Any

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.findings import Finding
from camtool.toolpath.moves import COLUMNS, Kind, PathMode, Toolpath, read_only
from camtool.toolpath.wanted import OperationNote, Operations

Coordinate = float | None

ROWS_AT_ONCE = 1 << 14

FEW_ROWS = 16
"""Up to this many rows are added as Python objects: to add them as arrays would take as long as
some ten rows."""

GROWTH = 8
"""A full column is enlarged by 1/GROWTH of its rows."""


class ToolpathBuilder:
    """Collect rows; a coordinate that is left out (None) keeps its value.

    >>> path = ToolpathBuilder().rapid(z=1.0).rapid(1, 0).line(z=-0.1, feed=10).arc(
    ...     3, 0, centre=(2, 0), ccw=False, feed=20).finish()
    >>> [move.kind.name for move in path]
    ['RAPID', 'RAPID', 'LINE', 'ARC_CW']
    """

    def __init__(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        self.position = start
        self.source = ""
        """Provenance given to the rows that follow."""
        self.block = -1
        """Program block given to the rows that follow."""
        self.mode: PathMode | None = None
        """Path mode of the rows that follow; None: the default of the machine."""
        self.run = -1
        """Index of the run in the plan for the rows that follow; −1: links between runs."""
        self._start = start
        self._rows: list[tuple[float, ...]] = []
        self._columns = {name: _Column(name) for name in (*COLUMNS, "run")}
        self._texts: dict[str, int] = {}
        self._modes: dict[PathMode, int] = {}
        self._notes: list[OperationNote] = []
        self._begin: list[int] = []

    def __len__(self) -> int:
        return len(self._columns["kind"]) + len(self._rows)

    def rapid(
        self, x: Coordinate = None, y: Coordinate = None, z: Coordinate = None
    ) -> ToolpathBuilder:
        """Add a straight rapid to these coordinates: the machine's highest speed, no cutting."""
        return self._move(Kind.RAPID, (x, y, z), math.nan)

    def line(
        self, x: Coordinate = None, y: Coordinate = None, z: Coordinate = None, *, feed: float
    ) -> ToolpathBuilder:
        """Add a straight cut to these coordinates at `feed` mm/min."""
        return self._move(Kind.LINE, (x, y, z), feed)

    def arc(
        self,
        x: float,
        y: float,
        z: Coordinate = None,
        *,
        centre: tuple[float, float],
        ccw: bool,
        feed: float,
    ) -> ToolpathBuilder:
        """Add an arc in XY about the absolute `centre`, or a helix if `z` is given.

        It is a full turn when its end lies above, below or at its start."""
        kind = Kind.ARC_CCW if ccw else Kind.ARC_CW
        return self._move(kind, (x, y, z), feed, centre)

    def event(self, kind: Kind, value: float | None = None) -> ToolpathBuilder:
        """Add an event at the present position; `value` in the unit that `Kind` gives."""
        return self._add(kind, self.position, (math.nan, math.nan), math.nan, value)

    def message(self, text: str) -> ToolpathBuilder:
        """Add a message to the operator."""
        return self.event(Kind.MESSAGE, float(self._index(text)))

    def operation(self, note: OperationNote) -> None:
        """Begin an operation: the rows that follow belong to it."""
        self._notes.append(note)
        self._begin.append(len(self))

    def set_position(self, x: float, y: float, z: float) -> ToolpathBuilder:
        """Set the present position without a move, for an event that moves the tool (homing)."""
        self.position = (x, y, z)
        return self

    def moves(
        self, kind: Ints, end: Floats, centre: Floats, feed: Floats, **others: Ints | Floats
    ) -> None:
        """Add K > 0 rows given as columns of a `Toolpath`. `others` sets `block`, `value`,
        `source` (indices from `provenance`) or `run`, where they differ from the builder's
        present values."""
        count = len(kind)
        of_all = {"source": self._of_source(), "mode": self._of_mode(), "run": self.run}
        columns = {"value": math.nan, "block": self.block, **of_all, **others}
        columns |= {"kind": kind, "end": end, "centre": centre, "feed": feed}
        if count <= FEW_ROWS:
            self._rows += _as_rows([columns[name] for name in self._columns], count)
            if len(self._rows) >= ROWS_AT_ONCE:
                self._gather()
        else:
            self._gather()
            for name, column in self._columns.items():
                column.add(columns[name], count)
        x, y, z = end[-1].tolist()
        self.position = (x, y, z)

    def provenance(self, texts: Iterable[str]) -> Ints:
        """Store the texts and return their indices for a column `source`; −1 for an empty text."""
        return np.array([self._index(text) if text else -1 for text in texts], dtype=np.int64)

    @property
    def runs(self) -> Ints:
        """Index (N,) of the run of each row."""
        self._gather()
        return np.asarray(self._columns["run"].to_array(), dtype=np.int64)

    def drain(self) -> Toolpath:
        """Return the rows added so far as a Toolpath and remove them, for programs that are read
        block by block."""
        path, self._start = self.finish(), self.position
        self._columns = {name: _Column(name) for name in (*COLUMNS, "run")}
        return path

    def finish(self, findings: Iterable[Finding] = ()) -> Toolpath:
        """Return the rows added so far as a Toolpath."""
        self._gather()
        begin = np.array(self._begin, dtype=np.int64)
        return Toolpath(
            **{name: self._columns[name].to_array() for name in COLUMNS},
            modes=tuple(self._modes),
            start=np.array(self._start, dtype=np.float64),
            texts=tuple(self._texts),
            findings=tuple(findings),
            operations=Operations(tuple(self._notes), begin) if self._notes else None,
        )

    def _move(
        self,
        kind: Kind,
        target: tuple[Coordinate, Coordinate, Coordinate],
        feed: float,
        centre: tuple[float, float] = (math.nan, math.nan),
    ) -> ToolpathBuilder:
        x, y, z = (
            old if new is None else float(new)
            for new, old in zip(target, self.position, strict=True)
        )
        self.position = (x, y, z)
        return self._add(kind, self.position, centre, feed, None)

    def _add(
        self,
        kind: Kind,
        end: tuple[float, float, float],
        centre: tuple[float, float],
        feed: float,
        value: float | None,
    ) -> ToolpathBuilder:
        number = math.nan if value is None else float(value)
        of_all = self._of_source(), self.block, self._of_mode(), self.run
        self._rows.append((kind, *end, *centre, feed, number, *of_all))
        if len(self._rows) >= ROWS_AT_ONCE:
            self._gather()
        return self

    def _of_source(self) -> int:
        return self._index(self.source) if self.source else -1

    def _of_mode(self) -> int:
        return -1 if self.mode is None else self._modes.setdefault(self.mode, len(self._modes))

    def _gather(self) -> None:
        """Move the rows collected as Python tuples into the columns of arrays."""
        if self._rows:
            table = np.array(self._rows, dtype=np.float64)
            self._rows = []
            cut = np.split(table, [1, 4, 6, 7, 8, 9, 10, 11], axis=1)
            for column, part in zip(self._columns.values(), cut, strict=True):
                column.add(part.reshape(column.shape_of(len(part))), len(part))

    def _index(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))


class _Column:
    """A column that grows in place: joining parts at the end would need twice the memory and
    fragment it. While all rows are equal only one of them is stored, except for `end`."""

    def __init__(self, name: str) -> None:
        self._dtype, self._width = COLUMNS.get(name, (np.int64, ()))
        self._rows: Any = np.empty(self.shape_of(0), dtype=self._dtype)
        self._count = 0
        self._same = name != "end"

    def __len__(self) -> int:
        return self._count

    def shape_of(self, rows: int) -> tuple[int, ...]:
        """Return the shape of an array of this column with so many rows: (rows,), (rows, 2) or
        (rows, 3)."""
        return (rows, *self._width)

    def add(self, rows: Ints | Floats | float, count: int) -> None:
        """Append `count` ≥ 1 rows; a single number is the value of all of them."""
        values = np.broadcast_to(np.asarray(rows, dtype=self._dtype), self.shape_of(count))
        if self._same and not self._count:
            self._rows = values[:1].copy()
        if self._same and not _are_same(self._rows, values):
            self._same = False
            self._rows = np.repeat(self._rows, self._count, axis=0)
        end = self._count + count
        if not self._same:
            if end > len(self._rows):
                if not self._rows.flags.writeable:
                    self._rows = self._rows.copy()
                self._rows.resize(self.shape_of(end + end // GROWTH), refcheck=False)
            self._rows[self._count : end] = values
        self._count = end

    def to_array(self) -> Any:
        """Return all rows of the column as a read-only array."""
        if self._same and self._count:
            return np.broadcast_to(read_only(self._rows), self.shape_of(self._count))
        if len(self._rows) != self._count:
            self._rows.resize(self.shape_of(self._count), refcheck=False)
        return read_only(self._rows)


def _as_rows(columns: Sequence[Ints | Floats | float], count: int) -> Iterator[tuple[float, ...]]:
    """Return an iterator over `count` tuples of numbers, one for each row of these columns; a
    column that is a single number repeats it."""
    parts: list[Any] = []
    for column in columns:
        if isinstance(column, np.ndarray):
            parts += [column.tolist()] if column.ndim == 1 else column.T.tolist()
        else:
            parts.append(repeat(column, count))
    return zip(*parts, strict=True)


def _are_same(one: Any, rows: Any) -> bool:
    """Return True if all `rows` have the same bits as row `one`: NaN equals NaN, and 0 differs
    from −0."""
    if one.dtype == np.float64:
        one, rows = one.view(np.int64), rows.view(np.int64)
    return bool((rows == one).all())
