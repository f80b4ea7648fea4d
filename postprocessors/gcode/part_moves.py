"""Moves in the coordinates of a program, in any frame and plane, as rows of a Toolpath in the
frame of the part.

Part zero is the zero of the frame (G54 …, G10, G92, rotation) in which the program makes its first
move; a later frame is placed by what it differs in. Arcs in XZ and YZ become chords."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from msgspec import Struct

from camtool import bounds
from camtool.arrays import Floats
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from .faults import LineFault

Point = tuple[float, float, float]

CHORD_MM: Final = 1e-4
"""Chords stray by no more from an arc in XZ or YZ."""

SAME_MM: Final = 1e-9
"""Places so near are one: units that were changed leave so much."""

_FULL_TURN: Final = 2.0 * math.pi

PLANES: Final = {170: (0, 1, 2), 180: (2, 0, 1), 190: (1, 2, 0)}
"""First axis, second axis and normal of G17, G18 and G19, tenfold."""


class ProgramFrame(Struct, frozen=True):
    """Frame that maps coordinates p of the program to the machine: R(p + shift) + origin, with a
    turn R about Z, mm and degrees."""

    origin: Point = (0.0, 0.0, 0.0)
    rotation: float = 0.0
    shift: Point = (0.0, 0.0, 0.0)


class PartMoves:
    """Takes moves in coordinates of the program, and adds rows to the path."""

    def __init__(
        self, path: ToolpathBuilder, full_turn_rad: float, *, is_lathe: bool = False
    ) -> None:
        """Begin at the path's position. `is_lathe`: the part's X is Z of the program, its Y is X,
        and its Z is Y."""
        self.path = path
        self._is_lathe = is_lathe
        self._flat_plane = 180 if is_lathe else 170
        self.mm = 1.0
        """Length of the program's unit, mm."""
        self.plane = 170
        self.feed = 0.0
        """Of moves that are not rapids, mm/min."""
        self.chords = 0
        """Count of arcs that became chords."""
        self.moved = False
        self._full_turn_rad = full_turn_rad
        self._frame = self._base = ProgramFrame()
        self._turn = (1.0, 0.0)
        self._shift = (0.0, 0.0, 0.0)
        self._same = True

    # Frames

    @property
    def is_part_frame(self) -> bool:
        """True if the coordinates of the program are those of the part: no shift, turn or scale is
        in force."""
        return self._same and not self._is_lathe

    def set_frame(self, frame: ProgramFrame) -> None:
        """Set the frame in which the coordinates that follow are given."""
        self._frame = frame
        if not self.moved:
            self._base = frame
        base = self._base
        self._same = frame == base
        # part = R(−b)(R(a)(p + shift) + origin − origin_b) − shift_b
        x, y = rotate(*frame.shift[:2], frame.rotation)
        x, y = rotate(
            x + frame.origin[0] - base.origin[0],
            y + frame.origin[1] - base.origin[1],
            -base.rotation,
        )
        self._shift = (
            x - base.shift[0],
            y - base.shift[1],
            frame.shift[2] + frame.origin[2] - base.origin[2] - base.shift[2],
        )
        angle = math.radians(frame.rotation - base.rotation)
        self._turn = (math.cos(angle), math.sin(angle)) if angle else (1.0, 0.0)

    def to_part(self, x: float, y: float, z: float) -> Point:
        """Return a place of the program's coordinates in the frame of the part, mm."""
        x, y, z = x * self.mm, y * self.mm, z * self.mm
        if not self._same:
            (cos, sin), (dx, dy, dz) = self._turn, self._shift
            if sin:
                x, y = x * cos - y * sin, x * sin + y * cos
            x, y, z = x + dx, y + dy, z + dz
        return (z, x, y) if self._is_lathe else (x, y, z)

    def snap(self, place: Point) -> Point:
        """Return the point, with coordinates that differ from the tool's only by rounding replaced
        by the tool's."""
        position = self.path.position
        if position == place:
            return position
        x, y, z = (
            old if abs(new - old) <= SAME_MM else new
            for old, new in zip(position, place, strict=True)
        )
        return x, y, z

    # Moves

    def rapid(self, x: float, y: float, z: float) -> None:
        """Add a rapid to a place in the program's coordinates."""
        self.moved = True
        self.path.rapid(*self.snap(self.to_part(x, y, z)))

    def line(self, x: float, y: float, z: float) -> None:
        """Add a straight cut at the feed to a place in the program's coordinates."""
        self.moved = True
        self.path.line(*self.snap(self.to_part(x, y, z)), feed=self.feed)

    def arc(self, end: list[float], centre: tuple[float, float], turn: int) -> None:
        """Add an arc of |turn| turns (the last may be incomplete), counter-clockwise where `turn`
        is above 0. Its end and centre are (first, second, normal) and (first, second) of the
        plane."""
        self.moved = True
        if len(self.path) + abs(turn) > bounds.MAX_MOVES:
            raise LineFault(too_many("the turns of this arc"), "p", bounds.SPLIT_PROGRAM)
        if self.plane == self._flat_plane:
            axes = PLANES[self.plane]
            places = []
            for flat in (end, (*centre, 0.0)):
                place = [0.0, 0.0, 0.0]
                for axis, value in zip(axes, flat, strict=True):
                    place[axis] = value
                places.append(self.to_part(*place))
            self._flat_arc(places[0], places[1][:2], turn)
        else:
            self._chords(end, centre, turn)

    def _flat_arc(self, end: Point, middle: tuple[float, float], turn: int) -> None:
        """Add an arc in the part's XY, whole turns first, each with its share of the height. An
        arc so short that the controller executes it as a full circle becomes a full circle, and a
        line to its end."""
        path = self.path
        x, y, z = path.position
        target = self.snap(end)
        own_turn = turn_of((x, y), target[:2], middle)
        same_ends = (x, y) == target[:2]
        ccw = turn > 0
        is_full_turn = same_ends or abs(own_turn) <= self._full_turn_rad
        sweep = (
            _FULL_TURN
            if is_full_turn
            else math.fmod((own_turn if ccw else -own_turn) + _FULL_TURN, _FULL_TURN)
        )
        turns = abs(turn)
        rise = (target[2] - z) / (_FULL_TURN * (turns - 1) + sweep)
        if turns > 1:
            heights = np.arange(1.0, turns) * (rise * _FULL_TURN)
            self._whole_turns((x, y, z), middle, ccw, heights)
        ends = (x, y) if is_full_turn else target[:2]
        path.arc(*ends, target[2], centre=middle, ccw=ccw, feed=self.feed)
        if is_full_turn and not same_ends:
            path.line(*target[:2], feed=self.feed)

    def _whole_turns(
        self, start: Point, centre: tuple[float, float], ccw: bool, rise: Floats
    ) -> None:
        """Add full circles that begin at a point and end at these heights (K,) above it."""
        count = len(rise)
        end = np.empty((count, 3))
        end[:, :2], end[:, 2] = start[:2], start[2] + rise
        self.path.moves(
            kind=np.full(count, int(Kind.ARC_CCW if ccw else Kind.ARC_CW)),
            end=end,
            centre=np.broadcast_to(centre, (count, 2)),
            feed=np.full(count, self.feed),
        )

    def _chords(self, end: list[float], centre: tuple[float, float], turn: int) -> None:
        """Add an arc in XZ or YZ as chords; its start and end may have different radii."""
        self.chords += 1
        axes = PLANES[self.plane]
        start = self._program(self.path.position)
        begin = [start[axis] for axis in axes]
        start_arm = (begin[0] - centre[0], begin[1] - centre[1])
        end_arm = (end[0] - centre[0], end[1] - centre[1])
        alpha, beta = math.atan2(start_arm[1], start_arm[0]), math.atan2(end_arm[1], end_arm[0])
        if turn > 0:
            sweep = math.fmod(beta - alpha + 2.0 * _FULL_TURN, _FULL_TURN)
        else:
            sweep = -math.fmod(alpha - beta + 2.0 * _FULL_TURN, _FULL_TURN)
        if abs(sweep) <= self._full_turn_rad:
            sweep = math.copysign(_FULL_TURN, turn)
        sweep += math.copysign(_FULL_TURN * (abs(turn) - 1), turn)
        radii = math.hypot(*start_arm), math.hypot(*end_arm)
        largest = max(radii) * self.mm
        chord = 4.0 * math.asin(math.sqrt(min(CHORD_MM / (2.0 * largest), 0.5)))
        count = max(math.ceil(abs(sweep) / chord), 1)
        if len(self.path) + count > bounds.MAX_MOVES:
            raise LineFault(too_many("the chords of this arc"), "p", bounds.SPLIT_PROGRAM)
        share = np.arange(1, count + 1) / count
        radius = radii[0] + share * (radii[1] - radii[0])
        angle = alpha + share * sweep
        points = np.empty((count, 3))
        points[:, axes[0]] = centre[0] + radius * np.cos(angle)
        points[:, axes[1]] = centre[1] + radius * np.sin(angle)
        points[:, axes[2]] = begin[2] + share * (end[2] - begin[2])
        points[-1, list(axes)] = end
        part_points = np.column_stack(self.to_part(*points.T))
        self.path.moves(
            kind=np.full(count, int(Kind.LINE)),
            end=part_points,
            centre=np.full((count, 2), np.nan),
            feed=np.full(count, self.feed),
        )

    def _program(self, place: Point) -> Point:
        """Return a place of the part's frame in the coordinates of the program."""
        x, y, z = (place[1], place[2], place[0]) if self._is_lathe else place
        if not self._same:
            (cos, sin), (dx, dy, dz) = self._turn, self._shift
            x, y, z = x - dx, y - dy, z - dz
            x, y = x * cos + y * sin, y * cos - x * sin
        return x / self.mm, y / self.mm, z / self.mm


def rotate(x: float, y: float, degrees: float) -> tuple[float, float]:
    """Rotate a point about zero."""
    if degrees == 0.0:
        return x, y
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return x * cos - y * sin, x * sin + y * cos


def turn_of(
    start: tuple[float, float], end: tuple[float, float], centre: tuple[float, float]
) -> float:
    """Return the signed angle from start to end about the centre, rad in (−π, π]; near 0 for the
    shortest arcs and for those of almost a full turn."""
    ox, oy = start[0] - centre[0], start[1] - centre[1]
    ex, ey = end[0] - centre[0], end[1] - centre[1]
    return math.atan2(ox * ey - oy * ex, ox * ex + oy * ey)


def too_many(subject: str) -> str:
    """Return the message for a program with too many moves."""
    return f"with {subject} the program has more than {bounds.MAX_MOVES} moves"
