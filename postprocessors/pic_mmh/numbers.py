"""The writer's first stage: every number of a toolpath checked, and turned into the dialect's own.

Nothing is sent from here. What this machine or its dialect cannot do is a PostError that names
the move, its source and the value.

A *unit* is the finest difference that the form can represent: 0.01 µm in the example form, 1 µm in
the annex form. A position is kept twice, as whole units (what is sent) and as whole steps (where
the controller then stands):  steps = round(units · unit / step), half away from zero."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.machine.model import controller_of
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.refusals import refuse, refuse_start, refuse_two_radii

from .dialect import PicMmhController, PicMmhDialect, PicMmhMachine
from .findings import FEED_ROUNDED

HALF_STEP_TOLERANCE: Final = 1e-6
"""A coordinate within this much (in steps) of half a step is half-way between two steps."""

UNITS_PER_MM: Final = {"example": 100_000, "annex": 1_000}
MAX_UNITS: Final = {"example": 9_999_999, "annex": 99_999}

UNIT_TOLERANCE: Final = 1e-6
"""A feed within this much (in units of the feed word) of a limit or a whole unit is on it."""

MAX_FEED_UNITS: Final = 99
"""Largest feed word: two digits (L3297-3309)."""

ARC_RADIUS_SPREAD_MM: Final = 0.005
"""The radii at the start and at the end of an arc may differ by at most this. Rounding centre and
ends to 1 µm causes less (√2 µm at each end)."""

MAX_DWELL_S: Final = 9900.0
"""A longer dwell (100 blocks, 2¾ hours) is taken for a mistake."""

DWELL_DIGITS_S: Final = 99
"""Seconds that the two digits of one G04 can hold (L3359-3366)."""

MAX_SPINDLE: Final = 9999
"""Rev/min that the four digits of S can hold (L3418-3426)."""

MAX_TOOL: Final = 99
"""Tools that the two digits of T can hold (L3455-3464)."""


class UnitGrid(Struct, frozen=True):
    """The units in which a form writes coordinates, and the steps of one axis that they mean."""

    units_per_mm: int
    most_units: int
    step_mm: float

    @classmethod
    def of(cls, dialect: PicMmhDialect, step_mm: float) -> UnitGrid:
        """Return the grid of a form for an axis whose coded step is `step_mm`."""
        return cls(UNITS_PER_MM[dialect.form], MAX_UNITS[dialect.form], step_mm)

    @property
    def resolution_mm(self) -> float:
        """The coarser of unit and step."""
        return max(1.0 / self.units_per_mm, self.step_mm)

    def fits(self, values_mm: Floats) -> Bools:
        """Return a mask, true for values that are finite and have no more digits than the form."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(np.abs(values_mm) * self.units_per_mm < self.most_units + 0.5)

    def units(self, values_mm: Floats) -> Ints:
        """Return values (mm, any shape) as whole units; they must fit.

        A value half-way between two steps is written one unit farther from zero: it means the same
        step, but no longer depends on the last bit of the controller's division."""
        scaled = values_mm * self.units_per_mm
        units = (np.sign(scaled) * np.floor(np.abs(scaled) + 0.5)).astype(np.int64)
        in_steps = np.abs(units) / (self.units_per_mm * self.step_mm)
        halfway = np.abs(in_steps - np.floor(in_steps) - 0.5) < HALF_STEP_TOLERANCE
        return np.asarray(units + np.where(halfway, np.sign(units), 0))

    def steps(self, units: Ints) -> Ints:
        """Return the steps at which the controller stands after being sent these units."""
        in_steps = np.abs(units) / (self.units_per_mm * self.step_mm)
        return np.asarray((np.sign(units) * np.floor(in_steps + 0.5)).astype(np.int64))

    def nearest_units(self, steps: Ints) -> Ints:
        """Return the units nearest to these steps. Where any whole number of units means a step at
        all, this one means these steps."""
        scaled = steps * (self.units_per_mm * self.step_mm)
        return np.asarray(np.rint(scaled).astype(np.int64))


