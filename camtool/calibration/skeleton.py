"""A file of measurements to fill in: every length of a sheet of coupons, by name."""

from __future__ import annotations

import json
from typing import Any

from camtool.calibration.coupons import Kind, Sheet
from camtool.machine.model import Machine

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
