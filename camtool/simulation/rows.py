"""Checks of the rows of a toolpath before any controller runs them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.arrays import Bools, Floats
from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath, read_only

MAX_PATH_STEPS = 1 << 40
"""Positions beyond this many steps (a million kilometres at 1 µm) are refused, so that counts
are exact in a float."""


def with_event_positions(toolpath: Toolpath, home: Floats) -> Toolpath:
    """Return the toolpath with each event at the end of the move before it, and homing at `home`
    (3,) mm; the same object if nothing changes."""
    kind, count = toolpath.kind, len(toolpath)
    events = np.flatnonzero(~toolpath.is_motion)
    homes = np.isin(kind[events], (Kind.HOME_XY, Kind.HOME_Z)).any()
    if not homes and (toolpath.end[events] == toolpath.starts_of(events)).all():
        return toolpath
    end = toolpath.end.copy()
    for axis, homing in ((0, Kind.HOME_XY), (1, Kind.HOME_XY), (2, Kind.HOME_Z)):
        end[kind == homing, axis] = home[axis]
        event_rows = np.where(toolpath.is_motion | (kind == homing), np.arange(count), -1)
        latest = np.maximum.accumulate(event_rows)
        end[:, axis] = np.where(latest < 0, toolpath.start[axis], end[latest, axis])
    return with_ends(toolpath, toolpath.start, end)


def with_ends(toolpath: Toolpath, start: Floats, end: Floats) -> Toolpath:
    """Return the toolpath with this start (3,) and these ends (N, 3), mm; the same object if
    nothing changes."""
    if (start == toolpath.start).all() and (end == toolpath.end).all():
        return toolpath
    return replace(toolpath, start=start, end=read_only(end))


def check_positions(toolpath: Toolpath, machine: Machine) -> None:
    """Raise ProgramError for an arc without a centre or a position that cannot be counted."""
    arcs = np.flatnonzero(toolpath.is_arc)
    is_bad = np.zeros(len(toolpath), dtype=np.bool_)
    is_bad[arcs] = ~np.isfinite(toolpath.centre[arcs]).all(axis=1)
    refuse(toolpath, is_bad, "an arc without a centre")
    limits = MAX_PATH_STEPS * np.array([axis.coded_step_mm for axis in machine.axes])

    def is_beyond(part: Toolpath) -> Bools:
        centre = np.where(part.is_arc[:, None], np.abs(part.centre), 0.0)
        is_outside = np.column_stack([np.abs(part.end) > limits, centre > limits[:2]])
        return np.asarray(is_outside.any(axis=1))

    message = "a position is beyond all that the controller can count"
    refuse(toolpath, toolpath.by_parts(is_beyond), message)


def check_rows(path: Toolpath, rows: int) -> None:
    """Raise ProgramError for feed moves without a feed and for events that cannot be followed, in
    the first `rows` rows."""
    running = np.arange(len(path)) < rows
    with np.errstate(invalid="ignore"):
        no_feed = path.is_feed & ~((path.feed > 0.0) & np.isfinite(path.feed))
        no_time = (path.kind == Kind.DWELL) & ~((path.value >= 0.0) & np.isfinite(path.value))
    is_moved = (path.kind == Kind.SET_ZERO) & path.end.any(axis=1)
    for is_bad, message, mend in (
        (no_feed, "a move at a feed without a feed above 0", "give it one (F)"),
        (no_time, "a dwell without its seconds", ""),
        (is_moved, "part zero is set away from part zero", "set it once, before any move"),
    ):
        refuse(path, running & is_bad, message, mend)


def refuse(toolpath: Toolpath, is_bad: npt.ArrayLike, message: str, mend: str = "") -> None:
    """Raise ProgramError with this message for the first row in the mask `is_bad` (N,), if any."""
    rows = np.flatnonzero(is_bad)
    if len(rows):
        raise ProgramError(message, where=block_of(toolpath, int(rows[0])), mend=mend)


def block_of(toolpath: Toolpath, row: int) -> str:
    """Return text that names the block (from 1) from which a row was read, and what called it; the
    row if it has no block."""
    block, caller = int(toolpath.block[row]), toolpath.text(row)
    if block < 0:
        return f"move {row}"
    return f"block {block + 1} ({caller})" if caller else f"block {block + 1}"
