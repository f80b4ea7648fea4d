"""The writer's second stage: lines in mm become jobs of lines that the slaves can run.

All numbers here are whole units of 0.1 mm, counted from home. A slave runs a distance in chunks
of two units and counts `distance / 2 − 1` of them downwards (L5589-5729), so that

- a distance of 1 (and a first point at 0 or 1) makes it run away: never sent;
- an odd distance loses its unit: vertices lie on a grid of two units unless asked otherwise;
- a speed of 0 on a distance never ends: never sent."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.moves import Toolpath

from .dialect import (
    CHUNK_UNITS,
    MAX_NUMBER,
    UNIT_MM,
    UNITS_PER_MM,
    MatlabRouterMachine,
    ResolvedDialect,
)
from .findings import (
    FEED_ROUNDED,
    FEED_ROUNDED_TO_LIMIT,
    FEED_ROUNDED_UP,
    MOVE_COLLAPSED,
    MOVE_COLLAPSED_STROKES,
    MOVE_SPLIT_BENT,
    MOVE_SPLIT_INTO_JOBS,
    PLACES_SNAPPED,
    PLACES_SNAPPED_AND_STARTS,
    PLACES_SNAPPED_FROM_ONE,
)
from .strokes import CutLines

TIE_TOLERANCE: Final = 1e-6
"""A coordinate within this part of the grid of half-way between two of its lines counts as
half-way, and goes to the farther one."""

UNIT_TOLERANCE: Final = 1e-6
"""A feed within this many counts of the limit is on it."""

MAX_SPEED_COUNTS: Final = 1023
"""The slaves discard a measured speed above this (L5496-5516)."""


FEED_NOTICE: Final = 1e-6
"""A feed that is off by less than this many mm/min is as wanted."""

SNAP_NOTICE_MM: Final = 1e-6
"""A vertex that is moved by less lies on the grid already."""


class SlaveLines(Struct, frozen=True, eq=False):
    """L lines that the slaves can run: `start`, `end` (L, 2) units from home; `feed` (L,) mm/min;
    `row` (L,) of the toolpath; `stroke` (L,) ascending."""

    start: Ints
    end: Ints
    feed: Floats
    row: Ints
    stroke: Ints

    def chosen(self, keep: Bools) -> SlaveLines:
        """Return the lines where `keep` (L,) is true."""
        return SlaveLines(
            self.start[keep], self.end[keep], self.feed[keep], self.row[keep], self.stroke[keep]
        )


class Jobs(Struct, frozen=True, eq=False):
    """All jobs in columns: their lines, the signed speeds (L, 2) of these in counts in 5 ms, and
    `offsets` (J+1,): job j has the lines offsets[j]:offsets[j+1]."""

    lines: SlaveLines
    speed: Ints
    offsets: list[int]


def jobs_of(
    cuts: CutLines, toolpath: Toolpath, machine: MatlabRouterMachine, dialect: ResolvedDialect
) -> tuple[Jobs, LineChanges]:
    """Return the jobs and the counts of what was changed to make them.

    PostError for what lies outside of the area or has a feed that cannot be written."""
    maker = _Maker(toolpath, machine, dialect)
    lines = maker.lines(cuts)
    return Jobs(lines, maker.speeds(lines), maker.offsets(lines)), maker.changes


class _Maker:
    """Conversion of all lines; `changes` counts what it changes."""

    def __init__(
        self, toolpath: Toolpath, machine: MatlabRouterMachine, dialect: ResolvedDialect
    ) -> None:
        self.changes = LineChanges()
        self._toolpath = toolpath
        self._dialect = dialect
        self._machine = machine
        self._zero = np.array(machine.controller.machine_zero_mm[:2])
        self._unit = machine.feed.unit_mm_min
        self._least = max(CHUNK_UNITS, dialect.grid_units)
        self._most_counts = min(
            MAX_SPEED_COUNTS, int(machine.max_feed_mm_min / self._unit + UNIT_TOLERANCE)
        )

    def lines(self, cuts: CutLines) -> SlaveLines:
        """Return the cuts as lines that the slaves can run."""
        return self._straight(self._mend(self._on_grid(cuts)))

    def _on_grid(self, cuts: CutLines) -> SlaveLines:
        """Return the lines with each vertex at the nearest point of the grid, the first vertex of
        a stroke at least one chunk away from home; PostError for vertices outside the area."""
        grid, count = self._dialect.grid_units, len(cuts.row)
        rows = np.concatenate([cuts.row, cuts.row])
        exact = (np.concatenate([cuts.start, cuts.end]) - self._zero) * UNITS_PER_MM
        units = np.floor(exact / grid + 0.5 + TIE_TOLERANCE) * grid
        self._refuse_outside(rows, units)
        first = np.concatenate([np.diff(cuts.stroke, prepend=-1) != 0, np.zeros(count, np.bool_)])
        early = first & (units < CHUNK_UNITS).any(axis=1)
        units[early] = np.maximum(units[early], self._least)
        self.changes.late_starts += int(early.sum())
        if count:
            shift = np.hypot(*(units - exact).T)
            row = int(rows[int(np.argmax(shift))])
            self.changes.note_snap(float(shift.max()) * UNIT_MM, self._toolpath.place(row))
        rounded = units.astype(np.int64)
        return SlaveLines(rounded[:count], rounded[count:], cuts.feed, cuts.row, cuts.stroke)

    def _refuse_outside(self, rows: Ints, units: Floats) -> None:
        for axis, name in enumerate("XY"):
            travel = (self._machine.axes.x, self._machine.axes.y)[axis].travel_mm
            max_units = MAX_NUMBER if travel is None else min(MAX_NUMBER, travel * UNITS_PER_MM)
            is_bad = ~((units[:, axis] >= 0.0) & (units[:, axis] <= max_units + TIE_TOLERANCE))
            if is_bad.any():
                line = int(np.argmax(is_bad))
                raise PostError(
                    f"{name} {units[line, axis] * UNIT_MM:.1f} mm from home is outside of 0 to"
                    f" {max_units * UNIT_MM:g} mm",
                    where=self._toolpath.place(int(rows[line])),
                    mend=self._area_remedy(units, axis, max_units),
                )

    def _area_remedy(self, units: Floats, axis: int, max_units: float) -> str:
        """Return the remedy that brings everything into the travel of an axis: the place of home,
        or a smaller drawing."""
        low, high = float(units[:, axis].min()), float(units[:, axis].max())
        if not high - low <= max_units:
            return "scale the drawing down"
        # Whole millimetres, and one to spare where there is room for it.
        zero = list(self._machine.controller.machine_zero_mm)
        shift = min(math.ceil(-low * UNIT_MM) + 1.0, (max_units - high) * UNIT_MM)
        zero[axis] -= shift
        place = ",".join(f"{value:g}" for value in zero)
        return f"use --origin lower-left, or --set controller.machine_zero_mm=[{place}]"

    def _mend(self, lines: SlaveLines) -> SlaveLines:
        """Return the lines without distances of 1 unit and without lines of no length."""
        if (np.abs(lines.end - lines.start) == 1).any():
            lines = self._without_ones(lines)
        keep = (lines.end != lines.start).any(axis=1)
        self.changes.dropped += int(len(keep) - keep.sum())
        remaining = distinct(lines.stroke[keep])
        for stroke in np.setdiff1d(lines.stroke, remaining).tolist():
            row = int(lines.row[int(np.searchsorted(lines.stroke, stroke))])
            self.changes.note_loss(self._toolpath.place(row))
        return lines.chosen(keep)

    def _without_ones(self, lines: SlaveLines) -> SlaveLines:
        """Return the lines with each vertex that lies one unit (in X or Y) from the vertex before
        it moved onto it. Each vertex moves from its own place, so errors do not add up."""
        starts, ends, strokes = lines.start.tolist(), lines.end.tolist(), lines.stroke.tolist()
        for line, end in enumerate(ends):
            if line and strokes[line] == strokes[line - 1]:
                starts[line] = ends[line - 1]
            for axis in (0, 1):
                if abs(end[axis] - starts[line][axis]) == 1:
                    end[axis] = starts[line][axis]
                    self.changes.ones += 1
        return replace(lines, start=np.array(starts), end=np.array(ends))

    def _majors(self, lines: SlaveLines) -> tuple[Ints, Floats, Ints]:
        """Return the distances (L, 2) of the lines, the larger of the two (L,) as floats, and the
        speed of that axis (L,), counts in 5 ms."""
        distance = np.abs(lines.end - lines.start)
        larger = distance.max(axis=1).astype(np.float64)
        slant = np.hypot(*distance.T) / larger
        share = 1.0 / slant if self._dialect.speed == "path" else 1.0
        exact = np.minimum(lines.feed * share / self._unit, float(MAX_NUMBER))
        counts = np.floor(exact + 0.5).astype(np.int64)
        fast = counts > self._most_counts
        if self._dialect.too_fast == "limited":
            self.changes.limited = max(self.changes.limited, int(fast.sum()))
            exact = np.where(fast, self._most_counts, exact)
            counts = np.minimum(counts, self._most_counts)
        else:
            self._refuse_feed(lines, fast, "above what its axes run at")
        self._refuse_feed(lines, counts < 1, "below one count of the encoder in 5 ms")
        errors = np.abs(exact - counts) * self._unit
        self.changes.feed_off = max(self.changes.feed_off, float(errors.max(initial=0.0)))
        if self._dialect.speed == "axis":
            self.changes.faster = max(self.changes.faster, float(slant.max(initial=1.0)))
        return distance, larger, counts

    def _refuse_feed(self, lines: SlaveLines, is_bad: Bools, complaint: str) -> None:
        if is_bad.any():
            line = int(np.argmax(is_bad))
            raise PostError(
                f"feed {lines.feed[line]:g} mm/min is {complaint}",
                where=self._toolpath.place(int(lines.row[line])),
                mend=f"an axis runs at {self._unit:g} to {self._most_counts * self._unit:g}"
                " mm/min; --set dialect.too_fast=limited takes the highest",
            )

    def speeds(self, lines: SlaveLines) -> Ints:
        """Return the signed speeds (L, 2), counts in 5 ms: the axis with the larger distance at
        the speed of the line, the other one in proportion, by the same operations as in the
        listing (L4444-4515) so that ties round alike."""
        distance, larger, counts = self._majors(lines)
        with np.errstate(divide="ignore"):
            factor = larger[:, None] / distance
        speed = np.floor(counts[:, None] / factor + 0.5).astype(np.int64)
        if ((speed == 0) & (distance > 0)).any() or (distance == 1).any():
            raise PostError("internal fault: a line that the slaves would never end")
        return np.asarray(np.where(lines.end < lines.start, -speed, speed))

    def _straight(self, lines: SlaveLines) -> SlaveLines:
        """Return the lines, those split into pieces whose rounded speeds would bend them beyond
        the tolerance or stop an axis."""
        distance, larger, counts = self._majors(lines)
        limits = LineLimits(
            self._dialect.bend_tolerance_mm * UNITS_PER_MM, self._dialect.grid_units, self._least
        )
        bent_lines = np.flatnonzero(bends(larger, distance.min(axis=1), counts, limits.tolerance))
        if len(bent_lines) == 0:
            return lines
        self.changes.bent += len(bent_lines)
        starts, ends = lines.start[bent_lines].tolist(), lines.end[bent_lines].tolist()
        pieces = [
            split_line(start, end, count, limits)
            for start, end, count in zip(starts, ends, counts[bent_lines].tolist(), strict=True)
        ]
        times = np.ones(len(larger), dtype=np.int64)
        times[bent_lines] = [len(part) for part in pieces]
        source = np.repeat(np.arange(len(times)), times)
        inner = np.isin(source, bent_lines)
        end = lines.end[source]
        end[inner] = [point for part in pieces for point in part]
        start = lines.start[source]
        continues = np.diff(source, prepend=-1) == 0
        start[continues] = end[np.flatnonzero(continues) - 1]
        return SlaveLines(start, end, lines.feed[source], lines.row[source], lines.stroke[source])

    def offsets(self, lines: SlaveLines) -> list[int]:
        """Return the index of each job's first line, then the number of all lines."""
        count = len(lines.row)
        if count == 0:
            return [0]
        begins = np.flatnonzero(np.diff(lines.stroke, prepend=-1)).tolist()
        offsets = []
        for first, last in zip(begins, [*begins[1:], count], strict=True):
            begin = first
            while begin < last:
                offsets.append(begin)
                begin = self._cut_at(lines, begin, last)
                self.changes.more_jobs += begin < last
        return [*offsets, count]

    def _cut_at(self, lines: SlaveLines, first: int, last: int) -> int:
        """Return the end of the job that begins with line `first`: at most `max_lines` later, and
        at a vertex from which the next job can begin."""
        max_end = first + self._dialect.max_lines
        if max_end >= last:
            return last
        usable = (lines.end[first:max_end] >= CHUNK_UNITS).all(axis=1)
        if not usable.any():
            raise PostError(
                f"{self._dialect.max_lines} lines in a row have no vertex at which a job could "
                "begin: all lie on X 0 or Y 0",
                where=self._toolpath.place(int(lines.row[first])),
                mend="move the drawing away from home",
            )
        return first + 1 + int(np.flatnonzero(usable)[-1])


