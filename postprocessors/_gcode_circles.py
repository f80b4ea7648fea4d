"""Geometry of arcs as their readers need it: centre from radius, and turn."""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.toolpath.builder import ToolpathBuilder

Point = tuple[float, float]

_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Circle:
    """An arc from `start` to `end` about `centre`, mm."""

    start: Point
    end: Point
    centre: Point
    ccw: bool


def centre_of_radius(
    start: Point, end: Point, radius: float, ccw: bool, slack_mm: float
) -> Point | str:
    """The centre of an arc given by its radius, or why there is none.

    With m the middle of the chord of length d, the centre lies √(R² − d²/4) beside it: on the left
    of the way for a CCW arc of at most half a turn; a negative R asks for more than half a turn,
    whose centre is on the other side. Half the chord may exceed |R| by the slack.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(dx, dy)
    if chord == 0.0:
        return "an arc by its radius that ends where it starts has no centre"
    if chord / 2.0 - abs(radius) > slack_mm:
        return f"half the chord is {chord / 2.0:.4f} mm, more than the radius"
    aside = math.sqrt(max(0.0, radius * radius - chord * chord / 4.0))
    left = aside if ccw == (radius > 0.0) else -aside
    return (
        (start[0] + end[0]) / 2.0 - left * dy / chord,
        (start[1] + end[1]) / 2.0 + left * dx / chord,
    )


def turn_of(circle: Circle) -> float:
    """How far the arc turns, rad, in (−π, π]: near 0 for the shortest and for the longest."""
    ox, oy = circle.start[0] - circle.centre[0], circle.start[1] - circle.centre[1]
    ex, ey = circle.end[0] - circle.centre[0], circle.end[1] - circle.centre[1]
    return math.atan2(ox * ey - oy * ex, ox * ex + oy * ey)


@dataclass(frozen=True)
class Way:
    """How an arc is run: mm/min; the turn (rad) below which the controller takes it for a full
    circle; and how many turns it begins."""

    feed: float
    full_turn_rad: float
    turns: int = 1


def follow(path: ToolpathBuilder, circle: Circle, to_z: float, way: Way) -> None:
    """The rows of an arc read at the path's position, a helix where it rises or sinks.

    Whole turns come first, each with its share of the height. An arc so short that the controller
    takes it for a full circle is one, and a line to its end.
    """
    same = circle.start == circle.end
    turn = turn_of(circle)
    full = same or abs(turn) <= way.full_turn_rad
    sweep = _TURN if full else math.fmod((turn if circle.ccw else -turn) + _TURN, _TURN)
    z = path.position[2]
    rise = (to_z - z) / (_TURN * (way.turns - 1) + sweep)
    for done in range(1, way.turns):
        height = z + rise * _TURN * done
        path.arc(*circle.start, height, centre=circle.centre, ccw=circle.ccw, feed=way.feed)
    end = circle.start if full else circle.end
    path.arc(*end, to_z, centre=circle.centre, ccw=circle.ccw, feed=way.feed)
    if full and not same:
        path.line(*circle.end, feed=way.feed)
