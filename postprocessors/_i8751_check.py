"""The writer's first stage: what this machine cannot do is refused before anything is written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.errors import PostError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.tools import mounted_before

from ._i8751_options import Dialect

Bools = npt.NDArray[np.bool_]

MOST_STEPS: Final = 10_000_000
"""A coordinate of more steps is taken for a mistake: 26 hours at the machine's speed."""

MOST_DWELL_S: Final = 36_000.0
"""A longer dwell (10 hours) is taken for a mistake."""

REFUSED: Final = {
    Kind.HOME_XY: "this machine has no limit switches to go home to",
    Kind.HOME_Z: "this machine has no limit switches to go home to",
}
"""Homing was proposed and not built (L5267-5273)."""


def place(toolpath: Toolpath, row: int) -> str:
    """`move 12 (CIRCLE 2F)`: a row and where it came from."""
    source = toolpath.text(row)
    return f"move {row} ({source})" if source else f"move {row}"


def check_toolpath(toolpath: Toolpath, machine: Machine, dialect: Dialect) -> None:
    """PostError for the first row that this machine cannot do."""
    if toolpath.start.any():
        x, y, z = toolpath.start.tolist()
        raise PostError(
            f"the toolpath starts at ({x:g}, {y:g}, {z:g}) mm, a program starts at part zero",
            mend="begin with a rapid from (0, 0, 0)",
        )
    _check_events(toolpath)
    _check_coordinates(toolpath, machine)
    with np.errstate(invalid="ignore"):
        bad_feed = toolpath.is_feed & ~((toolpath.feed > 0.0) & np.isfinite(toolpath.feed))
    _refuse(
        bad_feed,
        toolpath,
        lambda row: f"feed {toolpath.feed[row]:g} mm/min is no feed",
        "give a feed above 0; this machine then moves at its own speed",
    )
    _check_arcs(toolpath, dialect)


def _refuse(bad: Bools, toolpath: Toolpath, message: Callable[[int], str], mend: str) -> None:
    """PostError for the first bad row, if there is one."""
    if bad.any():
        row = int(np.argmax(bad))
        raise PostError(message(row), where=place(toolpath, row), mend=mend)


def _check_events(toolpath: Toolpath) -> None:
    kind, value = toolpath.kind, toolpath.value
    _refuse(
        (kind == Kind.TOOL_CHANGE) & ~mounted_before(toolpath),
        toolpath,
        lambda row: "this machine has no stop for a tool change",
        "write a program for each tool",
    )
    for refused, message in REFUSED.items():
        _refuse(
            kind == refused,
            toolpath,
            lambda row, message=message: message,  # type: ignore[misc]
            "leave it out, and do it by hand before the program",
        )
    _refuse(
        (kind == Kind.SET_ZERO) & toolpath.end.any(axis=1),
        toolpath,
        lambda row: "part zero is where the program starts",
        "set it first, before any move",
    )
    with np.errstate(invalid="ignore"):
        bad = (kind == Kind.DWELL) & ~((value >= 0.0) & (value <= MOST_DWELL_S))
    _refuse(
        bad,
        toolpath,
        lambda row: f"dwell {value[row]:g} s cannot be said",
        f"use 0 to {MOST_DWELL_S:g} s",
    )
    ended = np.cumsum(kind == Kind.END) - (kind == Kind.END)
    _refuse(
        ended > 0,
        toolpath,
        lambda row: "something follows the end of the program",
        "end the program once, last of all",
    )


def _check_coordinates(toolpath: Toolpath, machine: Machine) -> None:
    for axis, (name, given) in enumerate(zip("XYZ", machine.axes, strict=True)):
        most_mm = MOST_STEPS * given.coded_step_mm
        values = toolpath.end[:, axis]
        _refuse(
            np.abs(values) > most_mm,
            toolpath,
            lambda row, name=name, values=values: (  # type: ignore[misc]
                f"{name} = {values[row]:.6g} mm is more than {MOST_STEPS} steps"
            ),
            "check the unit of the drawing and the machine's coded_step_mm",
        )


def _check_arcs(toolpath: Toolpath, dialect: Dialect) -> None:
    """The two radii of an arc may differ by its tolerance, since its chords end at its end."""
    with np.errstate(invalid="ignore", over="ignore"):
        out, back = (p[:, :2] - toolpath.centre for p in (toolpath.starts, toolpath.end))
        spread = np.abs(np.hypot(out[:, 0], out[:, 1]) - np.hypot(back[:, 0], back[:, 1]))
        bad = toolpath.is_arc & ~(spread <= dialect.arc_tolerance_mm)
    _refuse(
        bad,
        toolpath,
        lambda row: f"start and end differ by {spread[row]:g} mm in their distance to the centre",
        "give the arc one radius",
    )
