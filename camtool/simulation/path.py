"""Any controller, as if it followed the programmed lines and arcs exactly.

It stands in where a controller's own arithmetic is not modelled: it has no interpolator, no
acceleration, no look-ahead. What it does with a row of the toolpath:

1. Ends go to the nearest coded step of each axis (`controller.grid` "steps") or stay as they are
   ("none"). Where that leaves the ends of an arc at two radii, its centre goes to the nearest
   point as far from both. Ends that the program itself has put at two radii (by more than
   `SPREAD_STEPS`) stay: radius and Z then change in proportion to the angle.
2. The commanded position runs along the line or arc; see `camtool.simulation.path` for
   where it is sampled. Between samples nothing is rounded: steps are counted, not taken.
3. A move takes way / feed, a rapid way / `Machine.rapid_mm_min`, and no straight move is faster
   than the highest rate of each axis, no helix than that of Z. Compensation takes no time.
4. Play, compensation and scale act on the commanded position as on that of any other controller.
   An axis has reversed when it came back by half a coded step: less is not seen by a motor.

Positions at and between samples: an error that changes with the way changes by no more than the
way, so the largest error between two samples exceeds that at the nearer one by half the spacing
at most; extents, reversals and the steps of each axis do not depend on the spacing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import ProgramError
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import PathController
from camtool.machine.model import Machine
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Ledger, Options
from camtool.toolpath.moves import Arms, Kind, Toolpath

MAX_PATH_STEPS = 1 << 40
"""Positions beyond this many steps (a million kilometres at 1 µm) are refused: counts must stay
exact in a float."""


SPREAD_STEPS = 2.0
"""Ends of an arc at two radii that differ by so many steps or fewer were made so by rounding."""

LEAST_CHORD_STEPS = 2.0
"""An arc with its ends nearer than this keeps its centre: no direction can be told from them."""


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.simulate.ControllerModel`."""
    return PathRun(toolpath, machine, options).run()


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """A coded step, or what a million samples of the whole program allow."""
    return sample_spacing_mm(toolpath, machine)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """Nothing is interpolated."""
    return "path"


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What the times leave out."""
    return (
        "the controller follows every line and arc exactly",
        "speeds change at once: there is no acceleration, and compensation takes no time",
    )


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The moves that the controller follows: ends on its grid, homing at machine zero.

    Raises ProgramError for arcs without a centre and for positions beyond all steps. An arc
    shorter than a step, whose rounded ends would turn it into a full circle, becomes a line; one
    that lacks less than a step of its full circle becomes that.
    """
    check_positions(toolpath, machine)
    home = np.array(machine.controller.machine_zero_mm, dtype=np.float64)
    exact = placed(toolpath, home)
    if isinstance(machine.controller, PathController) and machine.controller.grid == "none":
        return exact
    home = _on_grid(home, machine)
    start, end = _on_grid(exact.start, machine), _on_grid(exact.end, machine)
    sweeps = exact.sweeps()
    made = _centred(replace(exact, start=start, end=end), np.abs(sweeps), machine)
    while True:
        inside_out = made.is_arc & (np.abs(made.sweeps() - sweeps) > np.pi)
        if not inside_out.any():
            return made
        made = placed(_turned_back(made, inside_out, np.abs(sweeps) < np.pi), home)


def placed(toolpath: Toolpath, home: Floats) -> Toolpath:
    """The same with events where the moves before them ended, and homing at `home` (3,) mm."""
    kind, count = toolpath.kind, len(toolpath)
    end = toolpath.end.copy()
    for axis, homing in ((0, Kind.HOME_XY), (1, Kind.HOME_XY), (2, Kind.HOME_Z)):
        end[kind == homing, axis] = home[axis]
        known = np.where(toolpath.is_motion | (kind == homing), np.arange(count), -1)
        latest = np.maximum.accumulate(known)
        end[:, axis] = np.where(latest < 0, toolpath.start[axis], end[latest, axis])
    return replace(toolpath, end=end)


