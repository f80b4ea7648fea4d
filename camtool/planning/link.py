"""Runs linked to one toolpath: up, across, down, cut, and so on; home at the end."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.planning.arcs import cuts
from camtool.planning.items import Feeds, Run
from camtool.planning.job import Job, Operation, Tool
from camtool.planning.places import key_of, operation_name, own_numbers
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

FEED_TOLERANCE = 1e-9
"""A feed may exceed the highest one by this part of it: by rounding alone."""

SETTLED_DECIMALS = 10
"""Places are rounded to so many decimals of a mm: far above the noise of doubles, and far below
what any machine or tolerance knows."""

Approach = Callable[[Run], tuple[float, float] | None]
"""Where the tool comes from at safe height, (x, y) mm, before a run begins; None: anywhere."""


@dataclass(frozen=True, eq=False)
class Worked:
    """The runs of one operation, in order of cutting."""

    operation: Operation
    runs: Sequence[Run]


def safe_z_of(job: Job, machine: Machine) -> float:
    """The job's height of rapids above the stock, or the machine's, mm."""
    return machine.defaults.safe_z_mm if job.safe_z_mm is None else job.safe_z_mm


def depth_of(operation: Operation, machine: Machine) -> float:
    """The operation's depth of cut below the stock top, or the machine's, mm."""
    return machine.defaults.cut_depth_mm if operation.depth_mm is None else operation.depth_mm


def feeds_of(operation: Operation, machine: Machine) -> Feeds:
    """The operation's feeds, or the machine's, none above the rates of the axes.

    Plunges that nobody speaks of run at the feed of the cut, or at the highest that Z can.
    OptionError for feeds above what the machine takes at all, naming the highest.
    """
    said = operation.plunge_feed_mm_min
    cut = operation.feed_mm_min
    cut = machine.feed.default_mm_min if cut is None else cut
    plunge = cut if said is None else said
    if said is None and _above(cut, machine.max_plunge_mm_min):
        plunge = _sayable(machine.max_plunge_mm_min, machine)
    held: dict[str, float] = {}
    for name, flag, feed, highest in (
        ("feed", "--feed", cut, machine.max_feed_mm_min),
        ("plunge feed", "--plunge-feed", plunge, machine.max_plunge_mm_min),
    ):
        if _above(feed, machine.most_sayable_mm_min):
            raise OptionError(
                f"{name} {feed:g} mm/min is above {highest:.4g} mm/min, the highest of"
                f" {machine.target.name}",
                where=key_of(operation, name.replace(" ", "_")),
                mend=f"use {flag} {_sayable(highest, machine):g} or less",
            )
        if _above(feed, highest):
            held[name] = _sayable(highest, machine)
    return Feeds(held.get("feed", cut), held.get("plunge feed", plunge))


def lowered_feeds(job: Job, machine: Machine) -> Iterator[Finding]:
    """Feeds of the job, or of the machine, that the rates of its axes do not allow, each once."""
    axes = machine.axes
    told: set[tuple[str, float]] = set()
    for operation in job.operations:
        cut = operation.feed_mm_min or machine.feed.default_mm_min
        for name, said, highest, which in (
            ("feed", cut, machine.max_feed_mm_min, "xy"),
            ("plunge feed", operation.plunge_feed_mm_min, machine.max_plunge_mm_min, "z"),
        ):
            if said is None or not _above(said, highest) or (name, said) in told:
                continue
            told.add((name, said))
            slow = [n for n in which if _above(said, getattr(axes, n).max_rate_mm_min or said)]
            yield Finding(
                Code.FEED_ABOVE_LIMIT,
                Severity.WARNING,
                f"the {name} of {said:g} mm/min becomes {_sayable(highest, machine):g}, as fast as"
                f" the axes of {machine.target.name} are said to be: "
                + own_numbers(machine, [f"axes.{n}.max_rate_mm_min={said:g}" for n in slow]),
                where=operation_name(operation),
                measured=said,
                limit=highest,
                unit="mm_min",
            )


def _above(feed: float, highest: float) -> bool:
    return feed > highest * (1.0 + FEED_TOLERANCE)


def _sayable(highest_mm_min: float, machine: Machine) -> float:
    """The highest feed not above the highest that the dialect can say."""
    unit = machine.feed.unit_mm_min
    units = math.floor(highest_mm_min / unit * (1.0 + FEED_TOLERANCE))
    return units * unit or highest_mm_min


def settled(toolpath: Toolpath) -> Toolpath:
    """The same moves with their places rounded to SETTLED_DECIMALS.

    The ends of a straight wall differ by some 1e-15 of their size, as offsets, tabs and ramps come
    to them. Where a dialect's last decimal is a tie (a cutter of 1/8 inch has a radius of 1.5875)
    one end would be rounded up and the other down, and the wall written askew.
    """
    # Adding 0 makes −0 and 0 one.
    end, centre = (
        np.round(each, SETTLED_DECIMALS) + 0.0 for each in (toolpath.end, toolpath.centre)
    )
    return replace(toolpath, end=end, centre=centre)


def link(
    worked: Sequence[Worked],
    safe_z_mm: float,
    approaches: Callable[[], Approach] | None = None,
) -> ToolpathBuilder:
    """All moves of a program: the tool starts at part zero on the stock and ends above it.

    Rows know their run, counted through all of `worked`. `approaches` gives what tells where runs
    are come to from, a new one after a tool change."""
    builder = ToolpathBuilder().rapid(z=safe_z_mm)
    approach = approaches() if approaches is not None else None
    tool: Tool | None = None
    speed: float | None = None
    done = 0
    for each in worked:
        if not each.runs:
            continue
        builder.source = ""
        if _changes(tool, each.operation.tool):
            speed = _spin(builder, speed, None)
            builder.event(Kind.TOOL_CHANGE, float(each.operation.tool.number or 0))
            approach = approaches() if approaches is not None else None
        tool = each.operation.tool
        speed = _spin(builder, speed, each.operation.spindle_rpm)
        for run in each.runs:
            builder.run = done
            _cut_one(builder, run, safe_z_mm, approach)
            done += 1
        builder.run = -1
    builder.source = ""
    _spin(builder, speed, None)
    return builder.rapid(0.0, 0.0).event(Kind.END)


def _changes(before: Tool | None, tool: Tool) -> bool:
    """Whether the machine must be told of this tool: it has a number, and another was in."""
    return tool.number is not None and (before is None or before.number != tool.number)


def _spin(builder: ToolpathBuilder, speed: float | None, wanted: float | None) -> float | None:
    """Bring the spindle from one speed to another, None being off; the new speed."""
    if wanted != speed:
        builder.event(Kind.SPINDLE_OFF if wanted is None else Kind.SPINDLE_CW, wanted)
    return wanted


def _cut_one(
    builder: ToolpathBuilder, run: Run, safe_z_mm: float, approach: Approach | None
) -> None:
    builder.source = run.name
    x, y, z, _ = run.vertices[0].tolist()
    before = approach(run) if approach is not None else None
    if before is not None:
        builder.rapid(*before)
    builder.rapid(x, y).line(z=z, feed=run.plunge_mm_min)
    for cut in cuts(run.vertices, run.feed_mm_min):
        x, y, z = cut.end
        if math.isnan(cut.feed):
            builder.rapid(x, y, z)
        elif cut.centre is None:
            builder.line(x, y, z, feed=cut.feed)
        else:
            builder.arc(x, y, z=z, centre=cut.centre, ccw=cut.ccw, feed=cut.feed)
    if run.dwell_s > 0.0:
        builder.event(Kind.DWELL, run.dwell_s)
    builder.rapid(z=safe_z_mm)
