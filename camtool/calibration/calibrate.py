"""From measurements of coupons to the values of the machine, with their uncertainties.

measurements ─▶ readings, each an equation ─▶ `solve`, least squares ─▶ `calibrate`, in the
machine's units ─▶ `to_text`, `to_data`"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.calibration.measurements import Measurements
from camtool.calibration.model import SQUARENESS, MeasuredLength, Model, Parameter, readings_of
from camtool.errors import InputError
from camtool.machine.model import Axis, AxisUncertainty, Machine, Uncertainty
from camtool.units import UM_PER_MM

# Weighted least squares, and parameters that the readings do not determine.
#
#     minimise  Σ ((measured_i − predicted_i(p)) / u_i)²
#
# by Gauss-Newton: each round solves the problem linearised about the last values. One round is
# enough where the equations are linear, as all are but those of diagonals and circles. u_i is the
# standard uncertainty of a reading; where not all are known, all have the same weight. With A the
# weighted derivatives and s² = Σ residual² / (n − p),
#
#     covariance = s² (AᵀA)⁻¹,
#
# where s is at least 1 if the u_i are known: small residuals by chance do not make a reading
# better than its instrument.
#
# Parameters that the readings do not determine are fixed at the values of the machine's file:
# those on which no reading depends, and of those that occur only together the least important one,
# until the others are determined. The null space of A shows which they are.

ROUNDS = 50
"""Largest number of Gauss-Newton rounds; about five are usual."""

SETTLED = 1e-13
"""The solution is found when no parameter changes by more than this (of 1, of a mm, of a
tangent)."""

SINGULAR = 1e-9
"""Singular values below this part of the largest are zero: no reading determines their
direction."""

INVOLVED = 1e-6
"""A parameter belongs to an undetermined direction when its share in it is above this."""

OUTLIER_SIGMAS = 3.0

OUTLIER_FREEDOM = 4
"""The standard deviation of a residual is estimated from the other readings if these exceed the
parameters by at least this many; otherwise it is the uncertainty of the instrument."""


class FixedParameter(Struct, frozen=True):
    """A parameter that is not estimated, and the reason."""

    parameter: Parameter
    why: str


class Solution(Struct, frozen=True, eq=False):
    """The least-squares solution.

    `values` (P,) of the parameters in the order of the model, and their `covariance` (P, P): nan
    for fixed parameters, and where it is not known (as many readings as parameters, and no
    uncertainty of the instrument). `predicted` (n,) mm: the readings by the model; `sigma` (n,)
    mm: standard deviations of the residuals, nan where not known. `freedom`: number of readings
    less that of estimated parameters. `spread`: s, in mm where the u_i are not known, else in
    their units; nan without freedom."""

    values: Floats
    covariance: Floats
    predicted: Floats
    sigma: Floats
    free: Bools
    fixed: tuple[FixedParameter, ...]
    freedom: int
    spread: float

    def uncertainty(self, columns: Sequence[int]) -> float:
        """Return the standard uncertainty of the mean of the parameters `columns`; nan if
        unknown."""
        part = self.covariance[np.ix_(columns, columns)]
        return float(np.sqrt(part.sum())) / len(columns)


def solve(model: Model, start: Floats) -> Solution:
    """Fit the parameters of the model to its readings by least squares, from the values `start`
    (P,)."""
    uncertain_mm = [reading.uncertainty_mm or np.nan for reading in model.readings]
    has_uncertainty = bool(np.isfinite(uncertain_mm).all())
    weights = 1.0 / np.array(uncertain_mm) if has_uncertainty else np.ones(len(uncertain_mm))
    measured = np.array([reading.measured_mm for reading in model.readings])
    values = start.copy()
    is_free, fixed = _identifiable(model.parameters, model.slopes(values) * weights[:, None])
    for _ in range(ROUNDS):
        matrix = model.slopes(values)[:, is_free] * weights[:, None]
        residual = (measured - model.predict(values)) * weights
        change = np.linalg.lstsq(matrix, residual, rcond=None)[0]
        values[is_free] += change
        if not len(change) or np.abs(change).max() < SETTLED:
            break
    predicted = model.predict(values)
    matrix = model.slopes(values)[:, is_free] * weights[:, None]
    residual = (measured - predicted) * weights
    freedom = len(measured) - int(is_free.sum())
    spread = float(np.sqrt(residual @ residual / freedom)) if freedom > 0 else np.nan
    unit = np.fmax(spread, 1.0) if has_uncertainty else spread
    inverse = np.linalg.pinv(matrix)
    covariance = np.full((len(values), len(values)), np.nan)
    covariance[np.ix_(is_free, is_free)] = unit**2 * inverse @ inverse.T
    leverage = np.einsum("ij,ji->i", matrix, inverse)
    sigma = _sigma(residual, leverage, freedom, has_uncertainty=has_uncertainty) / weights
    return Solution(values, covariance, predicted, sigma, is_free, fixed, freedom, spread)


def _sigma(residual: Floats, leverage: Floats, freedom: int, *, has_uncertainty: bool) -> Floats:
    """Compute the standard deviation (n,) of each weighted residual, estimated from the other
    readings.

    Without reading i the sum of squares is smaller by r_i² / (1 − h_i), h the leverage. A reading
    that alone determines a parameter (h = 1) has no residual."""
    redundancy = np.clip(1.0 - leverage, 0.0, 1.0)
    is_testable = redundancy > SINGULAR
    sigmas = np.full(len(residual), 1.0 if has_uncertainty else np.nan)
    if freedom - 1 >= OUTLIER_FREEDOM:
        share = np.divide(
            residual**2, redundancy, out=np.zeros_like(redundancy), where=is_testable
        )
        squares = np.clip(residual @ residual - share, 0.0, None)
        sigmas = np.fmax(np.sqrt(squares / (freedom - 1)), 1.0 if has_uncertainty else 0.0)
    return np.where(is_testable, sigmas * np.sqrt(redundancy), np.nan)


def _identifiable(
    parameters: Sequence[Parameter], matrix: Floats
) -> tuple[Bools, tuple[FixedParameter, ...]]:
    """Return the mask (P,) of the parameters that the readings determine, and the other parameters
    with the reason."""
    size = np.linalg.norm(matrix, axis=0)
    is_free = size > 0.0
    touched = is_free.copy()
    while is_free.any():
        index = np.flatnonzero(is_free)
        _, singular, rows = np.linalg.svd(matrix[:, index] / size[index])
        rank = int((singular > SINGULAR * singular[0]).sum())
        if rank == len(index):
            break
        involved = index[np.abs(rows[rank:]).max(axis=0) > INVOLVED]
        is_free[max(involved, key=lambda column: (_fixing_order(parameters[column]), column))] = (
            False
        )
    fixed: list[FixedParameter] = []
    for column in np.flatnonzero(~is_free).tolist():
        reason = "no reading depends on it"
        if touched[column]:
            parts = np.linalg.lstsq(matrix[:, is_free], matrix[:, column], rcond=None)[0]
            shares = np.abs(parts) * size[is_free] > INVOLVED * size[column]
            partners = [
                str(parameters[other]) for other in np.flatnonzero(is_free)[shares].tolist()
            ]
            reason = f"the readings cannot distinguish it from {' and '.join(partners)}"
        fixed.append(FixedParameter(parameters[column], reason))
    return is_free, tuple(fixed)


def _fixing_order(parameter: Parameter) -> int:
    """Return the rank of a parameter among those that may be fixed; the highest is fixed first.
    The scale of a step ranks highest, since it is mostly known."""
    return ("play", "squareness", "scale").index(parameter.what)


# The values of the machine.

ZERO_SIGMAS = 3.0
"""A backlash below zero by at most this many standard uncertainties, or by a step, counts as zero;
a lower one is a fault of the measurements."""


COEFFICIENT_DECIMALS = 4


class Estimate(Struct, frozen=True):
    """An estimated value of the machine: `before` in its file, the measured `value` with its
    standard `uncertainty` (None: unknown), and the number of `readings` that depend on it. Steps
    and backlash (`what` is "play") in mm, squareness in rad."""

    what: str
    axis: str
    region: str
    before: float
    value: float
    uncertainty: float | None
    readings: int

    @property
    def name(self) -> str:
        """Name such as "step of x" or "play of y in V2"."""
        return str(Parameter(self.what, self.axis, self.region))


class NotEstimated(Struct, frozen=True):
    """A value that the readings do not determine, and the reason."""

    name: str
    why: str


class Fitted(Struct, frozen=True):
    """A reading and its prediction from the estimates; `sigmas`: residual divided by its standard
    deviation, None if that is unknown."""

    reading: MeasuredLength
    predicted_mm: float
    sigmas: float | None

    @property
    def residual_mm(self) -> float:
        """Measured value minus prediction."""
        return self.reading.measured_mm - self.predicted_mm

    @property
    def outlier(self) -> bool:
        """True if the residual exceeds `OUTLIER_SIGMAS`."""
        return self.sigmas is not None and abs(self.sigmas) > OUTLIER_SIGMAS


class Scatter(Struct, frozen=True):
    """The scatter of `count` readings of one `nominal` length, such as the eight diameters of a
    circle: their `mean_mm` and their standard deviation `sigma_mm` about it (n − 1)."""

    nominal: str
    count: int
    mean_mm: float
    sigma_mm: float


@dataclass(frozen=True)
class Calibration:
    """The result of a calibration. `freedom`: number of readings less that of estimated
    parameters; `spread_mm`: standard deviation of the residuals, None without freedom;
    `uncertainty_mm`: that of the instrument, as the root mean square over the readings, None when
    not known for all. `known`: how well the values are known with it, as machine files say it, for
    X and Y; given the values that are not estimated."""

    target: str
    file: str
    estimates: tuple[Estimate, ...]
    not_estimated: tuple[NotEstimated, ...]
    fitted: tuple[Fitted, ...]
    freedom: int
    spread_mm: float | None
    uncertainty_mm: float | None
    known: Uncertainty

    def estimate(self, quantity: str, axis: str = "", region: str = "") -> Estimate | None:
        """Return the estimate of this value, or None."""
        for each in self.estimates:
            if (each.what, each.axis, each.region) == (quantity, axis, region):
                return each
        return None


def calibrate(measurements: Measurements, machine: Machine) -> Calibration:
    """Estimate the values of `machine` from measurements.

    InputError for a file of another target, a file without measurements, and a backlash below
    zero."""
    _check_target(measurements, machine)
    readings = readings_of(measurements, machine)
    if not readings:
        raise InputError(
            "nothing was measured yet", file=measurements.file, mend="fill in the lengths"
        )
    model = Model(readings)
    solution = solve(model, model.start(machine))
    estimates = (*_estimates(model, solution, machine), *_mean_backlash(model, solution, machine))
    for estimate in estimates:
        _refuse_negative_backlash(estimate, machine, measurements.file)
    uncertainties = [reading.uncertainty_mm for reading in readings if reading.uncertainty_mm]
    predicted = solution.predicted.tolist()
    residuals = [r.measured_mm - p for r, p in zip(readings, predicted, strict=True)]
    freedom = solution.freedom
    return Calibration(
        target=machine.target.name,
        file=measurements.file,
        estimates=estimates,
        not_estimated=tuple(
            NotEstimated(str(each.parameter), each.why) for each in solution.fixed
        ),
        fitted=tuple(
            Fitted(reading, expected, _sigmas(residual, sigma))
            for reading, expected, residual, sigma in zip(
                readings, predicted, residuals, solution.sigma.tolist(), strict=True
            )
        ),
        freedom=freedom,
        spread_mm=_norm(residuals) / math.sqrt(freedom) if freedom > 0 else None,
        uncertainty_mm=_norm(uncertainties) / math.sqrt(len(uncertainties))
        if len(uncertainties) == len(readings)
        else None,
        known=_known_uncertainty(model, solution),
    )


def _check_target(measurements: Measurements, machine: Machine) -> None:
    if measurements.target not in ("", machine.target.name, machine.target.dialect):
        raise InputError(
            f"was measured on {measurements.target}, not on {machine.target.name}",
            file=measurements.file,
            where="key target",
            mend=f"give --target {measurements.target}, or change the key",
        )


def _estimates(model: Model, solution: Solution, machine: Machine) -> list[Estimate]:
    """Return the estimated parameters in the units of the machine."""
    start = model.start(machine)
    depends = model.depends(solution.values)
    estimates = []
    for column, parameter in enumerate(model.parameters):
        if not solution.free[column]:
            continue
        before, value = float(start[column]), float(solution.values[column])
        sigma = solution.uncertainty([column])
        quantity = parameter.what
        if parameter == SQUARENESS:
            before, value, sigma = (math.atan(before), math.atan(value), sigma / (1.0 + value**2))
        elif quantity == "scale":
            axis: Axis = getattr(machine.axes, parameter.axis)
            coded, quantity = axis.coded_step_mm, "step"
            before, value, sigma = axis.real_step_mm, value * coded, sigma * coded
        count = int(depends[:, column].sum())
        stated = sigma if math.isfinite(sigma) else None
        estimates.append(
            Estimate(quantity, parameter.axis, parameter.region, before, value, stated, count)
        )
    return estimates


def _mean_backlash(model: Model, solution: Solution, machine: Machine) -> list[Estimate]:
    """Return the mean backlash of each axis measured in regions, if it is estimated in all of
    them."""
    depends = model.depends(solution.values)
    estimates = []
    for axis in ("x", "y"):
        columns = [
            column
            for column, each in enumerate(model.parameters)
            if each.what == "play" and each.axis == axis and each.region
        ]
        if columns and all(solution.free[column] for column in columns):
            count = int(depends[:, columns].any(axis=1).sum())
            deviation = solution.uncertainty(columns)
            axis_record: Axis = getattr(machine.axes, axis)
            value = float(solution.values[columns].mean())
            stated = deviation if math.isfinite(deviation) else None
            estimates.append(
                Estimate("play", axis, "", axis_record.backlash_mm, value, stated, count)
            )
    return estimates


def _known_uncertainty(model: Model, solution: Solution) -> Uncertainty:
    """Compute the standard uncertainties of the estimates and their correlations.

    With J the derivatives of the machine's values by the parameters, their covariance is J C Jᵀ.
    Of the cells of an axis J takes the mean; their variance is the mean of those of the cells,
    which is more than that of the mean: a part lies in few cells. Readings that fit without any
    residual say nothing of their uncertainty. Where all coupons were cut with compensation, what
    it errs by is in the backlash."""
    covariance = np.nan_to_num(solution.covariance)
    certain = ~(np.diag(covariance) > 0.0)
    rows = {
        key: row for key, row in _rows(model, solution.values) if not certain[row != 0.0].any()
    }
    if not rows:
        return Uncertainty()
    slopes = np.array(list(rows.values()))
    joint = slopes @ covariance @ slopes.T
    for k, (key, row) in enumerate(rows.items()):
        if key.endswith("backlash_mm"):
            joint[k, k] = row @ np.diag(covariance)
    standard = dict(zip(rows, np.sqrt(np.diag(joint)).tolist(), strict=True))
    matrix = joint / np.sqrt(np.outer(np.diag(joint), np.diag(joint)))
    keys = list(rows)
    pairs = tuple(
        (keys[a], keys[b], round(float(matrix[a, b]), COEFFICIENT_DECIMALS) + 0.0)
        for a in range(len(keys))
        for b in range(a + 1, len(keys))
    )
    x, y = (
        AxisUncertainty(
            backlash_mm=standard.get(f"{axis}.backlash_mm"),
            scale=standard.get(f"{axis}.scale"),
            compensation_mm=0.0 if f"{axis}.backlash_mm" in standard and added else None,
        )
        for axis, added in (("x", _compensated(model, "x")), ("y", _compensated(model, "y")))
    )
    return Uncertainty(
        x=x,
        y=y,
        squareness_rad=standard.get("squareness_rad"),
        correlations=tuple(pair for pair in pairs if pair[2]),
    )


def _rows(model: Model, values: Floats) -> Iterator[tuple[str, Floats]]:
    """Yield (key of `[uncertainty]`, (P,) derivatives of its value by the parameters)."""
    for axis in "xy":
        for quantity, key in (("play", "backlash_mm"), ("scale", "scale")):
            is_own = [each.what == quantity and each.axis == axis for each in model.parameters]
            if any(is_own):
                divisor = np.where(is_own, values, 1.0) if quantity == "scale" else 1.0
                yield f"{axis}.{key}", np.array(is_own) / (sum(is_own) * divisor)
    lean = np.array([each == SQUARENESS for each in model.parameters])
    yield "squareness_rad", lean / (1.0 + values**2)


def _compensated(model: Model, axis: str) -> bool:
    """Return True if the controller added compensation at the reversals of an axis in every
    coupon."""
    courses = [each for reading in model.readings for each in reading.measure.courses]
    return all(each.added_mm > 0.0 for each in courses if each.axis == axis)


def _refuse_negative_backlash(estimate: Estimate, machine: Machine, file: str) -> None:
    """Raise InputError for a backlash below zero by more than a step and more than its
    uncertainty."""
    if estimate.what != "play":
        return
    axis: Axis = getattr(machine.axes, estimate.axis)
    slack_mm = max(axis.coded_step_mm, ZERO_SIGMAS * (estimate.uncertainty or 0.0))
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


# A calibration as text and as JSON.


def to_text(calibration: Calibration, machine: Machine) -> str:
    """Return a calibration as text: the estimates, the values that were not estimated, the
    compensation to set, and the residuals."""
    return "\n".join(_text(calibration, machine))


def to_data(calibration: Calibration, machine: Machine) -> dict[str, Any]:
    """Return a calibration as data for JSON; lengths in mm, residuals in µm, squareness in rad."""
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
        "uncertainty": _given_only(msgspec.to_builtins(calibration.known)),
        "compensation": [
            {"axis": axis, "mm": mm, "steps": steps}
            for axis, mm, steps in compensations(calibration, machine)
        ],
        "scatter": [
            {
                "nominal": each.nominal,
                "readings": each.count,
                "mean_mm": each.mean_mm,
                "sigma_um": _um(each.sigma_mm),
            }
            for each in scatters(calibration)
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


def _given_only(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table without unknown values."""
    inner = {
        key: _given_only(value) if isinstance(value, dict) else value
        for key, value in table.items()
    }
    return {key: value for key, value in inner.items() if value not in (None, {}, ())}


