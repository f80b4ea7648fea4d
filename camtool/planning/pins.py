"""Places of alignment pins: two holes in the waste of the stock that meet again when the part is
turned over.

The two lie on both sides of the line, as far apart as the stock is wide, in the wider of the two
strips beside the part that the line crosses. So they meet in no other way: turned over about the
other axis, or turned about by half, the part has them in the other strip."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents
from camtool.geometry.polylines import Polylines
from camtool.geometry.turn import Box
from camtool.planning.findings import PINS_PROPOSED
from camtool.planning.items import Chosen
from camtool.planning.job import Job, Operation
from camtool.planning.naming import flip_lines_of, key_of, pins_of
from camtool.records import replace

ROOM_SHARE = 2.0
"""Width of the strip that a pin needs, over its diameter."""

PIN_MM = 3.0
"""Diameter of proposed pins if the job has no drill."""

Pin = tuple[float, float]


def proposed_pins(
    stock_mm: Box, part_mm: Box, flip: tuple[str, float], diameter_mm: float, cut_mm: float
) -> tuple[Pin, Pin] | None:
    """Return places for two pins in the stock, None if there is no room. The part is cut out with
    a tool `cut_mm` wide; `flip`: the axis "x" or "y" of the line about which it is turned over,
    and the position of that line, mm."""
    across = 0 if flip[0] == "y" else 1
    along, room = 1 - across, ROOM_SHARE * diameter_mm
    ends = [
        (stock_mm[along], part_mm[along] - cut_mm),
        (part_mm[along + 2] + cut_mm, stock_mm[along + 2]),
    ]
    low, high = max(ends, key=lambda end: end[1] - end[0])
    half = min(flip[1] - stock_mm[across], stock_mm[across + 2] - flip[1]) - 0.5 * room
    if high - low < room or half < room:
        return None
    level = round(0.5 * (low + high), 2)
    first, second = flip[1] - half, flip[1] + half
    return ((first, level), (second, level)) if along else ((level, first), (level, second))


def with_pins(chosen: Chosen, placed: Drawing, job: Job, operation: Operation) -> Chosen:
    """Return what an operation takes; for one that drills pins, with the pins of the job.
    OptionError, with a proposal, if the job has none."""
    if operation.contract.takes != "pins":
        return chosen
    pins = pins_of(job)
    if not pins:
        places = _proposed_for(placed, job)
        raise OptionError(
            "there are no alignment pins to drill",
            where=key_of(operation, "kind"),
            mend="write them in the [[setups]] that is turned over: "
            + (pins_text(places) if places else "pins = [[x, y], [x, y]]"),
        )
    names = tuple(f"alignment pin {number}" for number in range(1, len(pins) + 1))
    return replace(chosen, points=np.array(pins), point_names=names)


def pin_findings(placed: Drawing, job: Job) -> list[Finding]:
    """Return a remark that proposes pins, if a set-up turns the part over without any."""
    if job.setup_of is None or job.setup_of[1].flip is None or pins_of(job):
        return []
    places = _proposed_for(placed, job)
    return [PINS_PROPOSED(pins=pins_text(places), diameter=_pin_mm(job))] if places else []


def pins_text(pins: Sequence[Pin]) -> str:
    """Return pins as the text of a key in a job file."""
    return f"pins = [{', '.join(f'[{x:g}, {y:g}]' for x, y in pins)}]"


def _proposed_for(placed: Drawing, job: Job) -> list[Pin]:
    """Return proposed pins for a part, in the frame of the face that is drawn; [] if there is no
    room or sizes are not known."""
    stock = None if job.stock is None else job.stock.box_mm
    lines = flip_lines_of(job)
    drawn = [each for each in (placed.paths, placed.unchosen.paths) if len(each)]
    if stock is None or len(lines) != 1 or not drawn:
        return []
    (left, right), (low, high) = extents(Polylines.joined(drawn)).tolist()
    wide = max(each.tool.diameter_mm for each in job.whole.operations)
    places = proposed_pins(stock, (left, low, right, high), lines[0], _pin_mm(job), wide)
    return sorted(map(job.placement.turn.back.point, places or ()))


def _pin_mm(job: Job) -> float:
    """Return the diameter for proposed pins: that of the widest drill of the job."""
    drills = [each.tool for each in job.whole.operations if each.tool.kind == "drill"]
    return max((tool.diameter_mm for tool in drills), default=0.0) or PIN_MM
