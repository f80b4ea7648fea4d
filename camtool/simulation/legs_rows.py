"""What controllers that count whole steps ask of the rows of a toolpath before they run it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import Floats
from camtool.toolpath.moves import Kind, Toolpath

MAX_STEPS = 1 << 30
"""Positions beyond this many steps (43 km at 40 µm) are refused: a step of one axis times a step
of another must fit 64 bits."""


def coded_steps_mm(machine: Machine) -> Floats:
    """(3,) mm of a step as the controller believes it."""
    return np.array([axis.coded_step_mm for axis in machine.axes])


def check_rows(toolpath: Toolpath, machine: Machine) -> None:
    """ProgramError for rows that no controller without homing can follow, naming the block."""
    kind, step_mm = toolpath.kind, coded_steps_mm(machine)
    far = (np.abs(toolpath.end) > MAX_STEPS * step_mm).any(axis=1)
    _refuse(toolpath, far, "a position is beyond all that the controller can count")
    homing = np.isin(kind, (Kind.HOME_XY, Kind.HOME_Z))
    _refuse(toolpath, homing, "this controller cannot return to machine zero", "move there")
    with np.errstate(invalid="ignore"):
        endless = (kind == Kind.DWELL) & ~((toolpath.value >= 0.0) & np.isfinite(toolpath.value))
    _refuse(toolpath, endless, "a dwell without its seconds")
    away = (kind == Kind.SET_ZERO) & toolpath.end.any(axis=1)
    mend = "set it once, before any move"
    _refuse(toolpath, away, "part zero is set away from part zero", mend)
    pushed = ~toolpath.is_motion & (toolpath.end != toolpath.starts).any(axis=1)
    _refuse(toolpath, pushed, "an event that moves the tool")


def waits_s(toolpath: Toolpath, rows: int) -> Floats:
    """(rows,) s that rows wait."""
    return np.where(toolpath.kind == Kind.DWELL, toolpath.value, 0.0)[:rows]


def _refuse(toolpath: Toolpath, bad: npt.ArrayLike, message: str, mend: str = "") -> None:
    """ProgramError for the first bad row."""
    rows = np.flatnonzero(np.asarray(bad)[: toolpath.running])
    if len(rows):
        raise ProgramError(message, where=place(toolpath, int(rows[0])), mend=mend)


def place(toolpath: Toolpath, row: int) -> str:
    """The block (from 1) that a row was read from, or the row when it was planned."""
    block = int(toolpath.block[row])
    return f"block {block + 1}" if block >= 0 else f"move {row}"
