"""Canonical calls to rows, as LinuxCNC's interpreter makes them.

While the cutter's radius is compensated, the last move waits until the next one is known, and
events wait behind it."""

from __future__ import annotations

import math
from collections.abc import Callable

from msgspec import Struct

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from ..gcode.part_moves import PLANES, PartMoves


class Queued(Struct):
    """A move that waits for its end: end and centre (in the axis order of the plane: first,
    second, normal) in units of the program; `turn` 0 for a straight one; the direction in which it
    was programmed, and the angle by which its arc was to turn (0: its end is fixed)."""

    kind: Kind
    end: list[float]
    centre: tuple[float, float] = (0.0, 0.0)
    turn: int = 0
    feed: float = math.nan
    direction: tuple[float, float] = (0.0, 0.0)
    sweep: float = 0.0
    block: int = -1
    source: str = ""


class Canon(PartMoves):
    """Receives canonical moves and events, adds rows to the path, and keeps those that wait."""

    def __init__(
        self, path: ToolpathBuilder, full_turn_rad: float, *, is_lathe: bool = False
    ) -> None:
        super().__init__(path, full_turn_rad, is_lathe=is_lathe)
        self.queue: list[Queued | Callable[[], None]] = []
        self._events = 0
        self.nose: tuple[float, float] = (0.0, 0.0)
        """Controlled point of a lathe tool, from the centre of its nose: X, Z."""

    @property
    def moves(self) -> int:
        """Number of rows so far that are moves, not events."""
        return len(self.path) - self._events

    def event(self, kind: Kind, value: float | None = None) -> None:
        """Add a row of an event, behind the moves that still wait for their ends."""
        self._events += 1
        block = self.path.block
        if not self.queue:
            self.path.event(kind, value)
            return

        def later() -> None:
            outer_block, self.path.block = self.path.block, block
            self.path.event(kind, value)
            self.path.block = outer_block

        self.queue.append(later)

    def wait(self, move: Queued) -> None:
        """Queue a move whose end may still change."""
        move.block, move.source = self.path.block, self.path.source
        move.feed = self.feed
        self.queue.append(move)

    def flush(self) -> None:
        """Add the queued moves to the path as rows."""
        if not self.queue:
            return
        waiting, self.queue = self.queue, []
        path, feed = self.path, self.feed
        place_before = path.block, path.source
        for each in waiting:
            if not isinstance(each, Queued):
                each()
                continue
            path.block, path.source, self.feed = each.block, each.source, each.feed
            self._emit(each)
        (path.block, path.source), self.feed = place_before, feed

    def _emit(self, move: Queued) -> None:
        axes = PLANES[self.plane]
        x, z = self.nose
        offsets = (x, 0.0, z) if self.plane == 180 else (0.0, 0.0, 0.0)
        end = [move.end[k] + offsets[axis] for k, axis in enumerate(axes)]
        if move.turn:
            centre = (move.centre[0] + offsets[axes[0]], move.centre[1] + offsets[axes[1]])
            self.arc(end, centre, move.turn)
            return
        place = [0.0, 0.0, 0.0]
        for k, axis in enumerate(axes):
            place[axis] = end[k]
        (self.rapid if move.kind == Kind.RAPID else self.line)(*place)
