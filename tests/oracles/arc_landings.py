"""Where an arc block of pic-mmh may end, searched literally: along the whole paths of the plain
interpolator, position by position. Nothing here is shared with the post-processor.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from tests.oracles.controllers import Point, direct_search

APART = 16


@dataclass(frozen=True)
class Form:
    """Units to a step, the most units that can be written, and how far a line may stray, steps."""

    units_per_step: float
    most_units: int
    sagitta: float

    def represents(self, steps: int) -> bool:
        """True if a whole unit of the dialect represents this step."""
        units = round(abs(steps) * self.units_per_step)
        back = math.floor(units / self.units_per_step + 0.5)
        return back == abs(steps) and units <= self.most_units


@dataclass(frozen=True)
class Arc:
    """In steps about its centre, which lies at `centre`; `sweep_rad` > 0."""

    start: Point
    end: Point
    centre: Point
    clockwise: bool
    sweep_rad: float

    @property
    def paths(self) -> list[list[Point]]:
        """The positions after iterations 1, 2, …, of each D that the controller may start with."""
        x, y = self.start
        rounded = x * x + y * y - round(math.hypot(x, y)) ** 2
        count = int(1.2 * math.hypot(x, y) * self.sweep_rad) + 40
        return [
            list(itertools.islice(direct_search(x, y, self.clockwise, error), count))
            for error in ((0, rounded) if rounded else (0,))
        ]


def landing(arc: Arc, form: Form) -> tuple[Point, int] | None:
    """The step at which the block ends, and its iteration."""
    paths = arc.paths
    path, radius = paths[0], math.hypot(*arc.start)
    length = radius * arc.sweep_rad
    low, high = max(1, math.floor(0.6 * length) - 4), math.ceil(1.1 * length) + 4
    first_of = [first_times(each) for each in paths]
    met = first_of[0].get(arc.end, 0)
    if low <= met <= high and stops(arc.end, met, first_of):
        return arc.end, met
    with_start = [arc.start, *path]
    near = min(range(low, high + 1), key=lambda k: (square(with_start[k], arc.end), k))
    first = max(0, near - max(1, math.floor(math.sqrt(4.0 * radius * form.sagitta))))

    def fits(k: int) -> bool:
        """True if the arc may end after iteration k."""
        written = (form.represents(p + c) for p, c in zip(path[k - 1], arc.centre, strict=True))
        return all(written) and stops(path[k - 1], k, first_of)

    onward = {k for k in range(first + 1, near + 1) if goes_on(arc, path[first:k])}
    for k in range(near, first, -1):
        if k in onward and fits(k):
            return path[k - 1], k
    if first == 0:
        return None
    others = [k for k in range(near, first, -1) if k not in onward and fits(k)]
    if others:
        best = min(others, key=lambda k: (square(path[k - 1], arc.end), -k))
        return path[best - 1], best
    return next(((path[k - 1], k) for k in range(first, 0, -1) if fits(k)), None)


def first_times(path: list[Point]) -> dict[Point, int]:
    """The first iteration after which the path stands at each of its positions."""
    found: dict[Point, int] = {}
    for k, point in enumerate(path, 1):
        found.setdefault(point, k)
    return found


def stops(at: Point, iteration: int, first_of: list[dict[Point, int]]) -> bool:
    """True if the controller stops at this step at this iteration, and for every D at about this
    one."""
    return first_of[0][at] == iteration and all(
        abs(each.get(at, -APART) - iteration) <= APART for each in first_of
    )


def goes_on(arc: Arc, path: list[Point]) -> bool:
    """True if the line from the last step of a piece of path to the arc's end reverses no axis."""
    turn = 1 if arc.clockwise else -1
    x, y = path[0]
    heading = [turn * y, -turn * x]
    for before, after in itertools.pairwise(path):
        for axis in (0, 1):
            heading[axis] = (after[axis] - before[axis]) or heading[axis]
    return all((arc.end[k] - path[-1][k]) * heading[k] >= 0 for k in (0, 1))


def square(a: Point, b: Point) -> int:
    """Their squared distance."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2
