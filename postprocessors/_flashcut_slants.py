"""Long slanted lines as pieces that the machine's timers do exactly.

The timers make the shorter axis too long where it has more steps than the half period has
milliseconds (docs/controllers/flashcut.md). A line of n and m ≤ n steps becomes K = ⌈m / (P − 1)⌉
pieces; piece k ends at the whole steps next to k·n/K and k·m/K from its start, so that the
controller, which rounds the way of each piece by itself, has nothing to round.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.errors import PostError
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import FlashcutController
from camtool.machine.controllers.flashcut_timers import half_periods_ms
from camtool.machine.model import Machine
from camtool.toolpath.lower import MAX_PARTS, Lowered
from camtool.toolpath.moves import Kind, Toolpath

from ._gcode_checks import place

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def split_slants(toolpath: Toolpath, machine: Machine) -> Lowered:
    """Lines of X and Y in pieces; PostError when they would be too many. XY and Z are apart."""
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return Lowered(toolpath, np.arange(len(toolpath)))
    q_mm = np.array([machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm])
    begin = toolpath.starts
    way = toolpath.end[:, :2] - begin[:, :2]
    steps = np.column_stack([to_steps(way[:, axis], float(q_mm[axis])) for axis in (0, 1)])
    feed = np.where(toolpath.is_feed, toolpath.feed, np.inf)
    alone = (steps == 0).any(axis=1)
    half_period = half_periods_ms(feed, float(q_mm.max()), alone, controller)
    exact = np.maximum(half_period - 1.0, 1.0)
    slanted = toolpath.kind == Kind.LINE
    pieces = np.where(slanted, np.ceil(np.abs(steps).min(axis=1) / exact), 1.0)
    count = np.maximum(pieces, 1.0)
    if count.sum() > MAX_PARTS:
        raise PostError(
            f"the program would have more than {MAX_PARTS} blocks",
            where=place(toolpath, int(count.argmax())),
            mend="say --set dialect.slants=whole",
        )
    return _cut(toolpath, count.astype(np.int64), steps, q_mm)


def _cut(toolpath: Toolpath, count: Ints, steps: Ints, q_mm: Floats) -> Lowered:
    """Each row in `count` (N,) pieces; `steps` (N, 2) of its whole way."""
    row = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    inner = np.flatnonzero(part + 1 < count[row])
    of = row[inner]
    share = ((part[inner] + 1) / count[of])[:, None]
    end = toolpath.end[row]
    end[inner, :2] = toolpath.starts[of, :2] + np.rint(share * steps[of]) * q_mm
    return Lowered(toolpath.picked(row, end=end), row)
