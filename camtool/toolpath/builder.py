"""Building a Toolpath row by row, or many moves at a time by columns."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.findings import Finding
from camtool.toolpath.moves import COLUMNS, Kind, PathMode, Toolpath, frozen
from camtool.toolpath.wanted import OperationNote, Operations

Coordinate = float | None

ROWS_AT_ONCE = 1 << 14
"""So many rows are Python objects at a time, no more."""

GROWTH = 8
"""A column that is full grows by this part of its rows."""


class ToolpathBuilder:
    """Collects rows; coordinates left out (None) stay where they are.

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
        """How the rows that follow meet their corners; None: as the machine does."""
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
        """Straight move at the machine's highest speed, not cutting."""
        return self._move(Kind.RAPID, (x, y, z), math.nan)

    def line(
        self, x: Coordinate = None, y: Coordinate = None, z: Coordinate = None, *, feed: float
    ) -> ToolpathBuilder:
        """Straight move at `feed` mm/min."""
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
        """Arc in XY about the absolute `centre`, with a `z` a helix; a full turn when it ends
        above, below or at its start."""
        kind = Kind.ARC_CCW if ccw else Kind.ARC_CW
        return self._move(kind, (x, y, z), feed, centre)

    def event(self, kind: Kind, value: float | None = None) -> ToolpathBuilder:
        """An event at the present position; `value` as `Kind` says."""
        return self._add(kind, self.position, (math.nan, math.nan), math.nan, value)

    def message(self, text: str) -> ToolpathBuilder:
        """A message to the operator."""
        return self.event(Kind.MESSAGE, float(self._index(text)))

    def operation(self, note: OperationNote) -> None:
        """From here on rows are of this operation."""
        self._notes.append(note)
        self._begin.append(len(self))

    def moved_to(self, x: float, y: float, z: float) -> ToolpathBuilder:
        """An event before this one left the tool here (homing)."""
        self.position = (x, y, z)
        return self

    def moves(
        self, kind: Ints, end: Floats, centre: Floats, feed: Floats, **others: Ints | Floats
    ) -> None:
        """K rows by columns as `Toolpath` has them; K is not 0. `others`: the columns `block`,
        `value`, `source` (as `provenance` gives it) and `run` that are not as they would be for
        moves one by one."""
        self._gather()
        count = len(kind)
        of_all = {"source": self._of_source(), "mode": self._of_mode(), "run": self.run}
        columns = {"value": math.nan, "block": self.block, **of_all, **others}
        columns |= {"kind": kind, "end": end, "centre": centre, "feed": feed}
        for name, column in self._columns.items():
            column.add(columns[name], count)
        x, y, z = end[-1].tolist()
        self.position = (x, y, z)

    def provenance(self, texts: Iterable[str]) -> Ints:
        """Index of each of these texts for a column `source`; −1 for an empty one."""
        return np.array([self._index(text) if text else -1 for text in texts], dtype=np.int64)

    @property
    def runs(self) -> Ints:
        """(N,) index of the run of each row."""
        self._gather()
        return np.asarray(self._columns["run"].whole(), dtype=np.int64)

    def drained(self) -> Toolpath:
        """The rows so far, which it then forgets: for what is read one block at a time."""
        path, self._start = self.finish(), self.position
        self._columns = {name: _Column(name) for name in (*COLUMNS, "run")}
        return path

    def finish(self, findings: Iterable[Finding] = ()) -> Toolpath:
        """The rows so far as a Toolpath."""
        self._gather()
        begin = np.array(self._begin, dtype=np.int64)
        return Toolpath(
            **{name: self._columns[name].whole() for name in COLUMNS},
            modes=tuple(self._modes),
            start=np.array(self._start, dtype=np.float64),
            texts=tuple(self._texts),
            findings=tuple(findings),
            operations=Operations(tuple(self._notes), begin) if self._notes else None,
        )

    def _move(
        self,
        kind: Kind,
        to: tuple[Coordinate, Coordinate, Coordinate],
        feed: float,
        centre: tuple[float, float] = (math.nan, math.nan),
    ) -> ToolpathBuilder:
        x, y, z = (
            old if new is None else float(new) for new, old in zip(to, self.position, strict=True)
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
        if len(self._rows) == ROWS_AT_ONCE:
            self._gather()
        return self

    def _of_source(self) -> int:
        return self._index(self.source) if self.source else -1

    def _of_mode(self) -> int:
        return -1 if self.mode is None else self._modes.setdefault(self.mode, len(self._modes))

    def _gather(self) -> None:
        """Bring the rows so far into columns."""
        if self._rows:
            table = np.array(self._rows, dtype=np.float64)
            self._rows = []
            cut = np.split(table, [1, 4, 6, 7, 8, 9, 10, 11], axis=1)
            for column, part in zip(self._columns.values(), cut, strict=True):
                column.add(part.reshape(column.shape_of(len(part))), len(part))

    def _index(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))


class _Column:
    """A column that grows where it stands: parts that are put together at the end would need twice
    the room, and leave holes in the memory. While all rows are the same, one of them is stored,
    but for ends."""

    def __init__(self, name: str) -> None:
        self._dtype, self._width = COLUMNS.get(name, (np.int64, ()))
        self._rows: Any = np.empty(self.shape_of(0), dtype=self._dtype)
        self._count = 0
        self._same = name != "end"

    def __len__(self) -> int:
        return self._count

    def shape_of(self, rows: int) -> tuple[int, ...]:
        """The shape of so many rows."""
        return (rows, *self._width)

    def add(self, rows: Ints | Floats | float, count: int) -> None:
        """So many further rows, at least one; a single number stands for all of them."""
        given = np.broadcast_to(np.asarray(rows, dtype=self._dtype), self.shape_of(count))
        if self._same and not self._count:
            self._rows = given[:1].copy()
        if self._same and not _are_same(self._rows, given):
            self._same = False
            self._rows = np.repeat(self._rows, self._count, axis=0)
        end = self._count + count
        if not self._same:
            if end > len(self._rows):
                if not self._rows.flags.writeable:
                    self._rows = self._rows.copy()
                self._rows.resize(self.shape_of(end + end // GROWTH), refcheck=False)
            self._rows[self._count : end] = given
        self._count = end

    def whole(self) -> Any:
        """All rows so far, which nobody can change any more."""
        if self._same and self._count:
            return np.broadcast_to(frozen(self._rows), self.shape_of(self._count))
        if len(self._rows) != self._count:
            self._rows.resize(self.shape_of(self._count), refcheck=False)
        return frozen(self._rows)


def _are_same(one: Any, rows: Any) -> bool:
    """Whether all rows are this one; NaN is the same as NaN, and 0 not as −0."""
    if one.dtype == np.float64:
        one, rows = one.view(np.int64), rows.view(np.int64)
    return bool((rows == one).all())
