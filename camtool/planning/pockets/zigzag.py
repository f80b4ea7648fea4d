"""Zig-zag ways of a pocket: straight strokes at an angle, to and fro, and rings round the walls.

The region of the tool's middle is shrunk by a margin m and cut by parallel lines, h apart. Their
pieces within it are the strokes; then the boundary of the whole region is followed, which takes
the margin off the walls. Nothing is left over when  h/2 + m ≤ r,  the tool's radius: the line
nearest to a place of the shrunk region is no farther than h/2, and if the way straight to it
leaves the shrunk region, that is within h/2, and so the wall's ring within h/2 + m. Every other
place is within m of that ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import extents, point_at
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Floats, Ints, Polylines, Segments, rotated
from camtool.planning.pockets.clip import scanned
from camtool.planning.pockets.parts import parts_of
from camtool.planning.pockets.route import Rails
from camtool.planning.pockets.way import Way

MOST_MARGIN = 0.5
"""The most that is left for the ring round the walls, over the tool's radius."""


@dataclass(frozen=True)
class Scan:
    """Distance of the strokes and radius of the tool, mm, and the angle of the strokes; whether
    the rings run as they are oriented (the region on their left) or the other way."""

    step_mm: float
    radius_mm: float
    angle_rad: float
    forward: bool = True


@dataclass(frozen=True, eq=False)
class Strokes:
    """J pieces of the lines: `row` (J,) of its line, `ends` (J, 2, 2) mm, `span` (J, 2) from and
    to where along its line, mm; all in one connected region."""

    row: Ints
    ends: Floats
    span: Floats

    def __len__(self) -> int:
        return len(self.row)


def zigzag_ways(region: Polylines, scan: Scan) -> list[Floats]:
    """(n, 3) x, y, bulge: an open path over all strokes and rings of one connected region.

    Several paths only where rounding hides the way from one stroke to the next (`Way`).
    """
    whole, way = Rails(region), Way()
    margin = min(scan.radius_mm - 0.5 * scan.step_mm, MOST_MARGIN * scan.radius_mm)
    for part in parts_of(offset_shape(region, margin)):
        rails, strokes = Rails(part), strokes_of(part, scan)
        around = whole
        for index, turned in _order(strokes):
            ends = strokes.ends[index, ::-1] if turned else strokes.ends[index]
            way.cut(np.column_stack([ends, np.zeros(2)]), around)
            around = rails
    way.cut_all(region, whole, whole, scan.forward)
    return way.ways()


def strokes_of(region: Polylines, scan: Scan) -> Strokes:
    """The pieces of equally spaced lines, no farther apart than the step, in a region."""
    turned = Polylines.of([rotated(path, -scan.angle_rad) for path in region])
    (left, right), (low, high) = extents(turned).tolist()
    count = max(1, math.ceil((high - low) / scan.step_mm))
    y = low + (np.arange(count) + 0.5) * ((high - low) / count)
    ahead = np.array([math.cos(scan.angle_rad), math.sin(scan.angle_rad)])
    across = np.array([-ahead[1], ahead[0]])
    start = (left - scan.step_mm) * ahead + y[:, None] * across
    end = (right + scan.step_mm) * ahead + y[:, None] * across
    lines = Segments.between(start, end, np.zeros(count))
    row, begin, stop = scanned(lines, Segments.of(region))
    ends = np.stack([point_at(lines, row, begin), point_at(lines, row, stop)], axis=1)
    return Strokes(row, ends, ends @ ahead)


def _order(strokes: Strokes) -> list[tuple[int, bool]]:
    """Every stroke once, each with whether it is cut from its end.

    From a stroke on to one beside it, as long as there is one; else to the nearest end of any
    that has at most one neighbour left, so that no row of strokes is broken in its middle.
    """
    beside = _neighbours(strokes)
    left = set(range(len(strokes)))
    found: list[tuple[int, bool]] = []
    onward = 1
    while left:
        if not found:
            among, here, last = [0], strokes.ends[0, 0], 0
        else:
            last, was_turned = found[-1]
            here = strokes.ends[last, 0 if was_turned else 1]
            among = _next(last, onward, strokes, beside, left)
        apart = np.hypot(*np.moveaxis(strokes.ends[among] - here, 2, 0))
        pick, side = np.unravel_index(int(apart.argmin()), apart.shape)
        chosen = among[int(pick)]
        if chosen in beside[last]:
            onward = int(strokes.row[chosen] - strokes.row[last])
        left.remove(chosen)
        found.append((chosen, bool(side)))
    return found


def _next(
    last: int, onward: int, strokes: Strokes, beside: list[list[int]], left: set[int]
) -> list[int]:
    """The strokes that may follow the last one, which went on to the next line or the one before
    (`onward` 1 or −1)."""
    near = [index for index in beside[last] if index in left]
    ahead = [index for index in near if strokes.row[index] - strokes.row[last] == onward]
    if near:
        return ahead or near
    ends = [index for index in left if sum(other in left for other in beside[index]) <= 1]
    return sorted(ends or left)


def _neighbours(strokes: Strokes) -> list[list[int]]:
    """For each stroke those of the lines before and behind it that run beside a part of it."""
    beside: list[list[int]] = [[] for _ in range(len(strokes))]
    first = np.searchsorted(strokes.row, np.arange(strokes.row.max(initial=-1) + 3))
    for index, row in enumerate(strokes.row.tolist()):
        low, high = strokes.span[index]
        for other in range(int(first[row + 1]), int(first[row + 2])):
            if strokes.span[other, 0] < high and strokes.span[other, 1] > low:
                beside[index].append(other)
                beside[other].append(index)
    return beside
