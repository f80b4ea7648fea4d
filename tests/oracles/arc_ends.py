"""Where an arc of the PIC18F8720 stops by each reading of the thesis, literally: step by step,
quadrants by the signs of both coordinates. Nothing is shared with `camtool.kernels`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import islice

from tests.oracles.controllers import Point, direct_search

READINGS = ("equal", "final-quadrant", "nearest")


@dataclass(frozen=True)
class Stop:
    """After how many iterations, where (about the centre), and whether it is the arc's own end."""

    samples: int
    at: Point
    met: bool


def corner(x: int, y: int, clockwise: bool) -> int:
    """Return the quadrant of the motion, 0 to 3 in the order of passage; a point on an axis
    belongs to the quadrant that the motion enters."""
    if not clockwise:
        x = -x  # seen in a mirror it runs clockwise
    if y > 0 and x >= 0:
        return 0
    if x > 0:
        return 1
    if y < 0:
        return 2
    return 3


def quarters(start: Point, end: Point, clockwise: bool) -> int:
    """Count the quadrants that the sweep from start to end enters, 4 for a whole turn."""
    entered = (corner(*end, clockwise) - corner(*start, clockwise)) % 4
    cross = start[0] * end[1] - start[1] * end[0]
    return 4 if entered == 0 and (-cross if clockwise else cross) <= 0 else entered


@lru_cache(maxsize=2)
def walked(start: Point, clockwise: bool, error: int) -> list[tuple[Point, int]]:
    """The positions after each iteration, for a turn and a half and more, each with how many
    quarters the path has entered by then."""
    limit = 12 * (max(map(abs, start)) + 2)
    entered, before, found = 0, start, []
    for point in islice(direct_search(*start, clockwise, error), limit):
        entered += sum(now == 0 and then != 0 for now, then in zip(point, before, strict=True))
        before = point
        found.append((point, entered))
    return found


def stop(start: Point, end: Point, clockwise: bool, error: int, reading: str) -> Stop:
    """Run an arc about (0, 0) with D = `error` at the start, and return where it stops."""
    wanted = quarters(start, end, clockwise)
    path = walked(start, clockwise, error)
    if reading == "equal":
        for at, (point, behind) in enumerate(path):
            if point == end and behind <= wanted + 1:
                return Stop(at + 1, end, True)
    if reading == "final-quadrant":
        signs = {0: (1, -1), 1: (-1, -1), 2: (-1, 1), 3: (1, 1)}[corner(*end, clockwise)]
        way = (signs[0] if clockwise else -signs[0]), signs[1]
        for at, (point, behind) in enumerate(path):
            done = all(w * (p - e) >= 0 for w, p, e in zip(way, point, end, strict=True))
            if behind > wanted or (behind == wanted and done):
                return Stop(at + 1, point, point == end)
    steps = [(0, start, 0)] + [(n + 1, *each) for n, each in enumerate(path)]
    near = [each for each in steps if wanted - 1 <= each[2] <= wanted + 1]
    samples, at_point, _ = min(
        near, key=lambda s: ((s[1][0] - end[0]) ** 2 + (s[1][1] - end[1]) ** 2, s[0])
    )
    return Stop(samples, at_point, reading == "nearest" and at_point == end)
