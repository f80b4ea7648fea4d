"""The writer's second stage: strokes in mm become jobs of lines that the slaves can run.

All numbers here are whole units of 0.1 mm, counted from home. A slave runs a distance in chunks
of two units and counts `distance / 2 − 1` of them downwards (L5589-5729), so that

- a distance of 1 (and a first point at 0 or 1) makes it run away: never sent;
- an odd distance loses its unit: vertices lie on a grid of two units unless asked otherwise;
- a speed of 0 on a distance never ends: never sent.

Speeds are whole counts, so the slower axis is a little too fast or too slow, and one axis arrives
first: the line bends. For distances D ≥ d and speeds V, v of the faster and the slower axis

    r = (v/V) / (d/D),   bend = d · (1 − min(r, 1/r))

Lines that bend by more than a tolerance are halved until they do not, or until the slower axis
has a single chunk left; if its speed still is 0, the line becomes three: along the faster axis,
across with v = 1 (d · V long), along again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.errors import PostError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Floats, Ints, Toolpath

from ._matlab_router_notes import Notes
from ._matlab_router_options import (
    CHUNK_UNITS,
    MOST_NUMBER,
    UNIT_MM,
    UNITS_PER_MM,
    Dialect,
)
from ._matlab_router_strokes import Stroke, place

Bools = npt.NDArray[np.bool_]

TIE_TOLERANCE: Final = 1e-6
"""A coordinate within this part of the grid of half-way between two of its lines is half-way, and
goes to the farther one."""

FEED_TOLERANCE: Final = 1e-6
"""A feed within this many counts of the limit is on it."""

FASTEST_COUNTS: Final = 1023
"""The slaves throw away a speed that they measure above this (L5496-5516)."""


@dataclass(frozen=True, eq=False)
class Job:
    """n lines: `xy` (n+1, 2) units from home; `speed` (n, 2) counts in 5 ms, with the sign of
    the direction; `row` (n,) the row of the toolpath that each line came from."""

    xy: Ints
    speed: Ints
    row: Ints


@dataclass(frozen=True, eq=False)
class _Lines:
    """A stroke on the grid: points (m+1, 2) units; rows and feeds (m,)."""

    xy: Ints
    row: Ints
    feed: Floats


class JobMaker:
    """Strokes in, jobs out; `notes` counts what was changed on the way."""

    def __init__(self, toolpath: Toolpath, machine: Machine, dialect: Dialect) -> None:
        self.notes = Notes()
        self._toolpath = toolpath
        self._dialect = dialect
        self._machine = machine
        self._zero = np.array(machine.controller.machine_zero_mm[:2])
        self._unit = machine.feed.unit_mm_min
        self._least = max(CHUNK_UNITS, dialect.grid_units)
        self._most_counts = min(
            FASTEST_COUNTS, int(machine.max_feed_mm_min / self._unit + FEED_TOLERANCE)
        )

    def jobs(self, stroke: Stroke) -> list[Job]:
        """The jobs of one stroke; none when it is smaller than the grid."""
        lines = self._mended(self._on_grid(stroke))
        if len(lines.row) == 0:
            self.notes.lost(place(self._toolpath, int(stroke.row[0])))
            return []
        lines = self._straight(lines)
        speed = self._speeds(lines)
        made = []
        first = 0
        while first < len(lines.row):
            last = self._cut_at(lines, first)
            part = slice(first, last)
            made.append(Job(lines.xy[first : last + 1], speed[part], lines.row[part]))
            first = last
        self.notes.more_jobs += len(made) - 1
        return made

    def _on_grid(self, stroke: Stroke) -> _Lines:
        """Vertices at the nearest point of the grid, the first one not nearer to home than a
        chunk; PostError for those outside the area."""
        grid = self._dialect.grid_units
        wanted = (stroke.points - self._zero) * UNITS_PER_MM
        snapped = np.floor(wanted / grid + 0.5 + TIE_TOLERANCE) * grid
        self._refuse_outside(stroke, snapped)
        early = snapped[0] < CHUNK_UNITS
        if early.any():
            snapped[0] = np.maximum(snapped[0], self._least)
            self.notes.late_starts += 1
        moved = np.hypot(*(snapped - wanted).T)
        self.notes.snapped(
            float(moved.max()) * UNIT_MM, place(self._toolpath, _row_at(stroke, moved))
        )
        return _Lines(snapped.astype(np.int64), stroke.row, stroke.feed)

    def _refuse_outside(self, stroke: Stroke, units: Floats) -> None:
        for axis, name in enumerate("XY"):
            travel = (self._machine.axes.x, self._machine.axes.y)[axis].travel_mm
            most = MOST_NUMBER if travel is None else travel * UNITS_PER_MM
            bad = ~((units[:, axis] >= 0.0) & (units[:, axis] <= most + TIE_TOLERANCE))
            if bad.any():
                vertex = int(np.argmax(bad))
                at = units[vertex, axis] * UNIT_MM
                x, y, z = self._machine.controller.machine_zero_mm
                raise PostError(
                    f"{name} {at:.1f} mm from home is outside of 0 to {most * UNIT_MM:g} mm",
                    where=place(self._toolpath, int(stroke.row[max(0, vertex - 1)])),
                    mend="use --origin lower-left, scale the drawing, or say where home lies: "
                    f"--set controller.machine_zero_mm=[{x:g},{y:g},{z:g}]",
                )

    def _mended(self, lines: _Lines) -> _Lines:
        """No distance of 1 and no line of no length."""
        xy = lines.xy
        if (np.abs(np.diff(xy, axis=0)) == 1).any():
            xy = xy.copy()
            for vertex in range(1, len(xy)):
                one = np.abs(xy[vertex] - xy[vertex - 1]) == 1
                xy[vertex, one] = xy[vertex - 1, one]
                self.notes.ones += bool(one.any())
        keep = (np.diff(xy, axis=0) != 0).any(axis=1)
        self.notes.dropped += int(len(keep) - keep.sum())
        return _Lines(np.vstack([xy[:1], xy[1:][keep]]), lines.row[keep], lines.feed[keep])

    def _majors(self, lines: _Lines) -> tuple[Ints, Floats, Ints]:
        """Distances (n, 2); the larger of each line as a float (n,); its speed in counts (n,)."""
        distance = np.abs(np.diff(lines.xy, axis=0))
        larger = distance.max(axis=1).astype(np.float64)
        share = np.ones(len(larger))
        if self._dialect.speed == "path":
            share = larger / np.hypot(*distance.T)
        wanted = lines.feed * share / self._unit
        counts = np.floor(np.minimum(wanted, float(MOST_NUMBER)) + 0.5).astype(np.int64)
        self._refuse_feed(lines, counts > self._most_counts, "above what its axes run at")
        self._refuse_feed(lines, counts < 1, "below one count of the encoder in 5 ms")
        off = np.abs(wanted - counts) * self._unit
        self.notes.feed_off = max(self.notes.feed_off, float(off.max(initial=0.0)))
        if self._dialect.speed == "axis":
            faster = float((np.hypot(*distance.T) / larger).max(initial=1.0))
            self.notes.faster = max(self.notes.faster, faster)
        return distance, larger, counts

    def _refuse_feed(self, lines: _Lines, bad: Bools, what: str) -> None:
        if bad.any():
            line = int(np.argmax(bad))
            raise PostError(
                f"feed {lines.feed[line]:g} mm/min is {what}",
                where=place(self._toolpath, int(lines.row[line])),
                mend=f"an axis runs at {self._unit:g} to {self._most_counts * self._unit:g}"
                " mm/min",
            )

    def _speeds(self, lines: _Lines) -> Ints:
        """(n, 2) signed counts: the larger distance at its speed, the other one in proportion,
        by the same operations as the listing (L4444-4515) so that ties fall alike."""
        distance, larger, counts = self._majors(lines)
        with np.errstate(divide="ignore"):
            factor = larger[:, None] / distance
        speed = np.floor(counts[:, None] / factor + 0.5).astype(np.int64)
        if ((speed == 0) & (distance > 0)).any() or (distance == 1).any():
            raise PostError("internal fault: a line that the slaves would never end")
        return np.asarray(np.where(np.diff(lines.xy, axis=0) < 0, -speed, speed))

    def _straight(self, lines: _Lines) -> _Lines:
        """Lines that whole speeds would bend too much, or stop, in pieces."""
        distance, larger, counts = self._majors(lines)
        smaller = distance.min(axis=1)
        tolerance = self._dialect.bend_tolerance_mm * UNITS_PER_MM
        bad = np.flatnonzero(_bends(larger, smaller, counts, tolerance))
        if len(bad) == 0:
            return lines
        xy = lines.xy.tolist()
        times = np.ones(len(larger), dtype=np.int64)
        points: list[list[int]] = [xy[0]]
        before = 0
        for line in bad.tolist():
            points += xy[before + 1 : line + 1]
            pieces = self._pieces(xy[line], xy[line + 1], int(counts[line]), tolerance)
            points += pieces
            times[line] = len(pieces)
            before = line + 1
        points += xy[before + 1 :]
        self.notes.bent += len(bad)
        return _Lines(
            np.array(points, dtype=np.int64),
            np.repeat(lines.row, times),
            np.repeat(lines.feed, times),
        )

    def _pieces(
        self, start: list[int], end: list[int], counts: int, tolerance: float
    ) -> list[list[int]]:
        """The ends of the pieces of one line, its own end last."""
        way = [end[0] - start[0], end[1] - start[1]]
        major = 0 if abs(way[0]) >= abs(way[1]) else 1
        longer, shorter = abs(way[major]), abs(way[1 - major])
        at = [0, 0]
        ends = []
        for along, across in _pieces(
            longer, shorter, counts, (tolerance, self._dialect.grid_units, self._least)
        ):
            at = [at[0] + along, at[1] + across]
            point = [0, 0]
            point[major] = start[major] + (at[0] if way[major] > 0 else -at[0])
            point[1 - major] = start[1 - major] + (at[1] if way[1 - major] > 0 else -at[1])
            ends.append(point)
        return ends

    def _cut_at(self, lines: _Lines, first: int) -> int:
        """Where the job that begins with this line ends: at most `max_lines` on, and at a vertex
        from which the next job can begin."""
        most = first + self._dialect.max_lines
        if most >= len(lines.row):
            return len(lines.row)
        usable = (lines.xy[first + 1 : most + 1] >= CHUNK_UNITS).all(axis=1)
        if not usable.any():
            raise PostError(
                f"{self._dialect.max_lines} lines on without a vertex at which a job could begin: "
                "all lie on X 0 or Y 0",
                where=place(self._toolpath, int(lines.row[first])),
                mend="move the drawing away from home",
            )
        return first + 1 + int(np.flatnonzero(usable)[-1])


def _row_at(stroke: Stroke, moved: Floats) -> int:
    """The row that ends (for the first vertex: starts) at the vertex that was moved most."""
    return int(stroke.row[max(0, int(np.argmax(moved)) - 1)])


def _bends(larger: Floats, smaller: Ints, counts: Ints, tolerance: float) -> Bools:
    """(n,) which lines stop (v = 0) or bend by more than the tolerance (units)."""
    slanted = smaller > 0
    wanted = counts * smaller / larger
    whole = np.floor(wanted + 0.5)
    ratio = np.where(slanted, whole / np.where(slanted, wanted, 1.0), 1.0)
    with np.errstate(divide="ignore"):
        bend = smaller * (1.0 - np.minimum(ratio, 1.0 / ratio))
    return np.asarray(slanted & ((whole == 0.0) | (bend > tolerance)))


def _pieces(
    longer: int, shorter: int, counts: int, limits: tuple[float, int, int]
) -> list[tuple[int, int]]:
    """A line of these distances as pieces (along, across) that do not bend too much.

    `limits`: the tolerance (units), the grid and the least distance that may be sent.
    """
    tolerance, grid, least = limits
    one = np.array([longer], dtype=np.float64), np.array([shorter]), np.array([counts])
    if not bool(_bends(*one, tolerance)[0]):
        return [(longer, shorter)]
    if shorter >= 2 * least:
        along, across = longer // 2 // grid * grid, shorter // 2 // grid * grid
        return [
            *_pieces(along, across, counts, limits),
            *_pieces(longer - along, shorter - across, counts, limits),
        ]
    if not bool(_bends(*one, float("inf"))[0]):
        return [(longer, shorter)]
    rest = longer - shorter * counts
    before = rest // 2 // grid * grid
    before = before if before >= least else 0
    parts = [(before, 0), (shorter * counts, shorter), (rest - before, 0)]
    return [part for part in parts if part != (0, 0)]
