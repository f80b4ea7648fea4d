"""The description of a job as JSON: its operations, what they take of a drawing, and the sides.

Contours of one operation, layer, side and reason are one group."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from camtool.findings import Finding
from camtool.geometry.facts import drawing_extents
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.planning.gouges import by_uncut
from camtool.planning.naming import setup_words
from camtool.planning.pins import with_pins
from camtool.planning.place import place
from camtool.planning.sides import Sides, choose, runs_beside

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.planning.items import Chosen
    from camtool.planning.job import Job, Operation

NOT_KNOWN_MM = math.inf
"""Default depth of operations, if neither the job nor the machine gives one."""


def described(
    job: Job, drawing: Drawing | None = None, machine: Machine | None = None
) -> tuple[dict[str, Any], list[Finding]]:
    """Return the job as data for JSON, lengths in mm: its operations, the contours that they take
    of the drawing, and the findings about the side on which the tool runs. OptionError for an
    operation that takes nothing."""
    facts: dict[str, Any] = {
        "operations": [_operation(job, k) for k in range(len(job.operations))]
    }
    if job.stock is not None:
        stock = job.stock
        facts["stock_mm"] = {
            "corner": None if stock.corner_mm is None else list(stock.corner_mm),
            "size": [*(stock.size_mm or (None, None)), stock.thickness_mm],
        }
    if job.setups:
        facts["setups"] = [
            {
                "name": setup.name,
                "operations": list(setup.operations),
                "words": setup_words(job.setup(setup.name)),
            }
            for setup in job.setups
        ]
    findings: list[Finding] = []
    if drawing is None:
        return facts, findings
    placed_drawing = place(drawing, job)
    x, y = drawing_extents(placed_drawing).tolist()
    facts = {"drawing": drawing.file, "extents_mm": {"x": x, "y": y}, **facts}
    unsaid = NOT_KNOWN_MM if machine is None else machine.defaults.cut_depth_mm
    sides = Sides.of(placed_drawing, job, unsaid)
    for operation, row in zip(job.operations, facts["operations"], strict=True):
        selection = choose(placed_drawing, operation, sides)
        selection = with_pins(selection, placed_drawing, job, operation)
        closed = selection.lines.closed
        row["takes"] = {
            "closed": int(closed.sum()),
            "open": int((~closed).sum()),
            "points": len(selection.points),
        }
        row["contours"] = _groups(operation, selection, sides, placed_drawing)
        if operation.side == "auto" and runs_beside(operation):
            findings += by_uncut(sides, operation, selection.source[closed])
    return facts, findings


def _operation(job: Job, index: int) -> dict[str, Any]:
    operation = job.operations[index]
    tool = operation.tool
    return {
        "number": index + 1 - _stages_before(job, index),
        "name": operation.name,
        "kind": operation.kind,
        "tool": {"name": tool.name, "diameter_mm": tool.diameter_mm},
        "depth_mm": operation.depth_mm,
        "below_stock_mm": _below(job, operation),
        "stage": operation.stage,
        "rest": operation.rest,
        "allowance_mm": operation.allowance_mm,
        "step_down_mm": operation.step_down_mm,
    }


def _stages_before(job: Job, index: int) -> int:
    """Return the number of finishing stages among the operations up to `index`, each of which
    belongs to the operation before it."""
    return sum(each.stage == "finish" for each in job.operations[: index + 1])


def _below(job: Job, operation: Operation) -> float | None:
    """Return how far an operation goes below the underside of the stock, mm; None if it does not,
    or if thickness or depth is not known."""
    if job.stock is None or operation.depth_mm is None:
        return None
    below = operation.depth_mm - job.stock.thickness_mm
    return below if below > POSITION_EPS_MM else None


def _groups(
    operation: Operation, selection: Chosen, sides: Sides, placed_drawing: Drawing
) -> list[dict[str, Any]]:
    """Return the number of contours for each layer, side on which the tool runs, and reason for
    that side."""
    contract = operation.contract
    if contract.cuts in ("at", "over"):
        return []
    groups: Counter[tuple[str, str, str]] = Counter()
    is_beside = runs_beside(operation)
    for place_in, row in enumerate(selection.source.tolist()):
        if contract.cuts in ("within", "along"):
            side, reason = ("within" if contract.cuts == "within" else "on"), contract.reason
        else:
            outer = "outside" if selection.rim[place_in] else "inside"
            side = outer if is_beside and selection.lines.closed[place_in] else "on"
            reason = sides.why(operation, row)
        groups[placed_drawing.layers[row], side, reason] += 1
    return [
        {"layer": layer, "contours": count, "side": side, "why": reason}
        for (layer, side, reason), count in groups.items()
    ]
