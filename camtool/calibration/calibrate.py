"""Measurements of coupons in, the machine's numbers with their uncertainties out.

read_measurements   a file, checked                            measurements.py
readings_of         each coupon as equations                   readings.py, model.py
solve               least squares, and what cannot be told     solve.py
calibrate           all of it, in the machine's own words      here
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from camtool.calibration.measurements import Measurements
from camtool.calibration.model import SQUARENESS, Model, Parameter, Reading
from camtool.calibration.readings import readings_of
from camtool.calibration.solve import OUTLIER_SIGMAS, Solution, solve
from camtool.errors import InputError
from camtool.machine.model import Axis, Machine

NONE_LEFT_SIGMAS = 3.0
"""A play below zero by no more than so many standard uncertainties, or than a step, is none;
beyond, a fault of the measurements."""


@dataclass(frozen=True)
class Estimate:
    """A number of the machine: as its file said it, as measured, and its standard uncertainty
    (None: not known). `readings` depend on it. Steps and play in mm, squareness in rad."""

    what: str
    axis: str
    region: str
    before: float
    value: float
    uncertainty: float | None
    readings: int

    @property
    def name(self) -> str:
        """Such as "step of x" or "play of y in V2"."""
        return str(Parameter(self.what, self.axis, self.region))


@dataclass(frozen=True)
class NotEstimated:
    """A number that the readings do not say, with the reason."""

    name: str
    why: str


@dataclass(frozen=True)
class Fitted:
    """A reading beside what the estimates make of it; `sigmas`: residual over its standard
    deviation, None where that is not known."""

    reading: Reading
    predicted_mm: float
    sigmas: float | None

    @property
    def residual_mm(self) -> float:
        """Measured less predicted."""
        return self.reading.measured_mm - self.predicted_mm

    @property
    def outlier(self) -> bool:
        """It stands out from what the others say."""
        return self.sigmas is not None and abs(self.sigmas) > OUTLIER_SIGMAS


@dataclass(frozen=True)
class Calibration:
    """Everything that was found. `freedom`: readings more than parameters; `spread_mm`: the
    residuals' standard deviation, None without freedom; `uncertainty_mm`: of the instrument, the
    root mean square where readings differ, None when not said of all."""

    target: str
    file: str
    estimates: tuple[Estimate, ...]
    not_estimated: tuple[NotEstimated, ...]
    fitted: tuple[Fitted, ...]
    freedom: int
    spread_mm: float | None
    uncertainty_mm: float | None

    def estimate(self, what: str, axis: str = "", region: str = "") -> Estimate | None:
        """The estimate of this number, if there is one."""
        for each in self.estimates:
            if (each.what, each.axis, each.region) == (what, axis, region):
                return each
        return None


def calibrate(measurements: Measurements, machine: Machine) -> Calibration:
    """The numbers of `machine` that the measurements say.

    InputError when the file is of another target, when nothing in it was measured, and for a play
    below zero.
    """
    _same_target(measurements, machine)
    readings = readings_of(measurements, machine)
    if not readings:
        raise InputError(
            "nothing was measured yet", file=measurements.file, mend="fill in the lengths"
        )
    model = Model(readings)
    solution = solve(model, model.start(machine))
    estimates = (*_plain(model, solution, machine), *_mean_plays(model, solution, machine))
    for estimate in estimates:
        _no_negative_play(estimate, machine, measurements.file)
    known = [reading.uncertainty_mm for reading in readings if reading.uncertainty_mm]
    predicted = solution.predicted.tolist()
    residuals = [r.measured_mm - p for r, p in zip(readings, predicted, strict=True)]
    freedom = solution.freedom
    return Calibration(
        target=machine.target.name,
        file=measurements.file,
        estimates=estimates,
        not_estimated=tuple(NotEstimated(str(each.parameter), each.why) for each in solution.held),
        fitted=tuple(
            Fitted(reading, expected, _sigmas(residual, sigma))
            for reading, expected, residual, sigma in zip(
                readings, predicted, residuals, solution.sigma.tolist(), strict=True
            )
        ),
        freedom=freedom,
        spread_mm=_norm(residuals) / math.sqrt(freedom) if freedom > 0 else None,
        uncertainty_mm=_norm(known) / math.sqrt(len(known))
        if len(known) == len(readings)
        else None,
    )


def _same_target(measurements: Measurements, machine: Machine) -> None:
    if measurements.target not in ("", machine.target.name, machine.target.dialect):
        raise InputError(
            f"was measured on {measurements.target}, not on {machine.target.name}",
            file=measurements.file,
            where="key target",
            mend=f"give --target {measurements.target}, or mend the key",
        )


def _plain(model: Model, solution: Solution, machine: Machine) -> list[Estimate]:
    """The parameters that were estimated, in the machine's units."""
    start = model.start(machine)
    depends = model.depends(solution.values)
    found = []
    for column, parameter in enumerate(model.parameters):
        if not solution.free[column]:
            continue
        before, value = float(start[column]), float(solution.values[column])
        sure = solution.uncertainty([column])
        what = parameter.what
        if parameter == SQUARENESS:
            before, value, sure = math.atan(before), math.atan(value), sure / (1.0 + value**2)
        elif what == "scale":
            axis: Axis = getattr(machine.axes, parameter.axis)
            coded, what = axis.coded_step_mm, "step"
            before, value, sure = axis.real_step_mm, value * coded, sure * coded
        count = int(depends[:, column].sum())
        known = sure if math.isfinite(sure) else None
        found.append(Estimate(what, parameter.axis, parameter.region, before, value, known, count))
    return found


def _mean_plays(model: Model, solution: Solution, machine: Machine) -> list[Estimate]:
    """The play of axes that were measured in regions: the mean, if all regions were told."""
    depends = model.depends(solution.values)
    found = []
    for axis in ("x", "y"):
        columns = [
            column
            for column, each in enumerate(model.parameters)
            if each.what == "play" and each.axis == axis and each.region
        ]
        if columns and all(solution.free[column] for column in columns):
            count = int(depends[:, columns].any(axis=1).sum())
            sure = solution.uncertainty(columns)
            said: Axis = getattr(machine.axes, axis)
            value = float(solution.values[columns].mean())
            known = sure if math.isfinite(sure) else None
            found.append(Estimate("play", axis, "", said.backlash_mm, value, known, count))
    return found


def _no_negative_play(estimate: Estimate, machine: Machine, file: str) -> None:
    """InputError for a play below zero by more than a step and more than its uncertainty."""
    if estimate.what != "play":
        return
    axis: Axis = getattr(machine.axes, estimate.axis)
    slack_mm = max(axis.coded_step_mm, NONE_LEFT_SIGMAS * (estimate.uncertainty or 0.0))
    if estimate.value < -slack_mm:
        raise InputError(
            f"{estimate.name} comes out as {estimate.value:.4g} mm, which no machine has",
            file=file,
            mend="were the two lines (or rows) exchanged, or was compensation_mm not what the "
            "controller added while cutting?",
        )


def _norm(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values))


def _sigmas(residual: float, sigma: float) -> float | None:
    return residual / sigma if math.isfinite(sigma) and sigma > 0.0 else None