# Lines that whole speeds would bend, in pieces that stay straight.
#
# Speeds are whole counts, so the slower axis is a little too fast or too slow, and one axis
# arrives first: the line bends. For distances D ≥ d and speeds V, v of the faster and slower axis
#
#     r = (v/V) / (d/D),   bend = d · (1 − min(r, 1/r))
#
# Lines that bend by more than a tolerance are halved until they do not, or until the slower axis
# has a single chunk left; if its speed still is 0, the line becomes three: along the faster axis,
# across with v = 1 (d · V long), along again.


class LineLimits(Struct, frozen=True):
    """Limits of a line, in units: its deviation from a straight one, the grid of its ends, and the
    shortest distance."""

    tolerance: float
    grid: int
    min_units: int


def bends(larger: Floats, smaller: Ints, counts: Ints, tolerance: float) -> Bools:
    """Return a mask (n,), true for lines that stop (an axis has speed 0) or bend by more than
    `tolerance` units."""
    slanted = smaller > 0
    exact = counts * smaller / larger
    rounded = np.floor(exact + 0.5)
    ratio = np.where(slanted, rounded / np.where(slanted, exact, 1.0), 1.0)
    with np.errstate(divide="ignore"):
        bend = smaller * (1.0 - np.minimum(ratio, 1.0 / ratio))
    return np.asarray(slanted & ((rounded == 0.0) | (bend > tolerance)))


