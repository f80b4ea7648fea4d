"""What `rs274` prints, as a path in the frame of the part, and whether a toolpath is that path.

Part zero is the zero of the frame of the first move, as our reader has it; later frames (G55, G92,
G10, a rotation) are placed by what they differ in. Straight moves that go nowhere count for
nothing. An arc in XZ or YZ must be a chain of chords on it, or only end where it does in a frame
that is turned; of a spline rs274 prints nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.rs274 import PRINTED_MM, Call

MM = {"CANON_UNITS_MM": 1.0, "CANON_UNITS_INCHES": 25.4}
AXES = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}
CHORD_MM = 2e-4
MOTIONS = ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED", "NURBS_FEED", "RIGID_TAP")


@dataclass
class Move:
    """One canonical move: what it is, its end in the frame of the part, and of an arc its centre,
    its turns and its plane; `slack`: by how much rs274's printing blurs it; feed mm/min."""

    name: str
    end: np.ndarray
    centre: np.ndarray
    turns: int
    plane: str
    slack: float
    feed: float


class Frames:
    """The frame of the program, and that of its first move."""

    def __init__(self) -> None:
        self.origin, self.shift, self.turn = np.zeros(3), np.zeros(3), 0.0
        self.base: tuple[np.ndarray, np.ndarray, float] | None = None

    def part(self, place: np.ndarray) -> np.ndarray:
        if self.base is None:
            self.base = self.origin.copy(), self.shift.copy(), self.turn
        origin, shift, turn = self.base
        machine = rotated(place + self.shift, self.turn) + self.origin
        return rotated(machine - origin, -turn) - shift


def rotated(place: np.ndarray, degrees: float) -> np.ndarray:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y, z = place
    return np.array([x * c - y * s, x * s + y * c, z])


def canonical(calls: list[Call]) -> list[Move]:
    """The moves of a program, as rs274 prints its calls."""
    frames, mm, plane, feed = Frames(), 1.0, "XY", math.nan
    by_turns = follows = False
    moves: list[Move] = []
    for name, text, values in calls:
        if name == "USE_LENGTH_UNITS":
            feed *= mm / MM[text]
            mm = MM[text]
        elif name == "SET_FEED_RATE":
            feed = values[0]
        elif name == "SET_FEED_MODE":
            by_turns = values[1] == 1
        elif "_SPEED_FEED_SYNC" in name:
            follows = name.startswith("START")
        elif name == "SET_G5X_OFFSET":
            frames.origin = np.array(values[1:4]) * mm
        elif name == "SET_G92_OFFSET":
            frames.shift = np.array(values[:3]) * mm
        elif name == "SET_XY_ROTATION":
            frames.turn = values[0]
        elif name == "SELECT_PLANE":
            plane = text.rsplit("_", 1)[-1]
        elif name in MOTIONS:
            known = math.nan if by_turns or follows else feed * mm
            moves.append(_move(name, values, (mm, plane, known), frames))
    return moves


def _move(name: str, values: list[float], modes: tuple[float, str, float], frames: Frames) -> Move:
    mm, plane, feed = modes
    slack = PRINTED_MM * mm * (1.0 if np.array_equal(frames.origin, np.zeros(3)) else 2.0)
    none = np.full(3, np.nan)
    if name == "NURBS_FEED":
        return Move(name, none, none, 0, plane, slack, feed)
    if name != "ARC_FEED":
        end = frames.part(np.array(values[:3]) * mm)
        return Move(name, end, none, 0, plane, slack, feed)
    axes = AXES[plane]
    if plane != "XY" and frames.turn != (frames.base or (0, 0, frames.turn))[2]:
        plane = "turned"
    end, centre = np.zeros(3), np.zeros(3)
    end[list(axes)] = values[0], values[1], values[5]
    centre[list(axes)] = values[2], values[3], 0.0
    return Move(
        name, frames.part(end * mm), frames.part(centre * mm), int(values[4]), plane, slack, feed
    )


def difference(path: Toolpath, calls: list[Call], *, feeds: bool = True) -> str:
    """Describe the first difference of a toolpath from the calls; "" if there is none."""
    wanted = canonical(calls)
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    rows = np.flatnonzero(path.is_motion | homing)
    walk = _Walk(path, rows.tolist())
    at = np.zeros(3)
    for number, move in enumerate(wanted):
        fault = walk.take(move, at, feeds=feeds)
        if fault:
            return f"move {number} ({move.name} to {move.end.round(4).tolist()}): {fault}"
        at = walk.here
    left = walk.left()
    return f"{left} further rows" if left else ""


