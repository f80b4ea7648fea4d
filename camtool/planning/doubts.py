"""What of a cut looks forgotten or too bold: said in one sentence, for the program does it.

Only where the program starts the spindle is a missing speed a doubt, and a point that follows
closed contours, and a plunge at the feed of the cut: other machines engrave with points, and
their spindles turn by hand.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.planning.items import Setting, Step
from camtool.planning.places import operation_name

IN_PASSES = ("profile", "pocket", "engrave")
"""Kinds of operation that go down in passes, each of one depth."""


def doubts(steps: Sequence[Step], *, starts_spindle: bool) -> list[Finding]:
    """One finding for all that is doubtful about the operations that cut something; none when
    all is well. `starts_spindle`: the program starts the spindle."""
    cutting = [step for step in steps if step.runs]
    said: dict[str, list[Step]] = defaultdict(list)
    for step in cutting:
        for doubt in _of(step, starts_spindle):
            said[doubt].append(step)
    if not said:
        return []
    parts = []
    for doubt, of in said.items():
        names = ", ".join(operation_name(step.operation) for step in of)
        parts.append(doubt if len(of) == len(cutting) else f"{names}: {doubt}")
    return [Finding(Code.CUT_DOUBTFUL, Severity.WARNING, "; ".join(parts))]


def _of(step: Step, starts_spindle: bool) -> Iterator[str]:
    """What is doubtful about an operation, each with the flag that mends it."""
    operation, feeds, tool = step.operation, step.setting.feeds, step.operation.tool
    wide = tool.radius_mm + operation.allowance_mm > 0.0
    if starts_spindle and operation.spindle_rpm is None:
        yield "nobody says how fast the spindle turns, so it stays off (--spindle)"
    on_line = operation.kind == "profile" and operation.side != "on" and not wide
    if starts_spindle and on_line and step.chosen.lines.closed.any():
        yield (
            "the tool has no width, so it runs on the line of closed contours (--tool-diameter,"
            " or --side on)"
        )
    deepest = deepest_pass(step.setting)
    mills = operation.kind in IN_PASSES and tool.kind == "flat" and tool.radius_mm > 0.0
    if mills and deepest > tool.diameter_mm + POSITION_EPS_MM:
        yield (
            f"a pass of {deepest:.4g} mm is deeper than the tool of {tool.diameter_mm:g} mm is"
            " wide (--step-down)"
        )
    plunges = operation.kind in IN_PASSES and operation.entry.kind == "plunge"
    fast = operation.plunge_feed_mm_min is None and feeds.plunge_mm_min >= feeds.cut_mm_min
    if starts_spindle and plunges and fast:
        yield (
            f"the tool plunges at the feed of the cut, {feeds.plunge_mm_min:g} mm/min"
            " (--plunge-feed)"
        )


def deepest_pass(setting: Setting) -> float:
    """How deep the deepest pass goes at a time, mm."""
    return float(-np.diff([0.0, *setting.levels_mm]).min())
