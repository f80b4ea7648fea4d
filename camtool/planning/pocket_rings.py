"""Contour-parallel ways of a pocket: rings from the middle outwards, in one stroke.

The region here is that of the tool's middle: the pocket shrunk by the tool's radius r. It is
shrunk again and again by the step s, and each boundary is a ring. What lies between two rings is
nearer than s to the outer one; so for s up to r nothing is left over, whatever the shape. For a
longer step the tool would miss what is farther than r both from the outer ring and from all that
lies within the inner one. There it also follows the boundary of the region shrunk by r, as far
as that is farther than r from the inner ring: the *tips*. They reach into corners and cores.

Regions fall apart as they shrink: they form a tree. A region is cut after all that came of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polyline, Polylines
from camtool.geometry.transform import reverse
from camtool.planning.along import Along
from camtool.planning.clip import outside_parts
from camtool.planning.pocket_parts import parts_of
from camtool.planning.pocket_route import Rails, closest, route, tidy

SHORTER = (0.95, 0.9, 0.85, 0.8)
"""Parts of the step that are tried where it leaves tips: rings alone make a calmer way."""


@dataclass(eq=False)
class Cell:
    """A connected region of the tool's middle, what it fell into when shrunk by a step, how many
    times it can be shrunk (`height`), and the tips between the two."""

    rails: Rails
    inner: list[Cell] = field(default_factory=list)
    tips: list[Polyline] = field(default_factory=list)
    height: int = 0


@dataclass(frozen=True)
class Steps:
    """Distance of the rings and radius of the tool, mm; whether rings run as they are oriented
    (the region on their left) or the other way."""

    step_mm: float
    radius_mm: float
    forward: bool = True


def ring_cells(region: Polylines, steps: Steps) -> Cell:
    """The tree of regions of one connected region of the tool's middle."""
    root = Cell(Rails(region))
    waiting, order = [root], []
    while waiting:
        cell = waiting.pop()
        order.append(cell)
        shrunk, cell.tips = _next_ring(cell.rails.region, steps)
        cell.inner = [Cell(Rails(part)) for part in parts_of(shrunk)]
        waiting += cell.inner
    for cell in reversed(order):
        cell.height = 1 + max((each.height for each in cell.inner), default=0)
    return root


def _next_ring(region: Polylines, steps: Steps) -> tuple[Polylines, list[Polyline]]:
    """The region shrunk by a step, and the tips; by a shorter step where that saves the tips."""
    shrunk = offset_shape(region, steps.step_mm)
    if steps.step_mm <= steps.radius_mm + POSITION_EPS_MM:
        return shrunk, []
    core = offset_shape(region, steps.radius_mm)
    tips = _tips(core, shrunk, steps)
    if all(path.closed for path in tips):
        return shrunk, tips
    for part in SHORTER:
        nearer = offset_shape(region, max(part * steps.step_mm, steps.radius_mm))
        if not _tips(core, nearer, steps):
            return nearer, []
    return shrunk, tips


def _tips(core: Polylines, shrunk: Polylines, steps: Steps) -> list[Polyline]:
    """What of the boundary of `core`, the region shrunk by the tool's radius, the tool does not
    cover from within the next ring."""
    if len(core) == 0 or len(shrunk) == 0:
        return list(core)
    return outside_parts(core, offset_shape(shrunk, -steps.radius_mm))


def ring_ways(root: Cell, steps: Steps) -> tuple[list[Floats], Cell]:
    """(n, 3) x, y, bulge: one open path over all rings, and the cell that it begins in.

    Several paths only where rounding hides the way from one ring to the next (`route`).
    """
    ways: list[Floats] = []
    way: list[Floats] = []
    first: Cell | None = None
    for cell, around in _inside_out(root, way):
        first, rails = first or cell, around.rails
        left = [Along.of(path) for path in (*cell.tips, *cell.rails.region)]
        while left:
            here = way[-1][-1, :2] if way else left[0].path.start
            stroke = _nearest(left, here, steps.forward)
            link = route(here, stroke[0, :2], rails) if way else stroke[:1]
            if link is None:
                ways.append(_chained(way))
                way.clear()
                link = stroke[:1]
            way += [link, stroke]
            rails = cell.rails
    assert first is not None
    return [*ways, _chained(way)], first


def _inside_out(root: Cell, way: list[Floats]) -> Iterator[tuple[Cell, Cell]]:
    """All cells, each after its inner ones, with the cell in which the tool can come to it.

    The highest first; later the one nearest to the end of the way so far, which grows meanwhile.
    """
    stack = [(root, list(root.inner))]
    around: Cell | None = None
    while stack:
        cell, left = stack[-1]
        if not left:
            stack.pop()
            yield cell, around or cell
            around = None
            continue
        around = around or cell
        if way:
            here = way[-1][-1, :2]
            pick = min(range(len(left)), key=lambda row: _distance(left[row], here))
        else:
            pick = max(range(len(left)), key=lambda row: (left[row].height, -row))
        chosen = left.pop(pick)
        stack.append((chosen, list(chosen.inner)))


def _distance(cell: Cell, point: Floats) -> float:
    return min(closest(along, point)[0] for along in cell.rails.paths)


def _nearest(left: list[Along], here: Floats, forward: bool) -> Floats:
    """Takes the path nearest to a place away: its vertices (k, 3) as it is cut from there."""
    ways = [closest(along, here) if along.path.closed else _ends(along, here) for along in left]
    pick = min(range(len(ways)), key=lambda row: ways[row][0])
    along, begin = left.pop(pick), ways[pick][1]
    if along.path.closed:
        total = along.total_mm if forward else -along.total_mm
        return along.piece(begin, begin + total)
    return (along.path if begin == 0.0 else reverse(along.path)).vertices


def _ends(along: Along, here: Floats) -> tuple[float, float]:
    """Distance to the nearer end of an open path, and the length along it to that end."""
    to_start, to_end = np.hypot(*(along.path.vertices[[0, -1], :2] - here).T).tolist()
    return (to_start, 0.0) if to_start <= to_end else (to_end, along.total_mm)


def _chained(parts: list[Floats]) -> Floats:
    """Open paths, each of which begins where the one before it ends, as one."""
    return tidy(np.concatenate([*(part[:-1] for part in parts[:-1]), parts[-1]]))
