"""The drawings that calibration needs, and what is measured on each.

The side from which each edge is reached must follow from the drawing, wherever the tool came
from. Lines and rulers are closed, so that they are cut the way they are drawn; begun in the
middle of their longest line, they reach every mark behind a run-up.

    lines                                       steps

    ┌────┐                                      ┌───┐ ┌─┐ ┌─┐ ┌─┐ ┌──┐
    │    └────────────────┐  second, in −       │   └─┘ └─┘ └─┘ └─┘  │   reached in −
    │    ┌────────────────┘  first, in +        │   ┌─┐ ┌─┐ ┌─┐ ┌─┐ ┌┘   reached in +
    └────┘                   run-up             └───┘ └─┘ └─┘ └─┘ └─┘

Squares are open, with a hook beside a corner at either end: cut from either one, opposite edges
are reached from opposite sides. Circles are closed, and begin where X reverses. (Two joined
lines: PIC thesis, L2353-2423; parallel-port thesis, L1165; squares and circles: PIC thesis,
L2457-2594; steps: ValCNC thesis, L1645.)
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

from camtool.errors import OptionError
from camtool.machine.model import Machine

Point = tuple[float, float]

# The grid on which the coupons of a sheet lie, and the cells that the sheet is divided into.
#
# Lengths are whole units, round numbers of mm that the machine can say: what is drawn is then what
# is cut, and easy to measure.

FINENESS = 50.0
"""The shorter side of a region has this many units of the grid of its coupons, or a few more: the
unit is a round number."""

MARGIN_UNITS = 2
"""Units of that grid that stay free around each coupon."""

RUN_UP_UNITS = 4
"""Shortest run-up, in units of that grid."""

RUN_UP_PLAYS = 3.0
"""A run-up is at least this many times as long as the machine's backlash and its compensation
together. The tool begins in the middle of the longest line of a coupon, so more than two are
needed to take both up."""

SAME = 1e-9
"""Numbers of units within this part of a whole number count as that number."""

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


# Coupons on the grid.

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


# A sheet as DXF and as SVG: mm, the same bytes every time.

COLOUR = 5
"""Index of the colour of all lines in DXF: blue."""

DECIMALS = 9
"""Decimals of numbers in SVG."""


def dxf(sheet: Sheet) -> bytes:
    """The sheet as DXF R2000, each path an LWPOLYLINE."""
    from ezdxf._options import options
    from ezdxf.filemanagement import new
    from ezdxf.units import MM

    # Without dates and GUIDs; the option is the library's own, so it is put back.
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        document = new("R2000", units=MM)
        space = document.modelspace()
        for path in sheet.paths:
            if path.layer not in document.layers:
                document.layers.add(path.layer, color=COLOUR)
            space.add_lwpolyline(
                path.vertices,
                format="xyb",
                close=path.closed,
                dxfattribs={"layer": path.layer},
            )
        text = io.StringIO(newline="\n")
        document.write(text)
    finally:
        options.write_fixed_meta_data_for_testing = before
    return text.getvalue().encode("cp1252")


def svg(sheet: Sheet) -> bytes:
    """The sheet as SVG, Y up by the transform of its only group."""
    width, height = (_number(side) for side in sheet.size)
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg"',
        f'     width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f'  <g id="{sheet.kind}" transform="matrix(1 0 0 -1 0 {height})"',
        f'     fill="none" stroke="#0000ff" stroke-width="{_number(min(sheet.size) / 500.0)}">',
        *(f'    <path d="{_path(path)}"/>' for path in sheet.paths),
        "  </g>",
        "</svg>",
        "",
    ]
    return "\n".join(rows).encode()


def _path(path: Path) -> str:
    """Lines and arcs; an arc's radius is chord · (1 + b²) / (4 |b|)."""
    ring = [*path.vertices, path.vertices[0]] if path.closed else list(path.vertices)
    x, y, _ = ring[0]
    parts = [f"M {_number(x)} {_number(y)}"]
    for (x1, y1, bulge), (x2, y2, _) in pairwise(ring):
        to = f"{_number(x2)} {_number(y2)}"
        if not bulge:
            parts.append(f"L {to}")
            continue
        radius = math.dist((x1, y1), (x2, y2)) * (1.0 + bulge**2) / (4.0 * abs(bulge))
        parts.append(f"A {_number(radius)} {_number(radius)} 0 0 {int(bulge > 0.0)} {to}")
    return " ".join([*parts, "Z"] if path.closed else parts)


def _number(value: float) -> str:
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


# A file of measurements to fill in: every length of a sheet of coupons, by name.

HOW: dict[Kind, tuple[str, ...]] = {
    "lines": (
        "first_mm: the line beside the mark on the side of part zero, from there to the bridge;",
        "second_mm: the other line. shorter_by_mm may stand in place of second_mm.",
    ),
    "squares": (
        "dx_mm, dy_mm: between opposite edges. diagonals_mm: lower left to upper right corner,",
        "and upper left to lower right; a corner is where its edges would meet.",
    ),
    "circles": (
        "diameters_mm: through the middle, at angles_deg from the X axis towards the Y axis.",
    ),
    "steps": (
        "forward_mm: from the first mark of the lower row (along Y: of the left one) to each of",
        "the others; backward_mm: from the same mark to those of the other row.",
    ),
}
"""What is measured, in words."""


def skeleton(sheet: Sheet, machine: Machine | None) -> str:
    """TOML text of the sheet's measurements; 0.0 stands for what was not measured."""
    width, height = sheet.size
    lines = [
        f"# Measurements of the {sheet.kind} coupon, {width:g} by {height:g} mm.",
        "# Lengths in mm, 0.0: not measured. Then: camtool calibrate THIS-FILE -o my-machine.toml",
        "# Cut: camtool post coupon.dxf --kind engrave --start longest-line --gap 0",
        *(f"# {line}" for line in HOW[sheet.kind]),
        "",
        f"target = {json.dumps(machine.target.dialect)}" if machine else '# target = "pic-mmh"',
        "# uncertainty_mm = 0.001   # standard uncertainty of your instrument",
        _compensation(machine),
    ]
    if sheet.regions:
        for axis in ("x", "y"):
            lines += ["", f"[regions.{axis}]    # from machine zero: part zero was taken for it"]
            lines += [f"{key} = {_value(value)}" for key, value in sheet.regions.items()]
    for kind, table in sheet.tables:
        lines += ["", f"[[{kind}]]", *(f"{key} = {_value(value)}" for key, value in table.items())]
    return "\n".join([*lines, ""])


def _compensation(machine: Machine | None) -> str:
    """What the controller adds at reversals, to be changed when it was off."""
    if machine is None:
        return "# compensation_mm = { x = 0.0, y = 0.0 }   # added at reversals while cutting"
    x, y = machine.axes.x.compensation_mm, machine.axes.y.compensation_mm
    return f"compensation_mm = {{ x = {x!r}, y = {y!r} }}   # added at reversals while cutting"


def _value(value: Any) -> str:
    return json.dumps(value)
