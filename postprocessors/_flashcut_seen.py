"""What the machine's timers make of a program's lines: found when it is read."""

from __future__ import annotations

from typing import Final

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import FlashcutController
from camtool.machine.controllers.flashcut_timers import half_periods_ms, steps_too_many
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath

MOST_MS: Final = 1e9
"""Half periods longer than this make no shorter axis too long."""


def timer_findings(path: Toolpath, machine: Machine) -> tuple[Finding, ...]:
    """How many moves of both axes get steps too many on their shorter one, and how many."""
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return ()
    rows = np.flatnonzero(path.is_motion & ~path.is_arc)
    x_mm, y_mm = machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm
    way = np.abs(path.end - path.starts)[rows]
    steps = np.column_stack([to_steps(way[:, 0], x_mm), to_steps(way[:, 1], y_mm)])
    feed = np.where(path.is_feed, path.feed, np.inf)[rows]
    half_period = half_periods_ms(feed, max(x_mm, y_mm), controller)
    whole = np.minimum(half_period, MOST_MS).astype(np.int64)
    extra = steps_too_many(steps.max(axis=1), steps.min(axis=1), whole, controller)
    count = int((extra > 0).sum())
    if not count:
        return ()
    worst = int(extra.argmax())
    most_um = float(extra[worst]) * 1000.0 * (y_mm if steps[worst].argmin() else x_mm)
    rapids = bool((path.kind[rows[extra > 0]] == Kind.RAPID).any())
    stays = controller.goes_on_from == "programmed"
    return (
        Finding(
            Code.EXECUTED_OTHERWISE,
            Severity.WARNING,
            f"{count} straight moves of both axes make their shorter one too long, by up to "
            f"{extra[worst]} steps ({most_um:.1f} µm), because each axis has a timer of its own"
            + ("; it stays in all that follows" if stays else "")
            + ". What lowers it: longer half periods (controller.half_period_ms), lines in pieces "
            "(dialect.slants=split)"
            + (", rapids along one axis at a time (dialect.rapids=one-axis)" if rapids else ""),
            where=f"block {int(path.block[rows[worst]]) + 1}",
            measured=most_um,
            limit=0.0,
            unit="um",
        ),
    )
