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
from camtool.planning.pockets.clip import outside_parts
from camtool.planning.pockets.parts import parts_of, pole
from camtool.planning.pockets.route import Rails, closest
from camtool.planning.pockets.way import Way

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
    (the region on their left) or the other way; whether the first one begins as near as can be
    to the middle of its region, where a helix goes down."""

    step_mm: float
    radius_mm: float
    forward: bool = True
    from_middle: bool = False


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
    """(n, 3) x, y, bulge: an open path over all rings, and the cell that it begins in.

    Several paths only where rounding hides the way from one ring to the next (`Way`).
    """
    way = Way()
    first = None
    for cell, around in _inside_out(root, way):
        if first is None:
            first = cell
            way.begin = pole(cell.rails.region) if steps.from_middle else None
        paths = (*cell.tips, *cell.rails.region)
        way.cut_all(paths, cell.rails, around.rails, steps.forward)
    return way.ways(), first or root


def _inside_out(root: Cell, way: Way) -> Iterator[tuple[Cell, Cell]]:
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
        chosen = left.pop(_pick(left, way.here))
        stack.append((chosen, list(chosen.inner)))


def _pick(cells: list[Cell], here: Floats | None) -> int:
    """The cell nearest to a place; the highest when the tool is nowhere yet."""
    if here is None:
        return max(range(len(cells)), key=lambda row: (cells[row].height, -row))
    apart = [min(closest(along, here)[0] for along in cell.rails.paths) for cell in cells]
    return int(np.argmin(apart))
