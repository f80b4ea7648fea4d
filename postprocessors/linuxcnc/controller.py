"""LinuxCNC: the programmed lines and arcs themselves, corners as the path mode says.

What it does with a program, in the order of this file:

1. Each row has the path mode that the program says there (G61, G61.1, G64 P Q), or that of the
   machine file. In the mode "blend", lines that lie on one line but for a tolerance are merged
   (`steps`).
2. Corners: stops, bends that pass for straight, blends, as they come out at the programmed
   feed. No blend leaves its corner by more than the tolerance.
3. Speeds: limits of the axes, turning in arcs, corners, so many moves ahead
   (`camtool.kernels.motion`), trapezoids (`speed_plan`).

Positions are the trajectory's, in 64-bit floats. The step generator follows them to the nearest
step, or an encoder to its count: half a step of each axis, which is not in the samples. Steps
are counted, not taken. Rounding never adds up.

BACKLASH of an axis (`compensation_mm`) is added at a change of its direction. LinuxCNC spreads
it over some milliseconds at half of the axis's limits; here it acts at once, and takes no time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, columns_of
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.motion import Options
from camtool.simulation.rows import check_rows
from camtool.simulation.samples import (
    ROWS_AT_ONCE,
    CountedSamples,
    SampledModel,
    SampledRows,
    move_lengths,
    sample_spacing_mm,
    spacing_along,
)
from camtool.simulation.speed_plan import FROM_REST, EntryState, SpeedPlan, axis_limits, max_along
from camtool.toolpath.moves import (
    EVENTS_AT_REST,
    Kind,
    PathMode,
    PolarArcs,
    Toolpath,
    are_arcs,
    read_only,
)

from . import steps as at
from .dialect import LinuxcncController, LinuxcncDialect
from .steps import MAX_CHAIN_POINTS, Blends, merge_lines

_Machine = Machine[LinuxcncController, LinuxcncDialect]

MIN_LENGTH_MM = 1e-9
"""Shortest remainder of a move between two blends that counts."""

LAST_PART = 0.5
"""Fraction of its acceleration that the last move before a wait uses in the mode "blend", and a
move that overlaps with another."""

MOVES_BEFORE = 2
"""Moves that are planned once more with a block: what a blend leaves of the last of them depends
on the corner at its start."""

RAMP_S = 0.01
"""A cut that lasts no longer, and does not end at rest, changes its speed evenly from its start to
its end (1 / ARC_BLEND_RAMP_FREQ, `tpActivateSegment`)."""

REST_PERIODS = 2.0
"""Servo periods that coming to rest takes beyond the trapezoid in whole periods, the nearest
number: 1 to 3 in all, by where the last of them ends (measured on 278 stops)."""


class LinuxcncModel(SampledModel[LinuxcncController, LinuxcncDialect]):
    """LinuxCNC: the path itself, its corners as the path mode says."""

    samples_per_speed = 1

    def speed_period_s(self, machine: _Machine) -> float:
        """Return the period of the trajectory planner, s."""
        return machine.controller.servo_period_s

    def sampled(self, path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
        """Yield the motion of the rows up to the end of the program."""
        return _rows_to_end(path, machine)

    def spacing_mm(self, toolpath: Toolpath, machine: _Machine) -> float:
        """Return the distance between samples, mm: a coded step, or more where the whole program
        would have more than a million samples."""
        return sample_spacing_mm(toolpath, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "blend" if the program blends corners, "path" if it follows the path exactly."""
        blends = any(mode.corners == "blend" for mode in _path_modes(toolpath, machine))
        return "blend" if blends else "path"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind figures and times, as sentences for the report."""
        return (
            *dict.fromkeys(_corner_sentence(mode) for mode in _path_modes(toolpath, machine)),
            "speeds by trapezoids within the limits of the axes, overrides at 100 %",
            "the step generator may be half a step off on each axis, which is not in the figures",
        )


def _rows_to_end(path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
    """Return the motion of the rows up to the end of the program; ProgramError for rows that
    cannot be followed."""
    rows = path.executed_rows
    check_rows(path, rows)
    return _Run(path.first(rows), machine).blocks()


def _corner_sentence(mode: PathMode) -> str:
    if mode.corners == "exact-path":
        return "no corner is rounded (G61)"
    if mode.corners == "exact-stop":
        return "the machine stops at each corner (G61.1)"
    if mode.tolerance_mm == 0.0:
        return "corners are blended as far as the moves allow (G64 without P)"
    return f"corners are blended within {mode.tolerance_mm:g} mm (G64 P), as the speed needs"


class PlannedWindow(Struct, frozen=True, eq=False):
    """The moves of some rows of a program, and the corners at their starts. Where the program
    continues before or behind the window, the first corner and the last move lack their
    neighbours. `origin` (N,): the row of the program that each row of `tangents.path` is, or is
    half of."""

    origin: Ints
    tangents: Tangents
    moves: PlannerMoves
    corners: PlannerCorners


class _Run:
    """Run of a program, planned in windows of some thousand rows.

    A block of rows begins where a move does. Planned with it are `MOVES_BEFORE` moves before it,
    for the corner between them, and as many moves behind it as the planner knows of. Moves begin
    at places: twice a row, and one more in the middle of an arc that is two lines."""

    def __init__(self, path: Toolpath, machine: _Machine) -> None:
        """Read limits and path modes; MachineError for missing limits."""
        self._path, self._machine = path, machine
        self._rules = _rules(_modes(path, machine), machine)
        self._begins, length = begins_of(path, self._rules.modes)
        self._spacing_mm = spacing_along(length, machine)
        self._before, self._since_rest_s = FROM_REST, 0.0
        self._passed_mm = 0.0, 0.0  # before the rows of a block: by rows, and by moves

    def blocks(self) -> Iterator[SampledRows]:
        """Yield the motion of all rows, some thousand at a time."""
        first_places = 2 * np.arange(0, len(self._path), ROWS_AT_ONCE)
        first = sorted(
            {self._move_at_row(int(k)) for k in np.searchsorted(self._begins, first_places)}
        )
        for low, high in pairwise([*first, len(self._begins)]):
            if low < high:
                yield self._block(low, high)

    def _move_at_row(self, move: int) -> int:
        """Return this move, or the first after it that begins where a row begins."""
        while self._place(move) % 2:
            move += 1
        return move

    def _block(self, low: int, high: int) -> SampledRows:
        """Return the motion of the moves low:high with its rows."""
        base, rows = self._place(low - MOVES_BEFORE), 2 * len(self._path)
        before = min(low, MOVES_BEFORE)
        own_moves = slice(before, before + high - low)
        window = lookahead = self._machine.controller.lookahead_moves
        while True:
            end = self._place(high + lookahead)
            window_plan = self._planned(base, end)
            places = slice(2 * own_moves.start, None if end == rows else -1)
            lasting, speeds = _speeds(window_plan, places, self._rules, self._before)
            overlap = np.append(window_plan.corners.overlap[1:], 0.0)
            overlaps = _in_turns(0.0, overlap)[lasting]
            done_count = int(lasting[: 2 * own_moves.stop].sum())
            if end == rows or len(speeds.length_mm) >= done_count + window:
                break
            lookahead *= 2  # some of the moves are too short to be planned
        part_seconds = np.zeros(len(lasting) + 1)
        cuts = np.repeat(window_plan.moves.cuts, 2)[lasting]
        squares = speeds.squares(self._machine.controller.lookahead_moves)
        part_seconds[:-1][lasting] = self._in_periods(
            speeds, squares, (overlaps, cuts), done_count
        )
        block_rows, first = slice(self._place(low) // 2, self._place(high) // 2), base // 2
        profile = _Profile.of(window_plan, part_seconds, speeds, squares, lasting)
        seconds = profile.origin_s[block_rows.start - first : block_rows.stop - first]
        samples = LinuxcncSamples(
            window_plan, profile, self._machine, self._spacing_mm, self._passed_mm
        )
        self._passed_mm = samples.passed_mm(own_moves.stop - min(high, MOVES_BEFORE))
        return SampledRows(block_rows.start, block_rows.stop, first, samples, seconds)

    def _place(self, move: int) -> int:
        """Return the place at which a move begins, counted in half rows."""
        begins = self._begins
        return int(begins[max(move, 0)]) if move < len(begins) else 2 * len(self._path)

    def _planned(self, low: int, high: int) -> PlannedWindow:
        """Return the plan of the moves between two places."""
        part, modes = self._path.part(low // 2, (high + 1) // 2), self._rules.modes
        part, origin = halve_arcs(part, modes.merging_mm(part.mode))
        own_rows = slice(low % 2, len(part) - high % 2)
        part, origin = part.part(own_rows.start, own_rows.stop), origin[own_rows]
        part, chain = merge_rows(part, modes.merging_mm(part.mode))
        tangents = Tangents(part)
        moves = moves_of(tangents, chain, self._rules)
        return PlannedWindow(origin, tangents, moves, corners_of(moves, tangents, self._rules))

    def _in_periods(
        self,
        plan: SpeedPlan,
        squares: Floats,
        overlaps_and_cuts: tuple[Floats, Bools],
        done_count: int,
    ) -> Floats:
        """Return (N,) seconds of each block, without the time in which it overlaps the next
        (`overlaps` (N,)). From rest to rest the time is a whole number of servo periods, with
        `REST_PERIODS` more. Very short cuts change their speed evenly over their whole length. The
        next plan begins behind the first `done_count` blocks."""
        overlaps, cuts = overlaps_and_cuts
        period_s = self._machine.controller.servo_period_s
        seconds = plan.seconds(squares)
        speeds = np.sqrt(squares)
        ramps = np.flatnonzero(cuts & (overlaps == 0.0) & (speeds[1:] > 0.0))
        evenly = 2.0 * plan.length_mm[ramps] / (speeds[ramps] + speeds[ramps + 1])
        seconds[ramps] = np.where(evenly < RAMP_S, evenly, seconds[ramps])
        seconds -= np.minimum(overlaps, 0.5 * seconds)
        has_rest = (squares[1:] == 0.0) & (overlaps == 0.0)
        rests = np.flatnonzero(has_rest)  # blocks behind which the machine stands
        run_starts = np.concatenate([[0], rests + 1])
        runs = np.add.reduceat(seconds, run_starts[:-1]) if len(rests) else np.zeros(0)
        runs[:1] += self._since_rest_s
        last = int(np.searchsorted(rests, done_count))
        before_s = 0.0 if last else self._since_rest_s
        self._since_rest_s = before_s + float(seconds[run_starts[last] : done_count].sum())
        self._before = plan.entry_after(done_count, squares)
        periods = np.rint(runs / period_s) + REST_PERIODS
        seconds[rests] += periods * period_s - runs
        return seconds


class LinuxcncSamples(CountedSamples):
    """Points along the moves, blends included."""

    def __init__(
        self,
        window_plan: PlannedWindow,
        profile: _Profile,
        machine: _Machine,
        spacing_mm: float,
        passed_mm: tuple[float, float],
    ) -> None:
        """Prepare the samples of a window. `passed_mm`: the lengths of all rows and of all moves
        before it, so that the last bits of positions do not depend on where a window begins."""
        path, moves, corners = window_plan.tangents.path, window_plan.moves, window_plan.corners
        super().__init__(path, machine, spacing_mm)
        self._origin, self._profile = window_plan.origin, profile
        halves = np.searchsorted(self._origin, np.arange(int(self._origin[-1]) + 2))
        self.first = self.first[halves]
        self._row = moves.row
        self._row_length = move_lengths(path)
        lengths = np.where(moves.row_of >= 0, self._row_length, 0.0)
        self._by_rows = np.cumsum(np.append(passed_mm[0], lengths))
        self._by_moves = np.cumsum(np.append(passed_mm[1], moves.length))
        into = self._by_rows[1:] - lengths - self._by_moves[np.maximum(moves.row_of, 0)]
        # Sums of a long program differ in their last bits; before its start no move is blended.
        self._into = np.maximum(into, 0.0)
        self._blends = None
        if corners.reach.any() or corners.before.any():
            tangent = window_plan.tangents.at_starts(moves.row)
            self._blends = Blends(
                self._ways,
                _corner_columns(corners),
                (moves.length, tangent, moves.row),
                (moves.row_of, self._into, self._row_length),
            )

    def passed_mm(self, move: int) -> tuple[float, float]:
        """Return the lengths of all rows, and of all moves, before a move."""
        row = self._row[move] if len(self._row) else 0
        return float(self._by_rows[row]), float(self._by_moves[move])

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return the row and the position of each of the samples low:high."""
        row, points = super().window(low, high)
        return self._origin[row], points

    def moments_s(self, low: int, high: int, rows_s: Floats) -> Floats:
        """Return (K,) seconds from the start of its row to each of the samples low:high."""
        row, share = self.places(low, high)
        along = self._into[row] + share * self._row_length[row]
        return self._profile.moments_s(row, self._into[row], along)

    def points(self, row: Ints, share: Floats) -> Floats:
        """Return (K, 3) mm: the points at fractions `share` (K,) of the lengths of rows (K,), on
        blends where there are any."""
        points = super().points(row, share)
        if self._blends is not None:
            self._blends.put(row, share, points)
        return points


