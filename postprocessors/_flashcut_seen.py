"""What the machine's timers make of a program's lines and feeds: found when it is read."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import FlashcutController
from camtool.machine.controllers.flashcut_timers import (
    feeds_of,
    half_periods_ms,
    shortest_ms,
    steps_too_many,
)
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath

HELD_GUARD: Final = 0.01
"""Part of a feed: whole milliseconds bring it no nearer than this at the fastest."""

WARNED_PART: Final = 0.5
"""Of the feed that a program says: a cut that gets less is a warning, not a remark."""

MOST_MS: Final = 1e9
"""Half periods longer than this make no shorter axis too long."""


def timer_findings(path: Toolpath, machine: Machine) -> tuple[Finding, ...]:
    """What feeds become, and which moves of both axes get steps too many on their shorter one."""
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return ()
    return (*_held(path, machine, controller), *_too_long(path, machine, controller))


def _held(path: Toolpath, machine: Machine, controller: FlashcutController) -> Iterator[Finding]:
    """FEED_HELD: cuts whose feed the shortest half period does not let them have."""
    rows = np.flatnonzero(path.is_feed)
    steps_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    way = (path.end - path.starts)[rows]
    moves = np.column_stack([to_steps(way[:, k], float(steps_mm[k])) != 0 for k in range(3)])
    alone = (moves.sum(axis=1) == 1) & ~path.is_arc[rows]
    step_mm = np.where(moves[:, 2] & alone, steps_mm[2], steps_mm[:2].max())
    asked = path.feed[rows]
    fastest = feeds_of(shortest_ms(alone, controller), step_mm, controller)
    late = np.flatnonzero(asked > fastest * (1.0 + HELD_GUARD))
    if len(late):
        worst = int(late[(asked[late] / fastest[late]).argmax()])
        gets, where = float(fastest[worst]), "along one axis" if alone[worst] else "of both axes"
        slow = gets < WARNED_PART * asked[worst]
        yield Finding(
            Code.FEED_HELD,
            Severity.WARNING if slow else Severity.INFO,
            f"{len(late)} cuts are slower than their F: F{asked[worst]:g} becomes {gets:.3g} "
            f"mm/min {where}, by the shortest half period (controller.half_period_ms, "
            "controller.single_axis_half_period_ms); a shorter one makes slanted lines less exact",
            where=f"block {int(path.block[rows[worst]]) + 1}",
            measured=gets,
            limit=float(asked[worst]),
            unit="mm_min",
        )


def _too_long(
    path: Toolpath, machine: Machine, controller: FlashcutController
) -> tuple[Finding, ...]:
    rows = np.flatnonzero(path.is_motion & ~path.is_arc)
    x_mm, y_mm = machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm
    way = np.abs(path.end - path.starts)[rows]
    steps = np.column_stack([to_steps(way[:, 0], x_mm), to_steps(way[:, 1], y_mm)])
    feed = np.where(path.is_feed, path.feed, np.inf)[rows]
    alone = (steps == 0).any(axis=1)
    half_period = half_periods_ms(feed, max(x_mm, y_mm), alone, controller)
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
