"""The section that a lathe cuts, beside the one that is wanted.

The nose is a circle about each place of the slides. A point of the wanted section is gouged by how
much nearer than its radius the slides come to it, and has material left by how much farther they
stay away. Arcs of the section are exact; the path of the slides is within half a step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.findings import Finding
from camtool.geometry.distance import nearest
from camtool.geometry.measure import length, sample
from camtool.geometry.polylines import Segments
from camtool.planning.items import Step
from camtool.planning.naming import at_place
from camtool.simulation.motion import Options
from camtool.stock.slides import slide_moves, tools_of_rows
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Toolpath
from camtool.verification.findings import SECTION_CUT

POINTS = 4000


def section_findings(
    decoded: Toolpath, target: LoadedTarget, steps: Sequence[Step], simulation: Options
) -> Iterator[Finding]:
    """Yield a finding for each turned section: how deep the predicted cut goes into it, and how
    much of it is left."""
    turned = [
        (index, step)
        for index, step in enumerate(step for step in steps if step.runs)
        if step.operation.contract.turns_work and step.operation.contract.takes_drawn
    ]
    if not turned or decoded.operations is None:
        return
    tools = tools_of_rows(decoded, None)
    moves = slide_moves(decoded, target, tools, simulation)
    begins = [*decoded.operations.begin.tolist(), len(decoded)]
    for index, step in turned:
        rows = (moves.row >= begins[index]) & (moves.row < begins[index + 1])
        # Without the way to the first cut, which begins wherever the tool happens to be.
        rows &= moves.row >= moves.row[rows & ~moves.rapid].min(initial=len(decoded))
        rows &= (moves.start != moves.end)[:, :2].any(axis=1)
        nose = step.operation.tool.radius_mm
        path = Segments.between(moves.start[rows, :2], moves.end[rows, :2], np.zeros(rows.sum()))
        for line, name in zip(step.chosen.lines, step.chosen.names, strict=True):
            points = sample(line, max(length(line) / POINTS, 1e-6))
            off = nearest(points, path).distance - nose
            deepest, farthest = int(off.argmin()), int(off.argmax())
            yield SECTION_CUT(
                where=at_place(name, points[farthest].tolist()),
                measured=1000.0 * float(off[farthest]),
                gouge=1000.0 * max(-float(off[deepest]), 0.0),
                x=float(points[deepest, 0]),
                y=float(points[deepest, 1]),
            )
