"""The grid on which the coupons of a sheet lie, and the cells that the sheet is divided into.

Lengths are whole units, round numbers of mm that the machine can say: what is drawn is then what
is cut, and easy to measure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from camtool.errors import OptionError
from camtool.machine.model import Machine

Point = tuple[float, float]

FINENESS = 50.0
"""The shorter side of a region has so many units of the grid on which its coupons lie, or a few
more: the unit is a round number."""

MARGIN_UNITS = 2
"""Units of that grid that stay free around each coupon."""

RUN_UP_UNITS = 4
"""Units of that grid that a run-up takes at least."""

RUN_UP_PLAYS = 3.0
"""A run-up is at least so many times as long as the machine's play and its compensation. More than
two: half of the longest line of a coupon, in whose middle the tool begins, then takes them up."""

SAME = 1e-9
"""Numbers of units within this part of a whole number are that number."""

MOST_REGIONS = 9
"""Columns and rows of regions at most."""


@dataclass(frozen=True)
class Cell:
    """Where coupons may lie, mm; a margin is off already."""

    left: float
    low: float
    right: float
    high: float


@dataclass(frozen=True)
class Grid:
    """The grid on which coupons lie, and how long their run-ups are, mm."""

    unit: float
    run_up: float

    def units(self, count: int) -> float:
        return count * self.unit

    def down(self, length: float) -> float:
        """The length on the grid, not longer; OptionError when nothing is left of it."""
        cut = math.floor(length / self.unit + SAME) * self.unit
        if cut <= 0.0:
            raise OptionError(
                "the coupons do not fit on the sheet",
                mend="give a larger --size, or fewer --regions",
            )
        return cut

    def middle(self, cell: Cell) -> tuple[float, float, float]:
        """(x, y) of a cell's middle on the grid, and how far its sides are from there."""
        x = self.down(0.5 * (cell.left + cell.right))
        y = self.down(0.5 * (cell.low + cell.high))
        return x, y, min(cell.right - x, x - cell.left, cell.high - y, y - cell.low)


def cells_of(size: Point, regions: tuple[int, int], unit: float) -> Iterator[tuple[str, Cell]]:
    """(name, cell) from the lower left on, row by row: A1, B1 … A2; no names for a single one."""
    columns, rows = regions
    margin = MARGIN_UNITS * unit
    for row in range(rows):
        for column in range(columns):
            name = f"{chr(ord('A') + column)}{row + 1}" if columns * rows > 1 else ""
            left = _on_grid(size[0] * column / columns, unit, math.ceil) + margin
            right = _on_grid(size[0] * (column + 1) / columns, unit, math.floor) - margin
            low = _on_grid(size[1] * row / rows, unit, math.ceil) + margin
            high = _on_grid(size[1] * (row + 1) / rows, unit, math.floor) - margin
            yield name, Cell(left, low, right, high)


def edges_of(size: Point, regions: tuple[int, int]) -> dict[str, Any]:
    """The cells of a file of measurements; {} for a single one."""
    columns, rows = regions
    if columns * rows == 1:
        return {}
    names = [
        [f"{chr(ord('A') + column)}{row + 1}" for column in range(columns)] for row in range(rows)
    ]
    return {
        "x_mm": [clean(size[0] * k / columns) for k in range(columns + 1)],
        "y_mm": [clean(size[1] * k / rows) for k in range(rows + 1)],
        "names": names,
    }


def grid_of(side: float, machine: Machine | None) -> Grid:
    """A round unit (1, 2 or 5 by a power of ten) which the machine can say, and run-ups that take
    up its play."""
    rough = side / FINENESS
    power = 10.0 ** math.floor(math.log10(rough) + SAME)
    unit = power * max(part for part in (1.0, 2.0, 5.0) if part * power <= rough * (1.0 + SAME))
    axes = (machine.axes.x, machine.axes.y) if machine is not None else ()
    finest = max((axis.resolution_mm or 0.0 for axis in axes), default=0.0)
    if finest > 0.0:
        unit = finest * max(1, math.floor(unit / finest + SAME))
    lost = max((max(axis.backlash_mm, axis.compensation_mm) for axis in axes), default=0.0)
    run_up = unit * max(RUN_UP_UNITS, math.ceil(RUN_UP_PLAYS * lost / unit - SAME))
    return Grid(unit, run_up)


def _on_grid(value: float, unit: float, how: Callable[[float], float]) -> float:
    """The value as whole units, rounded `how`; what rounding errors make of units are units."""
    units = value / unit
    near = round(units)
    return (near if abs(units - near) < SAME * max(1.0, abs(near)) else how(units)) * unit


def clean(value: float) -> float:
    """Without the last digits that adding up units leaves."""
    return round(value, 9) + 0.0
