"""The equations of the readings: how each measured length follows from the values of the machine.

When an axis is commanded to X and reaches it in +, its slide is at k·X; when it reaches X in −, at

    k·(X − C) + B

k is the real over the coded step, B the backlash and C what the controller adds at each reversal,
in its own mm: at a reversal the motor moves by C more, of which the mechanics lose B. (This is for
slides engaged in + at the start; centred slides are shifted as a whole, which changes no
distance.) On the table x = slide_x + q·slide_y and y = slide_y, where q is the tangent of the
squareness, the angle by which that between +X and +Y is less than 90°.

So between two positions that are n commanded mm apart along an axis, the slide moves by

    d = k·n + m·(B − k·C),     m = [second reached in −] − [first reached in −]  ∈ {−1, 0, 1}

and most coupons are a choice of n and m:

lines     the first line runs from a mark reached in + to the bridge, reached in +: n, m = 0; the
          second from the bridge back to a mark reached in −: n, m = −1. It is shorter by B − k·C.
          (PIC thesis, L2353-2423; parallel-port thesis, L1165.)
squares   edges reached from opposite sides: n = size, m = −1 on both axes. Diagonals are the
          distances of the corners, (Dx, Dy) and (−Dx, Dy) sheared: their difference is squareness.
steps     n and m = 0 forwards; n and m = 1 backwards, measured from the same zero. Along X, where
          the rows are a apart in Y, q·a is added.
closures  n = 0, m = 1.

Circles. In commanded mm, with e = B/k − C for each axis, a point that an axis passes in − is
shifted by e on that axis: a circle of radius r becomes four quarters with different centres,
symmetric about (e_x, e_y)/2. From there the quarter in the direction u has its centre at
s = (±e_x, ±e_y)/2, + for axes that run in −. After a reversal the slide waits until the motor has
come back by e, which cuts the quarter off at the extreme, r − e/2 from the middle. Hence

    D(u) = 2·min( u·s + √(r² − (u×s)²), (r − e_a/2) / |u_a| ),

where a is the axis that has just reversed. Along an axis, from extreme to extreme, D is 2r − e. On
the table the circle is sheared and stretched. Because straight lines stay straight, the diameter
along the direction t is D(u) / |v| with v = ((cos t − q·sin t) / k_x, sin t / k_y), u = v / |v|.

All equations also accept complex numbers, so that the solver can take derivatives without
subtraction: the imaginary part of f(p + i·h) / h."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.calibration.measurements import (
    Added,
    CircleCoupon,
    ClosureCoupon,
    Coupon,
    LinesCoupon,
    Measurements,
    SquareCoupon,
    StepsCoupon,
)
from camtool.machine.model import Axis, Machine

ALONG_AXIS = 1e-9
"""A diameter lies along an axis when the sine of the angle between them is below this."""

ROUNDING = 1e-12
"""Derivatives below this part of the largest by the same parameter are rounding errors."""

DERIVATIVE_STEP = 1e-30
"""Imaginary part with which derivatives are computed: its square vanishes beside any number."""


class Parameter(Struct, frozen=True):
    """A value to estimate: `what` is "scale", "play" or "squareness"; only play has a `region`."""

    what: str
    axis: str
    region: str = ""

    def __str__(self) -> str:
        region = f" in {self.region}" if self.region else ""
        return f"{self.what} of {self.axis}{region}" if self.axis else self.what


SQUARENESS = Parameter("squareness", "")


class CutAxis(Struct, frozen=True):
    """An axis during the cut of a coupon: the compensation that the controller added, and the
    region."""

    axis: str
    added_mm: float
    region: str = ""


class ParameterValues:
    """Trial values of the parameters, real or complex, by the names in the equations."""

    def __init__(self, values: Sequence[Any], columns: dict[Parameter, int]) -> None:
        self._values, self._columns = values, columns
        self.tangent = values[columns[SQUARENESS]]

    def scale(self, course: CutAxis) -> Any:
        """Return k of an axis."""
        return self._values[self._columns[Parameter("scale", course.axis)]]

    def lost(self, course: CutAxis) -> Any:
        """Return B − k·C of an axis, mm. If its backlash is measured in regions, coupons without a
        region use the mean of all regions."""
        own_column = self._columns.get(Parameter("play", course.axis, course.region))
        if own_column is not None:
            play = self._values[own_column]
        else:
            each = [
                self._values[column]
                for parameter, column in self._columns.items()
                if parameter.what == "play" and parameter.axis == course.axis
            ]
            play = sum(each) / len(each)
        return play - self.scale(course) * course.added_mm


class Measure(Protocol):
    """A length measured on a coupon."""

    @property
    def courses(self) -> tuple[CutAxis, ...]:
        """Axes on which the length depends."""

    @property
    def nominal(self) -> str:
        """Nominal length as text, such as "Ø 6 mm" or "X 2.5 mm"; equal for repeated lengths."""

    def predict(self, trial: ParameterValues) -> Any:
        """Compute the length by the model, mm."""


class AxisDistance(Struct, frozen=True):
    """The distance along one axis between two positions: `nominal_mm` and `turned` are n and m of
    the second equation above. Along X, `aside_mm` is how much further towards +Y the second
    position lies."""

    course: CutAxis
    nominal_mm: float
    turned: int
    aside_mm: float = 0.0

    @property
    def courses(self) -> tuple[CutAxis, ...]:
        return (self.course,)

    @property
    def nominal(self) -> str:
        region = f" in {self.course.region}" if self.course.region else ""
        play = ("", " and the play", " less the play")[self.turned]
        return f"{self.course.axis.upper()} {self.nominal_mm:g} mm{play}{region}"

    def predict(self, trial: ParameterValues) -> Any:
        length = trial.scale(self.course) * self.nominal_mm + self.turned * trial.lost(self.course)
        return length + trial.tangent * self.aside_mm


class Diagonal(Struct, frozen=True):
    """The distance between two positions, from their distances along X and Y."""

    x: AxisDistance
    y: AxisDistance

    @property
    def courses(self) -> tuple[CutAxis, ...]:
        return self.x.course, self.y.course

    @property
    def nominal(self) -> str:
        return f"diagonal of {abs(self.x.nominal_mm):g} × {self.y.nominal_mm:g} mm"

    def predict(self, trial: ParameterValues) -> Any:
        vertical = self.y.predict(trial)
        across = self.x.predict(trial) + trial.tangent * vertical
        return (across * across + vertical * vertical) ** 0.5


class Diameter(Struct, frozen=True):
    """A diameter of a circle, at an angle from the X axis towards the Y axis."""

    x: CutAxis
    y: CutAxis
    radius_mm: float
    angle_rad: float
    ccw: bool

    @property
    def courses(self) -> tuple[CutAxis, ...]:
        return self.x, self.y

    @property
    def nominal(self) -> str:
        return f"Ø {2.0 * self.radius_mm:g} mm"

    def predict(self, trial: ParameterValues) -> Any:
        cosine, sine = math.cos(self.angle_rad), math.sin(self.angle_rad)
        v_x = (cosine - trial.tangent * sine) / trial.scale(self.x)
        v_y = sine / trial.scale(self.y)
        size = (v_x * v_x + v_y * v_y) ** 0.5
        e_x = trial.lost(self.x) / trial.scale(self.x)
        e_y = trial.lost(self.y) / trial.scale(self.y)
        if abs(sine) < ALONG_AXIS:
            return (2.0 * self.radius_mm - e_x) / size
        if abs(cosine) < ALONG_AXIS:
            return (2.0 * self.radius_mm - e_y) / size
        return 2.0 * self._from_middle((v_x / size, v_y / size), (e_x, e_y)) / size

    def _from_middle(self, u: tuple[Any, Any], e: tuple[Any, Any]) -> Any:
        """Return half of D(u), mm: the distance of an end from the middle."""
        turn = 1.0 if self.ccw else -1.0
        runs_back = -turn * u[1].real < 0.0, turn * u[0].real < 0.0
        s_x, s_y = (
            0.5 * part if is_backward else -0.5 * part
            for part, is_backward in zip(e, runs_back, strict=True)
        )
        offset = u[0] * s_y - u[1] * s_x
        quarter = u[0] * s_x + u[1] * s_y + (self.radius_mm**2 - offset * offset) ** 0.5
        reversed_axis = 0 if (u[0].real * u[1].real > 0.0) == self.ccw else 1
        part = u[reversed_axis]
        extreme = (self.radius_mm - 0.5 * e[reversed_axis]) / (part if part.real > 0.0 else -part)
        return min(quarter, extreme, key=lambda distance: distance.real)


@dataclass(frozen=True)
class MeasuredLength:
    """One measured length, mm, with its standard uncertainty where that is known. `coupon` and
    `name` identify it, `source` is where its numbers come from."""

    coupon: str
    name: str
    measured_mm: float
    uncertainty_mm: float | None
    measure: Measure
    source: str = ""


class Model:
    """The parameters of a set of readings, and the predicted readings."""

    def __init__(self, readings: Sequence[MeasuredLength]) -> None:
        self.readings = tuple(readings)
        courses = [course for reading in readings for course in reading.measure.courses]
        axes = sorted({course.axis for course in courses})
        self.parameters: tuple[Parameter, ...] = (
            *(Parameter("scale", axis) for axis in axes),
            *(Parameter("play", axis, name) for axis in axes for name in _regions(courses, axis)),
            SQUARENESS,
        )
        self._columns = {parameter: column for column, parameter in enumerate(self.parameters)}

    def start(self, machine: Machine) -> Floats:
        """Return the values (P,) of the machine's file."""
        return np.array([_value_in_file(parameter, machine) for parameter in self.parameters])

    def predict(self, values: Floats) -> Floats:
        """Predict the readings (n,) mm for values (P,) of the parameters."""
        trial = ParameterValues(values.tolist(), self._columns)
        return np.array([reading.measure.predict(trial) for reading in self.readings])

    def slopes(self, values: Floats) -> Floats:
        """Compute the derivatives (n, P) of the predictions by the parameters."""
        columns = []
        for column in range(len(values)):
            stepped = values.astype(np.complex128)
            stepped[column] += 1j * DERIVATIVE_STEP
            trial = ParameterValues(stepped.tolist(), self._columns)
            predicted = [complex(reading.measure.predict(trial)) for reading in self.readings]
            columns.append([value.imag / DERIVATIVE_STEP for value in predicted])
        return np.array(columns).T

    def depends(self, values: Floats) -> Bools:
        """Return the mask (n, P) of readings that depend on a parameter."""
        slopes = np.abs(self.slopes(values))
        return np.asarray(slopes > ROUNDING * slopes.max(axis=0))


