"""An operation's numbers, the machine's where the job is silent: depth, passes, feeds, safe Z."""

from __future__ import annotations

import math
from collections.abc import Iterator

from camtool.errors import OptionError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.planning.contours.levels import carved_levels, levels
from camtool.planning.items import Feeds, Setting
from camtool.planning.job import Job, Operation
from camtool.planning.places import key_of, operation_name, own_numbers

FEED_TOLERANCE = 1e-9
"""A feed may exceed the highest one by this part of it: by rounding alone."""


def setting_of(operation: Operation, job: Job, machine: Machine) -> Setting:
    """The operation with the machine's numbers where it is silent; OptionError when too fast,
    and for passes that cannot be."""
    depth = depth_of(operation, machine)
    try:
        made = carved_levels if operation.kind == "vcarve" else levels
        passes = made(depth, operation.step_down_mm, operation.last_pass_mm)
    except OptionError as error:
        error.where = f"{operation_name(operation)}, {error.where}"
        raise
    return Setting(operation, feeds_of(operation, machine), passes, safe_z_of(job, machine))


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
