"""Cutter compensation (G41, G42): the path of the cutter's centre beside the programmed path.

The end of a move is known only with the next one, so that one move waits (`Canon.wait`). At a
corner that turns away from the cutter an arc about the corner joins the two moves, as exact as the
program; at one that turns towards it the waiting move ends where both offsets meet
(interp_convert.cc, interp_queue.cc). All points are (first, second, normal) of the plane: XY, ZX.
"""

from __future__ import annotations

import math
from typing import Final

from msgspec import Struct

from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from .canon import Canon, Queued

CORNER_RAD: Final = 0.05
"""A corner that turns by less is met without an arc (TOLERANCE_CONCAVE_CORNER)."""

SPREAD: Final = 0.01
"""Largest difference of the radii of an arc that compensation has shortened, in the program's
units."""

LONGER_MM: Final = 0.0254
"""An arc may become longer by this much turn before the corner counts as unreachable; 0.001 in
inches."""

LEFT, RIGHT = 1, -1

_HALF: Final = 0.5 * math.pi
_GOUGES: Final = "the tool does not reach a corner without cutting into the part beside it"

Flat = tuple[float, float]


class ProgrammedArc(Struct):
    """An arc as programmed: end, centre, and number of turns begun, above 0 counter-clockwise."""

    end: list[float]
    centre: Flat
    turn: int


