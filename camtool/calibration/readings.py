"""The coupons of a file as readings: `camtool.calibration.model` derives what each one means."""

from __future__ import annotations

import math
from collections.abc import Iterator

from camtool.calibration.measurements import Measurements
from camtool.calibration.model import Course, Diagonal, Diameter, Measure, Reading, Way
from camtool.calibration.records import Added, Circle, Closure, Coupon, Lines, Square, Steps
from camtool.machine.model import Axis, Machine


def readings_of(measurements: Measurements, machine: Machine) -> list[Reading]:
    """Every length that was measured, in the order of the file."""
    found: list[Reading] = []
    for name, coupon in measurements.coupons:
        courses = {
            axis: Course(
                axis,
                _added_mm(axis, getattr(machine.axes, axis), coupon, measurements),
                coupon.region,
            )
            for axis in ("x", "y", "z")
        }
        uncertainty_mm = coupon.uncertainty_mm or measurements.uncertainty_mm
        found += [
            Reading(name, called, length_mm, uncertainty_mm, measure, coupon.source)
            for called, length_mm, measure in _measures(coupon, courses)
        ]
    return found


Measured = Iterator[tuple[str, float, Measure]]


def _measures(coupon: Coupon, courses: dict[str, Course]) -> Measured:
    """(name, mm, what it is) of each length of a coupon that was measured."""
    match coupon:
        case Lines():
            yield from _lines(coupon, courses[coupon.axis])
        case Square():
            yield from _square(coupon, courses["x"], courses["y"])
        case Circle():
            yield from _circle(coupon, courses["x"], courses["y"])
        case Steps():
            yield from _steps(coupon, courses[coupon.axis])
        case Closure():
            for axis, gap in (("x", coupon.gap_x_mm), ("y", coupon.gap_y_mm)):
                if gap is not None:
                    yield f"gap in {axis}", gap, Way(courses[axis], 0.0, 1)


def _lines(lines: Lines, course: Course) -> Measured:
    if lines.first_mm:
        yield "first line", lines.first_mm, Way(course, lines.nominal_mm, 0)
    if lines.second_mm:
        yield "second line", lines.second_mm, Way(course, lines.nominal_mm, -1)
    if lines.shorter_by_mm is not None:
        yield "shorter by", lines.shorter_by_mm, Way(course, 0.0, 1)


def _square(square: Square, x: Course, y: Course) -> Measured:
    width, height = square.nominal_mm
    across, up = Way(x, width, -1), Way(y, height, -1)
    if square.dx_mm:
        yield "Dx", square.dx_mm, across
    if square.dy_mm:
        yield "Dy", square.dy_mm, up
    rising, falling = square.diagonals_mm or (0.0, 0.0)
    if rising:
        yield "rising diagonal", rising, Diagonal(across, up)
    if falling:
        yield "falling diagonal", falling, Diagonal(Way(x, -width, 1), up)


def _circle(circle: Circle, x: Course, y: Course) -> Measured:
    for degrees, diameter in zip(circle.angles, circle.diameters_mm, strict=True):
        if diameter:
            angle, ccw = math.radians(degrees), circle.direction == "ccw"
            measure = Diameter(x, y, 0.5 * circle.nominal_mm, angle, ccw)
            yield f"diameter at {degrees:g}°", diameter, measure


def _steps(steps: Steps, course: Course) -> Measured:
    aside_mm = steps.rows_apart_mm if steps.axis == "x" else 0.0
    for called, values, turned, aside in (
        ("forward", steps.forward_mm, 0, 0.0),
        ("backward", steps.backward_mm, 1, aside_mm),
    ):
        for nominal, value in zip(steps.nominal_mm, values or (), strict=False):
            if value:
                yield f"{called} at {nominal:g} mm", value, Way(course, nominal, turned, aside)


def _added_mm(axis: str, machine: Axis, coupon: Coupon, measurements: Measurements) -> float:
    """What the controller added at each reversal of the axis, in its own mm: whole steps."""
    said = coupon.compensation_mm or Added()
    for value in (getattr(said, axis), getattr(measurements.compensation_mm, axis)):
        if value is not None:
            return _whole_steps(value, machine)
    return _whole_steps(machine.compensation_mm, machine)


def _whole_steps(value_mm: float, axis: Axis) -> float:
    return round(value_mm / axis.coded_step_mm) * axis.coded_step_mm
