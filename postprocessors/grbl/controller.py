"""grbl 1.1, grblHAL, FluidNC: arcs as chords, lines of whole steps, speeds planned blocks ahead.

What it does with a program, in the order of this file:

1. Numbers become 32-bit floats, arcs the ends of chords.
2. Targets become steps and blocks; each block is a Bresenham line in X, Y and Z
   at once (`steps`). Its smoothing (AMASS) shifts steps of the slower axes
   within an event; at the end of each event the axes stand where they do without it.
3. Speeds: limits of the axes, corners by junction deviation, the ring of blocks
   (`camtool.kernels.motion`), trapezoids (`speed_plan`). They change times, not positions.

Positions are absolute: a row starts at the step where the one before ended, and no rounding adds
up. Its numbers, 32-bit floats, are nearer than a hundredth of a step. grbl does not compensate
backlash."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, columns_of
from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.legs import coded_steps_mm
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Options
from camtool.simulation.rows import check_rows
from camtool.simulation.samples import SampledModel, SampledRows
from camtool.simulation.speed_plan import FROM_REST, EntryState, SpeedPlan, axis_limits, max_along
from camtool.simulation.step_lines import LineRows, LineRun
from camtool.toolpath.moves import EVENTS_AT_REST, Kind, Toolpath, are_arcs

from .dialect import GrblController, GrblDialect
from .steps import step_lines_fill, steps_taken

_Machine = Machine[GrblController, GrblDialect]

ALWAYS_ON = 255
"""The $1 that leaves the motors on, and causes no delay at a stop."""

DWELL_STEP_S = 0.05
"""Step of dwells, which are rounded up (DWELL_TIME_STEP, `delay_sec`)."""


LASER_ASSUMPTION = (
    "laser mode ($32): what the laser burns is not simulated (it is off in rapids, and M4 scales "
    "its power with the speed)"
)


class GrblModel(SampledModel[GrblController, GrblDialect]):
    """grbl 1.1: chords, whole steps, trapezoids planned ahead."""

    def fused_run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> LineRun | None:
        """Return the motion as lines of whole steps, judged in closed form; None where the
        mechanics differ from place to place."""
        path = self.quantised(toolpath, machine)
        mechanics = self.mechanics(path, machine, options)
        if not mechanics.even:
            return None
        rows = path.executed_rows
        blocks = map(GrblSamples.lines, _rows_to_end(path, machine))
        return LineRun(blocks, rows, coded_steps_mm(machine), mechanics, rounds=True)

    def sampled(self, path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
        """Yield the motion of the rows up to the end of the program."""
        return _rows_to_end(path, machine)

    def mechanics(self, path: Toolpath, machine: _Machine, options: Options) -> Mechanics:
        """Return the mechanics with the slides at the step nearest to the start of the path."""
        start_mm = _nearest_steps(path.start.astype(np.float32), machine) * coded_steps_mm(machine)
        return Mechanics(machine, start_mm, options.effects)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "chords": arcs as chords, and lines by Bresenham's algorithm."""
        return "chords"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        controller = _controller(machine)
        return (
            f"arcs are chords within {controller.arc_tolerance_mm:g} mm ($12), lines whole steps",
            f"corners by a junction deviation of {controller.junction_deviation_mm:g} mm ($11), "
            f"speeds planned {controller.buffer_blocks - 1} blocks ahead",
            "the sender keeps grbl's buffer full; overrides stand at 100 %",
            *((LASER_ASSUMPTION,) if controller.laser_mode else ()),
        )


