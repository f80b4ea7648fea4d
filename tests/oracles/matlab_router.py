"""The Matlab router's own arithmetic, number by number: how the GUI makes speeds of points, and
how two axes that start together run one line."""

import math
from itertools import pairwise


def half_away(value: float) -> int:
    """Matlab's round."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def gui_arrays(
    points: list[tuple[int, int]], top: int = 480
) -> tuple[list[list[int]], list[list[int]]]:
    """(lxy, velxy), two rows each, of points in 0.1 mm."""
    lxy: list[list[int]] = [[], []]
    velxy: list[list[int]] = [[], []]
    for (x0, y0), (x1, y1) in pairwise(points):
        dx, dy = x1 - x0, y1 - y0
        vx = vy = float(top)
        if abs(dx) > abs(dy):
            vy = top / (abs(dx) / abs(dy)) if dy else 0.0
        elif abs(dy) > abs(dx):
            vx = top / (abs(dy) / abs(dx)) if dx else 0.0
        for axis, (way, speed) in enumerate(((dx, vx), (dy, vy))):
            lxy[axis].append(abs(way))
            velxy[axis].append(half_away(-speed if way < 0 else speed))
    return lxy, velxy


def run_line(
    distance: tuple[int, int], speed: tuple[int, int], ticks: int
) -> list[tuple[float, float]]:
    """Places (units) at `ticks` + 1 equal times of a line whose axes each run until they are
    there: speeds are any whole numbers above 0 where there is a distance."""
    needed = [d / v for d, v in zip(distance, speed, strict=True) if d]
    last = max(needed)
    return [
        (
            min(distance[0], speed[0] * last * tick / ticks),
            min(distance[1], speed[1] * last * tick / ticks),
        )
        for tick in range(ticks + 1)
    ]


def off_line(distance: tuple[int, int], place: tuple[float, float]) -> float:
    """Distance of a place from the straight line to `distance`."""
    cross = distance[0] * place[1] - distance[1] * place[0]
    return abs(cross) / math.hypot(*distance)
