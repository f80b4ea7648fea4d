"""The i8751 controller, step by step: every place that its motors stand at.

Both motors step together as often as the one with fewer steps, then the other one goes on alone;
Z follows (thesis lines L4683-4742, L4204-4222).
"""

from __future__ import annotations

import math


def walk(x_steps: int, y_steps: int) -> list[tuple[int, int]]:
    """The places after each pulse of one record, from (0, 0)."""
    x, y = 0, 0
    places = []
    x_left, y_left = abs(x_steps), abs(y_steps)
    while x_left or y_left:
        both = x_left and y_left
        if x_left and (both or not y_left):
            x += 1 if x_steps > 0 else -1
            x_left -= 1
        if y_left and (both or not x_left):
            y += 1 if y_steps > 0 else -1
            y_left -= 1
        places.append((x, y))
    return places


def farthest(
    places: list[tuple[int, int]], end: tuple[int, int], step_mm: tuple[float, float]
) -> float:
    """mm: the greatest distance of the places from the segment (0, 0)-`end` (steps)."""
    ex, ey = end[0] * step_mm[0], end[1] * step_mm[1]
    worst = 0.0
    for px, py in places:
        x, y = px * step_mm[0], py * step_mm[1]
        along = (x * ex + y * ey) / (ex * ex + ey * ey)
        along = min(1.0, max(0.0, along))
        worst = max(worst, math.hypot(x - along * ex, y - along * ey))
    return worst
