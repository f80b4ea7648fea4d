"""Building a Toolpath row by row."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from camtool.arrays import Ints
from camtool.findings import Finding
from camtool.toolpath.moves import Kind, PathMode, Toolpath

Coordinate = float | None


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
        self._runs: list[int] = []
        self._texts: dict[str, int] = {}
        self._modes: dict[PathMode, int] = {}

    def __len__(self) -> int:
        return len(self._rows)

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

    @property
    def runs(self) -> Ints:
        """(N,) index of the run of each row."""
        return np.array(self._runs, dtype=np.int64)

    def finish(self, findings: Iterable[Finding] = ()) -> Toolpath:
        """The rows so far as a Toolpath."""
        table = np.array(self._rows, dtype=np.float64).reshape(len(self._rows), 11)
        return Toolpath(
            kind=table[:, 0].astype(np.int64),
            end=table[:, 1:4],
            centre=table[:, 4:6],
            feed=table[:, 6],
            value=table[:, 7],
            source=table[:, 8].astype(np.int64),
            block=table[:, 9].astype(np.int64),
            mode=table[:, 10].astype(np.int64),
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
        source = self._index(self.source) if self.source else -1
        mode = -1
        if self.mode is not None:
            mode = self._modes.setdefault(self.mode, len(self._modes))
        self._runs.append(self.run)
        self._rows.append((kind, *end, *centre, feed, number, source, self.block, mode))
        return self

    def _index(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))