def _regions(courses: Sequence[CutAxis], axis: str) -> Iterator[str]:
    """Return the named regions of an axis in order, or one without a name."""
    named = dict.fromkeys(each.region for each in courses if each.axis == axis and each.region)
    yield from named or ("",)


def _value_in_file(parameter: Parameter, machine: Machine) -> float:
    if parameter == SQUARENESS:
        return math.tan(machine.mechanics.squareness_rad)
    axis: Axis = getattr(machine.axes, parameter.axis)
    if parameter.what == "scale":
        return axis.real_step_mm / axis.coded_step_mm
    return axis.backlash_mm


# The readings of the coupons in a file.


def readings_of(measurements: Measurements, machine: Machine) -> list[MeasuredLength]:
    """Return all measured lengths, in the order of the file."""
    lengths: list[MeasuredLength] = []
    for name, coupon in measurements.coupons:
        courses = {
            axis: CutAxis(
                axis,
                _added_mm(axis, getattr(machine.axes, axis), coupon, measurements),
                coupon.region,
            )
            for axis in ("x", "y", "z")
        }
        uncertainty_mm = coupon.uncertainty_mm or measurements.uncertainty_mm
        lengths += [
            MeasuredLength(name, quantity, length_mm, uncertainty_mm, measure, coupon.source)
            for quantity, length_mm, measure in _measures(coupon, courses)
        ]
    return lengths


