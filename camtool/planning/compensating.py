"""A toolpath bent beforehand, so that the slides come out where it was wanted (`compensate`).

wanted ─linear─▶ as the motors must go: scale and squareness undone, arcs stay arcs
       ─take up─▶ backlash taken up at reversals, and what the controller compensates wrongly"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import GeometryError
from camtool.geometry.curves import EllipseCurve
from camtool.geometry.fit import fit_curve
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Axis, Machine, PlayCells
from camtool.planning.reversing import Residual, residual
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import CompensatedToolpath, Kind, Move, Toolpath

OVERSHOOT = 0.5
"""An axis overshoots at a reversal by this share of the controller's excess compensation."""

STILL_STEPS = 0.5
"""An axis that goes less than this much of a coded step does not move."""

KICK_STEPS = 1.0
"""The step back that makes the controller compensate, in coded steps."""

AHEAD_MM = 1e-9
"""Positions nearer than this are equal."""

MIN_SHARE = 1e-9
"""An edge nearer than this share of a segment to its end is that end."""

TURN_EPS_RAD = 1e-9
"""A turning point nearer than this to an end of its arc is that end."""

Point = tuple[float, float, float]


def compensate(toolpath: Toolpath, machine: Machine) -> CompensatedToolpath:
    """Return `toolpath` changed so that the machine's scale, squareness and backlash make its
    slides come out where `toolpath` says. Sources of the rows are kept; blocks are not.

    What remains: at a reversal that the controller compensates by too much, half of the excess
    (see `_BacklashCompensator`), and the random part of the mechanics."""
    motors = motor_path(toolpath, machine)
    motion = _take_up_backlash(motors.toolpath, machine)
    row = motors.row[motion.row]
    if toolpath.operations is None or motion.toolpath is toolpath:
        return CompensatedToolpath(motion.toolpath, row)
    operations = toolpath.operations.picked(row)
    return CompensatedToolpath(replace(motion.toolpath, operations=operations), row)


def motor_path(toolpath: Toolpath, machine: Machine) -> CompensatedToolpath:
    """Return the path of the motors for which the slides follow `toolpath`, as far as scale and
    squareness are concerned; `toolpath` itself if both are exact.

    A slide is where its motor is times s = `real_step_mm` / `coded_step_mm` of the axis, about
    part zero, and Y leans by q (`camtool.simulation.mechanics`):

        x = s_x m_x + s_y m_y tan q,  y = s_y m_y,
    so  m_x = (x − y tan q) / s_x,    m_y = y / s_y.

    An arc stays an arc where that changes its radius alike in all directions, or by less than the
    machine's fit tolerance; else it becomes an ellipse, which is fitted by arcs within that
    tolerance."""
    square = np.eye(3)
    square[0, 1] = -math.tan(machine.mechanics.squareness_rad)
    scale = np.diag([axis.coded_step_mm / axis.real_step_mm for axis in machine.axes])
    matrix = scale @ square
    if np.array_equal(matrix, np.eye(3)):
        return CompensatedToolpath(toolpath, np.arange(len(toolpath)))
    return _ToolpathMapper(toolpath, matrix, machine.defaults.fit_tolerance_mm).compensate_moves()


