"""Rows of a toolpath as the displacements that the parallel-port machine's program makes of them.

line, rapid     one of X and Y, and one of Z where Z changes (G01 never has both, L980-992)
arc             chords of one angle each, from its start to its programmed end
homing          Y, then X, each alone until its sensor; Z alone
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError
from camtool.kernels.lattice import to_steps
from camtool.kernels.timers import HOME_X, HOME_Y, HOME_Z, XY, Moves, Z
from camtool.machine.controllers import FlashcutController
from camtool.machine.controllers.flashcut_timers import half_periods_ms
from camtool.machine.model import Machine, controller_of
from camtool.simulation.motion import Bools, Floats, Ints
from camtool.simulation.path import check_positions, placed
from camtool.toolpath.moves import Kind, Toolpath

MOST_LONG = (1 << 31) - 1
"""The largest of the controller's whole numbers (timeGetTime is a Long, L1334-1340): half periods
of more milliseconds are refused, and positions and radii of more than a quarter as many steps, so
that no displacement between two of them has more."""

CHORD_GUARD = 1e-9
"""Part of a chord: an arc longer than whole chords by less has no further one."""


def followed(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The same with homing at machine zero, and events where the moves before them ended.

    ProgramError for arcs without a centre and positions of more steps than can be counted.
    """
    check_positions(toolpath, machine)
    most = 0.25 * MOST_LONG * np.array([axis.coded_step_mm for axis in machine.axes])
    far = (np.abs(toolpath.end) > most).any(axis=1) | (np.abs(toolpath.start) > most).any()
    spoke = np.where(toolpath.is_arc[:, None], toolpath.centre - toolpath.starts[:, :2], 0.0)
    far |= (np.abs(spoke) > most[:2]).any(axis=1)
    if far.any():
        raise ProgramError(
            "a position is beyond all that the controller can count",
            where=row_place(toolpath, far),
        )
    return placed(toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64))


def half_periods(toolpath: Toolpath, machine: Machine, step_mm: float, alone: Bools) -> Ints:
    """(N,) ms of the longer axis of each row, for steps of `step_mm`; rapids have the shortest.
    `alone` (N,): rows of one axis.

    ProgramError for feeds whose half period the controller cannot count.
    """
    feed = np.where(toolpath.is_feed, toolpath.feed, np.inf)
    wanted = half_periods_ms(feed, step_mm, alone, controller_of(machine, FlashcutController))
    slow = wanted >= MOST_LONG
    if slow.any():
        raise ProgramError(
            f"a feed of {float(feed[slow][0]):g} mm/min is a step in weeks",
            where=row_place(toolpath, slow),
            mend="give it a higher one (F)",
        )
    return wanted.astype(np.int64)


def _alone(toolpath: Toolpath, x_mm: float, y_mm: float) -> Bools:
    """(N,) true for rows that move X or Y alone, by their steps of `x_mm` and `y_mm`: no arcs."""
    way = np.abs(toolpath.end - toolpath.starts)
    apart = np.minimum(to_steps(way[:, 0], x_mm), to_steps(way[:, 1], y_mm)) == 0
    return np.asarray(~toolpath.is_arc & (apart | (toolpath.kind >= Kind.HOME_XY)))


@dataclass(frozen=True, eq=False)
class MoveTable:
    """How many moves each row of a placed toolpath makes, and the moves of any window of rows."""

    toolpath: Toolpath
    starts: Floats
    sweeps: Floats
    chords: Ints
    rises: Bools
    half_period_xy: Ints
    half_period_z: Ints

    @classmethod
    def of(cls, toolpath: Toolpath, machine: Machine) -> MoveTable:
        """The table of a toolpath that `followed` gave."""
        kind, starts, sweeps = toolpath.kind, toolpath.starts, toolpath.sweeps()
        per_turn = controller_of(machine, FlashcutController).chords_per_turn
        homes_xy, homes_z = kind == Kind.HOME_XY, kind == Kind.HOME_Z
        rises = homes_z | (toolpath.is_motion & (toolpath.end[:, 2] != starts[:, 2]))
        along = toolpath.is_motion & ((toolpath.end[:, :2] != starts[:, :2]).any(axis=1) | ~rises)
        chords = np.ceil(np.abs(sweeps) * (per_turn / (2.0 * np.pi)) - CHORD_GUARD)
        parts = np.where(toolpath.is_arc, np.maximum(chords, 1.0), along + 2.0 * homes_xy)
        x, y, z = (axis.coded_step_mm for axis in machine.axes)
        return cls(
            toolpath,
            starts,
            sweeps,
            parts.astype(np.int64),
            rises,
            half_periods(toolpath, machine, max(x, y), _alone(toolpath, x, y)),
            half_periods(toolpath, machine, z, np.ones(len(toolpath), dtype=np.bool_)),
        )

    @property
    def moves_of_row(self) -> Ints:
        """(N,) moves of each row."""
        return self.chords + self.rises

    def moves(self, low: int, high: int) -> Moves:
        """The moves of the rows low:high; `Moves.row` counts from `low`."""
        count = self.moves_of_row[low:high]
        row = low + np.repeat(np.arange(high - low), count)
        part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        path, chords = self.toolpath, self.chords[row]
        homes = path.kind[row] >= Kind.HOME_XY
        upward = part == chords
        what = np.where(upward, np.where(homes, HOME_Z, Z), XY)
        what[homes & ~upward] = np.where(part[homes & ~upward] == 0, HOME_Y, HOME_X)
        target = path.end[row].copy()
        inner = np.flatnonzero(path.is_arc[row] & (part < chords - 1))
        target[inner, :2] = self._on_arc(row[inner], (part[inner] + 1) / chords[inner])
        half_period = np.where(upward, self.half_period_z[row], self.half_period_xy[row])
        return Moves(what, target, half_period, row - low)

    def _on_arc(self, row: Ints, share: Floats) -> Floats:
        """(J, 2) mm at these shares of the arcs' sweeps, as far from the centre as the start
        is: r = hypot(I, J) from the angle of the start on (L1378)."""
        centre = self.toolpath.centre[row]
        spoke = self.starts[row, :2] - centre
        radius = np.hypot(spoke[:, 0], spoke[:, 1])
        angle = np.arctan2(spoke[:, 1], spoke[:, 0]) + share * self.sweeps[row]
        turned = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(centre + radius[:, None] * turned)


def row_place(toolpath: Toolpath, bad: npt.ArrayLike) -> str:
    """The block (from 1) that the first bad row was read from, or the row when planned."""
    row = int(np.argmax(bad))
    block = int(toolpath.block[row])
    return f"block {block + 1}" if block >= 0 else f"move {row}"
