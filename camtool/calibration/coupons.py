"""The coupons of a calibration as drawings, and the file in which to enter their measurements.

The side from which each edge is reached must follow from the drawing, wherever the tool came from.
Lines and rulers are closed, so that they are cut in the direction in which they are drawn; begun
in the middle of their longest line, they reach every mark after a run-up.

    lines                                       steps

    ┌────┐                                      ┌───┐ ┌─┐ ┌─┐ ┌─┐ ┌──┐
    │    └────────────────┐  second, in −       │   └─┘ └─┘ └─┘ └─┘  │   reached in −
    │    ┌────────────────┘  first, in +        │   ┌─┐ ┌─┐ ┌─┐ ┌─┐ ┌┘   reached in +
    └────┘                   run-up             └───┘ └─┘ └─┘ └─┘ └─┘

Squares are open, with a hook beside a corner at both ends: cut from either end, opposite edges are
reached from opposite sides. Circles are closed and begin where X reverses. (Two joined
lines: PIC thesis, L2353-2423; parallel-port thesis, L1165; squares and circles: PIC thesis,
L2457-2594; steps: ValCNC thesis, L1645.)"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, Literal

from msgspec import Struct, field

from camtool.errors import OptionError
from camtool.machine.model import Machine

Point = tuple[float, float]

# The grid on which the coupons of a sheet lie, and the cells into which the sheet is divided.
#
# Lengths are whole units, round numbers of mm that the machine can represent: they are cut as
# drawn, and easy to measure.

FINENESS = 50.0
"""The shorter side of a region has this many units of the grid, or a few more: the unit is a round
number."""

MARGIN_UNITS = 2
"""Free units of the grid around each coupon."""

RUN_UP_UNITS = 4
"""The least length of a run-up, in units of the grid."""

RUN_UP_PLAYS = 3.0
"""A run-up is at least this many times the machine's backlash and compensation. With more than
two, half of the longest line of a coupon, in whose middle the tool begins, takes them up."""

SAME = 1e-9
"""Numbers of units that differ by less than this from a whole number are that number."""

MAX_REGIONS = 9
"""Largest number of columns, and of rows, of regions."""


class CouponCell(Struct, frozen=True):
    """A rectangle for coupons, mm, without its margin."""

    left: float
    low: float
    right: float
    high: float


class CouponGrid(Struct, frozen=True):
    """The grid on which coupons lie, and the length of their run-ups, mm."""

    unit: float
    run_up: float

    def units(self, count: int) -> float:
        return count * self.unit

    def down(self, length: float) -> float:
        """Round the length down to the grid; OptionError if it becomes 0."""
        cut = math.floor(length / self.unit + SAME) * self.unit
        if cut <= 0.0:
            raise OptionError(
                "the coupons do not fit on the sheet",
                mend="give a larger --size, or fewer --regions",
            )
        return cut

    def middle(self, cell: CouponCell) -> tuple[float, float, float]:
        """Return the point (x, y) of the grid at the middle of a cell, and its distance to the
        nearest side."""
        x = self.down(0.5 * (cell.left + cell.right))
        y = self.down(0.5 * (cell.low + cell.high))
        return x, y, min(cell.right - x, x - cell.left, cell.high - y, y - cell.low)


def cells_of(
    size: Point, regions: tuple[int, int], unit: float
) -> Iterator[tuple[str, CouponCell]]:
    """Return (name, cell) from the lower left on, row by row: A1, B1 … A2; "" for a single
    cell."""
    columns, rows = regions
    margin = MARGIN_UNITS * unit
    for row in range(rows):
        for column in range(columns):
            name = f"{chr(ord('A') + column)}{row + 1}" if columns * rows > 1 else ""
            left = _on_grid(size[0] * column / columns, unit, math.ceil) + margin
            right = _on_grid(size[0] * (column + 1) / columns, unit, math.floor) - margin
            low = _on_grid(size[1] * row / rows, unit, math.ceil) + margin
            high = _on_grid(size[1] * (row + 1) / rows, unit, math.floor) - margin
            yield name, CouponCell(left, low, right, high)


def edges_of(size: Point, regions: tuple[int, int]) -> dict[str, Any]:
    """Return the edges of the cells for a file of measurements; {} for a single cell."""
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


def grid_of(side: float, machine: Machine | None) -> CouponGrid:
    """Choose a round unit (1, 2 or 5 times a power of ten) that the machine can represent, and
    run-ups that take up its backlash."""
    rough = side / FINENESS
    power = 10.0 ** math.floor(math.log10(rough) + SAME)
    unit = power * max(part for part in (1.0, 2.0, 5.0) if part * power <= rough * (1.0 + SAME))
    axes = (machine.axes.x, machine.axes.y) if machine is not None else ()
    finest = max((axis.resolution_mm or 0.0 for axis in axes), default=0.0)
    if finest > 0.0:
        unit = finest * max(1, math.floor(unit / finest + SAME))
    backlash = max((max(axis.backlash_mm, axis.compensation_mm) for axis in axes), default=0.0)
    run_up = unit * max(RUN_UP_UNITS, math.ceil(RUN_UP_PLAYS * backlash / unit - SAME))
    return CouponGrid(unit, run_up)


def _on_grid(value: float, unit: float, rounding: Callable[[float], float]) -> float:
    """Return the value in whole units, rounded by `rounding`; rounding errors do not change the
    number."""
    units = value / unit
    nearest = round(units)
    return (
        nearest if abs(units - nearest) < SAME * max(1.0, abs(nearest)) else rounding(units)
    ) * unit


def clean(value: float) -> float:
    """Remove the rounding errors of sums of units from a value."""
    return round(value, 9) + 0.0


# Coupons on the grid.

Kind = Literal["lines", "squares", "circles", "steps"]
KINDS: tuple[Kind, ...] = ("lines", "squares", "circles", "steps")

GAP_UNITS = 3
"""Units of the grid between the lines of a coupon, and the height of the steps of a ruler."""

SQUARES = (1.0, 0.6, 0.3)
"""Sizes of the squares, as parts of the first: several, to distinguish scale from backlash."""

CIRCLES = (1.0, 2.0 / 3.0, 1.0 / 3.0)
"""Diameters of the circles, as parts of the first: 6, 4 and 2 as in the thesis, L2528-2594."""

ANGLES_DEG = (15.0, 35.0, 55.0, 75.0, 105.0, 125.0, 145.0, 165.0)
"""The angles of the measured diameters: eight, as in the thesis's Tabla 15, but none along an
axis, where the slides reverse and the line has a spike or a flat."""

STEPS = 10
"""Steps of a ruler (ten "tramos": ValCNC thesis, L1645)."""


class SheetPath(Struct, frozen=True):
    """A polyline of a drawing: vertices of x, y (mm) and bulge."""

    layer: str
    vertices: tuple[tuple[float, float, float], ...]
    closed: bool = False


class CouponSheet(Struct, frozen=True):
    """A drawing of `size` mm with its lower left corner at part zero. For the file of
    measurements, `tables` are its coupons, (kind, keys) each, and `regions` its cells, for both
    axes."""

    kind: Kind
    size: Point
    paths: tuple[SheetPath, ...]
    tables: tuple[tuple[str, dict[str, Any]], ...]
    regions: dict[str, Any] = field(default_factory=dict)


def sheet(
    kind: Kind, size: Point, regions: tuple[int, int] = (1, 1), machine: Machine | None = None
) -> CouponSheet:
    """Lay out the coupons of a kind on a sheet, with run-ups for the backlash of `machine`;
    OptionError if they do not fit."""
    if not all(1 <= count <= MAX_REGIONS for count in regions):
        raise OptionError(
            f"{regions[0]}x{regions[1]} regions", mend=f"give 1 to {MAX_REGIONS} each way"
        )
    if kind != "lines" and regions != (1, 1):
        raise OptionError(f"{kind} have no regions", mend="leave --regions out")
    grid = grid_of(min(size[0] / regions[0], size[1] / regions[1]), machine)
    layouts: dict[str, Callable[[CouponCell, CouponGrid], Made]] = {
        "lines": partial(_along_both, _two_lines),
        "squares": _squares,
        "circles": _circles,
        "steps": partial(_along_both, _ruler),
    }
    paths: list[SheetPath] = []
    tables: list[tuple[str, dict[str, Any]]] = []
    for name, cell in cells_of(size, regions, grid.unit):
        for path, table in layouts[kind](cell, grid):
            paths.append(path)
            region = {"region": name} if name else {}
            tables.append((kind, {**region, **table}))
    return CouponSheet(kind, size, tuple(paths), tuple(tables), edges_of(size, regions))


Coupon = tuple[SheetPath, dict[str, Any]]
Made = Iterator[Coupon]
AlongAxis = Callable[[str, Point, float, CouponGrid], Coupon]


def _along_both(one: AlongAxis, cell: CouponCell, grid: CouponGrid) -> Made:
    """Lay out two copies of a coupon: along X at the bottom of the cell, and along Y at its left
    side above that."""
    low = cell.low + grid.units(3 * GAP_UNITS + MARGIN_UNITS)
    yield one("x", (cell.left, cell.low), cell.right, grid)
    yield one("y", (low, cell.left), cell.high, grid)


def _two_lines(axis: str, corner: Point, end: float, grid: CouponGrid) -> Coupon:
    """Lay out two lines along an axis, from `corner` (along, across) to `end`."""
    along, across = corner
    run_up, gap = grid.run_up, grid.units(GAP_UNITS)
    mark = along + run_up
    length = grid.down(end - mark)
    points = [
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
    return SheetPath(f"LINES_{axis.upper()}", _vertices(axis, points), closed=True), table


def _ruler(axis: str, corner: Point, end: float, grid: CouponGrid) -> Coupon:
    along, across = corner
    run_up, tall = grid.run_up, grid.units(GAP_UNITS)
    zero = along + run_up
    pitch = grid.down((end - run_up - zero) / STEPS)
    marks = [zero + k * pitch for k in range(STEPS + 1)]
    outward = [(along, across), *_wave(marks, (across, across + tall))]
    far_end = marks[-1] + run_up
    return_wave = _wave(marks[::-1], (across + 2 * tall, across + 3 * tall))
    points = [
        *outward,
        (far_end, outward[-1][1]),
        (far_end, return_wave[0][1]),
        *return_wave,
        (along, return_wave[-1][1]),
    ]
    table = {
        "axis": axis,
        "nominal_mm": [clean(k * pitch) for k in range(1, STEPS + 1)],
        "forward_mm": [0.0] * STEPS,
        "backward_mm": [0.0] * STEPS,
        "rows_apart_mm": clean(2 * tall),
    }
    return SheetPath(f"STEPS_{axis.upper()}", _vertices(axis, points), closed=True), table


def _wave(marks: Sequence[float], levels: Point) -> list[Point]:
    """Return the points of a square wave: up at one mark, down at the next."""
    points: list[Point] = []
    for number, mark in enumerate(marks):
        first, second = levels if number % 2 == 0 else levels[::-1]
        points += [(mark, first), (mark, second)]
    return points


def _squares(cell: CouponCell, grid: CouponGrid) -> Made:
    """Lay out squares about the middle of the cell, one inside the other."""
    hook = grid.run_up
    x, y, room = grid.middle(cell)
    for part in SQUARES:
        half = grid.down(part * (room - hook))
        left, right, low, high = x - half, x + half, y - half, y + half
        stop = right - grid.unit
        points = [
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
            SheetPath("SQUARES", _vertices("x", points)),
            {"nominal_mm": [size, size], "dx_mm": 0.0, "dy_mm": 0.0, **diagonals},
        )


def _circles(cell: CouponCell, grid: CouponGrid) -> Made:
    """Lay out circles about the middle of the cell, each of two half circles, CCW from +X."""
    x, y, size = grid.middle(cell)
    for part in CIRCLES:
        radius = grid.down(part * size)
        halves = ((clean(x + radius), y, 1.0), (clean(x - radius), y, 1.0))
        yield (
            SheetPath("CIRCLES", halves, closed=True),
            {
                "nominal_mm": clean(2.0 * radius),
                "direction": "ccw",
                "angles_deg": list(ANGLES_DEG),
                "diameters_mm": [0.0] * len(ANGLES_DEG),
            },
        )


def _vertices(axis: str, points: Sequence[Point]) -> tuple[tuple[float, float, float], ...]:
    """Convert points (along, across) an axis to vertices."""
    if axis == "y":
        points = [(across, along) for along, across in points]
    return tuple((clean(x), clean(y), 0.0) for x, y in points)


# A sheet as DXF and as SVG in mm; the same sheet gives the same bytes.

COLOUR = 5
"""Colour index of all lines in DXF: blue."""

DECIMALS = 9
"""Decimal places of numbers in SVG."""


def dxf(sheet: CouponSheet) -> bytes:
    """Return the sheet as DXF R2000, each path an LWPOLYLINE."""
    from ezdxf._options import options
    from ezdxf.filemanagement import new
    from ezdxf.units import MM

    # Without dates and GUIDs; the option is global to the library, so it is restored.
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        document = new("R2000", units=MM)
        space = document.modelspace()
        for path in sheet.paths:
            if path.layer not in document.layers:
                document.layers.add(path.layer, color=COLOUR)
            space.add_lwpolyline(
                path.vertices, format="xyb", close=path.closed, dxfattribs={"layer": path.layer}
            )
        text = io.StringIO(newline="\n")
        document.write(text)
    finally:
        options.write_fixed_meta_data_for_testing = before
    return text.getvalue().encode("cp1252")


def svg(sheet: CouponSheet) -> bytes:
    """Return the sheet as SVG; the transform of its only group turns Y up."""
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


def _path(path: SheetPath) -> str:
    """Return SVG path data; the radius of an arc is chord · (1 + b²) / (4 |b|)."""
    ring = [*path.vertices, path.vertices[0]] if path.closed else list(path.vertices)
    x, y, _ = ring[0]
    parts = [f"M {_number(x)} {_number(y)}"]
    for (x1, y1, bulge), (x2, y2, _) in pairwise(ring):
        target = f"{_number(x2)} {_number(y2)}"
        if not bulge:
            parts.append(f"L {target}")
            continue
        radius = math.dist((x1, y1), (x2, y2)) * (1.0 + bulge**2) / (4.0 * abs(bulge))
        parts.append(f"A {_number(radius)} {_number(radius)} 0 0 {int(bulge > 0.0)} {target}")
    return " ".join([*parts, "Z"] if path.closed else parts)


def _number(value: float) -> str:
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


# A file of measurements to fill in, with every length of a sheet of coupons.

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
"""Instructions for measuring, as comments of the file."""


def skeleton(sheet: CouponSheet, machine: Machine | None) -> str:
    """Return the TOML text of a file for the measurements of a sheet; 0.0 means not measured."""
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
    """Return the compensation of the machine as text, for the user to change if it was off while
    cutting."""
    if machine is None:
        return "# compensation_mm = { x = 0.0, y = 0.0 }   # added at reversals while cutting"
    x, y = machine.axes.x.compensation_mm, machine.axes.y.compensation_mm
    return f"compensation_mm = {{ x = {x!r}, y = {y!r} }}   # added at reversals while cutting"


def _value(value: Any) -> str:
    return json.dumps(value)