class _ToolpathMapper:
    """Maps a toolpath by a matrix (3, 3)."""

    def __init__(self, toolpath: Toolpath, matrix: Floats, tolerance_mm: float) -> None:
        self._toolpath, self._matrix, self._tolerance_mm = toolpath, matrix, tolerance_mm
        plane = matrix[:2, :2]
        sizes = np.linalg.svd(plane, compute_uv=False)
        self._unround = float(sizes[0] - sizes[-1])
        self._b = ToolpathBuilder(self._to(tuple(toolpath.start.tolist())))

    def compensate_moves(self) -> CompensatedToolpath:
        sweeps = self._toolpath.sweeps()
        rows: list[int] = []
        for move in self._toolpath:
            self._b.source = move.source
            end = self._to(move.end)
            if move.kind == Kind.RAPID:
                self._b.rapid(*end)
            elif move.kind == Kind.LINE:
                self._b.line(*end, feed=_feed(move))
            elif move.kind in (Kind.ARC_CW, Kind.ARC_CCW):
                self._arc(move, end, float(sweeps[move.index]))
            else:
                _add_event(self._b, move, self._toolpath)
                self._b.set_position(*end)
            rows += [move.index] * (len(self._b) - len(rows))
        return CompensatedToolpath(
            self._b.finish(self._toolpath.findings), np.array(rows, dtype=np.int64)
        )

    def _to(self, point: tuple[float, ...]) -> Point:
        x, y, z = (self._matrix @ np.array(point)).tolist()
        return x, y, z

    def _arc(self, move: Move, end: Point, sweep: float) -> None:
        if move.centre is None:
            raise GeometryError("an arc without a centre", where=f"move {move.index}")
        centre = np.array(move.centre)
        spoke = np.array(move.start[:2]) - centre
        radius = float(np.hypot(*spoke))
        plane = self._matrix[:2, :2]
        new_centre = plane @ centre
        level = move.start[2] == move.end[2]
        if radius * self._unround <= self._tolerance_mm or not level:
            x, y = new_centre.tolist()
            ccw = move.kind == Kind.ARC_CCW
            self._b.arc(*end, centre=(x, y), ccw=ccw, feed=_feed(move))
            return
        angle = float(np.arctan2(spoke[1], spoke[0]))
        axes = plane * radius
        ellipse = EllipseCurve(new_centre, axes[:, 0], axes[:, 1], angle, angle + sweep)
        vertices = fit_curve(ellipse, self._tolerance_mm).vertices
        _add_vertices(self._b, vertices, end, _feed(move))


def _add_vertices(builder: ToolpathBuilder, vertices: Floats, end: Point, feed: float) -> None:
    """Add the lines and arcs between vertices (n, 3) x, y, bulge to the builder; the last one ends
    at `end`."""
    for (x0, y0, bulge), (x1, y1, _) in zip(
        vertices[:-1].tolist(), [*vertices[1:-1].tolist(), list(end)], strict=True
    ):
        if bulge == 0.0:
            builder.line(x1, y1, feed=feed)
            continue
        # Centre: off the midpoint of the chord by (1 − b²)/(4b) of it, to the left for b > 0.
        share = (1.0 - bulge * bulge) / (4.0 * bulge)
        centre = (0.5 * (x0 + x1) - share * (y1 - y0), 0.5 * (y0 + y1) + share * (x1 - x0))
        builder.arc(x1, y1, centre=centre, ccw=bulge > 0.0, feed=feed)


def _feed(move: Move) -> float:
    return math.nan if move.feed is None else move.feed


def _add_event(builder: ToolpathBuilder, move: Move, toolpath: Toolpath) -> None:
    """Add the event of `move` to the builder; a message keeps its text."""
    if move.kind == Kind.MESSAGE and move.value is not None:
        builder.message(toolpath.texts[int(move.value)])
    else:
        builder.event(move.kind, move.value)


class _Drive(Struct):
    """The state of an axis: the position that the controller commands, and the direction ±1 of its
    last move; `residual`: that of the region in which the tool is."""

    axis: Axis
    residual: Residual
    position: float
    sense: int
    step_mm: float

    def position_for(self, value: float, sense: int) -> float:
        """Return the position that puts the slide on `value` when driven towards `sense`."""
        return value - self.residual.error_mm(sense)

    def sense_of(self, begin: float, end: float) -> int:
        """Return the direction ±1 of a move of this axis; the direction of its last move if it
        does not move."""
        step = end - begin
        if abs(step) < STILL_STEPS * self.axis.coded_step_mm:
            return self.sense
        return 1 if step > 0.0 else -1

    def move_freely(self, begin: float, end: float) -> None:
        """Move in the air so that the slide comes to `end`, in whichever direction of motion is
        consistent with the position for it."""
        for sense in (self.sense_of(begin, end), -self.sense_of(begin, end)):
            target = self.position_for(end, sense)
            if (target - self.position) * sense > 0.0 or (
                sense == self.sense and target == self.position
            ):
                self.position, self.sense = target, sense
                return


def _take_up_backlash(toolpath: Toolpath, machine: Machine) -> CompensatedToolpath:
    """Return the positions that the controller must be given for slides on `toolpath` (in motor
    mm); the same toolpath if there is neither backlash nor compensation."""
    regions = _Regions(machine)
    if not regions.has_backlash:
        return CompensatedToolpath(toolpath, np.arange(len(toolpath)))
    return _BacklashCompensator(toolpath, machine, regions).compensate_moves()


