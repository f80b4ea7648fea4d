"""The file of measurements of coupons, with strict checks of types, signs and sizes.

    target = "pic-mmh"               # the target whose coupons they are
    uncertainty_mm = 0.001           # standard uncertainty of each reading; left out: not known
    compensation_mm = { x = 0.0 }    # added at reversals while cutting; left out: the machine's

    [[lines]]                        # and [[squares]], [[circles]], [[steps]], [[closures]]
    axis = "x"
    ...

A coupon may have its own `uncertainty_mm` and `compensation_mm`, and the `source` of its numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import msgspec
from msgspec import Meta

from camtool.errors import InputError, MachineError
from camtool.machine.ranges import Length, Lost, Place, Reading, Tolerance
from camtool.tables import convert, read_table

# The kinds of coupon: types, signs, sizes.

Pair = tuple[Length, Length]
Flat = Literal["x", "y"]
Any3 = Literal["x", "y", "z"]

_ZERO_IS_A_RESULT = ("shorter_by_mm", "gap_x_mm", "gap_y_mm")

MAX_RATIO = 2.0
"""A length more than this many times its nominal one, or less than that part of it, is a mistake:
a wrong unit, a missing digit."""


class Added(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The compensation that the controller added at reversals while cutting, mm; None: that of the
    machine file."""

    x: Lost | None = None
    y: Lost | None = None
    z: Lost | None = None


class Regions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The cells of the table in which the backlash of an axis was measured, as in `[play_map]` of
    a machine: edges in table coordinates; `names[j][i]` is the region of the coupons in a cell."""

    x_mm: tuple[Place, ...]
    y_mm: tuple[Place, ...]
    names: tuple[tuple[str, ...], ...]

    @property
    def every(self) -> frozenset[str]:
        """Return the names of all cells."""
        return frozenset(name for row in self.names for name in row)


class RegionsOf(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The regions of X and of Y, None for an axis without regions."""

    x: Regions | None = None
    y: Regions | None = None


