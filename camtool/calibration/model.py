"""What each measured length says of the machine: one equation for each reading.

An axis that is commanded to X, reached in +, has its slide at k·X; reached in −, at

    k·(X − C) + B

k is the real over the coded step, B the play and C what the controller adds at each reversal,
in its own mm: at a reversal the motor moves by C more, of which the mechanics lose B. (Slides
engaged in + at the start; centred ones are shifted as a whole, and no distance changes.)
The table shows x = slide_x + tan(g)·slide_y, y = slide_y: g is the squareness, by which the angle
between +X and +Y falls short of 90°.

So between two places that are n commanded mm apart along an axis, the slide's way is

    d = k·n + m·(B − k·C),     m = [second reached in −] − [first reached in −]  ∈ {−1, 0, 1}

and every kind of coupon is a choice of n and m:

lines     the first line goes from a mark reached in + to the bridge, reached in +: n, m = 0; the
          second from the bridge back to a mark reached in −: n, m = −1. It is shorter by B − k·C.
          (PIC thesis §5, L2353-2423; parallel-port thesis, L1165.)
squares   edges reached from opposite sides: n = size, m = −1 on both axes. Diagonals are the
          distances of the corners, (Dx, Dy) and (−Dx, Dy) sheared: their difference is squareness.
circles   a diameter at angle t from the X axis: n = D·cos t and D·sin t, seen along its direction;
          m from which way each axis runs at either end. Just behind a reversal the slide waits
          until the motor has come back by B − k·C: there its place is that of the reversal.
          Diameters along an axis are its extremes: m = −1.
steps     n and m = 0 forwards; n and m = 1 backwards, measured from the same zero.
closures  n = 0, m = 1.

k and B enter the slides' ways linearly, tan(g) times slide_y is a product of two: the solver
takes first derivatives and repeats, which is exact after one round where nothing is a product.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.machine.model import Axis, Machine

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Parameter:
    """One number to estimate: `what` is scale, play or squareness; `region` only of play."""

    what: str
    axis: str
    region: str = ""

    def __str__(self) -> str:
        at = f" in {self.region}" if self.region else ""
        return f"{self.what} of {self.axis}{at}" if self.axis else self.what


SQUARENESS = Parameter("squareness", "")


@dataclass(frozen=True)
class Way:
    """A way of one axis between two places of a coupon: `nominal_mm` commanded, `turned` as m."""

    axis: str
    nominal_mm: float
    turned: int
    added_mm: float
    region: str = ""


@dataclass(frozen=True)
class Reading:
    """One measured length: the ways of the axes between its two ends, seen along `direction`
    (radians from the X axis), or their length where that is None. `name` says which it is."""

    coupon: str
    name: str
    measured_mm: float
    uncertainty_mm: float | None
    ways: tuple[Way, ...]
    direction: float | None = None
    source: str = ""


class Model:
    """The parameters of a set of readings, and what the readings should be for values of them.

    Where the play of an axis was measured in regions, its play elsewhere is their mean.
    """

    def __init__(self, readings: Sequence[Reading]) -> None:
        ways = [way for reading in readings for way in reading.ways]
        axes = sorted({way.axis for way in ways})
        self._regions = {axis: _regions(ways, axis) for axis in axes}
        self.parameters: tuple[Parameter, ...] = (
            *(Parameter("scale", axis) for axis in axes),
            *(Parameter("play", axis, name) for axis in axes for name in self._regions[axis]),
            SQUARENESS,
        )
        self._column = {parameter: k for k, parameter in enumerate(self.parameters)}

    def start(self, machine: Machine) -> Floats:
        """(P,) what the machine's file says so far."""
        axes = {"x": machine.axes.x, "y": machine.axes.y, "z": machine.axes.z}
        return np.array([_said(parameter, axes, machine) for parameter in self.parameters])

    def lost_mm(self, values: Floats, way: Way) -> tuple[float, Floats]:
        """B − k·C of a way, mm, and its derivatives (P,)."""
        slope = np.zeros(len(values))
        every = self._regions[way.axis]
        names = (way.region,) if way.region in every else every
        for name in names:
            slope[self._column[Parameter("play", way.axis, name)]] = 1.0 / len(names)
        slope[self._column[Parameter("scale", way.axis)]] = -way.added_mm
        return float(slope @ values), slope

    def waits(self, values: Floats) -> Callable[[Way], float]:
        """For `camtool.calibration.readings`: B/k − C of a way, in commanded mm."""

        def wait(way: Way) -> float:
            scale = float(values[self._column[Parameter("scale", way.axis)]])
            return self.lost_mm(values, way)[0] / scale

        return wait

    def depends(self, reading: Reading, column: int, values: Floats) -> bool:
        """Whether a reading says anything of a parameter."""
        return bool(self.predict(values, reading)[1][column] != 0.0)

    def predict(self, values: Floats, reading: Reading) -> tuple[float, Floats]:
        """What the reading should be, mm, and its derivatives by the parameters (P,)."""
        ways = {way.axis: self._way(values, way) for way in reading.ways}
        if reading.direction is None and len(ways) == 1:
            [(value, slope)] = ways.values()
            return value, slope
        (x, x_slope), (y, y_slope) = ways["x"], ways["y"]
        tangent = values[self._column[SQUARENESS]]
        x, x_slope = x + tangent * y, x_slope + tangent * y_slope
        x_slope[self._column[SQUARENESS]] += y
        if reading.direction is None:
            along = (x / math.hypot(x, y), y / math.hypot(x, y))
        else:
            along = (math.cos(reading.direction), math.sin(reading.direction))
        return along[0] * x + along[1] * y, along[0] * x_slope + along[1] * y_slope

    def _way(self, values: Floats, way: Way) -> tuple[float, Floats]:
        lost, slope = self.lost_mm(values, way)
        slope = way.turned * slope
        scale = self._column[Parameter("scale", way.axis)]
        slope[scale] += way.nominal_mm
        return values[scale] * way.nominal_mm + way.turned * lost, slope


def _regions(ways: Sequence[Way], axis: str) -> tuple[str, ...]:
    """The named regions of an axis in their order; one without a name where there are none."""
    named = dict.fromkeys(way.region for way in ways if way.axis == axis and way.region)
    return tuple(named) or ("",)


def _said(parameter: Parameter, axes: Mapping[str, Axis], machine: Machine) -> float:
    if parameter == SQUARENESS:
        return math.tan(machine.mechanics.squareness_rad)
    axis = axes[parameter.axis]
    if parameter.what == "scale":
        return axis.real_step_mm / axis.coded_step_mm
    return axis.backlash_mm