class _BacklashCompensator:
    """Backlash taken up at reversals, and what a controller compensates wrongly.

    Driven in the direction d = ±1 and engaged, a slide stands at an offset from where the
    controller believes it to be (`camtool.planning.reversing.Residual`):

        slide = position + e(d)        so a wanted x asks for the position x − e(d).

    When an axis reverses, that position jumps by e(−d) − e(d) =: J in the new direction d:

    - J > 0, less is compensated than the backlash: the axis goes on by J alone, a line on which
      the slide does not move, and then along the path. Nothing is left over.
    - J < 0, the controller compensates by r = −J too much: its first step back throws the slide r
      ahead. So the axis first overshoots by `OVERSHOOT` · r, then makes one step back, which
      leaves the slide (1 − `OVERSHOOT`) · r ahead, and holds until the path has come as far. With
      one half the largest error is r/2, at the reversal only; without any of this it is r on the
      whole path back. An axis that still waits from the reversal before stands out already, and
      overshoots by the rest. In the cut nothing does better: the step throws the slide from one
      end of a length r to the other, wherever it is made, and one of the two ends is r/2 or more
      off the place of the reversal.

    Where the backlash changes with the region of the table, e does too: a step towards d is taken
    alone, one against it is waited for. Rapids and other moves in the air take up the backlash
    as they go. An axis that does not move keeps what it has."""

    def __init__(self, toolpath: Toolpath, machine: Machine, regions: _Regions) -> None:
        self._toolpath, self._regions = toolpath, regions
        self._home = machine.controller.machine_zero_mm
        first = 1 if machine.controller.start_direction == "+" else -1
        start = toolpath.start.tolist()
        self._drives = [
            _Drive(axis, residual, value, first, KICK_STEPS * _step_mm(axis))
            for axis, residual, value in zip(
                machine.axes, regions.residuals(start), start, strict=True
            )
        ]
        self._b = ToolpathBuilder(self._place())

    def compensate_moves(self) -> CompensatedToolpath:
        rows: list[int] = []
        sweeps = self._toolpath.sweeps()
        for move in self._toolpath:
            self._b.source = move.source
            if move.kind == Kind.RAPID:
                self._enter(move.end)
                for drive, begin, end in zip(self._drives, move.start, move.end, strict=True):
                    drive.move_freely(begin, end)
                self._b.rapid(*self._place())
            elif move.kind in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW):
                for segment in monotone_segments(move, float(sweeps[move.index])):
                    for part in self._regions.parts(segment):
                        self._enter(part.at(0.5))
                        self._cut(part, move)
            else:
                self._event(move)
            rows += [move.index] * (len(self._b) - len(rows))
        return CompensatedToolpath(
            self._b.finish(self._toolpath.findings), np.array(rows, dtype=np.int64)
        )

    def _enter(self, point: Point) -> None:
        """Use the backlash of the region around this point from here on."""
        for drive, axis_residual in zip(self._drives, self._regions.residuals(point), strict=True):
            drive.residual = axis_residual

    def _place(self) -> Point:
        x, y, z = (drive.position for drive in self._drives)
        return x, y, z

    def _line(self, move: Move) -> None:
        """Add a line to the place where the drives now stand, unless the tool is there."""
        if math.dist(self._b.position, self._place()) > AHEAD_MM:
            self._b.line(*self._place(), feed=_feed(move))

    def _cut(self, segment: MonotoneSegment, move: Move) -> None:
        """Add a segment at a feed: take up the backlash, overshoot and hold where necessary, and
        follow the segment."""
        self._overshoot(segment, move)
        for drive, begin, end in zip(self._drives, segment.begin, segment.end, strict=True):
            drive.sense = drive.sense_of(begin, end)
            ask = drive.position_for(begin, drive.sense)
            if (ask - drive.position) * drive.sense > AHEAD_MM:
                drive.position = ask
        self._line(move)
        shares = [self._follow_share(index, segment) for index in range(3)]
        low = 0.0
        for high in sorted({share for share in shares if 0.0 < share < 1.0} | {1.0}):
            self._follow(segment.part(low, high), [share <= low for share in shares], move)
            low = high

    def _overshoot(self, segment: MonotoneSegment, move: Move) -> None:
        """Add an overshoot and one step back, if this segment begins with a reversal that the
        controller compensates by too much."""
        reversing = []
        for drive, begin, end in zip(self._drives, segment.begin, segment.end, strict=True):
            sense = drive.sense_of(begin, end)
            excess = (drive.position - drive.position_for(begin, sense)) * sense
            if sense != drive.sense and excess > AHEAD_MM:
                thrown = (
                    drive.position_for(begin, drive.sense) - drive.position_for(begin, sense)
                ) * sense
                drive.position -= max(excess - (1.0 - OVERSHOOT) * thrown, 0.0) * sense
                reversing.append((drive, sense))
        if reversing:
            self._line(move)
            for drive, sense in reversing:
                drive.position += drive.step_mm * sense
                drive.sense = sense
            self._line(move)

    def _follow_share(self, index: int, segment: MonotoneSegment) -> float:
        """Return the share of the segment from which on an axis follows it; 0 unless the axis
        stands ahead of it."""
        drive = self._drives[index]
        begin, end = segment.begin[index], segment.end[index]
        distance = (drive.position - drive.position_for(begin, drive.sense)) * drive.sense
        if distance <= AHEAD_MM:
            return 0.0
        if distance >= abs(end - begin):
            return 1.0
        return segment.share_at(index, drive.position + drive.residual.error_mm(drive.sense))

    def _follow(self, part: MonotoneSegment, follows: list[bool], move: Move) -> None:
        """Add a part of a segment during which each axis either follows or holds still."""
        offsets = []
        for drive, begin, end, moves in zip(
            self._drives, part.begin, part.end, follows, strict=True
        ):
            offsets.append(drive.position_for(0.0, drive.sense))
            if moves and begin != end:
                drive.position = drive.position_for(end, drive.sense)
        if part.centre is None or not (follows[0] and follows[1]):
            self._line(move)
            return
        centre = (part.centre[0] + offsets[0], part.centre[1] + offsets[1])
        ccw = move.kind == Kind.ARC_CCW
        self._b.arc(*self._place(), centre=centre, ccw=ccw, feed=_feed(move))

    def _event(self, move: Move) -> None:
        homes = {Kind.HOME_XY: (0, 1), Kind.HOME_Z: (2,)}.get(move.kind, ())
        _add_event(self._b, move, self._toolpath)
        for index in homes:
            drive = self._drives[index]
            if drive.position != self._home[index]:
                drive.sense = 1 if self._home[index] > drive.position else -1
            drive.position = self._home[index]
        self._b.set_position(*self._place())


