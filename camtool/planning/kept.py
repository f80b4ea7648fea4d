"""What the runs of a plan must leave of the material, as the drawing has it.

A profile leaves the part, a pocket and a carving what is outside of their region; engraving and
drilling leave nothing in particular. Where reliefs go into the corners of the part, they are
meant to, and nothing is said of that operation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.geometry.nesting import nesting
from camtool.geometry.polylines import Bools, Floats, Ints, Polylines
from camtool.planning.items import Step
from camtool.planning.job import Operation
from camtool.planning.sides import runs_beside
from camtool.toolpath.wanted import Kept


def kept_of(steps: Sequence[Step]) -> tuple[Kept, ...]:
    """All runs of a plan, with what they must leave."""
    return tuple(each for step in steps for each in _kept(step))


def _kept(step: Step) -> Iterator[Kept]:
    operation, chosen = step.operation, step.chosen
    closed = np.flatnonzero(chosen.lines.closed)
    nest = nesting(chosen.lines.select(closed.tolist()))
    order = np.argsort(nest.depth, kind="stable")
    rows, depth = closed[order], nest.depth[order]
    if operation.kind in ("pocket", "vcarve"):
        lines = chosen.lines.select(rows.tolist())
        yield Kept(tuple(run.vertices for run in step.runs), lines, depth % 2 == 1, True)
        return
    beside = runs_beside(operation) and operation.corners == "none"
    for level in _levels(operation, depth) if beside else ():
        mine = rows[level]
        lines, stays = chosen.lines.select(mine.tolist()), chosen.rim[mine]
        # Beside a rim the rest of the stock is waste; beside a hole it is part.
        for rim in (True, False):
            names = {chosen.names[row] for row in mine[stays == rim].tolist()}
            yield Kept(_vertices(step, names), lines, stays, not rim)
    judged = {chosen.names[row] for row in rows.tolist()} if beside else set()
    # Open contours are cut on their lines, wherever these are; other runs leave nothing either.
    free = tuple(run.vertices for run in step.runs if run.name not in judged)
    yield Kept(free, Polylines.of([]), np.empty(0, dtype=np.bool_), False)


def _levels(operation: Operation, depth: Ints) -> Iterator[Bools]:
    """Which closed contours make one region, of their depths of nesting. With the sides of the
    nesting all do. Where the job names the side, a contour in another one is cut on that side
    too, whatever the outer one keeps: those of each depth are a region of their own."""
    if operation.side == "auto":
        yield np.ones(len(depth), dtype=np.bool_)
        return
    for each in np.unique(depth).tolist():
        yield depth == each


def _vertices(step: Step, names: set[str]) -> tuple[Floats, ...]:
    """The runs of a step that are contours of these names."""
    return tuple(run.vertices for run in step.runs if run.name in names)
