"""A toolpath decoded from one machine's program, as what another machine shall do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camtool.toolpath.moves import Kind, Toolpath


def at_feed(toolpath: Toolpath, feed_mm_min: float) -> Toolpath:
    """The same moves, all cuts at one feed."""
    return replace(toolpath, feed=np.where(toolpath.is_feed, feed_mm_min, toolpath.feed))


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