Measured = Iterator[tuple[str, float, Measure]]


def _measures(coupon: Coupon, courses: dict[str, CutAxis]) -> Measured:
    """Yield (name, mm, measure) of each measured length of a coupon."""
    match coupon:
        case LinesCoupon():
            yield from _lines(coupon, courses[coupon.axis])
        case SquareCoupon():
            yield from _square(coupon, courses["x"], courses["y"])
        case CircleCoupon():
            yield from _circle(coupon, courses["x"], courses["y"])
        case StepsCoupon():
            yield from _steps(coupon, courses[coupon.axis])
        case ClosureCoupon():
            for axis, gap in (("x", coupon.gap_x_mm), ("y", coupon.gap_y_mm)):
                if gap is not None:
                    yield f"gap in {axis}", gap, AxisDistance(courses[axis], 0.0, 1)


def _lines(lines: LinesCoupon, course: CutAxis) -> Measured:
    if lines.first_mm:
        yield "first line", lines.first_mm, AxisDistance(course, lines.nominal_mm, 0)
    if lines.second_mm:
        yield "second line", lines.second_mm, AxisDistance(course, lines.nominal_mm, -1)
    if lines.shorter_by_mm is not None:
        yield "shorter by", lines.shorter_by_mm, AxisDistance(course, 0.0, 1)