class Compensation:
    """State of cutter compensation: the side, the radius, and the end of the last move."""

    def __init__(self, canon: Canon) -> None:
        self.side = 0
        self.radius = 0.0
        self.first = True
        """True if the next move is the first one beside the path."""
        self.programmed = [0.0, 0.0, 0.0]
        self._canon = canon
        self._from: Flat | None = None
        """Start of the waiting move."""

    @property
    def active(self) -> bool:
        """True if moves are offset."""
        return self.side != 0 and self.radius > 0.0

    def scale(self, factor: float) -> None:
        """Multiply the radius, the places and the queued moves by `factor`, after a change of the
        unit of length."""
        self.radius *= factor
        self.programmed = [value * factor for value in self.programmed]
        if self._from is not None:
            self._from = self._from[0] * factor, self._from[1] * factor
        for move in self._canon.queue:
            if isinstance(move, Queued):
                move.end = [value * factor for value in move.end]
                move.centre = move.centre[0] * factor, move.centre[1] * factor

    def switch_off(self, centre: list[float]) -> bool:
        """Execute G40: the last queued move ends beside its programmed end. Return True if the
        cutter was beside the path."""
        was_beside = self.active and not self.first
        if was_beside:
            self._end_at(centre[0], centre[1])
        self.side, self.first = 0, True
        return was_beside

    def settle(self, centre: list[float]) -> None:
        """End the queued moves where the cutter's centre is, since the machine stops here."""
        self._end_at(centre[0], centre[1])

    # Moves; each returns where the cutter's centre ends

    def line(self, kind: Kind, target: list[float], centre: list[float]) -> list[float]:
        """Queue a straight move to a programmed point, from `centre`, where the cutter's centre
        is; return where that ends."""
        return (self._entry_line if self.first else self._line)(kind, target, centre)

    def _entry_line(self, kind: Kind, target: list[float], centre: list[float]) -> list[float]:
        direction = target[0] - centre[0], target[1] - centre[1]
        if math.hypot(*direction) <= self.radius:
            raise LineFault(
                "the move onto the compensated path is no longer than the tool's radius"
            )
        normal = math.atan2(direction[1], direction[0]) + self.side * _HALF
        unit = math.cos(normal), math.sin(normal)
        end = [target[0] + self.radius * unit[0], target[1] + self.radius * unit[1], target[2]]
        self._from = centre[0], centre[1]
        self._canon.wait(Queued(kind, end, direction=unit))
        self.first, self.programmed = False, list(target)
        return list(end)

    def _line(self, kind: Kind, target: list[float], centre: list[float]) -> list[float]:
        op, radius, side = self.programmed, self.radius, self.side
        direction = target[0] - op[0], target[1] - op[1]
        if direction == (0.0, 0.0):
            end = [centre[0], centre[1], target[2]]
            self._canon.wait(Queued(kind, list(end), direction=direction))
            self.programmed = list(target)
            return end
        theta, alpha = (
            math.atan2(centre[1] - op[1], centre[0] - op[0]),
            math.atan2(direction[1], direction[0]),
        )
        swing = (theta - alpha) * side
        beta = (swing + 2.0 * math.pi if swing < 0.0 else swing) - _HALF
        normal = alpha + side * _HALF
        end = [
            target[0] + radius * math.cos(normal),
            target[1] + radius * math.sin(normal),
            target[2],
        ]
        before = self._waiting()
        concave = beta < -CORNER_RAD or beta > math.pi + CORNER_RAD
        if before is not None and before.turn * side < 0 and beta > math.pi - CORNER_RAD:
            concave = True
        if concave and before is not None and before.turn:
            self._end_at(*self._arc_then_line(before, direction))
        elif concave:
            half = (beta + math.pi) / 2.0
            if half == 0.0:
                raise LineFault("a corner inside of which the path turns straight back")
            setback = radius / math.tan(half)
            angle = theta + side * _HALF
            self._end_at(
                centre[0] + setback * math.cos(angle), centre[1] + setback * math.sin(angle)
            )
        elif beta > CORNER_RAD:
            self._round(kind, (op[0], op[1]), normal, centre)
        else:
            self._canon.flush()
            self._from = centre[0], centre[1]
        self._canon.wait(Queued(kind, list(end), direction=direction))
        self.programmed = list(target)
        return end

    def _round(self, kind: Kind, corner: Flat, angle: float, centre: list[float]) -> None:
        """Go round a corner, by an arc (a line for a rapid) about it, to where the next move
        begins."""
        x = corner[0] + self.radius * math.cos(angle)
        y = corner[1] + self.radius * math.sin(angle)
        self._end_at(centre[0], centre[1])
        if kind == Kind.RAPID:
            self._canon.wait(Queued(kind, [x, y, centre[2]]))
        else:
            self._canon.wait(Queued(Kind.ARC_CW, [x, y, centre[2]], corner, -self.side))
        self._canon.flush()
        self._from = x, y

    def _arc_then_line(self, arc: Queued, direction: Flat) -> Flat:
        """Return where the offset of an arc meets the offset of the line that follows it.

        With the arc's centre c, the offset line has the distance d2 from c along its normal theta;
        the offset arc has the radius `old`: they meet at an angle acos(d2 / old) from the normal.
        """
        op, (cx, cy) = self.programmed, arc.centre
        old = math.hypot(cy - arc.end[1], cx - arc.end[0])
        theta = math.atan2(direction[1], direction[0]) + (_HALF if arc.turn > 0 else -_HALF)
        phi = math.atan2(cy - op[1], cx - op[0])
        inside = arc.turn * self.side > 0
        offset_radius = old + self.radius if inside else old - self.radius
        d = offset_radius * math.cos(theta - phi)
        part = (d - self.radius if inside else d + self.radius) / old if old else 2.0
        if not -1.0 <= part <= 1.0:
            raise LineFault(_GOUGES)
        half_angle = math.acos(part)
        angle = theta + math.pi + (-half_angle if (arc.turn > 0) == inside else half_angle)
        return cx + old * math.cos(angle), cy + old * math.sin(angle)

    def arc(self, arc: ProgrammedArc, centre: list[float], spread: float) -> list[float]:
        """Queue an arc from `centre`, where the cutter's centre is; return where that ends."""
        return self._entry_arc(arc, centre, spread) if self.first else self._arc(arc, centre)

    def _entry_arc(self, arc: ProgrammedArc, centre: list[float], spread: float) -> list[float]:
        """Queue the arc that leads onto the compensated path, and ends beside the programmed end;
        return where it ends."""
        if math.hypot(arc.end[0] - centre[0], arc.end[1] - centre[1]) <= self.radius:
            raise LineFault(
                "the arc onto the compensated path is no larger than the tool's radius"
            )
        inside = arc.turn * self.side > 0
        sign = 1.0 if inside else -1.0
        tangent = sign * (arc.centre[1] - arc.end[1]), sign * (arc.centre[0] - arc.end[0])
        gamma = math.atan2(*tangent)
        self.first, self.programmed = False, list(arc.end)
        x = arc.end[0] + self.radius * math.cos(gamma)
        y = arc.end[1] + self.radius * math.sin(gamma)
        to_centre = math.atan2(arc.centre[1] - y, arc.centre[0] - x)
        angle = math.atan2(centre[1] - y, centre[0] - x) - to_centre
        if abs(math.cos(angle)) < 1e-4:
            raise LineFault("the arc onto the compensated path is smaller than the tool")
        reach = math.hypot(centre[1] - y, centre[0] - x) / 2.0 / math.cos(angle)
        cx, cy = x + reach * math.cos(to_centre), y + reach * math.sin(to_centre)
        if abs(math.hypot(cx - x, cy - y) - math.hypot(cx - centre[0], cy - centre[1])) > spread:
            raise LineFault("no arc leads onto the compensated path here")
        self._canon.flush()
        end = [x, y, arc.end[2]]
        sweep = sweep_of((centre[0], centre[1]), (cx, cy), arc.turn, (x, y))
        self._canon.wait(Queued(Kind.ARC_CW, list(end), (cx, cy), arc.turn, sweep=sweep))
        return end

    def _arc(self, arc: ProgrammedArc, centre: list[float]) -> list[float]:
        op, radius, side, (cx, cy) = self.programmed, self.radius, self.side, arc.centre
        offset_radius = math.hypot(cx - arc.end[0], cy - arc.end[1])
        inside = arc.turn * side > 0
        theta = math.atan2(centre[1] - op[1], centre[0] - op[0]) - side * _HALF
        delta = math.atan2(cy - op[1], cx - op[0])
        alpha = delta - _HALF if arc.turn > 0 else delta + _HALF
        beta = (theta - alpha) * side
        if beta > 1.5 * math.pi:
            beta -= 2.0 * math.pi
        elif beta < -_HALF:
            beta += 2.0 * math.pi
        if inside and offset_radius <= radius:
            raise LineFault("an arc whose radius is no larger than the tool's")
        sign = 1.0 if inside else -1.0
        gamma = math.atan2(sign * (cy - arc.end[1]), sign * (cx - arc.end[0]))
        end = [
            arc.end[0] + radius * math.cos(gamma),
            arc.end[1] + radius * math.sin(gamma),
            arc.end[2],
        ]
        before = self._waiting()
        flat = abs(beta - math.pi) < CORNER_RAD
        if beta < -CORNER_RAD or beta > math.pi + CORNER_RAD or (flat and not inside):
            new = offset_radius - radius if inside else offset_radius + radius
            if before is not None and before.turn:
                meeting = self._arc_then_arc(before, arc, new)
            else:
                meeting = self._line_then_arc(
                    arc, theta, offset_radius * math.sin(beta - _HALF), new
                )
            self._end_at(*meeting)
        elif beta > CORNER_RAD:
            self._canon.flush()
            angle = delta if inside else delta + math.pi
            x, y = op[0] + radius * math.cos(angle), op[1] + radius * math.sin(angle)
            self._canon.wait(Queued(Kind.ARC_CW, [x, y, centre[2]], (op[0], op[1]), -side))
            self._canon.flush()
            self._from = x, y
        else:
            self._canon.flush()
            self._from = centre[0], centre[1]
        sweep = sweep_of((op[0], op[1]), arc.centre, arc.turn, (arc.end[0], arc.end[1]))
        self._canon.wait(Queued(Kind.ARC_CW, list(end), arc.centre, arc.turn, sweep=sweep))
        self.programmed = list(arc.end)
        return end

    def _line_then_arc(self, arc: ProgrammedArc, theta: float, across: float, new: float) -> Flat:
        """Return where the offset of a line meets the offset, of radius `new`, of the arc that
        follows it."""
        inside = arc.turn * self.side > 0
        part = (across + self.radius if inside else across - self.radius) / new if new else 2.0
        if not -1.0 <= part <= 1.0:
            raise LineFault(_GOUGES)
        half_angle = math.asin(part)
        angle = theta + (0.0 if inside else math.pi)
        angle += half_angle if (arc.turn > 0) == inside else -half_angle
        return arc.centre[0] + new * math.cos(angle), arc.centre[1] + new * math.sin(angle)

    def _arc_then_arc(self, before: Queued, arc: ProgrammedArc, new: float) -> Flat:
        """Return where two offset arcs meet, from the triangle of both radii and the distance of
        the centres."""
        (px, py), (cx, cy) = before.centre, arc.centre
        old = math.hypot(py - before.end[1], px - before.end[0])
        centre_distance = math.hypot(py - cy, px - cx)
        if old == 0.0 or centre_distance == 0.0:
            raise LineFault("two arcs about one centre cannot be compensated")
        part = (old * old + centre_distance * centre_distance - new * new) / (
            2.0 * old * centre_distance
        )
        if not -1.0 <= part <= 1.0:
            raise LineFault(_GOUGES)
        inside = before.turn * self.side > 0
        angle_back = math.acos(part)
        angle = math.atan2(cy - py, cx - px)
        angle += angle_back if (arc.turn > 0) == inside else -angle_back
        return px + old * math.cos(angle), py + old * math.sin(angle)

    # The waiting move

    def _waiting(self) -> Queued | None:
        queue = self._canon.queue
        return queue[0] if queue and isinstance(queue[0], Queued) else None

    def _end_at(self, x: float, y: float) -> None:
        """End the queued moves at a point and add them to the path; LineFault where one of them
        would have to turn round for that."""
        moves = [move for move in self._canon.queue if isinstance(move, Queued)]
        if not moves:
            self._canon.flush()
            return
        for move in moves:
            self._cut(move, x, y)
        self._canon.flush()
        self._from = x, y

    def _cut(self, move: Queued, x: float, y: float) -> None:
        start = self._from
        if not move.turn:
            if start is not None:
                step = x - start[0], y - start[1]
                if step[0] * move.direction[0] + step[1] * move.direction[1] < 0.0:
                    raise LineFault(_GOUGES)
            move.end[:2] = x, y
            return
        cx, cy = move.centre
        before, after = math.hypot(move.end[0] - cx, move.end[1] - cy), math.hypot(x - cx, y - cy)
        move.end[:2] = x, y
        if abs(before - after) > SPREAD:
            raise LineFault("compensation makes an arc of two radii here")
        if move.sweep and start is not None:
            longer = LONGER_MM if self._canon.mm == 1.0 else LONGER_MM / 25.4
            if abs(sweep_of(start, move.centre, move.turn, (x, y))) > abs(move.sweep) + longer:
                raise LineFault(_GOUGES)


def sweep_of(start: Flat, centre: Flat, turn: int, end: Flat) -> float:
    """Return the signed sweep of an arc, rad, with its full turns; positive is
    counter-clockwise."""
    alpha = math.atan2(start[1] - centre[1], start[0] - centre[0])
    beta = math.atan2(end[1] - centre[1], end[0] - centre[0])
    if turn > 0:
        beta += 2.0 * math.pi if beta <= alpha else 0.0
        return beta - alpha + (turn - 1) * 2.0 * math.pi
    alpha += 2.0 * math.pi if alpha <= beta else 0.0
    return beta - alpha + (turn + 1) * 2.0 * math.pi