def _corner_columns(corners: PlannerCorners) -> Floats:
    """Return the corners as columns for the compiled blends, with an empty one behind the last
    move."""
    count = len(corners.reach)
    table = np.zeros((count + 1, at.CORNER_COLUMNS))
    table[:, at.RAMP] = np.append(corners.ramp, 1.0)
    columns = (at.REACH, at.REACH_ON, at.BEFORE, at.BEHIND)
    values = (corners.reach, corners.reach_on, corners.before, corners.after)
    for column, value in zip(columns, values, strict=True):
        table[:count, column] = value
    table[:, at.TURN] = _turn_of(table[:, at.BEFORE], table[:, at.BEHIND], table[:, at.RAMP])
    centre, first, last = corners.shape
    angle = _angle_between(first, last)
    table[:count, at.ANGLE], table[:count, at.SINE] = angle, np.sin(angle)
    for column, vectors in ((at.CENTRE, centre), (at.FIRST, first), (at.LAST, last)):
        table[:count, column : column + 3] = vectors
    return table


def _speeds(
    window_plan: PlannedWindow, places: slice, rules: CornerRules, before: EntryState
) -> tuple[Bools, SpeedPlan]:
    """Return blends and moves as separate blocks of a speed plan, and a mask (2 M,) of those that
    have a length and lie in `places`. Even places of the mask are the blends before moves, odd
    ones the moves. A line that joins the blend at its end is not a block of its own. No block is
    faster than its length in `MIN_PERIODS` (`tpComputeOptimalVelocity`).

    In the mode "blend" the last move before a wait has half the acceleration: it was kept ready
    for a blend that never came (`tcGetOverallMaxAccel`). So do moves that overlap. In all modes it
    is entered no faster than it could stop within its half, for a blend could have taken the other
    half (`tpCalculateOptimizationInitialVel`)."""
    moves, corners = window_plan.moves, window_plan.corners
    own_length, joined_length = _lengths(moves, corners)
    path_lengths = _in_turns(corners.length + joined_length, own_length)
    lasting = np.zeros(len(path_lengths), dtype=np.bool_)
    lasting[places] = path_lengths[places] > MIN_LENGTH_MM
    along, fastest = _tangential_limits(moves, rules.modes, corners)
    entry_speed = np.where(corners.length > 0.0, np.inf, corners.speed)
    entered = np.minimum(entry_speed, np.where(moves.last, np.sqrt(along * own_length), np.inf))
    highest = _in_turns(corners.speed, np.minimum(moves.speed, fastest))
    np.minimum(highest, path_lengths / (MIN_PERIODS * rules.period_s), out=highest)
    return lasting, SpeedPlan(
        path_lengths[lasting],
        highest[lasting],
        _in_turns(corners.acceleration, along)[lasting],
        _in_turns(np.where(corners.joins, np.roll(entered, 1), np.inf), entered)[lasting],
        before,
    )


def _lengths(moves: PlannerMoves, corners: PlannerCorners) -> tuple[Floats, Floats]:
    """Return two arrays (M,), mm: the lengths of moves without their blends, 0 for lines that join
    a blend; and the lengths of the lines that join the blend at the start of each move."""
    own_length = moves.length - corners.reach_on
    own_length[:-1] -= corners.reach[1:]
    np.maximum(own_length, 0.0, out=own_length)
    joined_length = np.where(corners.joins, np.roll(own_length, 1), 0.0)
    own_length[:-1][corners.joins[1:]] = 0.0
    return own_length, joined_length


