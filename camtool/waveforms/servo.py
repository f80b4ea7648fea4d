"""Servo axes over time: speed ω and position θ of each motor, commanded and reached, and the error
along the path; as a picture, as a table of ticks, and as figures of each order.

A stream of ticks is read once; what a picture needs of it are columns, and figures need one order
at a time, so memory does not grow with the program but for a record of each order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.errors import OptionError
from camtool.machine.servo import ServoTicks, SpeedLoop
from camtool.pictures.colours import BACK, LAYER_COLOURS, PLUNGE
from camtool.pictures.draw import rendered
from camtool.pictures.options import PictureOptions
from camtool.plain import one_line
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Toolpath
from camtool.units import UM_PER_MM
from camtool.verification.case import Case
from camtool.verification.over_time import errors_over_time
from camtool.waveforms.columns import Held, TimeColumns
from camtool.waveforms.lanes import Lane, TimePlot, Trend, columns_for, lanes_svg
from camtool.waveforms.plot import TimeSpan, ribbon_of

AXES = "XYZ"

SETTLED = 0.02
"""A speed is settled within this part of its reference, as the designed settling time has it."""

STEADY_SHARE = 4
"""The steady error is the mean over the last quarter of the ticks with the full reference."""

HEIGHT = 110.0

QUANTITIES = 4
"""Number of quantities of each axis: reference and speed, wanted and reached position."""


class AxisMove(Struct, frozen=True):
    """The figures of an axis in one order of the controller: its begin `at_s` and its block (from
    1, 0: none); its full reference and its peak speed, rpm of the motor; the overshoot, as a share
    of the reference; the time until the speed stays within 2 % of the reference, None if it never
    does; the mean error of the speed at the end of the full reference, as a share of it, None if
    that is too short; and the distance of the axis from its programmed place at the end, µm."""

    axis: str
    at_s: float
    block: int
    reference_rpm: float
    peak_rpm: float
    overshoot: float
    settling_s: float | None
    steady_error: float | None
    end_error_um: float


@dataclass(frozen=True, eq=False)
class ServoRun:
    """The servo axes of a program: `toolpath`, as the target's `read` decodes it."""

    target: LoadedTarget
    toolpath: Toolpath
    loop: SpeedLoop
    name: str = ""
    from_s: float = 0.0
    span_s: float | None = None

    @cached_property
    def row_seconds(self) -> Floats:
        """(N,) s of each row."""
        seconds = np.zeros(len(self.toolpath))
        for chunk in self.target.simulate(self.toolpath):
            seconds[chunk.ledger.row] += chunk.ledger.duration_s
        return seconds

    @cached_property
    def shown_s(self) -> tuple[float, float]:
        """Start and end of the stretch; OptionError for one outside of the program."""
        return TimeSpan(self.from_s, self.span_s).within(float(self.row_seconds.sum()))

    @property
    def rpm(self) -> float:
        """Revolutions per minute of a count in a tick."""
        return 60.0 / (self.loop.tick_s * self.loop.counts_per_turn)

    @property
    def count_um(self) -> Floats:
        """(3,) µm of a count of each axis."""
        return UM_PER_MM * np.array([axis.coded_step_mm for axis in self.target.machine.axes])

    def ticks(self) -> Iterator[tuple[ServoTicks, Floats]]:
        """Yield the ticks of the speed loops up to the end of the stretch, and the error (K,), mm,
        along the path at each; NaN where nothing is cut."""
        errors = np.zeros(0)
        judged = errors_over_time(Case(self.toolpath, self.target))
        for ticks in self.target.target.servo_ticks(self.toolpath, self.target.machine):
            while len(errors) < len(ticks.at_s):
                errors = np.concatenate([errors, next(judged)[1]])
            yield ticks, errors[: len(ticks.at_s)]
            errors = errors[len(ticks.at_s) :]
            if ticks.at_s[-1] > self.shown_s[1]:
                return

    def moves(self) -> Iterator[AxisMove]:
        """Yield the figures of each axis for all orders that begin in the stretch."""
        from_s, to_s = self.shown_s
        parts: list[ServoTicks] = []
        for ticks, _ in self.ticks():
            for part in _by_line(ticks):
                if parts and parts[-1].line[0] != part.line[0]:
                    yield from self._figures(_joined(parts), from_s, to_s)
                    parts = []
                parts.append(part)
        if parts:
            yield from self._figures(_joined(parts), from_s, to_s)

    def _figures(self, ticks: ServoTicks, from_s: float, to_s: float) -> Iterator[AxisMove]:
        """Yield the figures of the axes that move in one order."""
        at_s = float(ticks.at_s[0]) - self.loop.tick_s
        if ticks.line[0] < 0 or not from_s <= at_s <= to_s:
            return
        for k, axis in enumerate(AXES):
            goal = float(ticks.goal[0, k])
            if not goal:
                continue
            speed = ticks.speed[:, k] * np.sign(goal)
            full = np.flatnonzero(np.abs(ticks.reference[:, k]) >= abs(goal) - 0.5)
            off = np.flatnonzero(np.abs(speed[full] - abs(goal)) > SETTLED * abs(goal))
            after = int(off[-1]) + 1 if len(off) else 0
            steady = full[len(full) - len(full) // STEADY_SHARE :]
            is_settled = after < len(full)
            settling_s = (int(full[after]) + 1) * self.loop.tick_s if is_settled else None
            steady_error = None
            if is_settled and len(steady):
                steady_error = float(speed[steady].mean()) / abs(goal) - 1.0
            peak = float(speed.max())
            end = ticks.reached[-1, k] - ticks.wanted[-1, k]
            yield AxisMove(
                axis=axis,
                at_s=at_s,
                block=int(self.toolpath.block[ticks.row[0]]) + 1,
                reference_rpm=goal * self.rpm,
                peak_rpm=peak * float(np.sign(goal)) * self.rpm,
                overshoot=peak / abs(goal) - 1.0,
                settling_s=settling_s,
                steady_error=steady_error,
                end_error_um=float(end * self.count_um[k]),
            )

    def picture(
        self, name: str, options: PictureOptions, axes: Sequence[str] | None = None
    ) -> bytes:
        """Return the picture for a file of this name, .svg or .png; see `svg`."""
        return rendered(lambda sized: self.svg(sized, axes), name, options)

    def svg(self, options: PictureOptions, axes: Sequence[str] | None = None) -> str:
        """Return the stretch as SVG text: ω and θ of `axes` (None: those that move) and the error
        along the path. OptionError for an unknown axis."""
        from_s, to_s = self.shown_s
        columns = TimeColumns(from_s, to_s, columns_for(options), QUANTITIES * len(AXES))
        along = TimeColumns(from_s, to_s, columns.count, 1)
        motion, errors = Held(columns), Held(along)
        for ticks, error_mm in self.ticks():
            turns = 1.0 / self.loop.counts_per_turn
            pairs = (ticks.reference * self.rpm, ticks.speed * self.rpm)
            places = (ticks.wanted * turns, ticks.reached * turns)
            motion.add(ticks.at_s, np.concatenate([*pairs, *places], axis=1), ticks.row)
            errors.add(ticks.at_s, error_mm[:, None] * UM_PER_MM, ticks.row)
        motion.finish(to_s)
        errors.finish(to_s)
        chosen = _chosen(axes, [k for k in range(3) if _moves(columns, k)])
        lanes = [lane for k in chosen for lane in _axis_lanes(columns, k)]
        curve = Trend("error along the path", BACK, along.low[0], along.high[0])
        lanes.append(Lane("distance from the path (µm)", (curve,), HEIGHT, from_zero=True))
        notes = [f"{to_s - from_s:.6g} s from {from_s:.6g} s on; ticks of {self._tick_ms:g} ms"]
        if along.largest[0].row >= 0:
            peak = along.largest[0]
            notes.append(f"at most {peak.value:.5g} µm from the path, at {peak.at_s:.6g} s")
        ribbon = ribbon_of(self.toolpath, self.row_seconds, columns)
        title = f"{one_line(self.name)}: servo axes"
        return lanes_svg(
            TimePlot(title, tuple(notes), from_s, to_s, tuple(lanes), ribbon), options
        )

    @property
    def _tick_ms(self) -> float:
        return 1e3 * self.loop.tick_s

    def table(self) -> Iterator[bytes]:
        """Yield a CSV table of all ticks of the stretch."""
        from_s, to_s = self.shown_s
        names = ["reference", "speed", "drive", "wanted", "reached"]
        heads = [f"{axis.lower()}_{name}" for axis in AXES for name in names]
        yield (",".join(["time_s", "block", *heads, "error_um"]) + "\n").encode()
        for ticks, error_mm in self.ticks():
            index = np.flatnonzero((ticks.at_s >= from_s) & (ticks.at_s <= to_s)).tolist()
            columns = [
                column[:, k]
                for k in range(3)
                for column in (
                    ticks.reference, ticks.speed, ticks.drive, ticks.wanted, ticks.reached
                )
            ]  # fmt: skip
            block = self.toolpath.block[ticks.row] + 1
            lines = []
            for i in index:
                values = [f"{column[i]:.6g}" for column in columns]
                error = "" if np.isnan(error_mm[i]) else f"{error_mm[i] * UM_PER_MM:.4f}"
                lines.append(",".join([f"{ticks.at_s[i]:.3f}", str(block[i]), *values, error]))
            yield "".join(f"{line}\n" for line in lines).encode()


class StepAnswer(Struct, frozen=True, eq=False):
    """The answer of an axis to a step: mean `speed` (K,) and `reference` (K,) in rpm of the motor,
    NaN reference in open loop, and `drive` (K,), percent, tick by tick."""

    axis: str
    speed: Floats
    reference: Floats
    drive: Floats


def steps_picture(
    name: str, title: str, answers: Sequence[StepAnswer], tick_s: float, options: PictureOptions
) -> bytes:
    """Return the picture of `steps_svg` for a file of this name, .svg or .png."""
    return rendered(lambda sized: steps_svg(title, answers, tick_s, sized), name, options)


def steps_svg(
    title: str, answers: Sequence[StepAnswer], tick_s: float, options: PictureOptions
) -> str:
    """Return SVG text of step responses: speed, position and drive of each axis."""
    seconds = tick_s * len(answers[0].speed)
    lanes = []
    for answer in answers:
        columns = TimeColumns(0.0, seconds, columns_for(options), 3)
        holder, bound = Held(columns), TimeColumns(0.0, seconds, columns.count, 1)
        begin_s: Floats = tick_s * np.arange(len(answer.speed), dtype=np.float64)
        turns = np.cumsum(answer.speed) * tick_s / 60.0
        values = np.column_stack([answer.speed, turns, answer.drive])
        row = np.zeros(len(begin_s), dtype=np.int64)
        holder.add(begin_s, values, row)
        holder.finish(seconds)
        bound.add(begin_s, begin_s + tick_s, answer.reference[:, None], row)
        colour = LAYER_COLOURS[AXES.index(answer.axis.upper())]
        name = answer.axis.upper()
        commanded = Trend("commanded", PLUNGE, bound.low[0], bound.high[0], is_wanted=True)
        for k, words in enumerate(("speed of {} (rpm)", "position of {} (turns)", "drive (%)")):
            curve = Trend(f"{name} reached", colour, columns.low[k], columns.high[k])
            curves = (curve, commanded) if k == 0 and np.isfinite(bound.low).any() else (curve,)
            lanes.append(Lane(words.format(name), curves, HEIGHT, from_zero=True))
    notes = (f"ticks of {1e3 * tick_s:g} ms",)
    return lanes_svg(TimePlot(title, notes, 0.0, seconds, tuple(lanes)), options)


def _moves(columns: TimeColumns, axis: int) -> bool:
    """Return True if an axis moves or has a reference other than 0."""
    quantities = [axis, 3 + axis]
    return bool(
        (columns.high[quantities] > 0.0).any()
        or ((columns.low[quantities] < 0.0) & np.isfinite(columns.low[quantities])).any()
    )


def _chosen(names: Sequence[str] | None, moving: list[int]) -> list[int]:
    """Return the indices of the named axes; by default of those that move."""
    if names is None:
        return moving
    unknown = [name for name in names if name.upper() not in AXES or len(name) != 1]
    if unknown:
        raise OptionError(f"there is no axis {unknown[0]!r}", mend="use X, Y, Z")
    return [k for k, name in enumerate(AXES) if name in {each.upper() for each in names}]


def _axis_lanes(columns: TimeColumns, axis: int) -> Iterator[Lane]:
    """Yield the lanes of ω and θ of an axis."""
    colour, name = LAYER_COLOURS[axis], AXES[axis]
    for first, words in (
        (0, f"speed of {name} (rpm of the motor)"),
        (2, f"position of {name} (turns)"),
    ):
        commanded, reached = 3 * first + axis, 3 * (first + 1) + axis
        yield Lane(
            words,
            (
                Trend(f"{name} reached", colour, columns.low[reached], columns.high[reached]),
                Trend("commanded", PLUNGE, columns.low[commanded], columns.high[commanded], True),
            ),
            HEIGHT,
            from_zero=first == 0,
        )


def _by_line(ticks: ServoTicks) -> Iterator[ServoTicks]:
    """Yield the ticks divided where another order begins."""
    edges = np.flatnonzero(np.diff(ticks.line)) + 1
    bounds: Ints = np.concatenate([[0], edges, [len(ticks.line)]])
    for low, high in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        part = slice(low, high)
        yield ServoTicks(*(getattr(ticks, name)[part] for name in ServoTicks.__struct_fields__))


def _joined(parts: list[ServoTicks]) -> ServoTicks:
    """Return consecutive ticks joined into one record."""
    return ServoTicks(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ServoTicks.__struct_fields__
        )
    )
