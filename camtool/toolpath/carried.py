"""A toolpath decoded from one machine's program, as what another machine shall do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath


def at_feed(toolpath: Toolpath, feed_mm_min: float) -> Toolpath:
    """The same moves, all cuts at one feed."""
    return replace(toolpath, feed=np.where(toolpath.is_feed, feed_mm_min, toolpath.feed))


def within_feeds(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The same moves with every cut at no more than the machine's highest feed; FEED_ABOVE_LIMIT
    tells of it where one was faster."""
    limit = machine.max_feed_mm_min
    with np.errstate(invalid="ignore"):
        fast = toolpath.is_feed & (toolpath.feed > limit)
    if not fast.any():
        return toolpath
    most = float(toolpath.feed[fast].max())
    found = Finding(
        Code.FEED_ABOVE_LIMIT,
        Severity.WARNING,
        f"{int(fast.sum())} cuts of up to {most:g} mm/min are written at {limit:g}, the highest "
        f"feed of {machine.target.name}",
        measured=most,
        limit=limit,
        unit="mm_min",
    )
    return replace(
        toolpath,
        feed=np.where(fast, limit, toolpath.feed),
        findings=(*toolpath.findings, found),
    )


def carried_over(decoded: Toolpath) -> Toolpath:
    """The moves and events of a program, free of what belongs to its own machine alone.

    Part zero set at the very beginning is left out: there every program begins. Homing becomes a
    rapid to where machine zero lay. Rows lose their block: the new program has blocks of its own.
    """
    first = 1 if len(decoded) and decoded.kind[0] == Kind.SET_ZERO else 0
    homes = (decoded.kind == Kind.HOME_XY) | (decoded.kind == Kind.HOME_Z)
    kind = np.where(homes, int(Kind.RAPID), decoded.kind)[first:]
    rows = np.arange(first, len(decoded))
    return decoded.picked(rows, kind=kind, block=np.full(len(rows), -1))
