"""The drawings that calibration needs, and what is measured on each.

The side from which each edge is reached must follow from the drawing, wherever the tool came
from. Lines and rulers are closed, so that they are cut the way they are drawn; begun in the middle
of their longest line, they reach every mark behind a run-up.

    lines                                       steps

    ┌────┐                                      ┌───┐ ┌─┐ ┌─┐ ┌─┐ ┌──┐
    │    └────────────────┐  second, in −       │   └─┘ └─┘ └─┘ └─┘  │   reached in −
    │    ┌────────────────┘  first, in +        │   ┌─┐ ┌─┐ ┌─┐ ┌─┐ ┌┘   reached in +
    └────┘                   run-up             └───┘ └─┘ └─┘ └─┘ └─┘

Squares are open, with a hook beside a corner at either end: cut from either one, opposite edges
are reached from opposite sides. Circles are closed, and begin where X reverses. (Two joined lines:
PIC thesis, L2353-2423; parallel-port thesis, L1165; squares and circles: PIC thesis, L2457-2594;
steps: ValCNC thesis, L1645.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from camtool.errors import OptionError
from camtool.machine.model import Machine

Kind = Literal["lines", "squares", "circles", "steps"]
KINDS: tuple[Kind, ...] = ("lines", "squares", "circles", "steps")
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

GAP_UNITS = 3
"""Units of that grid between the two lines of a coupon, and the height of a ruler's steps."""

SAME = 1e-9
"""Numbers of units within this part of a whole number are that number."""

SQUARES = (1.0, 0.6, 0.3)
"""Sizes of the squares, as parts of the first: several, to tell scale from play."""

CIRCLES = (1.0, 2.0 / 3.0, 1.0 / 3.0)
"""Diameters of the circles, as parts of the first: 6, 4 and 2 as in the thesis, L2528-2594."""

ANGLES_DEG = (15.0, 35.0, 55.0, 75.0, 105.0, 125.0, 145.0, 165.0)
"""Where the diameters of circles are measured: eight, as in the thesis's Tabla 15, but none along
an axis, where the slides reverse and the line has a spike or a flat."""

STEPS = 10
"""Steps of a ruler (ten "tramos": ValCNC thesis, L1645)."""

MOST_REGIONS = 9
"""Columns and rows of regions at most."""


@dataclass(frozen=True)
class Path:
    """A line of a drawing: vertices x, y, bulge in mm."""

    layer: str
    vertices: tuple[tuple[float, float, float], ...]
    closed: bool = False


@dataclass(frozen=True)
class Sheet:
    """A drawing of `size` mm, its lower left corner at part zero; `tables` are the coupons of a
    file of measurements, (kind, keys) each; `regions` its cells, the same for both axes."""

    kind: Kind
    size: Point
    paths: tuple[Path, ...]
    tables: tuple[tuple[str, dict[str, Any]], ...]
    regions: dict[str, Any] = field(default_factory=dict)


def sheet(
    kind: Kind, size: Point, regions: tuple[int, int] = (1, 1), machine: Machine | None = None
) -> Sheet:
    """The coupons of a kind on a sheet; OptionError when they do not fit, or when the run-ups do
    not take up the play of `machine`."""
    if not all(1 <= count <= MOST_REGIONS for count in regions):
        raise OptionError(
            f"{regions[0]}x{regions[1]} regions", mend=f"give 1 to {MOST_REGIONS} each way"
        )
    if kind != "lines" and regions != (1, 1):
        raise OptionError(f"{kind} have no regions", mend="leave --regions out")
    grid = _grid(min(size[0] / regions[0], size[1] / regions[1]), machine)
    made = {"lines": _lines, "squares": _squares, "circles": _circles, "steps": _steps}
    paths: list[Path] = []
    tables: list[tuple[str, dict[str, Any]]] = []
    for name, cell in _cells(size, regions, grid.unit):
        for path, table in made[kind](cell, grid):
            paths.append(path)
            region = {"region": name} if name else {}
            tables.append((kind, {**region, **table}))
    return Sheet(kind, size, tuple(paths), tuple(tables), _edges(size, regions))


@dataclass(frozen=True)
class _Cell:
    """Where coupons may lie, mm; a margin is off already."""

    left: float
    low: float
    right: float
    high: float


@dataclass(frozen=True)
class _Grid:
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


Made = Iterator[tuple[Path, dict[str, Any]]]


def _lines(cell: _Cell, grid: _Grid) -> Made:
    """Two lines along X at the bottom of the cell, two along Y at its left side."""
    low = cell.low + grid.units(3 * GAP_UNITS + MARGIN_UNITS)
    yield _two_lines("x", (cell.left, cell.low), cell.right, grid)
    yield _two_lines("y", (low, cell.left), cell.high, grid)


def _two_lines(axis: str, corner: Point, end: float, grid: _Grid) -> tuple[Path, dict[str, Any]]:
    """Two lines along an axis from `corner`, (along, across) it, to `end`."""
    along, across = corner
    run_up, gap = grid.run_up, grid.units(GAP_UNITS)
    mark = along + run_up
    length = grid.down(end - mark)
    ways = [
        (along, across),
        (mark, across),
        (mark, across + gap),
        (mark + length, across + gap),
        (mark + length, across + 2 * gap),
        (mark, across + 2 * gap),
        (mark, across + 3 * gap),
        (along, across + 3 * gap),
    ]
    table = {"axis": axis, "nominal_mm": _clean(length), "first_mm": 0.0, "second_mm": 0.0}
    return Path(f"LINES_{axis.upper()}", _turned(axis, ways), closed=True), table