class Numbers(Struct, frozen=True, eq=False):
    """Of N rows: ends (N, 3) and centres (N, 2) as units and as steps, and feeds (N,) in units of
    the feed word.

    `centre_*` are (0, 0) and `feed_units` 0 where the row has none; a centre that cannot be
    written is none (`far_arcs`)."""

    grids: tuple[UnitGrid, UnitGrid, UnitGrid]
    end_units: Ints
    end_steps: Ints
    centre_units: Ints
    centre_steps: Ints
    feed_units: Ints
    feed_finding: Finding | None


def numbers_of(toolpath: Toolpath, machine: PicMmhMachine, dialect: PicMmhDialect) -> Numbers:
    """Convert a toolpath to the integers of the program: units of the format, steps and feeds.

    Raises PostError for the first that the format cannot hold or the machine cannot do."""
    x, y, z = (UnitGrid.of(dialect, axis.coded_step_mm) for axis in machine.axes)
    grids = (x, y, z)
    _check_coordinates(toolpath, grids)
    feed_units, finding = _feed_units(toolpath, machine)
    centred = toolpath.is_arc & ~far_arcs(toolpath, machine, dialect)
    centres = np.where(centred[:, None], toolpath.centre, 0.0)
    end_units, end_steps = _units_and_steps(toolpath.end, grids)
    centre_units, centre_steps = _units_and_steps(centres, grids)
    return Numbers(
        grids=grids,
        end_units=end_units,
        end_steps=end_steps,
        centre_units=centre_units,
        centre_steps=centre_steps,
        feed_units=feed_units,
        feed_finding=finding,
    )


def _units_and_steps(
    values_mm: Floats, grids: tuple[UnitGrid, UnitGrid, UnitGrid]
) -> tuple[Ints, Ints]:
    """Convert columns of mm to units and to steps, each column by its own axis."""
    columns = list(zip(grids, values_mm.T, strict=False))
    units = [grid.units(column) for grid, column in columns]
    steps = [grid.steps(column) for (grid, _), column in zip(columns, units, strict=True)]
    return np.column_stack(units), np.column_stack(steps)


def check_motion(toolpath: Toolpath, machine: PicMmhMachine) -> None:
    """Refuse a path that does not start at the origin, and arcs with two radii."""
    refuse_start(toolpath)
    _check_arcs(toolpath, machine)


def _check_arcs(toolpath: Toolpath, machine: PicMmhMachine) -> None:
    """Raise PostError for arcs where the controller does not interpolate by direct search or X and
    Y have different steps, and for arcs with two radii."""
    if not toolpath.is_arc.any():
        return
    arcs = controller_of(machine, PicMmhController).arcs
    if arcs != "dsm":
        raise PostError(
            f"arcs are written for direct search, not for {arcs!r}",
            mend="use --set controller.arcs=dsm",
        )
    if machine.axes.x.coded_step_mm != machine.axes.y.coded_step_mm:
        raise PostError(
            "this controller draws no circles when the coded steps of X and Y differ",
            mend="set axes.x.coded_step_mm and axes.y.coded_step_mm to one value",
        )
    refuse_two_radii(toolpath, ARC_RADIUS_SPREAD_MM)


def _check_coordinates(toolpath: Toolpath, grids: tuple[UnitGrid, UnitGrid, UnitGrid]) -> None:
    """Raise PostError for an end of more than five digits of µm (L3284-3285)."""
    for name, values, grid in zip("XYZ", toolpath.end.T, grids, strict=True):
        refuse(
            toolpath,
            ~grid.fits(values),
            lambda row, name=name, values=values: (  # type: ignore[misc]
                f"{name} = {values[row]:.6g} mm has more than five digits of µm"
            ),
            "keep every coordinate within ±99.999 mm",
        )


def far_arcs(toolpath: Toolpath, machine: PicMmhMachine, dialect: PicMmhDialect) -> Bools:
    """Return a mask (N,), true for nearly straight arcs, whose centre has more than five digits of
    µm."""
    grids = (UnitGrid.of(dialect, axis.coded_step_mm) for axis in machine.axes)
    fits = [grid.fits(values) for grid, values in zip(grids, toolpath.centre.T, strict=False)]
    return np.asarray(toolpath.is_arc & ~(fits[0] & fits[1]))


