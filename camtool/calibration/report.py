"""A calibration as text and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from camtool.calibration.calibrate import Calibration, Estimate, Fitted
from camtool.machine.model import Axis, Machine
from camtool.units import UM_PER_MM


def to_text(calibration: Calibration, machine: Machine) -> str:
    """The numbers, what was not estimated, the residuals, what the controller should add."""
    return "\n".join(_text(calibration, machine))


def to_data(calibration: Calibration, machine: Machine) -> dict[str, Any]:
    """The same as JSON has it; lengths in mm, residuals in µm, squareness in rad."""
    return {
        "target": calibration.target,
        "file": calibration.file,
        "freedom": calibration.freedom,
        "spread_um": _um(calibration.spread_mm),
        "instrument_um": _um(calibration.uncertainty_mm),
        "estimates": [
            {
                "what": each.what,
                "axis": each.axis,
                "region": each.region,
                "unit": _unit(each),
                "before": each.before,
                "value": each.value,
                "uncertainty": each.uncertainty,
                "readings": each.readings,
            }
            for each in calibration.estimates
        ],
        "not_estimated": [
            {"name": each.name, "why": each.why} for each in calibration.not_estimated
        ],
        "compensation": [
            {"axis": axis, "mm": mm, "steps": steps}
            for axis, mm, steps in compensations(calibration, machine)
        ],
        "readings": [
            {
                "coupon": each.reading.coupon,
                "name": each.reading.name,
                "measured_mm": each.reading.measured_mm,
                "predicted_mm": each.predicted_mm,
                "residual_um": _um(each.residual_mm),
                "sigmas": each.sigmas,
                "outlier": each.outlier,
                "source": each.reading.source,
            }
            for each in calibration.fitted
        ],
    }


def compensations(calibration: Calibration, machine: Machine) -> Iterator[tuple[str, float, int]]:
    """(axis, mm, whole steps) that a controller would have to add at reversals to take up the
    play that was found: B/k, in its own mm."""
    for axis in ("x", "y", "z"):
        play, step = calibration.estimate("play", axis), calibration.estimate("step", axis)
        if play is not None:
            said: Axis = getattr(machine.axes, axis)
            steps = round(max(play.value, 0.0) / (step.value if step else said.real_step_mm))
            yield axis, steps * said.coded_step_mm, steps


def outliers(calibration: Calibration) -> list[str]:
    """One line for each reading that stands out."""
    return [
        f"{each.reading.coupon}, {each.reading.name}: {each.residual_mm * UM_PER_MM:+.1f} µm off, "
        f"{abs(each.sigmas or 0.0):.1f} standard deviations"
        for each in calibration.fitted
        if each.outlier
    ]


def _text(calibration: Calibration, machine: Machine) -> Iterator[str]:
    rows = [_row(each) for each in calibration.estimates]
    yield from _columns([("number", "before", "measured", "±", "unit", "readings"), *rows])
    for unknown in calibration.not_estimated:
        yield f"not estimated: {unknown.name}: {unknown.why}"
    for axis, mm, steps in compensations(calibration, machine):
        said: Axis = getattr(machine.axes, axis)
        if said.compensation_mm > 0.0:
            yield (
                f"compensation of {axis} that takes up this play: {mm:.4f} mm, {steps} steps "
                f"(the machine's file says {said.compensation_mm:g} mm)"
            )
    yield ""
    yield from _columns(
        [
            ("coupon", "reading", "measured", "predicted", "residual", ""),
            *map(_fit, calibration.fitted),
        ]
    )
    yield ""
    yield _spread(calibration)


def _row(each: Estimate) -> tuple[str, ...]:
    sure = "not known" if each.uncertainty is None else f"{each.uncertainty:.2g}"
    before, value = f"{each.before:.6g}", f"{each.value:.6g}"
    return each.name, before, value, sure, _unit(each), str(each.readings)


def _fit(each: Fitted) -> tuple[str, ...]:
    mark = "outlier" if each.outlier else ""
    measured, predicted = f"{each.reading.measured_mm:.4f}", f"{each.predicted_mm:.4f}"
    residual = f"{each.residual_mm * UM_PER_MM:+.1f} µm"
    return each.reading.coupon, each.reading.name, measured, predicted, residual, mark


def _spread(calibration: Calibration) -> str:
    if calibration.spread_mm is None:
        return "as many readings as numbers: nothing tells how well they fit"
    text = (
        f"residuals {calibration.spread_mm * UM_PER_MM:.1f} µm (standard deviation, "
        f"{calibration.freedom} degrees of freedom)"
    )
    if calibration.uncertainty_mm is not None:
        text += f"; instrument {calibration.uncertainty_mm * UM_PER_MM:.1f} µm"
    return text


def _unit(each: Estimate) -> str:
    return "rad" if each.what == "squareness" else "mm"


def _um(mm: float | None) -> float | None:
    return None if mm is None else mm * UM_PER_MM


def _columns(rows: list[tuple[str, ...]]) -> Iterator[str]:
    """Rows of text, their columns under each other: the first left, numbers right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    text = {0, 1} if rows[0][1] == "reading" else {0}
    for row in rows:
        cells = [
            cell.ljust(width) if column in text else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(cells).rstrip()
