"""Measurements of coupons as their TOML file may say them, strictly: types, signs, sizes.

    target = "pic-mmh"               # whose coupons they are
    uncertainty_mm = 0.001           # standard uncertainty of each reading; left out: not known
    compensation_mm = { x = 0.0 }    # added at reversals while cutting; left out: the machine's

    [[lines]]                        # and [[squares]], [[circles]], [[steps]], [[closures]]
    axis = "x"
    ...

A coupon may say its own `uncertainty_mm` and `compensation_mm`, and the `source` of its numbers.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec

from camtool.calibration.records import KINDS, MOST_TIMES, Added, Coupon, RegionsOf
from camtool.errors import InputError, MachineError
from camtool.machine.loader import convert, read_table
from camtool.machine.ranges import Tolerance


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file without its coupons, whose tables are known by name only."""

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
    """A file of measurements: its coupons with their names, such as "lines 2"."""

    file: str
    target: str
    uncertainty_mm: float | None
    compensation_mm: Added
    regions: RegionsOf
    coupons: tuple[tuple[str, Coupon], ...]


def read_measurements(path: Path) -> Measurements:
    """The file, checked; InputError names file, table, key and mend."""
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
        file,
        head.target,
        head.uncertainty_mm,
        head.compensation_mm,
        head.regions,
        tuple(coupons),
    )


def _tables(value: Any, kind: str, file: str) -> list[dict[str, Any]]:
    """The tables of a kind of coupon."""
    if not isinstance(value, list) or not all(isinstance(each, dict) for each in value):
        raise InputError(
            "is no array of tables", file=file, where=f"key {kind}", mend=f"write [[{kind}]]"
        )
    return value


def _check_regions(regions: RegionsOf, coupons: list[tuple[str, Coupon]], file: str) -> None:
    """InputError for cells that are no grid, and for a cell without a coupon."""
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
        there = {coupon.region for _, coupon in coupons if axis in coupon.axes}
        for name in sorted(cells.every - there):
            raise InputError(
                f"no coupon of {axis} was measured in the region {name!r}",
                file=file,
                where=f"table [regions.{axis}], key names",
                mend="name the regions as the coupons do",
            )


def _coupon(values: dict[str, Any], kind: type[Coupon], file: str, name: str) -> Coupon:
    """One table as its record, checked."""
    try:
        coupon = convert(values, kind, file)
    except MachineError as error:
        raise _as_input(error, file, f"[[{kind.kind}]] {name.split()[1]}, {error.where}") from None
    for key, wrong, mend in coupon.faults():
        raise InputError(wrong, file=file, where=_where(name, key), mend=mend)
    for key, measured, nominal in coupon.lengths():
        times = measured / nominal
        if not 1.0 / MOST_TIMES < times < MOST_TIMES:
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
    """What may have gone wrong with a length that is so many times its nominal one."""
    units = {"µm": 1000.0, "cm": 0.1, "m": 0.001, "inches": 1.0 / 25.4, "thousandths": 39.37}
    for unit, factor in units.items():
        if 1.0 / MOST_TIMES < times / factor < MOST_TIMES:
            return f"write it in mm: it seems to be in {unit}"
    return "look at the nominal length too: it is what the program commanded, in mm"


def _as_input(error: MachineError, file: str, where: str | None) -> InputError:
    return InputError(error.message, file=file, where=where, mend=error.mend)
