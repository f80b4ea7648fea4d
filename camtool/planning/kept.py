"""What the runs of a plan must leave of the material, as the drawing has it.

A profile leaves the part, a pocket and a carving what is outside of their region; engraving and
drilling leave nothing in particular. Where reliefs go into the corners of the part, they are
meant to, and nothing is said of that operation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.geometry.nest import nesting
from camtool.geometry.polylines import Bools, Floats, Polylines
from camtool.planning.plan import Step
from camtool.planning.sides import runs_beside
from camtool.toolpath.kept import Kept


def kept_of(steps: Sequence[Step]) -> tuple[Kept, ...]:
    """All runs of a plan, with what they must leave."""
    return tuple(each for step in steps for each in _kept(step))


def _kept(step: Step) -> Iterator[Kept]:
    operation, chosen = step.operation, step.chosen
    closed = np.flatnonzero(chosen.lines.closed)
    nest = nesting(chosen.lines.select(closed.tolist()))
    order = np.argsort(nest.depth, kind="stable")
    rows = closed[order]
    lines = chosen.lines.select(rows.tolist())
    if operation.kind in ("pocket", "vcarve"):
        yield Kept(_vertices(step, None), lines, nest.depth[order] % 2 == 1, True)
    elif runs_beside(operation) and operation.corners == "none":
        stays: Bools = chosen.rim[rows]
        holes = {chosen.names[row] for row in rows[~stays].tolist()}
        # Beside a rim the rest of the stock is waste; beside a hole it is part.
        yield Kept(_vertices(step, holes, within=False), lines, stays, False)
        yield Kept(_vertices(step, holes, within=True), lines, stays, True)
    else:
        nothing = np.empty(0, dtype=np.bool_)
        yield Kept(_vertices(step, None), Polylines.of([]), nothing, False)


def _vertices(step: Step, names: set[str] | None, *, within: bool = True) -> tuple[Floats, ...]:
    """The runs of a step: all, those of contours of these names, or those of all others."""
    return tuple(
        run.vertices for run in step.runs if names is None or (run.name in names) == within
    )