def _step_mm(axis: Axis) -> float:
    """Return the smallest distance of whole steps that a program can express, mm."""
    steps = to_steps(axis.resolution_mm or 0.0, axis.coded_step_mm)
    return max(1.0, float(steps)) * axis.coded_step_mm


class _Regions:
    """Residuals of backlash and compensation in each region of the table; they are divided by the
    scale, since the path is that of the motors.

    A wanted path is cut at the edges of the regions. The regions belong to positions of
    the controller, which differ from the wanted ones by the backlash: near an edge the neighbour's
    may be taken."""

    def __init__(self, machine: Machine) -> None:
        self._cells: tuple[PlayCells | None, ...] = machine.play_map.used
        self._zero = machine.controller.machine_zero_mm
        self._plain = tuple(_residual(axis, machine, None) for axis in machine.axes)
        self._by_cell: list[list[list[Residual]]] = [
            [[_residual(axis, machine, play) for play in row] for row in one.play_mm]
            if one is not None
            else []
            for axis, one in zip(machine.axes, self._cells, strict=True)
        ]

    @property
    def has_backlash(self) -> bool:
        """True if there is backlash or compensation anywhere."""
        cells = [one for table in self._by_cell for row in table for one in row]
        return any(one.matters for one in (*self._plain, *cells))

    def residuals(self, point: Sequence[float]) -> tuple[Residual, ...]:
        """Return the residuals (X, Y, Z) for the region that holds `point`, mm."""
        residuals = []
        for axis, cells in enumerate(self._cells):
            if cells is None:
                residuals.append(self._plain[axis])
                continue
            column = bisect_right(cells.x_mm[1:-1], point[0] - self._zero[0])
            row = bisect_right(cells.y_mm[1:-1], point[1] - self._zero[1])
            residuals.append(self._by_cell[axis][row][column])
        return tuple(residuals)

    def parts(self, segment: MonotoneSegment) -> Iterator[MonotoneSegment]:
        """Yield the segment cut at the edges of all regions."""
        shares = {0.0, 1.0}
        for cells in self._cells:
            if cells is None:
                continue
            for axis, edges in ((0, cells.x_mm), (1, cells.y_mm)):
                low, high = sorted((segment.begin[axis], segment.end[axis]))
                for edge in edges[1:-1]:
                    value = edge + self._zero[axis]
                    if low < value < high:
                        share = segment.share_at(axis, value)
                        if MIN_SHARE < share < 1.0 - MIN_SHARE:
                            shares.add(share)
        if len(shares) == 2:
            yield segment
            return
        for begin, end in pairwise(sorted(shares)):
            yield segment.part(begin, end)