def _steps(cell: _Cell, grid: _Grid) -> Made:
    """A ruler along X at the bottom, one along Y at the left side."""
    low = cell.low + grid.units(3 * GAP_UNITS + MARGIN_UNITS)
    yield _ruler("x", (cell.left, cell.low), cell.right, grid)
    yield _ruler("y", (low, cell.left), cell.high, grid)


def _ruler(axis: str, corner: Point, end: float, grid: _Grid) -> tuple[Path, dict[str, Any]]:
    along, across = corner
    run_up, tall = grid.run_up, grid.units(GAP_UNITS)
    zero = along + run_up
    pitch = grid.down((end - run_up - zero) / STEPS)
    marks = [zero + k * pitch for k in range(STEPS + 1)]
    there = [(along, across), *_wave(marks, (across, across + tall))]
    far = marks[-1] + run_up
    back = _wave(marks[::-1], (across + 2 * tall, across + 3 * tall))
    ways = [*there, (far, there[-1][1]), (far, back[0][1]), *back, (along, back[-1][1])]
    table = {
        "axis": axis,
        "nominal_mm": [_clean(k * pitch) for k in range(1, STEPS + 1)],
        "forward_mm": [0.0] * STEPS,
        "backward_mm": [0.0] * STEPS,
        "rows_apart_mm": _clean(2 * tall),
    }
    return Path(f"STEPS_{axis.upper()}", _turned(axis, ways), closed=True), table


def _wave(marks: Sequence[float], levels: Point) -> list[Point]:
    """Up at one mark, down at the next."""
    points: list[Point] = []
    for number, mark in enumerate(marks):
        first, second = levels if number % 2 == 0 else levels[::-1]
        points += [(mark, first), (mark, second)]
    return points


def _squares(cell: _Cell, grid: _Grid) -> Made:
    """Squares about the cell's middle, one in the other."""
    hook = grid.run_up
    x, y, most = _middle(cell, grid)
    for part in SQUARES:
        half = grid.down(part * (most - hook))
        left, right, low, high = x - half, x + half, y - half, y + half
        stop = right - grid.unit
        ways = [
            (right - hook, low - hook),
            (right, low - hook),
            (right, high),
            (left, high),
            (left, low),
            (stop, low),
            (stop, low + hook),
        ]
        size = _clean(2.0 * half)
        diagonals = {"diagonals_mm": [0.0, 0.0]}
        yield (
            Path("SQUARES", _turned("x", ways)),
            {"nominal_mm": [size, size], "dx_mm": 0.0, "dy_mm": 0.0, **diagonals},
        )


def _circles(cell: _Cell, grid: _Grid) -> Made:
    """Circles about the cell's middle, each of two half circles, counterclockwise from +X."""
    x, y, most = _middle(cell, grid)
    for part in CIRCLES:
        radius = grid.down(part * most)
        halves = ((_clean(x + radius), y, 1.0), (_clean(x - radius), y, 1.0))
        yield (
            Path("CIRCLES", halves, closed=True),
            {
                "nominal_mm": _clean(2.0 * radius),
                "direction": "ccw",
                "angles_deg": list(ANGLES_DEG),
                "diameters_mm": [0.0] * len(ANGLES_DEG),
            },
        )


def _turned(axis: str, ways: Sequence[Point]) -> tuple[tuple[float, float, float], ...]:
    """Points (along, across) an axis as vertices."""
    points = ways if axis == "x" else [(across, along) for along, across in ways]
    return tuple((_clean(x), _clean(y), 0.0) for x, y in points)


def _middle(cell: _Cell, grid: _Grid) -> tuple[float, float, float]:
    """(x, y) of the cell's middle on the grid, and how far its sides are from there."""
    x = grid.down(0.5 * (cell.left + cell.right))
    y = grid.down(0.5 * (cell.low + cell.high))
    return x, y, min(cell.right - x, x - cell.left, cell.high - y, y - cell.low)


def _cells(size: Point, regions: tuple[int, int], unit: float) -> Iterator[tuple[str, _Cell]]:
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
            yield name, _Cell(left, low, right, high)


def _edges(size: Point, regions: tuple[int, int]) -> dict[str, Any]:
    """The cells of a file of measurements; {} for a single one."""
    columns, rows = regions
    if columns * rows == 1:
        return {}
    names = [
        [f"{chr(ord('A') + column)}{row + 1}" for column in range(columns)] for row in range(rows)
    ]
    return {
        "x_mm": [_clean(size[0] * k / columns) for k in range(columns + 1)],
        "y_mm": [_clean(size[1] * k / rows) for k in range(rows + 1)],
        "names": names,
    }


def _grid(side: float, machine: Machine | None) -> _Grid:
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
    return _Grid(unit, run_up)


def _on_grid(value: float, unit: float, how: Callable[[float], float]) -> float:
    """The value as whole units, rounded `how`; what rounding errors make of units are units."""
    units = value / unit
    near = round(units)
    return (near if abs(units - near) < SAME * max(1.0, abs(near)) else how(units)) * unit


def _clean(value: float) -> float:
    """Without the last digits that adding up units leaves."""
    return round(value, 9) + 0.0