def _centred(made: Toolpath, sweep: Floats, machine: Machine) -> Toolpath:
    """Arcs whose centres are as far from their rounded ends as from their rounded starts.

    With the chord's direction u and its middle m, the nearest such point to the centre c is
    c − ((c − m)·u) u. It is as far from c as the ends' radii differ, times radius / chord: an arc
    of little sweep still runs between its ends, but one that lacks little of a full circle would
    be thrown to a side. So for more than half a turn the chord must not be below the radius.
    """
    step = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    begin, end, centre = made.starts[:, :2], made.end[:, :2], made.centre
    chord, out, back = end - begin, begin - centre, end - centre
    length, radius = np.hypot(chord[:, 0], chord[:, 1]), np.hypot(out[:, 0], out[:, 1])
    spread = np.abs(radius - np.hypot(back[:, 0], back[:, 1]))
    apt = made.is_arc & (length >= LEAST_CHORD_STEPS * step) & (spread <= SPREAD_STEPS * step)
    apt &= (sweep <= np.pi) | (length >= radius)
    u = chord[apt] / length[apt, None]
    off = ((centre[apt] - 0.5 * (begin + end)[apt]) * u).sum(axis=1)
    new = centre.copy()
    new[apt] -= off[:, None] * u
    return replace(made, centre=new)


def _turned_back(made: Toolpath, inside_out: Bools, short: Bools) -> Toolpath:
    """Arcs that rounding has turned inside out: the short ones as lines, the long ones closed."""
    lines, full = inside_out & short, inside_out & ~short
    end = made.end.copy()
    end[full, :2] = made.starts[full, :2]
    kind = np.where(lines, np.int64(Kind.LINE), made.kind)
    centre = np.where(lines[:, None], np.nan, made.centre)
    return replace(made, kind=kind, centre=centre, end=end)


def _on_grid(points: Floats, machine: Machine) -> Floats:
    """Points (..., 3) mm, each coordinate at its nearest coded step."""
    columns = [
        to_steps(points[..., index], axis.coded_step_mm) * axis.coded_step_mm
        for index, axis in enumerate(machine.axes)
    ]
    return np.stack(columns, axis=-1)


class PathRun:
    """One run of a toolpath; ProgramError for rows that no controller can follow."""

    def __init__(self, toolpath: Toolpath, machine: Machine, options: Options) -> None:
        self._path = held(toolpath, machine)
        self._rows = self._path.running
        check_rows(self._path, self._rows)
        self._seconds = _durations(self._path, machine)
        self._samples = PathSamples(self._path, sample_spacing_mm(self._path, machine))
        self._mechanics = Mechanics(machine, self._path.start, options.effects)
        self._coded_mm = [axis.coded_step_mm for axis in machine.axes]
        self._steps = self._in_steps(self._path.start[None, :])
        self._chunk_steps = options.chunk_steps

    def run(self) -> Iterator[Chunk]:
        """The chunks of all rows up to the end of the program."""
        first = self._samples.first
        total = int(first[self._rows])
        done = 0  # rows whose ledger is complete
        for low in range(0, total, self._chunk_steps):
            high = min(low + self._chunk_steps, total)
            row, commanded = self._samples.window(low, high)
            whole = self._rows if high == total else int(row[-1]) + int(high == first[row[-1] + 1])
            yield self._chunk(np.arange(done, max(whole, int(row[-1]) + 1)), row, commanded)
            done = whole
        if total == 0 and self._rows:
            yield self._chunk(np.arange(self._rows), np.empty(0, np.int64), NO_SAMPLES)

    def _chunk(self, rows: Ints, row: Ints, commanded: Floats) -> Chunk:
        """The samples of a window, and what the rows that it touches did in it."""
        offsets = np.concatenate([[0], np.flatnonzero(np.diff(row)) + 1, [len(row)]])
        first = self._samples.first
        samples = np.zeros(len(rows), dtype=np.int64)
        steps, reversals = np.zeros((2, len(rows), 3), dtype=np.int64)
        slide = NO_SAMPLES
        if len(row):
            moved = row[offsets[:-1]] - rows[0]
            slide, reversals[moved] = self._mechanics.follow(commanded, offsets)
            steps[moved] = self._counted(commanded, offsets)
            samples[moved] = np.diff(offsets)
        own = (first[1:] - first[:-1])[rows]
        share = np.where(own > 0, samples / np.maximum(own, 1), 1.0)
        ledger = Ledger(
            row=rows,
            duration_s=self._seconds[rows] * share,
            compensation_s=np.zeros(len(rows)),
            iterations=np.zeros(len(rows), dtype=np.int64),
            steps=steps,
            reversals=reversals,
            ended=np.ones(len(rows), dtype=np.bool_),
        )
        return Chunk(row, commanded, slide, ledger)

    def _counted(self, commanded: Floats, offsets: Ints) -> Ints:
        """(R, 3) steps of each run, from where the last window ended."""
        steps = np.concatenate([self._steps, self._in_steps(commanded)])
        self._steps = steps[-1:]
        return np.asarray(np.add.reduceat(np.abs(np.diff(steps, axis=0)), offsets[:-1], axis=0))

    def _in_steps(self, points: Floats) -> Ints:
        columns = [to_steps(points[:, axis], step) for axis, step in enumerate(self._coded_mm)]
        return np.column_stack(columns)


