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

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from camtool.calibration.grid import (
    MARGIN_UNITS,
    MOST_REGIONS,
    Cell,
    Grid,
    Point,
    cells_of,
    clean,
    edges_of,
    grid_of,
)
from camtool.errors import OptionError
from camtool.machine.model import Machine

Kind = Literal["lines", "squares", "circles", "steps"]
KINDS: tuple[Kind, ...] = ("lines", "squares", "circles", "steps")

GAP_UNITS = 3
"""Units of the grid between the two lines of a coupon, and the height of a ruler's steps."""

SQUARES = (1.0, 0.6, 0.3)
"""Sizes of the squares, as parts of the first: several, to tell scale from play."""

CIRCLES = (1.0, 2.0 / 3.0, 1.0 / 3.0)
"""Diameters of the circles, as parts of the first: 6, 4 and 2 as in the thesis, L2528-2594."""

ANGLES_DEG = (15.0, 35.0, 55.0, 75.0, 105.0, 125.0, 145.0, 165.0)
"""Where the diameters of circles are measured: eight, as in the thesis's Tabla 15, but none along
an axis, where the slides reverse and the line has a spike or a flat."""

STEPS = 10
"""Steps of a ruler (ten "tramos": ValCNC thesis, L1645)."""


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
    grid = grid_of(min(size[0] / regions[0], size[1] / regions[1]), machine)
    made = {"lines": _lines, "squares": _squares, "circles": _circles, "steps": _steps}
    paths: list[Path] = []
    tables: list[tuple[str, dict[str, Any]]] = []
    for name, cell in cells_of(size, regions, grid.unit):
        for path, table in made[kind](cell, grid):
            paths.append(path)
            region = {"region": name} if name else {}
            tables.append((kind, {**region, **table}))
    return Sheet(kind, size, tuple(paths), tuple(tables), edges_of(size, regions))


Coupon = tuple[Path, dict[str, Any]]
Made = Iterator[Coupon]
AlongAxis = Callable[[str, Point, float, Grid], Coupon]


def _lines(cell: Cell, grid: Grid) -> Made:
    """Two lines along X at the bottom of the cell, two along Y at its left side."""
    return _along_both(_two_lines, cell, grid)


def _steps(cell: Cell, grid: Grid) -> Made:
    """A ruler along X at the bottom, one along Y at the left side."""
    return _along_both(_ruler, cell, grid)


def _along_both(one: AlongAxis, cell: Cell, grid: Grid) -> Made:
    """One coupon along X at the bottom of the cell, one along Y at its left side, above it."""
    low = cell.low + grid.units(3 * GAP_UNITS + MARGIN_UNITS)
    yield one("x", (cell.left, cell.low), cell.right, grid)
    yield one("y", (low, cell.left), cell.high, grid)


def _two_lines(axis: str, corner: Point, end: float, grid: Grid) -> Coupon:
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
    table = {"axis": axis, "nominal_mm": clean(length), "first_mm": 0.0, "second_mm": 0.0}
    return Path(f"LINES_{axis.upper()}", _turned(axis, ways), closed=True), table


def _ruler(axis: str, corner: Point, end: float, grid: Grid) -> Coupon:
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
        "nominal_mm": [clean(k * pitch) for k in range(1, STEPS + 1)],
        "forward_mm": [0.0] * STEPS,
        "backward_mm": [0.0] * STEPS,
        "rows_apart_mm": clean(2 * tall),
    }
    return Path(f"STEPS_{axis.upper()}", _turned(axis, ways), closed=True), table


def _wave(marks: Sequence[float], levels: Point) -> list[Point]:
    """Up at one mark, down at the next."""
    points: list[Point] = []
    for number, mark in enumerate(marks):
        first, second = levels if number % 2 == 0 else levels[::-1]
        points += [(mark, first), (mark, second)]
    return points


def _squares(cell: Cell, grid: Grid) -> Made:
    """Squares about the cell's middle, one in the other."""
    hook = grid.run_up
    x, y, most = grid.middle(cell)
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
        size = clean(2.0 * half)
        diagonals = {"diagonals_mm": [0.0, 0.0]}
        yield (
            Path("SQUARES", _turned("x", ways)),
            {"nominal_mm": [size, size], "dx_mm": 0.0, "dy_mm": 0.0, **diagonals},
        )


def _circles(cell: Cell, grid: Grid) -> Made:
    """Circles about the cell's middle, each of two half circles, counterclockwise from +X."""
    x, y, most = grid.middle(cell)
    for part in CIRCLES:
        radius = grid.down(part * most)
        halves = ((clean(x + radius), y, 1.0), (clean(x - radius), y, 1.0))
        yield (
            Path("CIRCLES", halves, closed=True),
            {
                "nominal_mm": clean(2.0 * radius),
                "direction": "ccw",
                "angles_deg": list(ANGLES_DEG),
                "diameters_mm": [0.0] * len(ANGLES_DEG),
            },
        )


def _turned(axis: str, ways: Sequence[Point]) -> tuple[tuple[float, float, float], ...]:
    """Points (along, across) an axis as vertices."""
    points = ways if axis == "x" else [(across, along) for along, across in ways]
    return tuple((clean(x), clean(y), 0.0) for x, y in points)