class _Profile(Struct, frozen=True, eq=False):
    """The times of a window's parts, s: for each move (M,) the half of the blend at its start,
    what blends leave of it, and the half of the blend at its end; `rows_s` (P,) of the rows of the
    path, and `origin_s` of the program's rows that these are, or are halves of.

    `block` (M,): the block of the plan for each move, −1 for one of which blends leave nothing."""

    window_plan: PlannedWindow
    begin_s: Floats
    own_s: Floats
    end_s: Floats
    rows_s: Floats
    origin_s: Floats
    plan: SpeedPlan
    squares: Floats
    block: Ints

    @classmethod
    def of(
        cls,
        window_plan: PlannedWindow,
        part_seconds: Floats,
        plan: SpeedPlan,
        squares: Floats,
        lasting: Bools,
    ) -> _Profile:
        """Return the profile of times from the time of each blend and move, `part_seconds` (2 M +
        1,); `lasting` (2 M,): a mask of those that are blocks of the plan."""
        begin_s, end_s = _blend_seconds(window_plan, part_seconds)
        own_s = part_seconds[1::2]
        path, moves = window_plan.tangents.path, window_plan.moves
        rows_s = np.where(path.kind == Kind.DWELL, path.value, 0.0)
        moving = np.flatnonzero(moves.row_of >= 0)
        move = moves.row_of[moving]
        move_s = own_s + begin_s + end_s
        rows_s[moving] = move_s[move] * (move_lengths(path)[moving] / moves.length[move])
        origin_s = np.asarray(np.bincount(window_plan.origin, rows_s), dtype=np.float64)
        of_part = np.where(lasting, np.cumsum(lasting) - 1, -1)
        block = of_part[1::2]
        return cls(window_plan, begin_s, own_s, end_s, rows_s, origin_s, plan, squares, block)

    def moments_s(self, row: Ints, into: Floats, along: Floats) -> Floats:
        """Return (K,) seconds from the start of the program's row to the point `along` (K,) mm on
        the row `row` (K,) of the path, which begins `into` (K,) mm behind the start of the
        program's row."""
        moves, corners = self.window_plan.moves, self.window_plan.corners
        move = moves.row_of[row]
        reach, length = np.append(corners.reach, 0.0), moves.length[move]
        first, last = np.append(corners.reach_on, 0.0)[move], reach[move + 1]
        move_s = self.own_s + self.begin_s + self.end_s
        moment_s = move_s[move] * along / length  # in proportion, if blends use up the whole move
        planned = np.flatnonzero(self.block[move] >= 0)
        one, block = move[planned], self.block[move[planned]]
        way_mm = np.maximum(along - first, 0.0)[planned]
        whole_s = self.plan.moments_s(self.squares, block, self.plan.length_mm[block])
        own_share = self.plan.moments_s(self.squares, block, way_mm) / whole_s
        begin_part = _part_of(along[planned], first[planned])
        end_part = 1.0 - _part_of((length - along)[planned], last[planned])
        # A move that overlaps with the next one goes on into the time of that.
        overlap_s = np.minimum(np.append(corners.overlap[1:], 0.0), self.own_s)
        own_s = (self.own_s + overlap_s)[one] * own_share
        moment_s[planned] = self.begin_s[one] * begin_part + own_s + self.end_s[one] * end_part
        self._put_overlaps(moment_s, move, along, overlap_s)
        starts_s, origin = np.cumsum(self.rows_s) - self.rows_s, self.window_plan.origin
        first_row = np.searchsorted(origin, origin[row])
        before_s = move_s[move] * into / length
        return np.asarray(moment_s - before_s + starts_s[row] - starts_s[first_row])

    def _put_overlaps(
        self, moment_s: Floats, move: Ints, along: Floats, overlap_s: Floats
    ) -> None:
        """Set the moments (K,) that lie where two moves overlap to the time that both share,
        `overlap_s` (M,), which begins with the second move, as `LinuxcncSamples` places the
        points."""
        corners, length = self.window_plan.corners, self.window_plan.moves.length
        before, behind = np.append(corners.before, 0.0), np.append(corners.after, 0.0)
        turn = _turn_of(before, behind, np.append(corners.ramp, 1.0))
        leftover = np.maximum(length[move] - along, 0.0)
        ends = np.flatnonzero(leftover < before[move + 1])
        one, corner = move[ends], move[ends] + 1
        x = turn[corner] * (1.0 - leftover[ends] / before[corner])
        moment_s[ends] = self.own_s[one] + x * overlap_s[one]
        begins = np.flatnonzero(along < behind[move])
        corner = move[begins]
        x = turn[corner] + (1.0 - turn[corner]) * along[begins] / behind[corner]
        moment_s[begins] = x * overlap_s[corner - 1]


def _part_of(reached: Floats, length: Floats) -> Floats:
    """Return (K,) `reached` divided by `length`, limited to 0 … 1; 1 where the length is 0."""
    parts = np.ones(len(length))
    np.divide(reached, length, out=parts, where=length > 0.0)
    return np.clip(parts, 0.0, 1.0)


def _blend_seconds(window_plan: PlannedWindow, part_seconds: Floats) -> tuple[Floats, Floats]:
    """Return two arrays (M,), s: the times of the blends at the start and at the end of each move,
    from the time of each blend and move, `part_seconds` (2 M + 1,).

    Half of a blend belongs to the row on either side, and a line that joins it to the row before;
    the rows of a merged line share its time by their lengths."""
    moves, corners = window_plan.moves, window_plan.corners
    _, joined_length = _lengths(moves, corners)
    joined = np.flatnonzero(joined_length)
    later_share = np.full(len(moves.length) + 1, 0.5)
    later_share[joined] *= corners.length[joined] / (corners.length + joined_length)[joined]
    blend_seconds = part_seconds[0::2]
    later_seconds = later_share * blend_seconds
    return later_seconds[:-1], (blend_seconds - later_seconds)[1:]


def _in_turns(blends: Floats | float, moves: Floats) -> Floats:
    """Return (2 M,) the values of blends and moves alternately: `blends` before `moves` (M,)."""
    values = np.empty(2 * len(moves))
    values[0::2], values[1::2] = blends, moves
    return values


def _tangential_limits(
    moves: PlannerMoves, modes: CornerModes, corners: PlannerCorners
) -> tuple[Floats, Floats]:
    """Return the acceleration (M,) along each move, mm/s², without the shares that kinks at its
    ends and a last stop take; and the highest speed (M,) of arcs at that acceleration, mm/s. For
    an arc before a wait half of the acceleration is kept for the turning: the planner never
    completes it for a next move."""
    lost_share = np.maximum(corners.lost_share, np.append(corners.lost_share[1:], 0.0))
    last = moves.last
    overlapped = corners.overlap > 0.0
    overlapped |= np.append(overlapped[1:], False)
    spared = np.where(overlapped | (last & modes.blend(moves.mode)), LAST_PART, 1.0)
    overall = moves.acceleration * (1.0 - lost_share) * spared
    along, fastest = moves.tangential(np.arange(len(overall)), overall)
    rough = last & moves.is_arc
    along[rough], fastest[rough] = TANGENT_RATIO * overall[rough], np.inf
    return along, fastest


class CornerModes(Struct, frozen=True, eq=False):
    """Treatment of the corner behind a row, by its mode (an index, as in `Toolpath.mode`). Columns
    of `table`, a row for each mode: 1 if corners are blended; 1 if the tool stops (neither: it
    follows the path without a stop); the tolerance of blends, mm, inf: none; the tolerance of
    merging, mm, 0: none."""

    table: Floats

    def blend(self, mode: Ints) -> Bools:
        """Return a mask (K,), true where corners behind moves of these modes (K,) are blended."""
        return np.asarray(self.table[:, 0][mode] > 0.0)

    def stop(self, mode: Ints) -> Bools:
        """Return a mask (K,), true where the machine stops at corners behind moves of these
        modes."""
        return np.asarray(self.table[:, 1][mode] > 0.0)

    def tolerance_mm(self, mode: Ints) -> Floats:
        """Return (K,) the greatest distance of blends from their corners; inf: as far as the moves
        allow."""
        return np.asarray(self.table[:, 2][mode])

    def merging_mm(self, mode: Ints) -> Floats:
        """Return (K,) the tolerance within which lines are merged, mm; 0: they are never
        merged."""
        return np.asarray(self.table[:, 3][mode])


def _modes(path: Toolpath, machine: _Machine) -> CornerModes:
    """Return the rules of the path mode of each row, which is that of the program or else that of
    the machine file."""
    return CornerModes(
        np.array(
            [
                (mode.corners == "blend", mode.corners == "exact-stop",
                 mode.tolerance_mm or np.inf, mode.merging_mm)
                for mode in _path_modes(path, machine)
            ]
        )
    )  # fmt: skip


