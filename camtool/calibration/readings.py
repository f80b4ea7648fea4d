"""The coupons of a file as readings: `camtool.calibration.model` derives what each one means."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from camtool.calibration.measurements import (
    Added,
    Circle,
    Closure,
    Coupon,
    Lines,
    Measurements,
    Square,
    Steps,
)
from camtool.calibration.model import Reading, Way
from camtool.machine.model import Axis, Machine

Waits = Callable[[Way], float]
"""How far a motor comes back, in commanded mm, before its slide follows: B/k − C of a way."""

ALONG_AXIS = 1e-9
"""A diameter lies along an axis when the sine of the angle between them is below this."""


def readings_of(measurements: Measurements, machine: Machine, waits: Waits) -> list[Reading]:
    """Every length that was measured; `waits` decides what circles look like at reversals."""
    found: list[Reading] = []
    for name, coupon in measurements.coupons:
        found += _Coupon(name, coupon, measurements, machine).readings(waits)
    return found


class _Coupon:
    """One coupon with what it takes from the file and the machine."""

    def __init__(
        self, name: str, coupon: Coupon, measurements: Measurements, machine: Machine
    ) -> None:
        self.name, self.coupon = name, coupon
        self._default_mm = measurements.uncertainty_mm
        self._added = {
            axis: _added_mm(axis, getattr(machine.axes, axis), coupon, measurements)
            for axis in ("x", "y", "z")
        }

    def readings(self, waits: Waits) -> Iterator[Reading]:
        """The readings of the coupon."""
        match self.coupon:
            case Lines():
                yield from self._lines(self.coupon)
            case Square():
                yield from self._square(self.coupon)
            case Circle():
                yield from self._circle(self.coupon, waits)
            case Steps():
                yield from self._steps(self.coupon)
            case Closure():
                yield from self._closure(self.coupon)

    def _lines(self, lines: Lines) -> Iterator[Reading]:
        first = self._way(lines.axis, lines.nominal_mm, 0)
        second = self._way(lines.axis, lines.nominal_mm, -1)
        if lines.first_mm:
            yield self._reading("first line", lines.first_mm, first)
        if lines.second_mm:
            yield self._reading("second line", lines.second_mm, second)
        if lines.shorter_by_mm is not None:
            yield self._reading("shorter by", lines.shorter_by_mm, self._way(lines.axis, 0.0, 1))

    def _square(self, square: Square) -> Iterator[Reading]:
        width, height = square.nominal_mm
        across, up = self._way("x", width, -1), self._way("y", height, -1)
        if square.dx_mm:
            yield self._reading("Dx", square.dx_mm, across)
        if square.dy_mm:
            yield self._reading("Dy", square.dy_mm, up)
        rising, falling = square.diagonals_mm or (0.0, 0.0)
        if rising:
            yield self._reading("rising diagonal", rising, across, up)
        if falling:
            yield self._reading("falling diagonal", falling, self._way("x", -width, 1), up)

    def _circle(self, circle: Circle, waits: Waits) -> Iterator[Reading]:
        for degrees, diameter in zip(circle.angles, circle.diameters_mm, strict=True):
            if diameter:
                angle = math.radians(degrees)
                ways = self._diameter(circle, angle, waits)
                yield self._reading(f"diameter at {degrees:g}°", diameter, *ways, direction=angle)

    def _diameter(self, circle: Circle, angle: float, waits: Waits) -> tuple[Way, Way]:
        """The ways of both axes from one end of a diameter to the other."""
        cosine, sine = math.cos(angle), math.sin(angle)
        if abs(sine) < ALONG_AXIS:
            way = math.copysign(circle.nominal_mm, cosine)
            return self._way("x", way, -round(cosine)), self._way("y", 0.0, 0)
        if abs(cosine) < ALONG_AXIS:
            way = math.copysign(circle.nominal_mm, sine)
            return self._way("x", 0.0, 0), self._way("y", way, -round(sine))
        turn = 1.0 if circle.direction == "ccw" else -1.0
        towards = {"x": (cosine, -turn * sine), "y": (sine, turn * cosine)}
        ways = []
        for axis, (part, heading) in towards.items():
            radius = 0.5 * circle.nominal_mm
            wait = waits(self._way(axis, 0.0, 1))
            far = _place(radius, part, heading, wait)
            near = _place(radius, -part, -heading, wait)
            ways.append(self._way(axis, far[0] - near[0], far[1] - near[1]))
        return ways[0], ways[1]

    def _steps(self, steps: Steps) -> Iterator[Reading]:
        for called, values, turned in (
            ("forward", steps.forward_mm, 0),
            ("backward", steps.backward_mm, 1),
        ):
            for nominal, value in zip(steps.nominal_mm, values or (), strict=False):
                if value:
                    way = self._way(steps.axis, nominal, turned)
                    yield self._reading(f"{called} at {nominal:g} mm", value, way)

    def _closure(self, closure: Closure) -> Iterator[Reading]:
        for axis, gap in (("x", closure.gap_x_mm), ("y", closure.gap_y_mm)):
            if gap is not None:
                yield self._reading(f"gap in {axis}", gap, self._way(axis, 0.0, 1))

    def _way(self, axis: str, nominal_mm: float, turned: int) -> Way:
        return Way(axis, nominal_mm, turned, self._added[axis], self.coupon.region)

    def _reading(
        self, name: str, measured_mm: float, *ways: Way, direction: float | None = None
    ) -> Reading:
        return Reading(
            coupon=self.name,
            name=name,
            measured_mm=measured_mm,
            uncertainty_mm=self.coupon.uncertainty_mm or self._default_mm,
            ways=ways,
            direction=direction,
            source=self.coupon.source,
        )


def _place(radius: float, part: float, heading: float, wait: float) -> tuple[float, int]:
    """(commanded mm from the centre, 1 when reached in −) of a point of a circle on one axis,
    whose cosine there is `part` and which runs the way of `heading`.

    Where the motor has come back from a reversal by less than `wait`, the slide still stands at
    the reversal: at the far end as it was reached in +, at the near end as it was reached in −.
    """
    if heading < 0.0:
        return (radius, 0) if radius * (1.0 - part) < wait else (radius * part, 1)
    return (-radius, 1) if radius * (1.0 + part) < wait else (radius * part, 0)


def _added_mm(axis: str, machine: Axis, coupon: Coupon, measurements: Measurements) -> float:
    """What the controller added at each reversal of the axis, in its own mm: whole steps."""
    said: Added = coupon.compensation_mm or Added()
    for value in (getattr(said, axis), getattr(measurements.compensation_mm, axis)):
        if value is not None:
            return _whole_steps(value, machine)
    return _whole_steps(machine.compensation_mm, machine)


def _whole_steps(value_mm: float, axis: Axis) -> float:
    return round(value_mm / axis.coded_step_mm) * axis.coded_step_mm
