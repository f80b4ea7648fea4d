"""Numbers of the writer: what the dialect can say, and the steps that the controller makes of it.

A *unit* is the finest difference that the form can say: 0.01 µm in the example form, 1 µm in the
annex form. A position is held twice, as whole units (what is sent) and as whole steps (where the
controller then stands):  steps = round(units · unit / step), half away from zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ._pic_mmh_options import Dialect

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

HALF_STEP_TOLERANCE: Final = 1e-6
"""A coordinate within this much (in steps) of half a step is half-way between two steps."""

UNITS_PER_MM: Final = {"example": 100_000, "annex": 1_000}
MOST_UNITS: Final = {"example": 9_999_999, "annex": 99_999}


def say_example(units: int) -> str:
    """`02969.00`, `-00000.14`: five digits, a point, two digits; whole units in, so never `-0`."""
    whole, rest = divmod(abs(units), 100)
    return f"{'-' if units < 0 else ''}{whole:05d}.{rest:02d}"


def say_annex(units: int) -> str:
    """`+02969`, `-00001`: always a sign, then five digits."""
    return f"{units:+06d}"


SAY: Final = {"example": say_example, "annex": say_annex}


@dataclass(frozen=True)
class Grid:
    """The units of one form laid over the steps of one axis."""

    units_per_mm: int
    most_units: int
    step_mm: float

    @classmethod
    def of(cls, dialect: Dialect, step_mm: float) -> Grid:
        """The grid of a form for an axis whose coded step is `step_mm`."""
        return cls(UNITS_PER_MM[dialect.form], MOST_UNITS[dialect.form], step_mm)

    @property
    def resolution_mm(self) -> float:
        """The coarser of unit and step."""
        return max(1.0 / self.units_per_mm, self.step_mm)

    def fits(self, values_mm: Floats) -> Bools:
        """Which values are finite and have no more digits than the form."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(np.abs(values_mm) * self.units_per_mm < self.most_units + 0.5)

    def units(self, values_mm: Floats) -> Ints:
        """Values (mm, any shape) as whole units; they must fit.

        A value that would lie half-way between two steps is said one unit farther from zero: the
        step stays the same, and no longer hangs on the last bit of the controller's division.
        """
        scaled = values_mm * self.units_per_mm
        units = (np.sign(scaled) * np.floor(np.abs(scaled) + 0.5)).astype(np.int64)
        in_steps = np.abs(units) / (self.units_per_mm * self.step_mm)
        halfway = np.abs(in_steps - np.floor(in_steps) - 0.5) < HALF_STEP_TOLERANCE
        return np.asarray(units + np.where(halfway, np.sign(units), 0))

    def steps(self, units: Ints) -> Ints:
        """The steps at which the controller stands after being sent these units."""
        in_steps = np.abs(units) / (self.units_per_mm * self.step_mm)
        return np.asarray((np.sign(units) * np.floor(in_steps + 0.5)).astype(np.int64))

    def nearest_units(self, steps: Ints) -> Ints:
        """The units nearest to these steps; `says` tells which of them really mean the step."""
        scaled = steps * (self.units_per_mm * self.step_mm)
        return np.asarray(np.rint(scaled).astype(np.int64))

    def says(self, steps: Ints) -> Bools:
        """Which steps some whole unit means (the nearest one, if any does)."""
        units = self.nearest_units(steps)
        return np.asarray((self.steps(units) == steps) & (np.abs(units) <= self.most_units))
