"""What the writers of flashcut and valcnc refuse or split before a block is made."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from camtool.errors import PostError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.lower import Lowered, helices_to_steps, slope_step_mm
from camtool.toolpath.moves import Kind, Toolpath

from ._gcode_checks import check, place

HOMES = (Kind.HOME_XY, Kind.HOME_Z)


def check_plain(toolpath: Toolpath, machine: Machine) -> None:
    """PostError for the first row that has no meaning here, named as the toolpath numbers it."""
    check(toolpath, machine)
    for row in np.flatnonzero(~toolpath.is_motion).tolist():
        kind = Kind(int(toolpath.kind[row]))
        if kind in HOMES:
            raise PostError(
                "this machine has no code to go to machine zero",
                where=place(toolpath, row),
                mend="leave homing out, do it by hand",
            )
        if kind == Kind.SET_ZERO and toolpath.end[row].any():
            raise PostError(
                "part zero can only be set at part zero",
                where=place(toolpath, row),
                mend="set it first, before any move",
            )
        if kind == Kind.END and row < len(toolpath) - 1:
            raise PostError("moves follow the end of the program", where=place(toolpath, row + 1))


def split_z(toolpath: Toolpath, machine: Machine) -> tuple[Lowered, Finding | None]:
    """XY and Z apart, slopes and helices as steps; and MOVE_SPLIT when a feed move had to be."""
    step_mm = slope_step_mm(machine)
    lowered = helices_to_steps(toolpath, step_mm)
    twice = np.bincount(lowered.row, minlength=len(toolpath)) > 1
    twice &= toolpath.is_feed
    if not twice.any():
        return lowered, None
    return lowered, Finding(
        Code.MOVE_SPLIT,
        Severity.WARNING,
        f"{int(twice.sum())} feed moves in XY and Z became steps of at most {step_mm:g} mm, flat "
        "and then down, or up and then flat: nowhere deeper than the slope",
        where=place(toolpath, int(twice.argmax())),
        measured=step_mm,
        unit="mm",
    )


def left_out(toolpath: Toolpath, kinds: Collection[Kind], why: str) -> list[Finding]:
    """One EVENT_LEFT_OUT when there are rows of `kinds`: how many of what, and `why`."""
    rows = np.flatnonzero(np.isin(toolpath.kind, [int(kind) for kind in kinds]))
    if not len(rows):
        return []
    names = ", ".join(dict.fromkeys(Kind(kind).name for kind in toolpath.kind[rows].tolist()))
    return [
        Finding(
            Code.EVENT_LEFT_OUT,
            Severity.WARNING,
            f"{len(rows)} events were left out ({names}): {why}",
            where=place(toolpath, int(rows[0])),
        )
    ]