def _path_modes(path: Toolpath, machine: _Machine) -> tuple[PathMode, ...]:
    """Return the path modes of the program; the last (index −1) is that of the machine file, if a
    row has none of its own."""
    silent = len(path) == 0 or bool((path.mode < 0).any())
    return (*path.modes, _machine_mode(machine)) if silent else path.modes


def _rules(modes: CornerModes, machine: _Machine) -> CornerRules:
    controller = machine.controller
    return CornerRules(
        modes=modes,
        kink_ratio=controller.kink_ratio,
        period_s=controller.servo_period_s,
        rate=axis_limits(machine, "max_rate_mm_min") / 60.0,
        acceleration=axis_limits(machine, "acceleration_mm_s2"),
    )


def _machine_mode(machine: _Machine) -> PathMode:
    """Return the path mode that `[dialect]` gives."""
    dialect = machine.dialect
    if dialect.path != "blend":
        return PathMode(dialect.path)
    return PathMode("blend", dialect.blend_tolerance_mm, dialect.blend_tolerance_mm)


# The moves of LinuxCNC's planner: rows merged into lines, and what bounds each of them.
#
# From `emccanon.cc`. Along a unit vector u a line is limited to min(limit / |u|) of the axes.
# An arc of radius r and sweep φ turns in XY, at no more than the slower axis v_xy, a_xy:
#
#     v² ≤ a_xy · √¾ · r_e,   r_e² = (least r)² + (dr/dφ)²       (`arc`, ARC_FEED)
#
# and a helix lets Z keep its own limits. Along an arc half of the acceleration is used, the rest
# is kept for turning (`tcGetTangentialMaxAccel`, tc.c); no move takes less than `MIN_PERIODS` of
# the servo.

NORMAL_RATIO = np.sqrt(0.75)
"""Largest share of the acceleration for turning (BLEND_ACC_RATIO_NORMAL)."""

TANGENT_RATIO = 0.5
"""Fraction of the acceleration that is used along the path of an arc
(BLEND_ACC_RATIO_TANGENTIAL)."""

MIN_PERIODS = 1.02
"""Servo periods that the shortest move lasts (TP_MIN_SEGMENT_CYCLES, tp_types.h)."""