def _durations(path: Toolpath, machine: Machine) -> Floats:
    """(N,) s of each row; NaN feeds, which `check_rows` refuses, only behind the end."""
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    speed = np.where(path.is_feed, path.feed, machine.rapid_mm_min)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        seconds = np.where(path.is_motion | homing, 60.0 * move_lengths(path) / speed, 0.0)
    way = np.abs(path.end - path.starts) if len(path) else np.zeros((0, 3))
    for index, axis in enumerate(machine.axes):
        if axis.max_rate_mm_min is not None:
            least = 60.0 * way[:, index] / axis.max_rate_mm_min
            turns = path.is_arc & (index < 2)  # but a helix rises evenly
            seconds = np.where(turns, seconds, np.maximum(seconds, least))
    return np.where(path.kind == Kind.DWELL, path.value, seconds)


def check_positions(toolpath: Toolpath, machine: Machine) -> None:
    """ProgramError for an arc without a centre or a position that cannot be counted."""
    bad = toolpath.is_arc & ~np.isfinite(toolpath.centre).all(axis=1)
    if bad.any():
        raise ProgramError("an arc without a centre", where=_place(toolpath, bad))
    most = MAX_PATH_STEPS * np.array([axis.coded_step_mm for axis in machine.axes])
    centre = np.where(toolpath.is_arc[:, None], np.abs(toolpath.centre), 0.0)
    far = np.any(np.column_stack([np.abs(toolpath.end) > most, centre > most[:2]]), axis=1)
    if far.any():
        raise ProgramError(
            "a position is beyond all that the controller can count",
            where=_place(toolpath, far),
        )


def check_rows(path: Toolpath, rows: int) -> None:
    """ProgramError for moves without a feed and events that cannot be followed."""
    running = np.arange(len(path)) < rows
    with np.errstate(invalid="ignore"):
        no_feed = running & path.is_feed & ~((path.feed > 0.0) & np.isfinite(path.feed))
        no_time = (path.kind == Kind.DWELL) & ~((path.value >= 0.0) & np.isfinite(path.value))
    if no_feed.any():
        raise ProgramError(
            "a move at a feed without a feed above 0",
            where=_place(path, no_feed),
            mend="give it one (F)",
        )
    if (running & no_time).any():
        raise ProgramError("a dwell without its seconds", where=_place(path, running & no_time))
    away = running & (path.kind == Kind.SET_ZERO) & path.end.any(axis=1)
    if away.any():
        raise ProgramError(
            "part zero is set away from part zero",
            where=_place(path, away),
            mend="set it once, before any move",
        )


def _place(toolpath: Toolpath, bad: npt.ArrayLike) -> str:
    """The block (from 1) that the first bad row was read from, or the row when planned."""
    row = int(np.argmax(bad))
    block = int(toolpath.block[row])
    return f"block {block + 1}" if block >= 0 else f"move {row}"


# A toolpath as points along its own lines and arcs, any window of them at a time.
#
# Each line is one piece; each arc is cut where an axis turns (right, above, left, below of its
# centre), so that in every piece X and Y run one way. Each piece is sampled evenly, its end
# included: whatever the spacing, the ends of all moves and the turning points of all axes are
# samples, and with them extents and reversals are exact.

MAX_SAMPLES = 1_000_000
"""Samples are a coded step apart, or wider when a program would have more of them than this."""

SPACING_EPS = 1e-6
"""Samples may be wider apart by this part of their spacing: by rounding alone."""

TURN_EPS_RAD = 1e-9
"""A turning point nearer than this to an end of its arc is that end."""

TURNS_OF_ARC = 4
"""No arc passes more turning points between its ends than this."""


def sample_spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """How far apart samples are: the finer coded step of X and Y, or what `MAX_SAMPLES` allows."""
    step = min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    return max(step, float(move_lengths(toolpath).sum()) / MAX_SAMPLES)