def compensations(calibration: Calibration, machine: Machine) -> Iterator[tuple[str, float, int]]:
    """Yield (axis, mm, whole steps) for each axis: what the controller must add at reversals to
    take up the measured backlash, B/k, in its own mm."""
    for axis in ("x", "y", "z"):
        play, step = calibration.estimate("play", axis), calibration.estimate("step", axis)
        if play is not None:
            axis_record: Axis = getattr(machine.axes, axis)
            steps = round(
                max(play.value, 0.0) / (step.value if step else axis_record.real_step_mm)
            )
            yield axis, steps * axis_record.coded_step_mm, steps


def scatters(calibration: Calibration) -> list[Scatter]:
    """Return the scatter of each nominal length with several readings, as in table 15 of the
    thesis on pic-mmh (L2528-2630): of the readings themselves, without a model, so that errors of
    the machine are included."""
    readings: dict[str, list[float]] = {}
    for each in calibration.fitted:
        readings.setdefault(each.reading.measure.nominal, []).append(each.reading.measured_mm)
    return [
        Scatter(nominal, len(values), statistics.fmean(values), statistics.stdev(values))
        for nominal, values in readings.items()
        if len(values) > 1
    ]


def outliers(calibration: Calibration) -> list[str]:
    """Return one line for each outlier."""
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
        axis_record: Axis = getattr(machine.axes, axis)
        if axis_record.compensation_mm > 0.0:
            yield (
                f"compensation of {axis} that takes up this play: {mm:.4f} mm, {steps} steps "
                f"(the machine's file says {axis_record.compensation_mm:g} mm)"
            )
    yield ""
    yield from _columns(
        [
            ("coupon", "reading", "measured", "predicted", "residual", ""),
            *map(_fit, calibration.fitted),
        ]
    )
    yield ""
    if repeated := scatters(calibration):
        head = ("repeated length", "readings", "mean", "σ", "3σ")
        yield from _columns([head, *map(_scatter_row, repeated)])
        yield ""
    yield _spread(calibration)


