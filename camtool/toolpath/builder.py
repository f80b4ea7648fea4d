"""Building a Toolpath row by row, or many moves at a time by columns."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.findings import Finding
from camtool.toolpath.moves import COLUMNS, WHOLE, Kind, PathMode, Toolpath

Coordinate = float | None

ROWS_AT_ONCE = 1 << 14
"""So many rows are Python objects at a time, no more."""


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
        self._columns: dict[str, list[Any]] = {name: [] for name in (*COLUMNS, "run")}
        self._texts: dict[str, int] = {}
        self._modes: dict[PathMode, int] = {}

    def __len__(self) -> int:
        return sum(map(len, self._columns["kind"])) + len(self._rows)

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
        columns = {"kind": kind, "end": end, "centre": centre, "feed": feed, **others}
        same = {"source": self._of_source(), "mode": self._of_mode(), "run": self.run}
        for name, number in {"value": math.nan, "block": self.block, **same}.items():
            columns.setdefault(name, np.full(count, number))
        for name, column in columns.items():
            self._columns[name].append(column)
        x, y, z = end[-1].tolist()
        self.position = (x, y, z)

    def provenance(self, texts: Iterable[str]) -> Ints:
        """Index of each of these texts for a column `source`; −1 for an empty one."""
        return np.array([self._index(text) if text else -1 for text in texts], dtype=np.int64)

    @property
    def runs(self) -> Ints:
        """(N,) index of the run of each row."""
        return np.asarray(self._gathered("run"), dtype=np.int64)

    def finish(self, findings: Iterable[Finding] = ()) -> Toolpath:
        """The rows so far as a Toolpath."""
        return Toolpath(
            **{name: self._gathered(name) for name in COLUMNS},
            modes=tuple(self._modes),
            start=np.array(self._start, dtype=np.float64),
            texts=tuple(self._texts),
            findings=tuple(findings),
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
            for name, part in zip((*COLUMNS, "run"), cut, strict=True):
                column = part if name in ("end", "centre") else part[:, 0]
                self._columns[name].append(column)

    def _gathered(self, name: str) -> Any:
        """A column of all rows, as one array that a Toolpath need not copy."""
        self._gather()
        parts = self._columns[name]
        if len(parts) != 1 or parts[0].flags.writeable:
            shape = (0, *{"end": (3,), "centre": (2,)}.get(name, ()))
            dtype = np.int64 if name in (*WHOLE, "run") else np.float64
            whole = np.concatenate(parts or [np.empty(shape)], dtype=dtype, casting="unsafe")
            whole.flags.writeable = False
            parts[:] = [whole]
        return parts[0]

    def _index(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))