def split_line(
    start: list[int], end: list[int], counts: int, limits: LineLimits
) -> list[list[int]]:
    """Return the ends (x, y) of the pieces into which the line from `start` to `end` is split; the
    last is its own end."""
    travel = (end[0] - start[0], end[1] - start[1])
    major = 0 if abs(travel[0]) >= abs(travel[1]) else 1
    place = list(start)
    ends = []
    for along, across in _pieces(abs(travel[major]), abs(travel[1 - major]), counts, limits):
        place[major] += along if travel[major] > 0 else -along
        place[1 - major] += across if travel[1 - major] > 0 else -across
        ends.append(list(place))
    return ends


def _bend(longer: int, shorter: int, counts: int) -> float:
    """Return how far the driven line strays from the straight one, units; inf if its slower axis
    would stand still."""
    exact = counts * shorter / longer
    rounded = math.floor(exact + 0.5)
    if shorter == 0:
        return 0.0
    if rounded == 0:
        return math.inf
    return shorter * (1.0 - min(rounded / exact, exact / rounded))


def _pieces(longer: int, shorter: int, counts: int, limits: LineLimits) -> list[tuple[int, int]]:
    """Return the pieces (along, across) of a line of these distances, none of which bends too
    much."""
    bend = _bend(longer, shorter, counts)
    if bend <= limits.tolerance:
        return [(longer, shorter)]
    grid = limits.grid
    if shorter >= 2 * limits.min_units:
        along, across = longer // 2 // grid * grid, shorter // 2 // grid * grid
        return [
            *_pieces(along, across, counts, limits),
            *_pieces(longer - along, shorter - across, counts, limits),
        ]
    if bend < math.inf:
        return [(longer, shorter)]
    straight = longer - shorter * counts
    before = straight // 2 // grid * grid
    before = before if before >= limits.min_units else 0
    parts = [(before, 0), (shorter * counts, shorter), (straight - before, 0)]
    return [part for part in parts if part != (0, 0)]