class Coupon(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Keys that every coupon may have besides its lengths; `region` names the part of the table in
    which it lies."""

    kind: ClassVar[str]
    readings: ClassVar[tuple[str, ...]]
    """The keys of the measured values of the coupon."""

    source: str = ""
    region: str = ""
    uncertainty_mm: Tolerance | None = None
    compensation_mm: Added | None = None

    @property
    def axes(self) -> str:
        """Axes whose backlash the coupon may determine."""
        return "xy"

    @property
    def measured(self) -> bool:
        """True if anything is measured: 0.0 is a reading still to be filled in, except where it is
        a possible result (`shorter_by_mm`, gaps)."""
        for key in self.readings:
            value = getattr(self, key)
            readings = value if isinstance(value, tuple) else (value,)
            if any(readings) or (value is not None and key in _ZERO_IS_A_RESULT):
                return True
        return False

    def lengths(self) -> Iterator[tuple[str, float, float]]:
        """Return (key, measured, nominal) of each length that must be near a nominal one, mm."""
        return iter(())

    def faults(self) -> Iterator[tuple[str, str, str]]:
        """Return (key, fault, correction) of faults that the types do not reveal."""
        return iter(())


class LinesCoupon(Coupon, frozen=True, kw_only=True):
    """Two parallel lines along an axis, joined at one end. `first_mm` is the line that was cut
    in +, `second_mm` the other one, or `shorter_by_mm` how much it falls short of the first."""

    kind = "lines"
    readings = ("first_mm", "second_mm", "shorter_by_mm")

    axis: Flat
    nominal_mm: Length
    first_mm: Reading | None = None
    second_mm: Reading | None = None
    shorter_by_mm: Place | None = None

    @property
    def axes(self) -> str:
        return self.axis

    def lengths(self) -> Iterator[tuple[str, float, float]]:
        if self.first_mm:
            yield "first_mm", self.first_mm, self.nominal_mm

    def faults(self) -> Iterator[tuple[str, str, str]]:
        if self.second_mm is not None and self.shorter_by_mm is not None:
            yield "shorter_by_mm", "says what second_mm says", "leave one of them out"
        for key, value in (("second_mm", self.second_mm), ("shorter_by_mm", self.shorter_by_mm)):
            if value is not None and abs(value) > MAX_RATIO * self.nominal_mm:
                yield key, f"is {value:g} on a line of {self.nominal_mm:g} mm", "write it in mm"


class SquareCoupon(Coupon, frozen=True, kw_only=True):
    """A rectangle whose opposite edges were reached from opposite sides. `diagonals_mm`: from
    the lower left to the upper right corner, and from the upper left to the lower right one."""

    kind = "squares"
    readings = ("dx_mm", "dy_mm", "diagonals_mm")

    nominal_mm: Pair
    dx_mm: Reading | None = None
    dy_mm: Reading | None = None
    diagonals_mm: tuple[Reading, Reading] | None = None

    def lengths(self) -> Iterator[tuple[str, float, float]]:
        width, height = self.nominal_mm
        if self.dx_mm:
            yield "dx_mm", self.dx_mm, width
        if self.dy_mm:
            yield "dy_mm", self.dy_mm, height
        for diagonal in filter(None, self.diagonals_mm or ()):
            yield "diagonals_mm", diagonal, (width**2 + height**2) ** 0.5


class CircleCoupon(Coupon, frozen=True, kw_only=True):
    """A full circle, cut in a `direction`. `diameters_mm` are those at `angles_deg` from the X
    axis towards the Y axis, or at equal angles over half a turn from the X axis on."""

    kind = "circles"
    readings = ("diameters_mm",)

    nominal_mm: Length
    direction: Literal["cw", "ccw"]
    diameters_mm: tuple[Reading, ...]
    angles_deg: tuple[Annotated[float, Meta(ge=-360.0, le=360.0)], ...] | None = None

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of the diameters, degrees."""
        count = len(self.diameters_mm)
        return self.angles_deg or tuple(180.0 * k / count for k in range(count))

    def lengths(self) -> Iterator[tuple[str, float, float]]:
        for diameter in filter(None, self.diameters_mm):
            yield "diameters_mm", diameter, self.nominal_mm

    def faults(self) -> Iterator[tuple[str, str, str]]:
        if self.angles_deg is not None and len(self.angles_deg) != len(self.diameters_mm):
            yield (
                "angles_deg",
                f"has {len(self.angles_deg)} angles for {len(self.diameters_mm)} diameters",
                "give each diameter its angle, or leave it out for evenly spread ones",
            )


class StepsCoupon(Coupon, frozen=True, kw_only=True):
    """A ruler: positions at `nominal_mm` from a zero that was reached in +. `forward_mm` were
    reached in + too, `backward_mm` in −, at the same nominal positions, in a row that lies
    `rows_apart_mm` to the + side of the first."""

    kind = "steps"
    readings = ("forward_mm", "backward_mm")

    axis: Any3
    nominal_mm: tuple[Length, ...]
    forward_mm: tuple[Reading, ...] | None = None
    backward_mm: tuple[Place, ...] | None = None
    rows_apart_mm: Place = 0.0

    @property
    def axes(self) -> str:
        return self.axis

    def lengths(self) -> Iterator[tuple[str, float, float]]:
        for measured, nominal in zip(self.forward_mm or (), self.nominal_mm, strict=False):
            if measured:
                yield "forward_mm", measured, nominal

    def faults(self) -> Iterator[tuple[str, str, str]]:
        for key, values in (("forward_mm", self.forward_mm), ("backward_mm", self.backward_mm)):
            if values is not None and len(values) != len(self.nominal_mm):
                yield (
                    key,
                    f"has {len(values)} readings for {len(self.nominal_mm)} nominal places",
                    "give one for each; 0.0 is one not taken",
                )
            for value in values or ():
                if abs(value) > MAX_RATIO * max(self.nominal_mm):
                    yield key, f"{value:g} is far beyond the ruler", "write it in mm"


class ClosureCoupon(Coupon, frozen=True, kw_only=True):
    """A closed contour, begun in + on both axes and ended in −: the distance of its end from its
    start, mm, positive towards +. `nominal_mm` is its size, for the check of the gaps."""

    kind = "closures"
    readings = ("gap_x_mm", "gap_y_mm")

    nominal_mm: Pair
    gap_x_mm: Place | None = None
    gap_y_mm: Place | None = None

    def faults(self) -> Iterator[tuple[str, str, str]]:
        gaps = (("gap_x_mm", self.gap_x_mm), ("gap_y_mm", self.gap_y_mm))
        for (key, gap), size in zip(gaps, self.nominal_mm, strict=True):
            if gap is not None and abs(gap) > size:
                yield key, f"is {gap:g} on a contour of {size:g} mm", "write it in mm"


KINDS: tuple[type[Coupon], ...] = (
    LinesCoupon,
    SquareCoupon,
    CircleCoupon,
    StepsCoupon,
    ClosureCoupon,
)
"""The kinds of tables in a file, in order."""


# The file.


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file without its coupons; their tables are listed by name only."""

    target: str = ""
    uncertainty_mm: Tolerance | None = None
    compensation_mm: Added = Added()
    regions: RegionsOf = RegionsOf()
    lines: tuple[()] = ()
    squares: tuple[()] = ()
    circles: tuple[()] = ()
    steps: tuple[()] = ()
    closures: tuple[()] = ()


class Measurements(msgspec.Struct, frozen=True):
    """A file of measurements: its measured coupons with their names, such as "lines 2"."""

    file: str
    target: str
    uncertainty_mm: float | None
    compensation_mm: Added
    regions: RegionsOf
    coupons: tuple[tuple[str, Coupon], ...]


def read_measurements(path: Path) -> Measurements:
    """Read and check a file; InputError names file, table, key and the correction."""
    file = str(path)
    try:
        table = read_table(path)
        tables = {kind.kind: _tables(table.pop(kind.kind, []), kind.kind, file) for kind in KINDS}
        head = convert(table, _Head, file)
    except MachineError as error:
        raise _as_input(error, file, error.where) from None
    coupons = []
    for kind in KINDS:
        for number, values in enumerate(tables[kind.kind], start=1):
            name = f"{kind.kind} {number}"
            coupons.append((name, _coupon(values, kind, file, name)))
    if not coupons:
        raise InputError(
            "no coupon is in it",
            file=file,
            mend="`camtool coupon lines --measurements FILE` writes a file to fill in",
        )
    coupons = [(name, coupon) for name, coupon in coupons if coupon.measured]
    if not coupons:
        raise InputError(
            "nothing was measured", file=file, mend="fill in what was; 0.0 stands for what was not"
        )
    _check_regions(head.regions, coupons, file)
    return Measurements(
        file, head.target, head.uncertainty_mm, head.compensation_mm, head.regions, tuple(coupons)
    )


def _tables(value: Any, kind: str, file: str) -> list[dict[str, Any]]:
    """Return the tables of a kind of coupon."""
    if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
        raise InputError(
            "is no array of tables", file=file, where=f"key {kind}", mend=f"write [[{kind}]]"
        )
    return value


def _check_regions(regions: RegionsOf, coupons: list[tuple[str, Coupon]], file: str) -> None:
    """Raise InputError for cells that are not a grid, and for a cell without a coupon."""
    for axis, cells in (("x", regions.x), ("y", regions.y)):
        if cells is None:
            continue
        for key in ("x_mm", "y_mm"):
            edges = getattr(cells, key)
            if len(edges) < 2 or any(a >= b for a, b in pairwise(edges)):
                raise InputError(
                    "is no row of ascending edges",
                    file=file,
                    where=f"table [regions.{axis}], key {key}",
                    mend="write two edges or more, each above the one before",
                )
        rows, columns = len(cells.y_mm) - 1, len(cells.x_mm) - 1
        if len(cells.names) != rows or any(len(row) != columns for row in cells.names):
            raise InputError(
                f"is not {rows} rows (along y_mm) of {columns} names (along x_mm)",
                file=file,
                where=f"table [regions.{axis}], key names",
            )
        measured = {coupon.region for _, coupon in coupons if axis in coupon.axes}
        for name in sorted(cells.every - measured):
            raise InputError(
                f"no coupon of {axis} was measured in the region {name!r}",
                file=file,
                where=f"table [regions.{axis}], key names",
                mend="name the regions as the coupons do",
            )


def _coupon(values: dict[str, Any], kind: type[Coupon], file: str, name: str) -> Coupon:
    """Convert one table to a checked record."""
    try:
        coupon = convert(values, kind, file)
    except MachineError as error:
        raise _as_input(error, file, f"[[{kind.kind}]] {name.split()[1]}, {error.where}") from None
    for key, complaint, mend in coupon.faults():
        raise InputError(complaint, file=file, where=_where(name, key), mend=mend)
    for key, measured, nominal in coupon.lengths():
        times = measured / nominal
        if not 1.0 / MAX_RATIO < times < MAX_RATIO:
            raise InputError(
                f"{measured:g} is {times:.3g} times the nominal {nominal:g} mm",
                file=file,
                where=_where(name, key),
                mend=_unit_meant(times),
            )
    return coupon


def _where(name: str, key: str) -> str:
    kind, number = name.split()
    return f"[[{kind}]] {number}, key {key}"


def _unit_meant(times: float) -> str:
    """Return the advice for a length that is `times` as large as its nominal one, such as a
    mistaken unit."""
    units = {"µm": 1000.0, "cm": 0.1, "m": 0.001, "inches": 1.0 / 25.4, "thousandths": 39.37}
    for unit, factor in units.items():
        if 1.0 / MAX_RATIO < times / factor < MAX_RATIO:
            return f"write it in mm: it seems to be in {unit}"
    return "look at the nominal length too: it is what the program commanded, in mm"


def _as_input(error: MachineError, file: str, place: str | None) -> InputError:
    return InputError(error.message, file=file, where=place, mend=error.mend)
