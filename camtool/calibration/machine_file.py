"""The machine file of a calibration, for `--machine`: it extends the target.

The values of the user's own machine file stay; measured values replace them, each with its
uncertainty and its source in a comment."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from camtool.calibration.calibrate import Calibration, Estimate
from camtool.calibration.measurements import Measurements, Regions
from camtool.machine.model import Machine
from camtool.tables import Table, toml_lines

WITHIN_UNCERTAINTY = 0.02
"""Values are rounded to this part of their uncertainty."""

DIGITS = 9
"""Significant digits of values whose uncertainty is not known."""

UNCERTAINTY_DIGITS = 3


def machine_file(
    calibration: Calibration, measurements: Measurements, machine: Machine, user_table: Table
) -> str:
    """Return the TOML text of a machine file. `machine` has the values before the calibration;
    `user_table` is the table of the user's file, or one with only the key `extends`."""
    table: Table = json.loads(json.dumps(user_table))  # a copy, tables and all
    notes: dict[str, str] = {}
    for axis in ("x", "y", "z"):
        for quantity, key in (("step", "real_step_mm"), ("play", "backlash_mm")):
            estimate = calibration.estimate(quantity, axis)
            if estimate is not None:
                _set(table, f"axes.{axis}.{key}", _rounded(estimate))
                notes[f"axes.{axis}.{key}"] = _note(estimate, calibration)
    squareness = calibration.estimate("squareness")
    if squareness is not None:
        _set(table, "mechanics.squareness_rad", _rounded(squareness))
        notes["mechanics.squareness_rad"] = _note(squareness, calibration)
    _set_map(table, notes, calibration, measurements, machine)
    _set_uncertainty(table, notes, calibration)
    head = (
        f"# {machine.target.name}, calibrated from {_without_path(calibration.file)}.",
        "# ± is the standard uncertainty.",
        "",
    )
    return "\n".join([*head, *toml_lines(table, notes)]) + "\n"


def _set_map(
    table: Table,
    notes: dict[str, str],
    calibration: Calibration,
    measurements: Measurements,
    machine: Machine,
) -> None:
    """Set, in place, the map of backlash by region for axes measured in all regions; switch off an
    older map of an axis whose backlash was measured as a whole."""
    for axis in ("x", "y"):
        cells: Regions | None = getattr(measurements.regions, axis)
        unmapped = calibration.estimate("play", axis)
        if cells is not None and unmapped is not None:
            plays = {name: calibration.estimate("play", axis, name) for name in cells.every}
            rows = [[_rounded(plays[name]) for name in row] for row in cells.names]
            _set(table, "play_map.use", True)
            _set(table, f"play_map.{axis}.x_mm", list(cells.x_mm))
            _set(table, f"play_map.{axis}.y_mm", list(cells.y_mm))
            _set(table, f"play_map.{axis}.play_mm", rows)
            worst = max(
                filter(None, (each.uncertainty for each in plays.values() if each)), default=None
            )
            notes[f"play_map.{axis}.play_mm"] = (
                f"{_uncertainty_words(worst)}, {_without_path(calibration.file)}"
            )
        elif unmapped is not None and machine.play_map.use and getattr(machine.play_map, axis):
            _set(table, "play_map.use", False)
            notes["play_map.use"] = f"the play of {axis} was measured as a whole since"


def _set_uncertainty(file_table: Table, notes: dict[str, str], calibration: Calibration) -> None:
    """Set, in place, the uncertainties of the measured values, and remove older ones of the same
    values; others are kept."""
    measured = [
        f"{axis}.{key}"
        for axis in ("x", "y")
        for quantity, key in (("step", "scale"), ("play", "backlash_mm"))
        if calibration.estimate(quantity, axis) is not None
    ]
    if calibration.estimate("squareness") is not None:
        measured.append("squareness_rad")
    uncertainty, earlier = calibration.known, file_table.get("uncertainty", {})
    for key in measured:
        table, _, name = f"uncertainty.{key}".rpartition(".")
        _table(file_table, table).pop(name, None)
        standard = uncertainty.standard(key)
        if standard is not None:
            _set(file_table, f"uncertainty.{key}", float(f"{standard:.{UNCERTAINTY_DIGITS}g}"))
            notes[f"uncertainty.{key}"] = _without_path(calibration.file)
    for axis in ("x", "y"):
        if uncertainty.standard(f"{axis}.compensation_mm") is not None:
            _set(file_table, f"uncertainty.{axis}.compensation_mm", 0.0)
            notes[f"uncertainty.{axis}.compensation_mm"] = "what it errs by is in the backlash"
    older = [row for row in earlier.get("correlations", []) if not {*row[:2]} & {*measured}]
    if older or uncertainty.correlations:
        _set(file_table, "uncertainty.correlations", [*older, *uncertainty.correlations])
    elif "correlations" in earlier:
        del earlier["correlations"]


def _table(table: Table, path: str) -> Table:
    """Return the table at this path within `table`; it is added if there is none."""
    for name in path.split("."):
        table = table.get(name, {})
    return table


def _rounded(estimate: Estimate | None) -> float:
    """Round the value to a small part of its uncertainty; a backlash below 0 becomes 0."""
    assert estimate is not None
    value = max(estimate.value, 0.0) if estimate.what != "squareness" else estimate.value
    if estimate.uncertainty:
        decimals = math.ceil(-math.log10(WITHIN_UNCERTAINTY * estimate.uncertainty))
        return round(value, decimals) + 0.0
    return float(f"{value:.{DIGITS}g}")


def _note(estimate: Estimate, calibration: Calibration) -> str:
    readings = f"{estimate.readings} reading{'s' if estimate.readings != 1 else ''}"
    return (
        f"{_uncertainty_words(estimate.uncertainty)}, {readings} of "
        f"{_without_path(calibration.file)}; {estimate.before:.6g} before"
    )


def _uncertainty_words(uncertainty: float | None) -> str:
    return "uncertainty not known" if uncertainty is None else f"± {uncertainty:.2g}"


def _without_path(file: str) -> str:
    """Return the name of a file for a comment: without its folder, with printable characters
    only."""
    return "".join(char if char.isprintable() else "?" for char in Path(file).name)


def _set(table: Table, key: str, value: Any) -> None:
    *tables, name = key.split(".")
    for each in tables:
        table = table.setdefault(each, {})
    table[name] = value