def _row(each: Estimate) -> tuple[str, ...]:
    deviation = "not known" if each.uncertainty is None else f"{each.uncertainty:.2g}"
    before, value = f"{each.before:.6g}", f"{each.value:.6g}"
    return each.name, before, value, deviation, _unit(each), str(each.readings)


def _fit(each: Fitted) -> tuple[str, ...]:
    mark = "outlier" if each.outlier else ""
    measured, predicted = f"{each.reading.measured_mm:.4f}", f"{each.predicted_mm:.4f}"
    residual = f"{each.residual_mm * UM_PER_MM:+.1f} µm"
    return each.reading.coupon, each.reading.name, measured, predicted, residual, mark


def _scatter_row(each: Scatter) -> tuple[str, ...]:
    sigma_um = each.sigma_mm * UM_PER_MM
    mean, sigma, three = f"{each.mean_mm:.4f}", f"{sigma_um:.1f} µm", f"{3.0 * sigma_um:.1f} µm"
    return each.nominal, str(each.count), mean, sigma, three


def _spread(calibration: Calibration) -> str:
    if calibration.spread_mm is None:
        return "as many readings as values: how well they fit is not known"
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
    """Align rows as text: words to the left, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    text = {0, 1} if rows[0][1] == "reading" else {0}
    for row in rows:
        cells = [
            cell.ljust(width) if column in text else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        yield "  ".join(cells).rstrip()