def move_lengths(toolpath: Toolpath) -> Floats:
    """(N,) mm of way of each row in space, whatever moves it (events have none)."""
    if len(toolpath) == 0:
        return np.zeros(0)
    length = np.linalg.norm(toolpath.end - toolpath.starts, axis=1)
    arms = Arms(toolpath, toolpath.is_arc)
    rise = arms.end[:, 2] - arms.begin[:, 2]
    radius = 0.5 * (arms.radius + arms.end_radius)
    length[arms.row] = np.hypot(radius * arms.sweep, rise)
    return np.asarray(length)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Stretches of rows from `begin` (P,) to `end` (P,), as shares of the row `row` (P,)."""

    row: Ints
    begin: Floats
    end: Floats


class PathSamples:
    """The samples of all rows of a toolpath, numbered from 0 in order; none are held."""

    def __init__(self, toolpath: Toolpath, spacing_mm: float) -> None:
        """`spacing_mm` is the widest distance of two samples along the path."""
        self._toolpath = toolpath
        self._starts = toolpath.starts
        self._way = toolpath.end - self._starts
        self._arms = Arms(toolpath, toolpath.is_arc)
        self._arm_of_row = np.full(len(toolpath), -1, dtype=np.int64)
        self._arm_of_row[self._arms.row] = np.arange(len(self._arms.row))
        length = move_lengths(toolpath)
        self._pieces = _pieces(length, self._arms)
        pieces = self._pieces
        way = length[pieces.row] * (pieces.end - pieces.begin)
        self._parts = np.maximum(np.ceil(way / spacing_mm - SPACING_EPS), 1.0).astype(np.int64)
        self._offsets = np.concatenate([[0], np.cumsum(self._parts)])
        self.first = self._offsets[np.searchsorted(pieces.row, np.arange(len(toolpath) + 1))]
        """(N+1,) row r owns samples first[r]:first[r+1]; its start is no sample of it."""

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Row (K,) and position (K, 3) mm of the samples low:high."""
        row, share = self.places(low, high)
        return row, self.points(row, share)

    def places(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Row (K,) and share (K,) of its way, in (0, 1], of the samples low:high."""
        index = np.arange(low, high)
        piece = np.searchsorted(self._offsets, index, side="right") - 1
        part, parts = index - self._offsets[piece] + 1, self._parts[piece]
        begin, end = self._pieces.begin[piece], self._pieces.end[piece]
        share = np.where(part == parts, end, begin + (end - begin) * (part / parts))
        return self._pieces.row[piece], share

    def points(self, row: Ints, share: Floats) -> Floats:
        """(K, 3) mm: the points at shares (K,) of the ways of rows (K,)."""
        points = self._starts[row] + share[:, None] * self._way[row]
        arm = self._arm_of_row[row]
        on_arc = np.flatnonzero(arm >= 0)
        points[on_arc] = self._arms.points(arm[on_arc], share[on_arc])
        last = np.flatnonzero(share == 1.0)
        points[last] = self._toolpath.end[row[last]]
        return points


def _pieces(length: Floats, arms: Arms) -> _Pieces:
    """All pieces in order: rows without arcs that move are one, arcs as many as they need."""
    straight = length > 0.0
    straight[arms.row] = False
    rows = np.flatnonzero(straight)
    lines = _Pieces(rows, np.zeros(len(rows)), np.ones(len(rows)))
    arcs = _arc_pieces(arms)
    row = np.concatenate([lines.row, arcs.row])
    order = np.argsort(row, kind="stable")
    return _Pieces(
        row[order],
        np.concatenate([lines.begin, arcs.begin])[order],
        np.concatenate([lines.end, arcs.end])[order],
    )


def _arc_pieces(arms: Arms) -> _Pieces:
    """Arcs cut at their turning points.

    These lie at angles k·π/2. Seen in the direction of the arc (σ = ±1) from its start at σ·a,
    the next ones are k = ⌊σa/(π/2)⌋ + 1, + 2, ...
    """
    quarter = 0.5 * np.pi
    ahead = np.sign(arms.sweep) * arms.angle
    next_turn = np.floor(ahead / quarter)[:, None] + np.arange(1, TURNS_OF_ARC + 1)
    turn = next_turn * quarter - ahead[:, None]
    sweep = np.abs(arms.sweep)[:, None]
    inside = (turn > TURN_EPS_RAD) & (turn < sweep - TURN_EPS_RAD)
    ends = np.ones((len(sweep), 1), dtype=np.bool_)
    kept = np.concatenate([ends, inside, ends], axis=1)
    bounds = np.concatenate([0.0 * sweep, turn / sweep, sweep / sweep], axis=1)
    which, _ = np.nonzero(kept)
    bound = bounds[kept]
    inner = np.flatnonzero(np.diff(which) == 0)
    return _Pieces(arms.row[which[inner]], bound[inner], bound[inner + 1])