def _residual(axis: Axis, machine: Machine, play_mm: float | None) -> Residual:
    """Return the residual of an axis with this backlash (None: its own); compensation is in whole
    steps."""
    play = axis.backlash_mm if play_mm is None else play_mm
    added_mm = axis.compensation_mm
    if play_mm is not None and machine.controller.compensates_by_region:
        added_mm = play_mm * axis.coded_step_mm / axis.real_step_mm
    whole_steps_mm = float(to_steps(added_mm, axis.coded_step_mm)) * axis.coded_step_mm
    at_motor = replace(
        axis,
        backlash_mm=play * axis.coded_step_mm / axis.real_step_mm,
        compensation_mm=whole_steps_mm,
    )
    return residual(at_motor, machine.controller)


class MonotoneSegment(Struct, frozen=True):
    """A part of a line or arc on which no axis reverses: from `begin` to `end` mm, straight, or
    about `centre` (x, y) with `sweep_rad`, CCW positive and at most a quarter turn; Z in
    proportion to the length."""

    begin: Point
    end: Point
    centre: tuple[float, float] | None = None
    sweep_rad: float = 0.0

    def at(self, share: float) -> Point:
        """Return the point at this share (0 to 1) of the length; exact at the ends."""
        if share <= 0.0:
            return self.begin
        if share >= 1.0:
            return self.end
        line = [a + share * (b - a) for a, b in zip(self.begin, self.end, strict=True)]
        if self.centre is None:
            return line[0], line[1], line[2]
        (cx, cy), (x, y, _) = self.centre, self.begin
        radius, end_radius = (
            math.hypot(x - cx, y - cy),
            math.hypot(self.end[0] - cx, self.end[1] - cy),
        )
        radius += share * (end_radius - radius)
        angle = math.atan2(y - cy, x - cx) + share * self.sweep_rad
        return cx + radius * math.cos(angle), cy + radius * math.sin(angle), line[2]

    def share_at(self, axis: int, value: float) -> float:
        """Return the share of the length at which an axis that moves has this value; 0 or 1 if the
        value is beyond an end.

        On an arc the angle θ with c + r cos θ (sin θ for Y) = value; of its two solutions the one
        within the sweep."""
        first, last = self.begin[axis], self.end[axis]
        share = min(max((value - first) / (last - first), 0.0), 1.0)
        if self.centre is None or axis == 2 or share in (0.0, 1.0):
            return share
        low, high = 0.0, 1.0  # the axis runs in one direction: bisection cannot fail
        rising = last > first
        while high - low > np.finfo(np.float64).eps:
            share = 0.5 * (low + high)
            if share in (low, high):
                break
            if (self.at(share)[axis] < value) == rising:
                low = share
            else:
                high = share
        return high

    def part(self, low: float, high: float) -> MonotoneSegment:
        """Return the part between two shares of the length."""
        return MonotoneSegment(
            self.at(low), self.at(high), self.centre, (high - low) * self.sweep_rad
        )


def monotone_segments(move: Move, sweep_rad: float) -> Iterator[MonotoneSegment]:
    """Yield the parts of a move in which no axis reverses: a line as a whole, an arc of this
    signed sweep divided where X or Y reverses."""
    if move.kind not in (Kind.ARC_CW, Kind.ARC_CCW) or move.centre is None:
        yield MonotoneSegment(move.start, move.end)
        return
    full_segment = MonotoneSegment(move.start, move.end, move.centre, sweep_rad)
    cx, cy = move.centre
    sign = math.copysign(1.0, sweep_rad)
    # Seen along the arc the turning points are the next multiples of a quarter turn.
    quarter = 0.5 * math.pi
    travel_angle = sign * math.atan2(move.start[1] - cy, move.start[0] - cx)
    turn = (math.floor(travel_angle / quarter) + 1.0) * quarter - travel_angle
    shares = [0.0]
    while turn < abs(sweep_rad) - TURN_EPS_RAD:
        if turn > TURN_EPS_RAD:
            shares.append(turn / abs(sweep_rad))
        turn += quarter
    shares.append(1.0)
    for low, high in pairwise(shares):
        yield full_segment.part(low, high)
