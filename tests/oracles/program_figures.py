"""Figures of a program in the G-code that LinuxCNC and grbl share, counted from its text.

The moves come from the reader of `tests.oracles.stock`; the slides are each axis on its own, as
docs/mechanics.md has it: a scale, and a play whose flanks are taken up one after the other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from camtool.arrays import Floats
from tests.oracles.part_sizes import TOP_MM, reach, removed, swept
from tests.oracles.stock import Cutter, Move, moves_of

STEP_MM = 0.02
"""From one point along a move to the next."""

TURN_MM = 0.0025
"""An axis has turned when it has come back by half a step."""


@dataclass(frozen=True)
class Axis:
    """An axis without compensation: a real step over a coded one, and its play, which lies ahead
    of a first move in −."""

    scale: float = 1.0
    play: float = 0.0

    def slide(self, places: Floats) -> Floats:
        """Position of the slide for each commanded place, from 0 on."""
        motor, at = places * self.scale, 0.0
        if self.play == 0.0:
            return motor
        found = np.empty(len(motor))
        for k, place in enumerate(motor.tolist()):
            at = min(max(at, place), place + self.play)
            found[k] = at
        return found


@dataclass
class Program:
    """A program and the axes of its machine."""

    text: str
    x: Axis = Axis()
    y: Axis = Axis()
    areas: dict[Cutter, Any] = field(default_factory=dict)

    @cached_property
    def moves(self) -> list[Move]:
        """Its moves, without those that go nowhere."""
        return moves_of(self.text)

    def tool_of(self, row: int) -> int | None:
        """The number of the tool that makes a move, None before the first T word."""
        lines = self.text.splitlines()[: self.moves[row].line]
        said = [re.search(r"\bT(\d+)", re.sub(r"\(.*?\)", "", line)) for line in lines]
        numbers = [int(match[1]) for match in said if match]
        return numbers[-1] if numbers else None

    @cached_property
    def cuts(self) -> list[int]:
        """The moves that cut: feeds that go sideways, below the top at one end at least."""
        return [
            k
            for k, move in enumerate(self.moves)
            if not move.rapid and move.length > 1e-6 and min(move.a[2], move.b[2]) < -1e-6
        ]

    @cached_property
    def track(self) -> tuple[Floats, Any]:
        """(J, 3) places along all moves, and (J,) the move of each: level lines by their ends,
        where no axis has play, and all else by points."""
        is_exact = self.x.play == self.y.play == 0.0
        places, rows = [], []
        for k, move in enumerate(self.moves):
            if move.centre is None and is_exact and move.a[2] == move.b[2]:
                along = move.at(np.array([0.0, 1.0]))
            else:
                along = move.points(STEP_MM)
            places.append(along)
            rows.append(np.full(len(along), k))
        return np.concatenate(places), np.concatenate(rows)

    @cached_property
    def slides(self) -> tuple[Floats, Any]:
        """(J, 3) where the slides are along all moves, and (J,) the move of each."""
        places, rows = self.track
        x, y = self.x.slide(places[:, 0]), self.y.slide(places[:, 1])
        return np.column_stack([x, y, places[:, 2]]), rows

    def cut_slides(self) -> tuple[Floats, Any]:
        """The same on the cuts alone, below the top."""
        places, rows = self.slides
        here = np.isin(rows, self.cuts) & (places[:, 2] < -1e-9)
        return places[here], rows[here]

    @property
    def blocks(self) -> int:
        """Lines that say something to the machine."""
        said = [re.sub(r"\(.*?\)|;.*", "", line).strip() for line in self.text.splitlines()]
        return sum(bool(line) for line in said)

    def extents(self) -> list[tuple[float, float]]:
        """[lowest, highest] of X, Y and Z, arcs with their extremes, the beginning too."""
        found = []
        for axis in range(3):
            places = [0.0, *(move.b[axis] for move in self.moves)]
            if axis < 2:
                places += [place for move in self.moves for place in _poles(move, axis)]
            found.append((min(places), max(places)))
        return found

    def way(self) -> list[float]:
        """Total way of each axis, mm."""
        found = [0.0, 0.0, 0.0]
        for move in self.moves:
            for axis in range(3):
                places = [move.a[axis], *_poles(move, axis), move.b[axis]]
                found[axis] += sum(abs(b - a) for a, b in pairwise(places))
        return found

    def rapid_mm(self) -> float:
        """Length of all rapids in XY, mm."""
        return sum(move.length for move in self.moves if move.rapid)

    def levels(self) -> list[float]:
        """The heights at which a cut is level, downwards."""
        cuts = [self.moves[k] for k in self.cuts]
        found = {round(move.b[2], 4) for move in cuts if move.a[2] == move.b[2]}
        return sorted(found, reverse=True)

    def deepest(self) -> float:
        """Largest depth of the program, mm."""
        return -min(move.b[2] for move in self.moves)

    def seconds(self, feeds: Sequence[float], rapid_mm_s: float) -> tuple[float, float]:
        """Durations without acceleration, of all moves and of cuts alone; `feeds` (K,) mm/min."""
        total = cutting = 0.0
        cuts = set(self.cuts)
        for k, (move, feed) in enumerate(zip(self.moves, feeds, strict=True)):
            away = [abs(b - a) for a, b in zip(move.a, move.b, strict=True)]
            if move.rapid:
                own = max(away) / rapid_mm_s
            else:
                own = math.hypot(move.length, away[2]) / (feed / 60.0)
            total += own
            cutting += own if k in cuts else 0.0
        return total, cutting

    def feeds(self) -> list[float]:
        """mm/min of each move: the last F word."""
        found, feed = [], math.nan
        lines = self.text.splitlines()
        said = [re.sub(r"\(.*?\)|;.*", "", line) for line in lines]
        at = {move.line: [] for move in self.moves}  # type: ignore[var-annotated]
        for line, words in enumerate(said, 1):
            if match := re.search(r"F\s*(\d+\.?\d*)", words):
                feed = float(match[1])
            if line in at:
                at[line] = feed
        for move in self.moves:
            found.append(at[move.line])
        return found  # type: ignore[return-value]

    def reversals(self) -> tuple[list[int], list[int]]:
        """Count the reversals of X, Y and Z, all and while cutting; a first move in − counts."""
        cuts = set(self.cuts)
        every, cutting = [0, 0, 0], [0, 0, 0]
        for axis in range(3):
            way, farthest = 1.0, 0.0
            for k, move in enumerate(self.moves):
                for place in (*_poles(move, axis), move.b[axis]):
                    back = (farthest - place) * way
                    if back >= TURN_MM:
                        way = -way
                        every[axis] += 1
                        cutting[axis] += k in cuts
                    if back >= TURN_MM or back <= 0.0:
                        farthest = place
        return every, cutting

    def contours(self) -> int:
        """Count the stretches that are cut between rapids and moves in the air."""
        count, inside = 0, False
        for k, move in enumerate(self.moves):
            if k in set(self.cuts):
                count += not inside
                inside = True
            elif move.rapid or move.length > 1e-6 or min(move.a[2], move.b[2]) >= -1e-6:
                inside = inside and move.a == move.b
        return count

    @cached_property
    def exact(self) -> Program:
        """The same on a machine without faults."""
        return Program(self.text)

    def removed(self, cutter: Cutter) -> Any:
        """The area that the tool removes at the surface, by the slides."""
        if cutter not in self.areas:
            self.areas[cutter] = self._removed(cutter)
        return self.areas[cutter]

    def _removed(self, cutter: Cutter) -> Any:
        if self.x == self.y == Axis():
            return removed([self.moves[k] for k in self.cuts], cutter)
        # The tip of a carving lies at the top itself, and is cut.
        places, rows = self.slides
        here = np.isin(rows, self.cuts) & (places[:, 2] <= TOP_MM)
        tracks = np.split(places[here], np.flatnonzero(np.diff(rows[here])) + 1)
        return swept([(along, reach(along, cutter)) for along in tracks])


def _poles(move: Move, axis: int) -> list[float]:
    """Yield the extreme places of an arc along an axis, in the order of its travel."""
    if move.centre is None or axis == 2:
        return []
    radius = math.dist(move.a[:2], move.centre)
    first = math.atan2(move.a[1] - move.centre[1], move.a[0] - move.centre[0])
    found = list[tuple[float, float]]()
    for pole in (0.0, math.pi) if axis == 0 else (0.5 * math.pi, -0.5 * math.pi):
        turn = (pole - first) % math.tau if move.sweep > 0.0 else (first - pole) % math.tau
        if turn < abs(move.sweep):
            sign = math.cos(pole) if axis == 0 else math.sin(pole)
            found.append((turn, move.centre[axis] + sign * radius))
    return [place for _, place in sorted(found)]