class _Walk:
    """The rows of a path, one after the other."""

    def __init__(self, path: Toolpath, rows: list[int]) -> None:
        self.path, self.rows, self.k = path, rows, 0
        self.here = np.zeros(3)

    def left(self) -> int:
        while self.k < len(self.rows) and self._goes_nowhere(self.rows[self.k]):
            self.k += 1
        return len(self.rows) - self.k

    def _goes_nowhere(self, row: int) -> bool:
        straight = self.path.kind[row] not in (Kind.ARC_CW, Kind.ARC_CCW)
        return straight and bool(np.abs(self.path.end[row] - self.here).max() < 1e-9)

    def take(self, move: Move, at: np.ndarray, *, feeds: bool) -> str:
        straight = move.name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED")
        if straight and np.abs(move.end - at).max() <= move.slack:
            if self.k < len(self.rows) and self._goes_nowhere(self.rows[self.k]):
                self.k += 1
            return ""
        while self.k < len(self.rows) and self._goes_nowhere(self.rows[self.k]):
            self.k += 1
        if self.k >= len(self.rows):
            return "no row is left"
        if move.name == "ARC_FEED" and move.plane != "turned":
            return self._arc(move) if move.plane == "XY" else self._chords(move)
        if move.name == "NURBS_FEED" or move.plane == "turned":
            block = self.path.block[self.rows[self.k]]
            while self.k < len(self.rows) and self.path.block[self.rows[self.k]] == block:
                self._next()
            close = math.isnan(move.end[0]) or np.abs(self.here - move.end).max() <= move.slack
            return "" if close else f"ends at {self.here.round(4).tolist()}"
        row = self._next()
        if not self._is(row, move):
            kind = Kind(int(self.path.kind[row])).name
            return f"is {kind} to {self.path.end[row].round(4).tolist()}, row {row}"
        if feeds and move.name == "STRAIGHT_FEED" and not self._fed(row, move):
            return f"its feed is {self.path.feed[row]:g}, not {move.feed:g}"
        if move.name == "RIGID_TAP":
            self._next()
        return ""

    def _fed(self, row: int, move: Move) -> bool:
        if math.isnan(move.feed):  # it follows the spindle
            return True
        return abs(self.path.feed[row] - move.feed) <= 1e-3 * max(move.feed, 1.0)

    def _is(self, row: int, move: Move) -> bool:
        cuts = self.path.kind[row] == Kind.LINE
        close = np.abs(self.path.end[row] - move.end).max() <= move.slack
        return bool(close and cuts == (move.name != "STRAIGHT_TRAVERSE"))

    def _next(self) -> int:
        row = self.rows[self.k]
        self.k += 1
        self.here = self.path.end[row]
        return row

    def _arc(self, move: Move) -> str:
        kind = Kind.ARC_CCW if move.turns > 0 else Kind.ARC_CW
        row = -1
        for _ in range(abs(move.turns)):
            if self.k >= len(self.rows):
                return "a turn is missing"
            row = self._next()
            if self.path.kind[row] != kind:
                return f"row {row} is {Kind(int(self.path.kind[row])).name}"
            far = np.abs(self.path.centre[row] - move.centre[:2]).max()
            if far > move.slack:
                return f"the centre of row {row} lies {far:g} mm off"
        close = np.abs(self.path.end[row] - move.end).max() <= move.slack
        full_and_line = self.k < len(self.rows) and not close
        if full_and_line:
            row = self._next()
            close = np.abs(self.path.end[row] - move.end).max() <= move.slack
        return "" if close else f"ends at {self.path.end[row].round(4).tolist()}"

    def _chords(self, move: Move) -> str:
        """Rows on the arc, up to its end."""
        a, b, n = AXES[move.plane]
        begin = self.here
        radii = [
            math.hypot(each[a] - move.centre[a], each[b] - move.centre[b])
            for each in (begin, move.end)
        ]
        angle = math.atan2(begin[b] - move.centre[b], begin[a] - move.centre[a])
        last = math.atan2(move.end[b] - move.centre[b], move.end[a] - move.centre[a])
        way = 1.0 if move.turns > 0 else -1.0
        own = ((last - angle) * way) % (2.0 * math.pi)
        if own < 1e-4 or own > 2.0 * math.pi - 1e-7:
            own = 2.0 * math.pi
        wanted = own + 2.0 * math.pi * (abs(move.turns) - 1)
        done, before = 0.0, angle
        while self.k < len(self.rows):
            row = self._next()
            end = self.path.end[row]
            r = math.hypot(end[a] - move.centre[a], end[b] - move.centre[b])
            now = math.atan2(end[b] - move.centre[b], end[a] - move.centre[a])
            done += ((now - before) * way) % (2.0 * math.pi)
            before = now
            share = done / wanted
            if abs(r - radii[0] - share * (radii[1] - radii[0])) > CHORD_MM + 2 * move.slack:
                return f"row {row} lies off the arc"
            if abs(end[n] - begin[n] - share * (move.end[n] - begin[n])) > 3 * move.slack + 1e-3:
                return f"row {row} lies off the helix"
            if np.abs(end - move.end).max() <= move.slack and done > wanted - 1e-3:
                return ""
        return "the arc has no end"