def _square(square: SquareCoupon, x: CutAxis, y: CutAxis) -> Measured:
    width, height = square.nominal_mm
    across, vertical = AxisDistance(x, width, -1), AxisDistance(y, height, -1)
    if square.dx_mm:
        yield "Dx", square.dx_mm, across
    if square.dy_mm:
        yield "Dy", square.dy_mm, vertical
    rising, falling = square.diagonals_mm or (0.0, 0.0)
    if rising:
        yield "rising diagonal", rising, Diagonal(across, vertical)
    if falling:
        yield "falling diagonal", falling, Diagonal(AxisDistance(x, -width, 1), vertical)


def _circle(circle: CircleCoupon, x: CutAxis, y: CutAxis) -> Measured:
    for degrees, diameter in zip(circle.angles, circle.diameters_mm, strict=True):
        if diameter:
            angle, ccw = math.radians(degrees), circle.direction == "ccw"
            measure = Diameter(x, y, 0.5 * circle.nominal_mm, angle, ccw)
            yield f"diameter at {degrees:g}°", diameter, measure


def _steps(steps: StepsCoupon, course: CutAxis) -> Measured:
    aside_mm = steps.rows_apart_mm if steps.axis == "x" else 0.0
    for quantity, values, turns, offset in (
        ("forward", steps.forward_mm, 0, 0.0),
        ("backward", steps.backward_mm, 1, aside_mm),
    ):
        for nominal, value in zip(steps.nominal_mm, values or (), strict=False):
            if value:
                yield (
                    f"{quantity} at {nominal:g} mm",
                    value,
                    AxisDistance(course, nominal, turns, offset),
                )


def _added_mm(axis: str, machine: Axis, coupon: Coupon, measurements: Measurements) -> float:
    """Return the compensation that the controller added at reversals of the axis, in its own mm:
    whole steps."""
    added = coupon.compensation_mm or Added()
    for value in (getattr(added, axis), getattr(measurements.compensation_mm, axis)):
        if value is not None:
            return _whole_steps(value, machine)
    return _whole_steps(machine.compensation_mm, machine)


def _whole_steps(value_mm: float, axis: Axis) -> float:
    return round(value_mm / axis.coded_step_mm) * axis.coded_step_mm