class LineChanges(Struct):
    """Counts of the writer's changes; places name the worst or the first of each kind."""

    snap_mm: float = 0.0
    snap_place: str = ""
    late_starts: int = 0
    ones: int = 0
    dropped: int = 0
    lost_strokes: int = 0
    lost_place: str = ""
    bent: int = 0
    more_jobs: int = 0
    limited: int = 0
    feed_off: float = 0.0
    faster: float = 1.0

    def note_snap(self, moved_mm: float, place: str) -> None:
        """Record a stroke and how far its worst vertex was moved."""
        if moved_mm > max(self.snap_mm, SNAP_NOTICE_MM):
            self.snap_mm, self.snap_place = moved_mm, place

    def note_loss(self, place: str) -> None:
        """Record a stroke of which nothing is left on the grid."""
        self.lost_strokes += 1
        self.lost_place = self.lost_place or place

    def findings(self, dialect: ResolvedDialect) -> Iterator[Finding]:
        """Yield one finding for each kind of change that the writer made."""
        grid_mm = dialect.grid_units * UNIT_MM
        if self.snap_mm:
            yield (PLACES_SNAPPED_AND_STARTS if self.late_starts else PLACES_SNAPPED)(
                where=self.snap_place,
                measured=self.snap_mm,
                limit=grid_mm,
                moved_um=self.snap_mm * 1000.0,
                starts=self.late_starts,
            )
        if self.ones:
            yield PLACES_SNAPPED_FROM_ONE(measured=self.ones)
        if self.lost_strokes:
            yield MOVE_COLLAPSED_STROKES(
                where=self.lost_place, measured=self.lost_strokes, grid=grid_mm
            )
        if self.dropped:
            yield MOVE_COLLAPSED(measured=self.dropped, grid=grid_mm)
        if self.bent:
            yield MOVE_SPLIT_BENT(measured=self.bent, tolerance=dialect.bend_tolerance_mm)
        if self.more_jobs:
            yield MOVE_SPLIT_INTO_JOBS(measured=self.more_jobs, most=dialect.max_lines)
        if self.limited:
            yield FEED_ROUNDED_TO_LIMIT(measured=self.limited)
        if self.feed_off > FEED_NOTICE:
            yield FEED_ROUNDED(measured=self.feed_off)
        if self.faster > 1.0:
            yield FEED_ROUNDED_UP(measured=self.faster)