def _rows_to_end(path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
    """Return the motion of the rows up to the end of the program; ProgramError for rows that
    cannot be followed."""
    controller = _controller(machine)
    check_rows(path, path.executed_rows)
    return sample_rows(path.first(path.executed_rows), machine, controller)


def plan_to_end(path: Toolpath, machine: _Machine) -> Iterator[PlannedBlocks]:
    """Return the planned blocks of all rows up to the end of the program; raises as
    `GrblModel.run`."""
    controller = _controller(machine)
    check_rows(path, path.executed_rows)
    return plan_rows(path.first(path.executed_rows), machine, controller)


class PlannedBlocks(Struct, frozen=True, eq=False):
    """The planned `blocks` (B,) of the rows low:high: `plan` and `squares` of these and of the
    blocks behind them, and a mask (B,) of those after which the machine stands."""

    low: int
    high: int
    blocks: Blocks
    plan: SpeedPlan
    squares: Floats
    rests: Bools


def plan_rows(
    path: Toolpath, machine: _Machine, controller: GrblController
) -> Iterator[PlannedBlocks]:
    """Yield the planned blocks of all rows, some thousand at a time. Each window is planned
    together with the block before it, for the corner between them, and with as many blocks behind
    it as the ring buffer holds."""
    window = controller.buffer_blocks - 1
    parts, stops = blocks_of(path, machine, controller), stops_of(path, controller)
    pending: list[Blocks] = []
    last, before, low = NO_BLOCKS, FROM_REST, 0
    while low < len(path):
        while sum(len(part) for part in pending[1:]) < window:
            part = next(parts, None)
            if part is None:
                break
            pending.append(part)
        block_group = pending.pop(0)
        count, high = len(block_group), min(low + ROWS_AT_ONCE, len(path))
        known_blocks = join_blocks([last, block_group, *pending]).part(
            0, len(last) + count + window
        )
        plan = speeds_of(known_blocks, path, machine, before, len(last), stops)
        squares = plan.squares(window)
        rests = np.append(stops.before(known_blocks), True)[len(last) + 1 :][:count]
        yield PlannedBlocks(low, high, block_group, plan, squares, rests)
        before, low = plan.entry_after(count, squares), high
        last = block_group.part(count - 1, count) if count else last


def sample_rows(
    path: Toolpath, machine: _Machine, controller: GrblController
) -> Iterator[SampledRows]:
    """Yield the motion of all rows, some thousand at a time."""
    for planned in plan_rows(path, machine, controller):
        low, high, blocks = planned.low, planned.high, planned.blocks
        seconds, count = dwells_of(path, low, high, controller), len(blocks)
        own_s = planned.plan.seconds(planned.squares)[:count]
        own_s += idle_delay_s(controller) * planned.rests
        np.add.at(seconds, blocks.row - low, own_s)
        samples = GrblSamples(planned, own_s, machine)
        yield SampledRows(low, high, low, samples, seconds, iterates=True)


def dwells_of(path: Toolpath, low: int, high: int, controller: GrblController) -> Floats:
    """Return (high − low,) seconds of dwell in the rows low:high."""
    seconds = np.zeros(high - low)
    dwells = low + np.flatnonzero(path.kind[low:high] == Kind.DWELL)
    values = path.value[dwells].tolist()
    seconds[dwells - low] = [dwell_s(value, controller.firmware) for value in values]
    return seconds


def idle_delay_s(controller: GrblController) -> float:
    """Return the seconds that the machine waits at each stop ($1)."""
    waits = controller.firmware == "grbl" and controller.idle_delay_ms != ALWAYS_ON
    return controller.idle_delay_ms / 1000.0 if waits else 0.0


class GrblSamples:
    """All step events of some rows, numbered from 0, computed when they are asked for."""

    def __init__(self, planned: PlannedBlocks, seconds: Floats, machine: _Machine) -> None:
        """Prepare the samples of planned blocks. `seconds` (B,): the duration of each block."""
        blocks = planned.blocks
        self._blocks, self._low = blocks, planned.low
        self._planned, self._seconds = planned, seconds
        self._step_mm = coded_steps_mm(machine)
        self._offsets = np.concatenate([[0], np.cumsum(blocks.events, dtype=np.int64)])
        rows = np.arange(planned.low, planned.high + 1)
        self.first = self._offsets[np.searchsorted(blocks.row, rows)]

    @staticmethod
    def lines(rows: SampledRows) -> LineRows:
        """Return the lines of whole steps in these rows."""
        assert isinstance(rows.samples, GrblSamples)
        blocks = rows.samples._blocks
        columns = (blocks.row, blocks.start, blocks.way)
        return LineRows(
            rows.low,
            rows.high,
            rows.seconds,
            *(one.astype(np.int64, order="C") for one in columns),
        )

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return the row and the position of each of the step events low:high."""
        blocks = self._blocks
        begin = int(np.searchsorted(self._offsets, low, side="right")) - 1
        end = int(np.searchsorted(self._offsets, high, side="left"))
        commanded = np.empty((high - low, 3))
        lines = (blocks.start[begin:end].astype(np.int64), blocks.way[begin:end].astype(np.int64))
        first = (0, low - int(self._offsets[begin]))
        step_lines_fill(lines, first, self._step_mm, commanded)
        bounds = np.clip(self._offsets[begin : end + 1], low, high)
        row = blocks.row[begin:end].astype(np.int64) - self._low
        return np.repeat(row, np.diff(bounds)), commanded

    def moments_s(self, low: int, high: int, rows_s: Floats) -> Floats:
        """Return (K,) seconds from the start of its row to each of the step events low:high."""
        plan, row = self._planned.plan, self._blocks.row
        block = np.searchsorted(self._offsets, np.arange(low, high), side="right") - 1
        event = np.arange(low + 1, high + 1) - self._offsets[block]
        way_mm = plan.length_mm[block] * (event / self._blocks.events[block])
        begin_s = np.cumsum(self._seconds) - self._seconds
        begin_s -= begin_s[np.searchsorted(row, row)]
        return np.asarray(begin_s[block] + plan.moments_s(self._planned.squares, block, way_mm))

    def steps(self, bounds: Ints) -> Ints:
        """Return the number of steps of each axis between the step events `bounds`."""
        block = np.searchsorted(self._offsets, bounds, side="right") - 1
        begin = int(block[0])
        travel = self._blocks.way[begin : int(block[-1]) + 1].astype(np.int64)
        travelled = np.zeros((len(travel) + 1, 3), dtype=np.int64)
        np.cumsum(np.abs(travel), axis=0, out=travelled[1:])
        count = travelled[block - begin]
        inside = np.flatnonzero(bounds > self._offsets[block])
        event = bounds[inside] - self._offsets[block[inside]]
        count[inside] += np.abs(steps_taken(travel[block[inside] - begin], event))
        return np.asarray(np.diff(count, axis=0))


def _controller(machine: _Machine) -> GrblController:
    """Return the machine's controller; MachineError for a compensation that grbl cannot make."""
    for name, axis in zip("xyz", machine.axes, strict=True):
        if axis.compensation_mm > 0.0:
            raise MachineError(
                "grbl does not compensate backlash",
                where=f"table [axes.{name}], key compensation_mm",
                mend="leave it out",
            )
    return machine.controller


def dwell_s(seconds: float, firmware: str = "grbl") -> float:
    """Return the real duration of a dwell, s, which the firmware counts in 32-bit floats:
    `delay_sec` of grbl and grblHAL, `mc_dwell` of FluidNC."""
    if firmware == "FluidNC":
        return math.floor(np.float32(1000.0) * np.float32(seconds)) / 1000.0
    per_second = np.float32(1.0 / DWELL_STEP_S)
    return math.ceil(per_second * np.float32(seconds)) * DWELL_STEP_S


# The blocks of grbl's planner: targets rounded to steps, and how fast each may go.
#
# From `plan_buffer_line` (planner.c): a target in mm, times the steps of a mm, goes to the nearest
# step (halves away from zero), each by itself, so that nothing drifts. A target in the step where
# the machine stands makes no block. Length and direction are those of the whole steps.

MAX_STEPS = 1 << 29
"""Positions beyond this many steps (2 km at 4 µm) are refused: products of two counts must fit
64 bits. grbl's own 32-bit floats count no single steps beyond 2²⁴."""

STRAIGHT_COS = 0.999999
"""Cosine between two blocks beyond which they count as straight on, or as straight back
(planner.c)."""

MIN_SPEED_MM_S = 1.0 / 60.0
"""No block is slower (MINIMUM_FEED_RATE, config.h)."""

SPINDLE = (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF)
COOLANT = (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD, Kind.COOLANT_OFF)

ROWS_AT_ONCE = 1 << 12

BLOCKS_AT_ONCE = 1 << 14

Shorts = npt.NDArray[np.int32]


class Blocks(Struct, frozen=True, eq=False):
    """B blocks in order: the row (B,) and the target (B,) at which each ends, and its start and
    travel, both (B, 3) steps. Targets without a step have no block."""

    row: Shorts
    target: Shorts
    start: Shorts
    way: Shorts

    def __len__(self) -> int:
        return len(self.row)

    @property
    def events(self) -> Shorts:
        """Step events (B,) of each block: the steps of the axis that has the most."""
        return np.asarray(np.abs(columns_of(self.way)).max(axis=0, initial=0))

    def part(self, low: int, high: int) -> Blocks:
        """Return the blocks low:high."""
        rows = slice(low, high)
        return Blocks(self.row[rows], self.target[rows], self.start[rows], self.way[rows])


_NONE = np.empty(0, np.int32)
NO_BLOCKS = Blocks(_NONE, _NONE, _NONE.reshape(0, 3), _NONE.reshape(0, 3))


def join_blocks(parts: list[Blocks]) -> Blocks:
    """Concatenate parts of consecutive blocks."""
    return Blocks(
        np.concatenate([part.row for part in parts]),
        np.concatenate([part.target for part in parts]),
        np.concatenate([part.start for part in parts]),
        np.concatenate([part.way for part in parts]),
    )


def blocks_of(path: Toolpath, machine: _Machine, controller: GrblController) -> Iterator[Blocks]:
    """Yield the blocks of a program, `ROWS_AT_ONCE` rows at a time; ProgramError for positions
    beyond grbl's counters."""
    begin, target_count = _nearest_steps(path.start[None, :].astype(np.float32), machine), 0
    for low in range(0, len(path), ROWS_AT_ONCE):
        rows = np.arange(low, min(low + ROWS_AT_ONCE, len(path)))
        blocks, begin, count = blocks_from(begin, path, rows, machine, controller)
        yield replace(blocks, target=blocks.target + np.int32(target_count))
        target_count += count


def blocks_from(
    begin: Ints, path: Toolpath, rows: Ints, machine: _Machine, controller: GrblController
) -> tuple[Blocks, Ints, int]:
    """Return the blocks of the consecutive rows `rows` (R,), which begin at `begin` (1, 3) steps;
    the position where the last block ends; and the number of targets."""
    targets = targets_of(path, rows, machine, controller)
    stop = _nearest_steps(targets.mm, machine)
    is_far = columns_of(np.abs(stop) > MAX_STEPS).any(axis=0)
    if is_far.any():
        row = int(targets.row[is_far.argmax()])
        block = int(path.block[row])
        raise ProgramError(
            "a position is beyond all that the controller can count",
            where=f"block {block + 1}" if block >= 0 else f"move {row}",
        )
    start = np.concatenate([begin, stop])
    begin, start = start[-1:], start[:-1]
    travel = stop - start
    moves = np.flatnonzero(columns_of(travel).any(axis=0))
    columns = targets.row[moves], moves, start[moves], travel[moves]
    return Blocks(*(column.astype(np.int32) for column in columns)), begin, len(travel)


def _nearest_steps(mm: Singles, machine: _Machine) -> Ints:
    """Return positions as (..., 3) whole steps: the product in 32-bit floats, halves rounded away
    from zero."""
    steps_per_mm = np.array([1.0 / axis.coded_step_mm for axis in machine.axes], dtype=np.float32)
    product = (mm * steps_per_mm).astype(np.float64)
    return np.asarray(np.copysign(np.floor(np.abs(product) + 0.5), product).astype(np.int64))


def speeds_of(
    blocks: Blocks, path: Toolpath, machine: _Machine, before: EntryState, first: int, stops: Stops
) -> SpeedPlan:
    """Compute the nominal speed of each block from `first` on, and the highest speed through each
    corner.

    Along a unit vector u no axis exceeds its own limit, so a block is limited to min(limit / |u|).
    At a corner between u1 and u2, with θ the angle between −u1 and u2, a circle touches both at
    `junction_deviation_mm` δ from the corner, and is followed (for its speed alone) at the
    acceleration a that u2 − u1 allows: v² = a δ sin(θ/2) / (1 − sin(θ/2)).

    The timer cannot wait longer than `least_step_hz` says, so slower blocks run at that rate."""
    controller = machine.controller
    assert isinstance(controller, GrblController)
    step_mm = coded_steps_mm(machine)
    rate = axis_limits(machine, "max_rate_mm_min") / 60.0
    acceleration = axis_limits(machine, "acceleration_mm_s2")
    lengths_mm, speeds, along, corners = (np.empty(len(blocks)) for _ in range(4))
    for low in range(0, len(blocks), BLOCKS_AT_ONCE):
        batch = slice(low, low + BLOCKS_AT_ONCE)
        travels = blocks.way[max(low - 1, 0) : batch.stop] * step_mm
        lengths = np.sqrt(columns_of(travels**2).sum(axis=0))
        units = travels / lengths[:, None]
        turn = np.diff(units, axis=0, prepend=units[: 1 if low == 0 else 0])
        earlier = 0 if low == 0 else 1
        length, unit = lengths[earlier:], units[earlier:]
        highest = max_along(rate, unit)
        row = blocks.row[batch]
        cuts = (path.kind[row] >= Kind.LINE) & (path.kind[row] <= Kind.ARC_CCW)
        feed = np.where(cuts, path.feed[row], np.inf) / 60.0
        speed = np.maximum(np.minimum(feed, highest), MIN_SPEED_MM_S)
        events = np.abs(columns_of(blocks.way[batch])).max(axis=0, initial=0)
        speed = np.maximum(speed, controller.least_step_hz * length / events)
        lengths_mm[batch], speeds[batch] = length, speed
        along[batch] = max_along(acceleration, unit)
        across = np.sqrt(columns_of(turn**2).sum(axis=0))
        cosine = 0.5 * across**2 - 1.0  # of the angle between the way back and the way on
        half_sine = np.sqrt(np.clip(0.5 * (1.0 - cosine), 0.0, 1.0))
        turn /= np.where(across > 0.0, across, 1.0)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            allowed = max_along(acceleration, turn)
            square = allowed * controller.junction_deviation_mm * half_sine / (1.0 - half_sine)
        corner = np.sqrt(np.where(cosine < -STRAIGHT_COS, np.inf, square))
        corner[cosine > STRAIGHT_COS] = 0.0
        corners[batch] = corner
    corners[stops.before(blocks)] = 0.0
    return SpeedPlan(lengths_mm[first:], speeds[first:], along[first:], corners[first:], before)


class Stops(Struct, frozen=True, eq=False):
    """Masks of stops of the machine: before rows (N,), and at targets without a step within rows
    (N,); None if there are no such rows."""

    rows: Bools
    lit: Bools | None

    def before(self, blocks: Blocks) -> Bools:
        """Return a mask (B,), true for blocks before which the machine comes to rest."""
        if not len(blocks):
            return np.zeros(0, dtype=np.bool_)
        first, last = int(blocks.row[0]), int(blocks.row[-1])
        waits = np.cumsum(self.rows[first : last + 1])[blocks.row - first]
        rests = np.diff(waits, prepend=-1) > 0
        if self.lit is not None:
            rests |= self.lit[blocks.row] & (np.diff(blocks.target, prepend=0) > 1)
        return np.asarray(rests)


def stops_of(path: Toolpath, controller: GrblController) -> Stops:
    """Return the rows at which the machine comes to rest. Events that repeat what is in force stop
    nothing. In laser mode a change of power does not either, but a target without a step stops a
    laser of constant power (M3), whose power is then set at once (`mc_line`)."""
    rows = np.isin(path.kind, EVENTS_AT_REST)
    coolant = np.flatnonzero(np.isin(path.kind, COOLANT))
    kind = np.append(Kind.COOLANT_OFF, path.kind[coolant])
    rows[coolant[kind[1:] == kind[:-1]]] = False
    spindle = np.flatnonzero(np.isin(path.kind, SPINDLE))
    kind = np.append(Kind.SPINDLE_OFF, path.kind[spindle])
    speed = np.nan_to_num(np.append(0.0, path.value[spindle]))
    same_power = (kind[1:] == Kind.SPINDLE_OFF) | (speed[1:] == speed[:-1]) | controller.laser_mode
    rows[spindle[same_power & (kind[1:] == kind[:-1])]] = False
    if not controller.laser_mode:
        return Stops(rows, None)
    index = np.searchsorted(spindle, np.arange(len(path)), side="right")
    return Stops(rows, kind[index] == Kind.SPINDLE_CW)


# The targets that grbl 1.1 hands to its planner, in its own 32-bit floats.
#
# Lines have one, their end; an arc has the ends of its chords (`mc_arc` in motion_control.c): all
# but the last lie on the circle about its centre with the radius of its start, the last is its
# end. Every operation rounds to 32 bits as the C code does on a processor whose double has 32 bits
# (AVR); sine, cosine and arc tangent may differ from its library's in the last bit.

Singles = npt.NDArray[np.float32]
Reals = npt.NDArray[np.floating]

MAX_DIGITS = 8
"""grbl drops the digits of a number after this many (MAX_INT_DIGITS, nuts_bolts.c)."""

DECIMAL_EPS = 1e-6
"""Units of the last decimal: a number farther than this from all such units was written with more
decimals, and becomes its nearest float."""

FULL_TURN_RAD = np.float32(5e-7)
"""An arc that turns by less is a full circle (ARC_ANGULAR_TRAVEL_EPSILON, config.h)."""

MAX_SEGMENTS = 1 << 16
"""The chords of an arc are counted in 16 bits."""


class Targets(Struct, frozen=True, eq=False):
    """T targets in order: mm (T, 3), 32-bit, and the row (T,) of each."""

    row: Ints
    mm: Singles


def targets_of(
    path: Toolpath, rows: Ints, machine: _Machine, controller: GrblController
) -> Targets:
    """Return the targets that the consecutive rows `rows` (R,) give to the planner; rows without
    motion give none."""
    kind = path.kind[rows]
    ends = as_read(path.end[rows], machine)
    begins = as_read(path.starts_of(rows), machine)
    asks = (kind <= Kind.ARC_CCW) | np.isin(kind, (Kind.HOME_XY, Kind.HOME_Z))
    counts = np.where(asks, 1, 0)
    arcs = np.flatnonzero(are_arcs(kind))
    chords = _Chords(path, machine, begins[arcs], ends[arcs], rows[arcs], controller.firmware)
    counts[arcs] = chords.segments(controller)
    row = np.repeat(np.arange(len(rows)), counts)
    mm = ends[row]
    first = np.cumsum(counts) - counts
    inside, points = chords.points(counts[arcs], first[arcs], controller.arc_correction)
    mm[inside] = points
    return Targets(rows[row], mm)


def as_read(values: Floats, machine: _Machine) -> Singles:
    """Return the values that `read_float` (nuts_bolts.c) makes of the digits of these numbers.

    The digits form one integer, which is multiplied by 0.01 and 0.1 until the decimal point is in
    its place, with rounding at each step. `dialect.decimals` gives the number of decimals; a
    number that has more is taken as the nearest float."""
    nearest_single = values.astype(np.float32)
    decimals = machine.dialect.decimals
    scaled = np.abs(values) * 10.0**decimals
    digits = np.rint(scaled)
    digits_before = (
        np.maximum(np.floor(np.log10(np.maximum(np.trunc(np.abs(values)), 1.0))), 0.0) + 1.0
    )
    dropped = np.clip(digits_before + decimals - MAX_DIGITS, 0, decimals).astype(np.int64)
    read_values = np.floor(digits / 10.0**dropped).astype(np.float32)
    remaining = decimals - dropped
    for _ in range(decimals // 2):
        read_values = np.where(remaining >= 2, read_values * np.float32(0.01), read_values)
        remaining = np.where(remaining >= 2, remaining - 2, remaining)
    read_values = np.where(remaining == 1, read_values * np.float32(0.1), read_values)
    written = np.abs(scaled - digits) <= DECIMAL_EPS
    return np.asarray(np.where(written, np.copysign(read_values, nearest_single), nearest_single))


class _Chords:
    """The arcs of a program, J of them, from `begin` to `end` (J, 3) mm. grblHAL keeps the centre
    and the radius vector in 64 bits (`mc_arc` of its motion_control.c), the others in 32."""

    def __init__(
        self,
        path: Toolpath,
        machine: _Machine,
        begin: Singles,
        end: Singles,
        arcs: Ints,
        firmware: str,
    ) -> None:
        self._begin, self._end = begin, end
        self._real: type[np.floating] = np.float64 if firmware == "grblHAL" else np.float32
        offset = as_read(path.centre[arcs] - path.starts_of(arcs)[:, :2], machine)
        self._offset = offset
        first: Reals = begin[:, :2].astype(self._real)
        self._centre = first + offset
        self._radius = np.sqrt(offset[:, 0] * offset[:, 0] + offset[:, 1] * offset[:, 1])
        rx, ry = (-offset).T.astype(self._real)
        tx, ty = end[:, 0] - self._centre[:, 0], end[:, 1] - self._centre[:, 1]
        turn = np.arctan2(rx * ty - ry * tx, rx * tx + ry * ty).astype(np.float32)
        full_turn = self._real(2.0 * np.pi)
        clockwise = path.kind[arcs] == Kind.ARC_CW
        downward = np.where(turn >= -FULL_TURN_RAD, turn - full_turn, turn)
        upward = np.where(turn <= FULL_TURN_RAD, turn + full_turn, turn)
        self._turn = np.where(clockwise, downward, upward).astype(np.float32)

    def segments(self, controller: GrblController) -> Ints:
        """Return (J,) the number of chords of each arc: ⌊|½ φ r| / √(δ (2r − δ))⌋ with the arc
        tolerance δ, and at least 1."""
        tolerance = np.float32(controller.arc_tolerance_mm)
        half = tolerance * (np.float32(2.0) * self._radius - tolerance)
        arc_length = np.abs(np.float32(0.5) * self._turn * self._radius)
        with np.errstate(invalid="ignore", divide="ignore"):
            count = np.floor(arc_length / np.sqrt(half))
        truncated = np.where(np.isfinite(count), count, 0.0).astype(np.int64) % MAX_SEGMENTS
        return np.maximum(truncated, 1)

    def points(self, segments: Ints, first: Ints, correction: int) -> tuple[Ints, Singles]:
        """Return the targets inside arcs: (P,) the arc of each, and their positions (P, 3) mm.

        A radius vector is turned by the angle of a chord, θ, with cos θ ≈ 1 − θ²/2 and sin θ ≈ θ −
        θ³/6; after `correction` turns the next one is computed anew."""
        inner = segments - 1
        arc = np.repeat(np.arange(len(segments)), inner)
        number = np.arange(len(arc)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
        theta = (self._turn / segments.astype(np.float32))[arc]
        x0, y0 = -self._offset[arc, 0], -self._offset[arc, 1]
        since_correction = number % (correction + 1)
        angle = (number - since_correction).astype(np.float32) * theta
        cos_i, sin_i = np.cos(angle), np.sin(angle)
        anew = number >= since_correction + 1
        x = np.where(anew, x0 * cos_i - y0 * sin_i, x0).astype(self._real)
        y = np.where(anew, x0 * sin_i + y0 * cos_i, y0).astype(self._real)
        cos_t = np.float32(2.0) - theta * theta
        sin_t = theta * np.float32(0.16666667) * (cos_t + np.float32(4.0))
        cos_t = cos_t * np.float32(0.5)
        for step in range(1, correction + 1):
            corrected = np.flatnonzero(since_correction >= step)
            c, s, u, v = cos_t[corrected], sin_t[corrected], x[corrected], y[corrected]
            x[corrected] = u * c - v * s
            y[corrected] = (u * s + v * c).astype(np.float32)
        points = np.empty((len(arc), 3), dtype=np.float32)
        points[:, 0] = self._centre[arc, 0] + x
        points[:, 1] = self._centre[arc, 1] + y
        points[:, 2] = self._heights(segments, arc)
        return np.repeat(first, inner) + number - 1, points

    def _heights(self, segments: Ints, arc: Ints) -> Singles:
        """Return the Z of the targets inside arcs: an equal rise is added at each, with rounding
        to 32 bits."""
        z: Singles = self._begin[arc, 2].copy()
        rise = (self._end[:, 2] - self._begin[:, 2]) / segments.astype(np.float32)
        last_targets = np.cumsum(segments - 1)
        for arc_index in np.flatnonzero((rise != 0.0) & (segments > 1)).tolist():
            low, high = (
                int(last_targets[arc_index] - segments[arc_index] + 1),
                int(last_targets[arc_index]),
            )
            z[low] += rise[arc_index]
            z[low + 1 : high] = rise[arc_index]
            z[low:high] = np.add.accumulate(z[low:high])
        return z