def _feed_units(toolpath: Toolpath, machine: PicMmhMachine) -> tuple[Ints, Finding | None]:
    """Return the whole units of the F word (8 for `F08`) of each row, 0 where it is no feed move;
    and FEED_ROUNDED if a feed was rounded down to that unit, else None.

    The link carries one report per step and so bounds the step rate, feed / (60 · step)
    (L3196-3199); F00 would make the controller divide by 0."""
    unit = machine.feed.unit_mm_min
    max_units = min(MAX_FEED_UNITS, math.floor(machine.max_feed_mm_min / unit + UNIT_TOLERANCE))
    mend = f"the highest feed is {max_units * unit:g} mm/min, the lowest {unit:g} mm/min"
    is_cut = toolpath.is_feed
    feed = np.where(is_cut, toolpath.feed, unit)
    highest = min(machine.max_feed_mm_min, MAX_FEED_UNITS * unit)
    refuse(toolpath, ~(feed > 0.0), lambda row: f"a feed of {feed[row]:g} mm/min", mend)
    refuse(
        toolpath,
        feed > highest + UNIT_TOLERANCE * unit,
        lambda row: f"feed {feed[row]:g} mm/min is above what the link to the machine allows",
        mend,
    )
    units = np.floor(feed / unit + UNIT_TOLERANCE).astype(np.int64)
    refuse(toolpath, units < 1, lambda row: f"feed {feed[row]:g} mm/min would be F00", mend)
    excess = feed - units * unit
    rounded = excess > UNIT_TOLERANCE * unit
    units = np.where(is_cut, units, 0)
    if not rounded.any():
        return units, None
    row = int(np.argmax(excess))
    return units, FEED_ROUNDED(
        where=toolpath.place(row),
        measured=excess[row],
        limit=unit,
        count=int(rounded.sum()),
        feed=feed[row],
        lowered=units[row] * unit,
    )


def event_words(toolpath: Toolpath, row: int) -> tuple[list[str], bool]:
    """Return the blocks of a dwell, spindle or tool event, and whether its value had to be
    rounded.

    Dwells are whole seconds of two digits (L3359-3366), rounded up and split; spindle speeds have
    four digits (L3418-3426), tools two (L3455-3464)."""
    kind, value = Kind(int(toolpath.kind[row])), float(toolpath.value[row])
    if kind == Kind.SPINDLE_OFF:
        return ["M05;"], False
    name, max_value = {
        Kind.DWELL: ("dwell", MAX_DWELL_S),
        Kind.SPINDLE_CW: ("spindle speed", MAX_SPINDLE),
        Kind.SPINDLE_CCW: ("spindle speed", MAX_SPINDLE),
        Kind.TOOL_CHANGE: ("tool", MAX_TOOL),
    }[kind]
    if math.isnan(value) and name == "spindle speed":
        raise PostError(
            "the spindle is started without a speed, which M03 and M04 need on this machine",
            where=toolpath.place(row),
            mend="give the speed: --spindle, or S in the program",
        )
    is_whole = kind != Kind.TOOL_CHANGE or value == math.floor(value)
    if not (0.0 <= value <= max_value and is_whole):
        raise PostError(
            f"{name} {value:g} does not fit into a block",
            where=toolpath.place(row),
            mend=f"use a whole number from 0 to {max_value:g}",
        )
    number = math.ceil(value) if kind == Kind.DWELL else round(value)
    if kind == Kind.DWELL:
        full_blocks, remainder = divmod(number, DWELL_DIGITS_S)
        blocks = [f"G04P{DWELL_DIGITS_S:02d};"] * full_blocks + (
            [f"G04P{remainder:02d};"] if remainder else []
        )
    elif kind == Kind.TOOL_CHANGE:
        blocks = [f"M06T{number:02d};"]
    else:
        blocks = [f"{'M03' if kind == Kind.SPINDLE_CW else 'M04'}S{number:04d};"]
    return blocks, number != value