def halve_arcs(path: Toolpath, tolerance_mm: Floats) -> tuple[Toolpath, Ints]:
    """Replace each arc whose sagitta is below `tolerance_mm` (N,) of its row by two lines over its
    middle (ARC_FEED, emccanon.cc). Return the rows, and for each the row that it comes from."""
    every = np.arange(len(path))
    arcs = np.flatnonzero(path.is_arc & (tolerance_mm > 0.0))
    if len(arcs) == 0:
        return path, every
    arms = PolarArcs(path, path.is_arc & (tolerance_mm > 0.0))
    bow = arms.radius * (1.0 - np.cos(0.5 * arms.sweep))
    flat = np.flatnonzero(bow < tolerance_mm[arcs])
    if len(flat) == 0:
        return path, every
    angle = arms.angle[flat] + 0.5 * arms.sweep[flat]
    spoke = arms.radius[flat, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    rows = arcs[flat]
    origin = np.insert(every, rows, rows)
    first = np.searchsorted(origin, rows)
    kind, end, centre = path.kind[origin], path.end[origin], path.centre[origin]
    for half in (first, first + 1):
        kind[half], centre[half] = Kind.LINE, np.nan
    end[first, :2] = arms.centre[flat] + spoke
    end[first, 2] = 0.5 * (arms.begin[flat, 2] + arms.end[flat, 2])
    kind, end, centre = read_only(kind), read_only(end), read_only(centre)
    return path.picked(origin, kind=kind, end=end, centre=centre), origin


def merge_rows(path: Toolpath, tolerance_mm: Floats) -> tuple[Toolpath, Ints]:
    """Return the rows with the ends of merged lines moved onto their common line, and (N,) the
    line of each row. `tolerance_mm` (N,) of each row; 0: it is not merged.

    Only feed moves with the same feed and path mode, and with nothing but moves of no length
    between them, are merged; any event, an MSG comment too, ends a line."""
    count = len(path)
    if not tolerance_mm.any():
        return path, np.arange(count)
    same_feed = np.zeros(count, dtype=np.bool_)
    same_feed[1:] = path.feed[1:] == path.feed[:-1]
    is_line = path.kind == Kind.LINE
    is_break = ~(is_line & same_feed) | (tolerance_mm == 0.0)
    is_break[1:] |= ~is_line[:-1] | (path.mode[1:] != path.mode[:-1])
    points = np.concatenate([path.start[None, :], path.end])
    chain, merged_ends = np.empty(count, dtype=np.int64), np.empty((count, 3))
    merge_lines(points, is_break, tolerance_mm, chain, merged_ends)
    return replace(path, end=read_only(merged_ends)), chain


def begins_of(path: Toolpath, modes: CornerModes) -> tuple[Ints, Floats]:
    """Return the places (M,) where moves begin, the first at 0, counted in half rows; and (N,) the
    length of each row with the end that `merge_rows` gives it."""
    length, begins = np.zeros(len(path)), [np.zeros(1, dtype=np.int32)]
    low, end = 0, 2 * len(path)
    at_once = max(ROWS_AT_ONCE, MAX_CHAIN_POINTS + 2)  # more rows than one merged line can have
    while low < end:
        base = low // 2
        part = path.part(base, min(base + at_once, len(path)))
        ends_here = 2 * (base + len(part)) == end
        part, origin = halve_arcs(part, modes.merging_mm(part.mode))
        place = 2 * (base + origin)
        place[1:] += np.diff(origin) == 0
        part, origin, place = part.part(low % 2, len(part)), origin[low % 2 :], place[low % 2 :]
        part, chain = merge_rows(part, modes.merging_mm(part.mode))
        # The last line may continue in the next part.
        rows = len(part) if ends_here else int(np.searchsorted(chain, chain[-1]))
        own_length = move_lengths(part)[:rows]
        lasting = np.bincount(chain[:rows], own_length) > 0.0
        first = np.searchsorted(chain[:rows], np.flatnonzero(lasting))
        begins.append(place[first].astype(np.int32))
        by_row = np.bincount(origin[:rows], own_length)
        length[base : base + len(by_row)] += by_row
        low = end if ends_here else int(place[rows])
    all_begins = np.concatenate(begins)
    return np.concatenate([all_begins[:1], all_begins[2:]]), length


class PlannerMoves(Struct, frozen=True, eq=False):
    """M moves in order. row_of (N,): the move of each row of the program, −1 for rows that do not
    move; row (M,): the first row of each move, and mode (M,) the path mode there. length mm, speed
    mm/s (as programmed, within the limits), acceleration mm/s² (of the whole machine in that
    direction), each (M,); is_arc (M,), and for arcs the `highest` speed (M,) mm/s and the
    centripetal acceleration `bend` (M,) mm/s² at that speed, 0 for lines; waits (M,): the machine
    comes to rest before this move, whatever the corner; same_kind (M,): this move and the one
    before are both rapids or both at a feed; cuts (M,): at a feed."""

    row_of: Ints
    row: Ints
    mode: Ints
    length: Floats
    speed: Floats
    acceleration: Floats
    is_arc: Bools
    highest: Floats
    bend: Floats
    waits: Bools
    same_kind: Bools
    cuts: Bools

    @property
    def last(self) -> Bools:
        """Mask (M,) of the moves behind which the machine waits."""
        return np.append(self.waits[1:], np.ones(min(len(self.waits), 1), dtype=np.bool_))

    def tangential(self, indices: Ints, overall: Floats) -> tuple[Floats, Floats]:
        """Return for moves (K,) with the total acceleration `overall` (K,): the acceleration along
        them, mm/s², and the highest speed at it, mm/s. The tangential part is what turning at full
        speed leaves, but at least half (`pmCircleActualMaxVel`)."""
        bend, part = self.bend[indices], NORMAL_RATIO * overall
        steep = bend > part
        tangent_share = np.sqrt(np.maximum(1.0 - (bend / overall) ** 2, 0.0))
        along = np.where(steep, TANGENT_RATIO, tangent_share) * overall
        with np.errstate(divide="ignore", invalid="ignore"):
            slower = self.highest[indices] * np.sqrt(part / bend)
        return along, np.where(steep, slower, np.inf)


def moves_of(tangents: Tangents, chain: Ints, rules: CornerRules) -> PlannerMoves:
    """Return the planner's moves of merged rows."""
    path, period_s = tangents.path, rules.period_s
    row_length = move_lengths(path)
    length: Floats = np.bincount(chain, row_length, minlength=len(path)).astype(np.float64)
    lasting = length > 0.0
    number = np.cumsum(lasting) - 1
    row_of = np.where(row_length > 0.0, number[chain], -1)
    moving = np.flatnonzero(row_of >= 0)
    lead = moving[np.diff(row_of[moving], prepend=-1) > 0]  # the first row of each move
    length = length[lasting]
    assert len(lead) == len(length)
    is_arc = path.is_arc[lead]
    begin = tangents.at_starts(lead)
    highest, along = max_along(rules.rate, begin), max_along(rules.acceleration, begin)
    arcs = np.flatnonzero(is_arc)
    arm, limits = tangents.arm_of(lead[arcs]), (rules.rate, rules.acceleration)
    bend = np.zeros(len(lead))
    highest[arcs], along[arcs], bend[arcs] = _arc_limits(tangents.arms, arm, length[arcs], limits)
    highest = np.minimum(highest, length / period_s)
    cuts = path.is_feed[lead]
    speed = np.minimum(np.where(cuts, path.feed[lead], np.inf) / 60.0, highest)
    waits = np.diff(np.cumsum(np.isin(path.kind, EVENTS_AT_REST))[lead], prepend=-1) > 0
    same_kind = cuts == np.roll(cuts, 1)
    mode = path.mode[lead]
    return PlannerMoves(
        row_of, lead, mode, length, speed, along, is_arc, highest, bend, waits, same_kind, cuts
    )


class Tangents:
    """Unit tangents at the ends of the rows of a path, in which merged rows are straight."""

    def __init__(self, path: Toolpath) -> None:
        self.path = path
        self.arms = PolarArcs(path, path.is_arc)

    def arm_of(self, arcs: Ints) -> Ints:
        """Return (J,) the indices in `arms` of rows that are arcs."""
        return np.searchsorted(self.arms.row, arcs)

    def at_starts(self, rows: Ints) -> Floats:
        """Return (K, 3) unit tangents at the starts of rows (K,), which must have a length."""
        return self._at(rows, self.arms.radius, 0.0)

    def at_ends(self, rows: Ints, *, level: bool = False) -> Floats:
        """Return (K, 3) unit tangents at the ends of rows (K,); with `level` without the rise of
        helices."""
        return self._at(rows, self.arms.end_radius, 1.0, level=level)

    def pushed_at_starts(self, rows: Ints, acceleration: Floats, speed: Floats) -> Floats:
        """Return (K, 3) unit vectors of the tool's acceleration at the starts of rows (K,): along
        the tangent; for arcs also inward, by the tangential acceleration (K,) and half of the
        speed (K,)."""
        push = self._at(rows, self.arms.radius, 0.0, level=True)
        arcs = np.flatnonzero(are_arcs(self.path.kind[rows]))
        arm = self.arm_of(rows[arcs])
        angle, radius = self.arms.angle[arm], self.arms.radius[arm]
        inward = np.column_stack([-np.cos(angle), -np.sin(angle), np.zeros(len(arcs))])
        push[arcs] *= acceleration[arcs, None]
        push[arcs] += ((0.5 * speed[arcs]) ** 2 / radius)[:, None] * inward
        return _unit(push)

    def _at(self, rows: Ints, radius: Floats, share: float, *, level: bool = False) -> Floats:
        path, arms = self.path, self.arms
        tangent = path.end.take(rows, axis=0) - path.starts_of(rows)
        kind = path.kind[rows]
        arcs = np.flatnonzero(are_arcs(kind))
        arm = self.arm_of(rows[arcs])
        sweep, grows = arms.sweep[arm], (arms.end_radius - arms.radius)[arm]
        angle, r = arms.angle[arm] + share * sweep, radius[arm]
        cos, sin = np.cos(angle), np.sin(angle)
        tangent[arcs, 0] = grows * cos - r * sweep * sin
        tangent[arcs, 1] = grows * sin + r * sweep * cos
        if level:
            tangent[arcs, 2] = 0.0
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        return tangent


def _arc_limits(
    arms: PolarArcs, arm: Ints, length: Floats, limits: tuple[Floats, Floats]
) -> tuple[Floats, Floats, Floats]:
    """Return the highest speed of arcs, their total acceleration, and the centripetal part of it
    at that speed."""
    rate, acceleration = limits
    v_xy, a_xy = rate[:2].min(), acceleration[:2].min()
    r, r_end, sweep = arms.radius[arm], arms.end_radius[arm], np.abs(arms.sweep[arm])
    rise = np.abs(arms.end[arm, 2] - arms.begin[arm, 2])
    grows = r_end - r
    min_radius = np.minimum(r, r_end)
    radius = np.hypot(min_radius, grows / sweep)
    level = np.hypot(min_radius * sweep, grows)
    planar = np.minimum(v_xy, np.sqrt(a_xy * NORMAL_RATIO * radius))
    highest = length / np.maximum(rise / rate[2], level / planar)
    overall = length / np.maximum(rise / acceleration[2], level / a_xy)
    turning = _turning_radius(r, grows / sweep, rise)
    highest = np.minimum(highest, np.sqrt(NORMAL_RATIO * overall * turning))
    return highest, overall, highest**2 / turning


def _covered_share(x: Floats, ramp: Floats) -> Floats:
    """Return the fraction of its length that the second of two overlapping moves has covered
    after the fraction x of the time, if it accelerates during the first fraction `ramp`."""
    return np.where(x < ramp, x**2 / (2.0 * ramp), x - 0.5 * ramp) / (1.0 - 0.5 * ramp)


def _turn_of(before: Floats, after: Floats, ramp: Floats) -> Floats:
    """Return (M,) the fraction x of the time of an overlap at which the rest of the first move
    equals what the second has covered: there the tool is nearest to the corner, and the first move
    ends and the second begins.

    The rest, (1 − x)² `before`, falls, and the covered length, `_covered_share`(x) `after`, grows,
    so they meet once; found by bisection. 0.5 where nothing overlaps."""
    low, high = np.zeros(len(before)), np.ones(len(before))
    ramp = np.where(before > 0.0, ramp, 1.0)
    for _ in range(TURN_ROUNDS):
        middle = 0.5 * (low + high)
        early = (1.0 - middle) ** 2 * before > _covered_share(middle, ramp) * after
        low, high = np.where(early, middle, low), np.where(early, high, middle)
    return np.where((before > 0.0) & (after > 0.0), 0.5 * (low + high), 0.5)


TURN_ROUNDS = 40
"""Bisections of the time of an overlap: to the last digits."""


def _turning_radius(r: Floats, growth: Floats, rise: Floats) -> Floats:
    """Return the radius by which the planner limits the speed of arcs of radius r at their start,
    which grow by `growth` per radian (`pmCircleEffectiveMinRadius`, blendmath.c). It takes the
    whole rise for that of one radian, so that helices may be faster than their curvature
    allows."""
    inner = growth**2 + r**2
    spiral = inner**1.5 / (inner + growth**2)
    return np.asarray(spiral + rise**2 / spiral)


# How LinuxCNC meets the corners between its moves.
#
# At each corner with unit tangents u1 before and u2 behind it (`tpSetupTangent`, tp.c):
#
# - within 2° of straight back: a stop;
# - a bend that takes less than `kink_ratio` of the highest acceleration of any axis in one servo
#   period: no corner at all, but both moves accelerate less by that part;
# - else a stop in the modes "exact-path" and "exact-stop" (which stops at the others too), and in
#   "blend" an arc that touches both moves (`blendComputeParameters`, blendmath.c).
#
# With θ half the angle between −u1 and u2, an arc of radius R touches lines at d from the corner
# and leaves it by T:
#
#     R = d tan θ,   T = R (1/sin θ − 1) = d (1 − sin θ)/cos θ,   v² ≤ √¾ a R
#
# T is at most the tolerance and a quarter of the shorter move; d at most half a line, the last two
# thirds of an arc (or, if less, a radian and a half), and its first third. No blend is wider than
# its speed needs, v²/(√¾ a), or than as long a time at that speed as half the acceleration would
# need to reach it.
#
# An arc that curves towards the other move counts as its chord, and θ becomes less by a quarter of
# what may be used of it. R is then laid against the arcs themselves, and given up where that
# leaves the corner by more than T, or uses more of an arc than it may.
#
# Where no arc is possible the moves overlap, or the corner is met slowly, as if it were none: of
# the three the planner takes the one that it thinks the fastest (`tpChooseBestBlend`).

STRAIGHT_BACK_RAD = np.deg2rad(2.0)
"""A way back within this angle is a stop (SHARP_CORNER_DEG)."""

TOLERANCE_PART = 0.25
"""Fraction of the shorter move: no blend leaves its corner by more (`tcFindBlendTolerance`)."""

LINE_PART = 0.5
"""Fraction of a line: a blend uses no more at each end (BLEND_DIST_FRACTION)."""

ARC_END_PART = 2.0 / 3.0
"""Fraction of an arc: a blend at its end uses no more (`blendInit3FromArcLine`)."""

ARC_START_PART = 1.0 / 3.0
"""Fraction of an arc: a blend at its start uses no more (`blendInit3FromLineArc`)."""

COPLANAR = 1e-6
"""Arcs and what they meet lie in one plane when the normal of their tangents leaves that of the
arc by no more than this."""

MIN_BEND_RAD = 1e-3
"""Moves that bend by less have no arc between them (TP_MIN_ARC_ANGLE)."""


class PlannerCorners(Struct, frozen=True, eq=False):
    """Corners at the starts of M moves: `speed` (M,) mm/s, 0 for a stop; `lost_share` (M,): the
    part of the acceleration that a bend takes from the moves on both sides; `reach` and `reach_on`
    (M,) mm: how far from the corner a blend begins on the move before, and ends on the move
    behind, 0 without one; `acceleration` (M,) mm/s² along blends; `length` (M,) mm along them;
    `shape` (3, M, 3): their centres, and the vectors from there to their starts and ends. Where
    moves overlap: `before` and `after` (M,) mm, how far from the corner they do; `overlap` (M,) s,
    how long; and `ramp` (M,), the part of that time in which the second of them speeds up; 0
    elsewhere. `joins` (M,): the line before the corner is part of the blend."""

    speed: Floats
    lost_share: Floats
    reach: Floats
    reach_on: Floats
    acceleration: Floats
    length: Floats
    shape: Floats
    before: Floats
    after: Floats
    overlap: Floats
    ramp: Floats
    joins: Bools


class CornerRules(Struct, frozen=True):
    """`modes`: how corners are met; `kink_ratio`; `period_s` of the servo; limits (3,) of the
    axes, mm/s and mm/s²."""

    modes: CornerModes
    kink_ratio: float
    period_s: float
    rate: Floats
    acceleration: Floats


class Bends(Struct, frozen=True, eq=False):
    """Unit tangents (K, 3) `before` and `after` corners."""

    before: Floats
    after: Floats

    @property
    def inward(self) -> Floats:
        """Unit vectors (K, 3) from the corner to the centre of a blend."""
        return _unit(self.after - self.before)

    @property
    def onward(self) -> Floats:
        """Unit vectors (K, 3) along the middle of a blend."""
        return _unit(self.after + self.before)

    @property
    def theta(self) -> Floats:
        """Half the interior angle (K,) of the corner, rad: straight on it is π/2."""
        cosine = np.clip(-(self.before * self.after).sum(axis=1), -1.0, 1.0)
        return np.asarray(0.5 * np.arccos(cosine))

    def subset(self, indices: Ints) -> Bends:
        """Return the bends at these corners."""
        return Bends(self.before[indices], self.after[indices])


def corners_of(moves: PlannerMoves, tangents: Tangents, rules: CornerRules) -> PlannerCorners:
    """Return the speed, overlap or blend at the start of each move."""
    bends = Bends(
        tangents.at_ends(np.roll(moves.row, 1)),  # the first has no effect
        tangents.at_starts(moves.row),
    )
    used_mm = np.zeros(len(moves.length))  # length of each move used by the blend at its start
    lines = ~moves.is_arc & (moves.same_kind | ~moves.cuts)
    joinable = lines
    for _ in range(MAX_ROUNDS):
        corners = _meet(moves, tangents, bends, used_mm, joinable, rules)
        free = lines & (corners.overlap == 0.0)
        if (corners.reach_on == used_mm).all() and (free == joinable).all():
            break
        used_mm, joinable = corners.reach_on, free
    return corners


GAP_PERIODS = 4.0
"""A line of which the blend at its end leaves less than so many servo periods at the blend's speed
becomes part of the blend (ARC_BLEND_GAP_CYCLES, `blendCheckConsume`)."""

MAX_ROUNDS = 4
"""Most rounds of planning the corners with the lengths that the blends of the round before
leave."""


def _meet(
    moves: PlannerMoves,
    tangents: Tangents,
    bends: Bends,
    used_mm: Floats,
    joinable: Bools,
    rules: CornerRules,
) -> PlannerCorners:
    """Return all corners, where the blends at the starts of moves take `used_mm` (M,) of them.
    Lines that overlap with the move before, or wait for the spindle behind a rapid, are not
    `joinable` (M,) (`tcCanConsume`)."""
    count = len(moves.length)
    zeros = [np.zeros(count) for _ in range(10)]
    corners = PlannerCorners(
        zeros[0], zeros[1], zeros[2], zeros[3], zeros[4], zeros[5], np.zeros((3, count, 3)),
        zeros[6], zeros[7], zeros[8], zeros[9],
        np.zeros(count, dtype=np.bool_),
    )  # fmt: skip
    rows = np.arange(count)
    before = moves.mode[rows - 1]
    turn = bends.after - bends.before
    is_reversal = np.linalg.norm(bends.after + bends.before, axis=1) < STRAIGHT_BACK_RAD
    # The move before a corner says how it is met; both say how far a blend may leave it.
    is_free = ~moves.waits[rows] & moves.same_kind[rows] & ~is_reversal & ~rules.modes.stop(before)
    # A kink: the change of velocity within one period, as a part of what each axis can do.
    highest = np.minimum(moves.speed[rows - 1], moves.speed[rows])
    jolt = highest / rules.period_s + moves.acceleration[rows]
    part = np.abs(turn) * jolt[:, None] / rules.acceleration
    part = columns_of(part).max(axis=0, initial=0.0)
    curved = moves.is_arc[rows] | moves.is_arc[rows - 1]
    part = np.where(curved, part / TANGENT_RATIO, part)
    smooth = is_free & (part < rules.kink_ratio)
    corners.speed[rows] = np.where(smooth, np.inf, 0.0)
    corners.lost_share[rows] = np.where(smooth, part, 0.0)
    blends = is_free & ~smooth & rules.modes.blend(before)
    normal = np.cross(bends.before, bends.after)
    flat = np.hypot(normal[:, 0], normal[:, 1]) <= COPLANAR * np.linalg.norm(normal, axis=1)
    straight = np.flatnonzero(blends & ~curved)
    _round_lines(
        corners, moves, tangents, straight, bends.subset(straight), used_mm, joinable, rules
    )
    bent = np.flatnonzero(blends & curved & flat)
    _round_arcs(corners, moves, tangents, bent, bends.subset(bent), used_mm, joinable, rules)
    blended = np.flatnonzero(blends)
    kink = highest[blended] * rules.kink_ratio / part[blended]
    _choose(corners, moves, tangents, blended, kink, used_mm, rules)
    return corners


def _choose(
    corners: PlannerCorners,
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    kink: Floats,
    used_mm: Floats,
    rules: CornerRules,
) -> None:
    """Decide how the moves at the corners `rows` (K,) meet, and change `corners` accordingly: by
    overlap, by the speed `kink` (K,) at which the corner counts as straight, or by the blend; the
    planner takes the fastest by its estimate, the first of equals (`tpChooseBestBlend`)."""
    arc = corners.speed[rows]
    overlap = _worth(moves, tangents, rows, used_mm, rules)
    overlaps = (overlap >= kink) & (overlap >= arc)
    bends = ~overlaps & (kink >= arc)
    for column in (corners.reach, corners.reach_on, corners.length, corners.joins):
        column[rows[overlaps | bends]] = 0
    corners.speed[rows[overlaps]] = 0.0
    _overlap(corners, moves, tangents, rows[overlaps], rules)
    corners.speed[rows[bends]] = kink[bends]
    corners.lost_share[rows[bends]] = rules.kink_ratio


class _Overlaps(Struct, frozen=True, eq=False):
    """Speeds mm/s of both moves while they overlap, and half the angle between them, (K,)."""

    first: Floats
    second: Floats
    theta: Floats


def _overlaps(
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    rates: tuple[Floats, Floats],
    lengths: tuple[Floats, Floats],
    overall: Floats,
    modes: CornerModes,
) -> _Overlaps:
    """Return the overlaps of moves at corners (`tpComputeBlendVelocity`), from the accelerations
    along both moves and the lengths that count for them; `overall` (K,) is the acceleration of the
    second move with its turning part."""
    one, other = rates
    reachable = [
        np.minimum(np.sqrt(rate * length), moves.speed[k])
        for k, rate, length in ((rows - 1, one, lengths[0]), (rows, other, lengths[1]))
    ]
    lasting = np.minimum(moves.length[rows - 1] / reachable[0], moves.length[rows] / reachable[1])
    blend_s = np.minimum(lasting, np.maximum(reachable[0] / one, reachable[1] / other))
    first = np.minimum(reachable[0], blend_s * one)
    second = np.minimum(reachable[1], blend_s * other)
    before = tangents.at_ends(moves.row[rows - 1], level=True)
    after = tangents.pushed_at_starts(moves.row[rows], overall, moves.speed[rows])
    theta = Bends(before, after).theta
    tolerance, cosine = modes.tolerance_mm(moves.mode[rows - 1]), np.cos(theta)
    bends = cosine > 0.5 * MIN_BEND_RAD
    tolerance_speed = 2.0 * np.sqrt(one * tolerance / np.where(bends, cosine, 1.0))
    tolerance_speed = np.where(bends, tolerance_speed, np.inf)
    return _Overlaps(
        np.minimum(first, tolerance_speed), np.minimum(second, tolerance_speed), theta
    )


def _worth(
    moves: PlannerMoves, tangents: Tangents, rows: Ints, used_mm: Floats, rules: CornerRules
) -> Floats:
    """Return (K,) the speed, mm/s, by which the planner rates an overlap before it knows the next
    corner: it assumes that half of each move may be used up by then, that bends take their part of
    the acceleration, and arcs half for turning."""
    rates = [
        LAST_PART * (1.0 - rules.kink_ratio) * moves.acceleration[k]
        * np.where(moves.is_arc[k], TANGENT_RATIO, 1.0)
        for k in (rows - 1, rows)
    ]  # fmt: skip
    lengths = 0.5 * (moves.length[rows - 1] - used_mm[rows - 1]), 0.5 * moves.length[rows]
    overall = LAST_PART * (1.0 - rules.kink_ratio) * moves.acceleration[rows]
    overlaps = _overlaps(
        moves, tangents, rows, (rates[0], rates[1]), lengths, overall, rules.modes
    )
    return np.asarray(0.25 * np.sin(overlaps.theta) * (overlaps.first + overlaps.second))


def _overlap(
    corners: PlannerCorners,
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    rules: CornerRules,
) -> None:
    """Fill in the overlap of the moves at the corners `rows` (K,)."""
    one, _ = moves.tangential(rows - 1, LAST_PART * moves.acceleration[rows - 1])
    other, _ = moves.tangential(rows, LAST_PART * moves.acceleration[rows])
    lengths = moves.length[rows - 1], moves.length[rows]
    overall = LAST_PART * moves.acceleration[rows]
    overlaps = _overlaps(moves, tangents, rows, (one, other), lengths, overall, rules.modes)
    # While the first comes to rest, the second starts from rest, whatever its speed at the corner.
    seconds = overlaps.first / one
    reached = np.minimum(moves.speed[rows], seconds * other)
    corners.overlap[rows], corners.ramp[rows] = seconds, reached / other / seconds
    corners.before[rows] = 0.5 * overlaps.first * seconds
    corners.after[rows] = reached * (seconds - 0.5 * reached / other)


class _Rounds(Struct, frozen=True, eq=False):
    """Wanted blends, each (K,): half the angle `theta` of the corner as the planner assumes it;
    the tolerance, mm; the radius, mm; the speed, mm/s; and the acceleration in their plane,
    mm/s²."""

    theta: Floats
    tolerance: Floats
    radius: Floats
    speed: Floats
    acceleration: Floats


def _rounds(
    moves: PlannerMoves,
    rows: Ints,
    normal: Floats,
    theta: Floats,
    longest: Floats,
    planar: Floats,
    rules: CornerRules,
) -> _Rounds:
    """Return the blends at the corners `rows` (K,), in planes of the unit normals (K, 3). They use
    at most `longest` (K,) mm of either move, and are no faster than the larger of `planar` (K,)
    mm/s and the speed of the axes in that plane (`blendParamKinematics`,
    `blendComputeParameters`).

    In the plane no axis exceeds its limit when the whole is limited to min(limit / √(1 − m²))."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.sqrt(np.maximum(1.0 - normal**2, 0.0))
        acceleration = (rules.acceleration / share).min(axis=1, initial=np.inf)
        rate = np.maximum((rules.rate / share).min(axis=1, initial=np.inf), planar)
        shorter = np.minimum(moves.length[rows], moves.length[rows - 1])
        modes = rules.modes
        allowed = np.minimum(
            modes.tolerance_mm(moves.mode[rows]), modes.tolerance_mm(moves.mode[rows - 1])
        )
        tolerance = np.minimum(allowed, TOLERANCE_PART * shorter)
        by_tolerance = tolerance * np.cos(theta) / (1.0 - np.sin(theta))
        reach = np.minimum(longest, by_tolerance)
        widest = reach * np.tan(theta)
        across = NORMAL_RATIO * acceleration
        programmed = np.maximum(moves.speed[rows - 1], moves.speed[rows])
        speed = np.minimum(np.minimum(programmed, rate), np.sqrt(across * widest))
        half = 0.5 * acceleration
        by_time = np.minimum(np.sqrt(2.0 * half * reach), speed) / half * speed
        by_time /= np.pi - 2.0 * theta
        radius = np.maximum(speed**2 / across, np.minimum(by_time, widest))
    return _Rounds(theta, tolerance, radius, speed, acceleration)


def _fill(
    corners: PlannerCorners,
    rows: Ints,
    rounds: _Rounds,
    reach: tuple[Floats, Floats],
    shape: Floats,
    is_valid: Bools,
    left_mm: Floats,
    rules: CornerRules,
) -> None:
    """Fill in the blends that are valid (`is_valid` (K,)): `reach` on both moves, with the centre
    and both spokes in `shape` (3, K, 3). They leave `left_mm` (K,) of the move before; inf where
    that move may not join."""
    rows, shape = rows[is_valid], shape[:, is_valid]
    length = np.linalg.norm(shape[1], axis=1) * _angle_between(shape[1], shape[2])
    speed = rounds.speed[is_valid]
    left_mm = left_mm[is_valid]
    joins = left_mm < GAP_PERIODS * rules.period_s * speed
    lasting = (length + np.where(joins, left_mm, 0.0)) / rules.period_s
    corners.joins[rows] = joins
    corners.speed[rows] = np.minimum(speed, lasting)
    corners.reach[rows], corners.reach_on[rows] = reach[0][is_valid], reach[1][is_valid]
    corners.acceleration[rows] = TANGENT_RATIO * rounds.acceleration[is_valid]
    corners.length[rows] = length
    corners.shape[:, rows] = shape


def _round_lines(
    corners: PlannerCorners,
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    bends: Bends,
    used_mm: Floats,
    joinable: Bools,
    rules: CornerRules,
) -> None:
    """Fill in the blends between lines at the corners `rows`."""
    theta = bends.theta
    bent = np.pi - 2.0 * theta
    longest = np.minimum(
        moves.length[rows - 1] - used_mm[rows - 1], LINE_PART * moves.length[rows - 1]
    )
    longest = np.minimum(longest, LINE_PART * moves.length[rows])
    # The height of the triangle of both highest speeds.
    clipped = np.cos(np.minimum(bent, CLIPPED_RAD))
    one, other = moves.highest[rows - 1], moves.highest[rows]
    one, other = np.minimum(one, other / clipped), np.minimum(other, one / clipped)
    across = other[:, None] * bends.after - one[:, None] * bends.before
    with np.errstate(divide="ignore", invalid="ignore"):
        planar = one * other * np.sin(bent) / np.linalg.norm(across, axis=1)
        normal = _unit(np.cross(bends.before, bends.after))
        rounds = _rounds(moves, rows, normal, theta, longest, planar, rules)
        reach = rounds.radius / np.tan(theta)
        centre_distance = rounds.radius / np.sin(theta)
    inward = centre_distance[:, None] * bends.inward
    shape = np.stack(
        [
            tangents.path.starts_of(moves.row[rows]) + inward,
            -reach[:, None] * bends.before - inward,
            reach[:, None] * bends.after - inward,
        ]
    )
    is_valid = (bent > MIN_BEND_RAD) & (rounds.radius * bent > MIN_LENGTH_MM)
    left_mm = moves.length[rows - 1] - used_mm[rows - 1] - reach
    left_mm[~joinable[rows - 1]] = np.inf
    _fill(corners, rows, rounds, (reach, reach), shape, is_valid, left_mm, rules)


CLIPPED_RAD = 0.49 * np.pi
"""The planner takes no corner for sharper, where it compares the speeds of two lines."""

MIN_THETA_RAD = np.pi / 12.0
"""No arc is laid between two arcs where θ is less (`blendInit3FromArcArc`)."""


class _Side(Struct, frozen=True, eq=False):
    """One of the two moves at K corners, with points as complex numbers: its tangent there; for
    arcs the circle that touches it (`centre`, `radius`), the `sign` with which a blend's radius
    counts where it touches that circle from inside (−1) or outside (1), and the angle `max_angle`
    that a blend may use; `longest` mm: the part of the move that a blend may use; `less`: by how
    much θ is reduced."""

    is_arc: Bools
    tangent: Floats
    centre: Floats
    radius: Floats
    sign: Floats
    max_angle: Floats
    longest: Floats
    less: Floats


def _side(
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    corner: Floats,
    tangent: Floats,
    other: Floats,
    theta: Floats,
    used_mm: Floats,
    *,
    ends: bool,
) -> _Side:
    """Return the geometry on one side of the corners (K,): that of the moves `rows` (K,), which
    end there (`ends`) or begin there."""
    is_arc, arms = moves.is_arc[rows], tangents.arms
    arcs = np.flatnonzero(is_arc)
    arm = tangents.arm_of(moves.row[rows[arcs]])
    geometry = corner[arcs], tangent[arcs], other[arcs]
    growth = (arms.end_radius - arms.radius)[arm] / np.abs(arms.sweep[arm])
    centre = arms.centre[arm, 0] + 1j * arms.centre[arm, 1] + growth * geometry[1]
    spoke = geometry[0] - centre
    towards = (spoke * geometry[2].conj()).real
    convex = towards < 0.0 if ends else towards >= 0.0
    sweep = np.abs(arms.sweep[arm])
    remaining = sweep * (1.0 - used_mm[rows[arcs]] / moves.length[rows[arcs]]) if ends else sweep
    part = ARC_END_PART if ends else ARC_START_PART
    max_angle = np.minimum(part * remaining, np.where(convex, theta[arcs], 0.5 * np.pi))
    radius = np.abs(spoke)
    count = len(rows)
    side = _Side(
        is_arc=is_arc,
        tangent=tangent,
        centre=np.zeros(count, dtype=np.complex128),
        radius=np.zeros(count),
        sign=np.zeros(count),
        max_angle=np.zeros(count),
        longest=LINE_PART * moves.length[rows],
        less=np.zeros(count),
    )
    if ends:
        side.longest[:] = np.minimum(side.longest, moves.length[rows] - used_mm[rows])
    side.centre[arcs], side.radius[arcs], side.max_angle[arcs] = centre, radius, max_angle
    side.sign[arcs] = np.where(convex, -1.0, 1.0)
    side.longest[arcs] = np.where(convex, np.sin(0.25 * max_angle), max_angle) * radius
    side.less[arcs] = np.where(convex, 0.25 * max_angle, 0.0)
    return side


def _round_arcs(
    corners: PlannerCorners,
    moves: PlannerMoves,
    tangents: Tangents,
    rows: Ints,
    bends: Bends,
    used_mm: Floats,
    joinable: Bools,
    rules: CornerRules,
) -> None:
    """Fill in the blends at the corners `rows` between moves one of which is an arc; all lie in
    XY."""
    if len(rows) == 0:
        return
    theta_tan = bends.theta
    starts = tangents.path.starts_of(moves.row[rows])
    corner, height = starts[:, 0] + 1j * starts[:, 1], starts[:, 2]
    one, other = (each[:, 0] + 1j * each[:, 1] for each in (bends.before, bends.after))
    first = _side(moves, tangents, rows - 1, corner, one, other, theta_tan, used_mm, ends=True)
    last = _side(moves, tangents, rows, corner, other, one, theta_tan, used_mm, ends=False)
    theta = theta_tan - np.maximum(first.less, last.less)
    side_sign = np.sign((one.conj() * other).imag)
    normal = np.column_stack([0.0 * side_sign, 0.0 * side_sign, side_sign])
    longest = np.minimum(first.longest, last.longest)
    rounds = _rounds(moves, rows, normal, theta, longest, np.zeros(len(rows)), rules)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = _centre_of(corner, side_sign, rounds.radius, first, last)
        strays = np.abs(centre - corner) - rounds.radius
        turns = [
            np.where(
                side.is_arc,
                np.abs(np.angle((corner - side.centre) * (centre - side.centre).conj())),
                np.abs(((centre - corner) * side.tangent.conj()).real),
            )
            for side in (first, last)
        ]
    both_arcs = first.is_arc & last.is_arc
    is_valid = np.isfinite(centre) & (strays <= rounds.tolerance) & (theta > 0.0)
    is_valid &= (np.pi - 2.0 * theta_tan > MIN_BEND_RAD) & ~(both_arcs & (theta < MIN_THETA_RAD))
    is_valid &= rounds.radius * (np.pi - 2.0 * theta) > MIN_LENGTH_MM
    reach, spokes = [], []
    for side, side_rows, turn, ends in (
        (first, rows - 1, turns[0], True),
        (last, rows, turns[1], False),
    ):
        is_valid &= ~side.is_arc | (turn <= side.max_angle)
        distance, point = turn.copy(), corner + (-turn if ends else turn) * side.tangent
        arcs = np.flatnonzero(side.is_arc)
        arm = tangents.arm_of(moves.row[side_rows[arcs]])
        share = np.where(is_valid[arcs], turn[arcs], 0.0) / np.abs(tangents.arms.sweep[arm])
        is_valid[arcs] &= share < 1.0
        touched = tangents.arms.points(arm, 1.0 - share if ends else share)
        point[arcs] = touched[:, 0] + 1j * touched[:, 1]
        distance[arcs] = share * moves.length[side_rows[arcs]]
        reach.append(distance)
        spokes.append(point - centre)
    shape = np.stack(
        [np.column_stack([centre.real, centre.imag, height])]
        + [np.column_stack([each.real, each.imag, 0.0 * height]) for each in spokes]
    )
    left_mm = moves.length[rows - 1] - used_mm[rows - 1] - reach[0]
    left_mm[~joinable[rows - 1]] = np.inf
    _fill(corners, rows, rounds, (reach[0], reach[1]), shape, is_valid, left_mm, rules)


def _centre_of(
    corner: Floats, side_sign: Floats, radius: Floats, first: _Side, last: _Side
) -> Floats:
    """Return (K,) the centres of circles of a radius (K,) that touch both sides, the ones nearest
    to the corners; NaN where there are none."""
    distance = [side.sign * radius + side.radius for side in (first, last)]
    # A line and an arc: at `radius` beside the line, `distance` from the arc's centre.
    line_first = ~first.is_arc
    along = np.where(line_first, first.tangent, last.tangent)
    arc = np.where(line_first, last.centre, first.centre)
    target_distance = np.where(line_first, distance[1], distance[0])
    normal = 1j * side_sign * along
    to_arc = arc - corner
    u, n = (to_arc * along.conj()).real, (to_arc * normal.conj()).real
    root = np.sqrt(target_distance**2 - (radius - n) ** 2)
    step = np.minimum(np.abs(u + root), np.abs(u - root))
    by_line = corner + np.where(line_first, -step, step) * along + radius * normal
    # Two arcs: a triangle.
    centre_line = last.centre - first.centre
    centre_distance = np.abs(centre_line)
    x = (distance[0] ** 2 - distance[1] ** 2 + centre_distance**2) / (2.0 * centre_distance)
    y = np.sqrt(np.maximum(distance[0] ** 2 - x**2, 0.0))
    direction = centre_line / centre_distance
    candidates = [first.centre + (x + 1j * sign * y) * direction for sign in (1.0, -1.0)]
    is_first_nearer = np.abs(candidates[0] - corner) <= np.abs(candidates[1] - corner)
    by_arcs = np.where(is_first_nearer, candidates[0], candidates[1])
    return np.asarray(np.where(first.is_arc & last.is_arc, by_arcs, by_line))


def _angle_between(one: Floats, other: Floats) -> Floats:
    """Return (K,) the angles between vectors (K, 3), rad."""
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.arctan2(across, (one * other).sum(axis=-1)))


def _unit(vectors: Floats) -> Floats:
    """Return vectors (M, 3) scaled to length 1; vectors of length 0 are unchanged."""
    length = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0)[:, None])
