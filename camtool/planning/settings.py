"""An operation's numbers: depth, passes, feeds, safe Z; the machine's where the job gives none."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.machine.model import FEED_TOLERANCE, Machine, exceeds
from camtool.planning.findings import FEED_ABOVE_LIMIT_IN_JOB
from camtool.planning.items import Feeds, Setting
from camtool.planning.job import Job, Operation
from camtool.planning.naming import key_of, operation_name, own_numbers

PASS_SLACK = 1e-9
"""Steps may exceed the step down by this part of it, by rounding, before a pass is added."""

MAX_PASSES = 10_000


class Cone(Struct, frozen=True):
    """A V bit: the tangent of its half angle, the radius of its flat tip, mm, and the largest
    radius that it cuts at the surface, mm (inf: not known)."""

    slope: float
    tip_mm: float
    widest_mm: float

    @classmethod
    def of(cls, operation: Operation) -> Cone:
        """Return the cone of an operation's V bit; OptionError if its tool is none."""
        tool = operation.tool
        if tool.kind != "v" or tool.tip_angle_rad is None:
            raise OptionError(
                "carving needs a V bit",
                where=key_of(operation, "tool"),
                mend='use a tool with kind = "v" and a tip_angle',
            )
        widest = tool.radius_mm or math.inf
        return cls(math.tan(0.5 * tool.tip_angle_rad), 0.5 * tool.tip_diameter_mm, widest)

    def radius_at(self, depth_mm: float) -> float:
        """Return the radius of the cut at the surface, mm, with the tip at this depth."""
        return min(self.tip_mm + depth_mm * self.slope, self.widest_mm)

    def depth_of(self, rho: Floats) -> Floats:
        """Return the depths of the tip, mm, at which it cuts these radii at the surface."""
        return np.maximum(rho - self.tip_mm, 0.0) / self.slope


def setting_of(operation: Operation, job: Job, machine: Machine) -> Setting:
    """Return the operation with the machine's numbers where it gives none; OptionError for speeds
    and feeds that are too high, and for impossible passes."""
    turns_work = operation.contract.turns_work
    depth = 0.0 if turns_work else depth_of(operation, machine)
    _check_coolant(operation, machine)
    # The helix of a bore has turns, not passes; along the wall one pass takes it all.
    descent = operation.contract.descent
    _check_spindle(operation, machine)
    in_one = descent == "helix" or operation.stage == "finish" or turns_work
    try:
        levels_of = carved_levels if descent == "slopes" else levels
        step, last = operation.step_down_mm, operation.last_pass_mm
        passes = (-depth,) if in_one else levels_of(depth, step, last)
    except OptionError as error:
        error.where = f"{operation_name(operation)}, {error.where}"
        raise
    return Setting(
        operation,
        feeds_of(operation, machine),
        passes,
        safe_z_of(job, machine),
        speed_of(operation, machine),
        job.stock,
    )


def speed_of(operation: Operation, machine: Machine) -> float | None:
    """Return the spindle speed of the operation, or the machine's default, rev/min; None if
    neither has one, and for 0 (off). OptionError for a speed that the spindle does not have."""
    spindle, rpm = machine.spindle, operation.spindle_rpm
    if rpm is None:
        return spindle.default_rpm
    if rpm == 0.0:
        return None
    if spindle.switched == "none":
        raise OptionError(
            f"{machine.target.name} has no spindle",
            where=key_of(operation, "spindle"),
            mend="leave the speed out",
        )
    if not spindle.reaches(rpm):
        upper = "" if spindle.max_rpm is None else f" to {spindle.max_rpm:g}"
        faster = [f"spindle.max_rpm={rpm:g}"]
        raise OptionError(
            f"{rpm:g} rev/min is not in the range of the spindle, {spindle.min_rpm:g}{upper}",
            where=key_of(operation, "spindle"),
            mend="give a speed in it (--spindle)"
            + (f"; {own_numbers(machine, faster)}" if rpm > spindle.min_rpm else ""),
        )
    return rpm


def _check_spindle(operation: Operation, machine: Machine) -> None:
    """Raise OptionError for turning on a mill, for milling on a lathe, and for feeds that must
    follow the spindle if its turns are not counted."""
    turns_work, kind = machine.spindle.turns == "work", operation.contract
    if kind.turns_work != turns_work:
        turned, other = ("work", "tool") if turns_work else ("tool", "work")
        raise OptionError(
            f"the spindle of {machine.target.name} turns the {turned}, and {kind.name!r} wants one"
            f" that turns the {other}",
            where=key_of(operation, "kind"),
            mend="use a machine whose file says spindle.turns = "
            + ('"tool"' if turns_work else '"work"'),
        )
    if kind.follows_spindle and not machine.spindle.encoder:
        raise OptionError(
            f"{machine.target.name} does not count the turns of its spindle, which the feed of a"
            " thread must follow",
            where=key_of(operation, "kind"),
            mend="use a machine whose file says spindle.encoder = true, if it can",
        )


def _check_coolant(operation: Operation, machine: Machine) -> None:
    """Raise OptionError for coolant that the machine does not have."""
    kinds_needed = ("mist", "flood") if operation.coolant == "both" else (operation.coolant,)
    for each in kinds_needed:
        if each != "off" and each not in machine.coolant.kinds:
            raise OptionError(
                f"{machine.target.name} has no {each} coolant",
                where=key_of(operation, "coolant"),
                mend=f"write {each} = true in [coolant] of your machine file if it has",
            )


def safe_z_of(job: Job, machine: Machine) -> float:
    """Return the job's height of rapids above the stock, or the machine's, mm."""
    return machine.defaults.safe_z_mm if job.safe_z_mm is None else job.safe_z_mm


def depth_of(operation: Operation, machine: Machine) -> float:
    """Return the depth of cut of the operation below the stock top, or the machine's default, mm.
    A carved floor is no deeper than the bit is where it is widest."""
    carved = operation.rest_of
    if carved is not None and carved.contract.rest == "floor":
        cone = Cone.of(carved)
        wanted_mm = machine.defaults.cut_depth_mm if carved.depth_mm is None else carved.depth_mm
        return min(wanted_mm, float(cone.depth_of(np.array(cone.widest_mm))))
    return machine.defaults.cut_depth_mm if operation.depth_mm is None else operation.depth_mm


def feeds_of(operation: Operation, machine: Machine) -> Feeds:
    """Return the feeds of the operation, or the machine's defaults, limited to the rates of the
    axes.

    A plunge feed that is not given is the machine's share of the feed of the cut (without one,
    that feed), or the highest that Z can. OptionError for feeds above what the machine takes at
    all, naming the highest."""
    given_feed = operation.plunge_feed_mm_min
    cut = operation.feed_mm_min
    cut = machine.feed.default_mm_min if cut is None else cut
    plunge = given_feed
    if plunge is None:
        plunge = cut
        if machine.defaults.plunge_share is not None:
            plunge = _programmable(machine.defaults.plunge_share * cut, machine)
    if given_feed is None and exceeds(plunge, machine.max_plunge_mm_min):
        plunge = _programmable(machine.max_plunge_mm_min, machine)
    lowered_by_name: dict[str, float] = {}
    for name, flag, feed, highest in (
        ("feed", "--feed", cut, machine.max_feed_mm_min),
        ("plunge feed", "--plunge-feed", plunge, machine.max_plunge_mm_min),
    ):
        if exceeds(feed, machine.max_programmable_mm_min):
            raise OptionError(
                f"{name} {feed:g} mm/min is above {highest:.4g} mm/min, the highest of"
                f" {machine.target.name}",
                where=key_of(operation, name.replace(" ", "_")),
                mend=f"use {flag} {_programmable(highest, machine):g} or less",
            )
        if exceeds(feed, highest):
            lowered_by_name[name] = _programmable(highest, machine)
    return Feeds(lowered_by_name.get("feed", cut), lowered_by_name.get("plunge feed", plunge))


def lowered_feeds(job: Job, machine: Machine) -> Iterator[Finding]:
    """Yield a finding for each feed of the job or the machine that is lowered to the rates of its
    axes, without repeats."""
    axes = machine.axes
    reported: set[tuple[str, float]] = set()
    for operation in job.operations:
        cut = operation.feed_mm_min or machine.feed.default_mm_min
        for name, feed, highest, axis_names in (
            ("feed", cut, machine.max_feed_mm_min, "xy"),
            ("plunge feed", operation.plunge_feed_mm_min, machine.max_plunge_mm_min, "z"),
        ):
            if feed is None or not exceeds(feed, highest) or (name, feed) in reported:
                continue
            reported.add((name, feed))
            slow = [
                n for n in axis_names if exceeds(feed, getattr(axes, n).max_rate_mm_min or feed)
            ]
            yield FEED_ABOVE_LIMIT_IN_JOB(
                where=operation_name(operation),
                measured=feed,
                limit=highest,
                feed=name,
                lowered=_programmable(highest, machine),
                machine=machine.target.name,
                mend=own_numbers(machine, [f"axes.{n}.max_rate_mm_min={feed:g}" for n in slow]),
            )


def _programmable(highest_mm_min: float, machine: Machine) -> float:
    """Return the highest feed not above this one that a program can express."""
    unit = machine.feed.unit_mm_min
    units = math.floor(highest_mm_min / unit * (1.0 + FEED_TOLERANCE))
    return units * unit or highest_mm_min


def levels(
    depth_mm: float, step_down_mm: float | None, last_pass_mm: float | None
) -> tuple[float, ...]:
    """Return the z of all passes, mm, downwards from the first one to −depth.

    Steps are equal and no larger than `step_down_mm` (None: one step); with `last_pass_mm` the
    last one is that, and the others are equal. OptionError for numbers not above 0, a last pass
    above the step down or the depth, and more than MAX_PASSES.

    >>> levels(1.0, 0.4, None)
    (-0.3333333333333333, -0.6666666666666666, -1.0)
    >>> levels(1.0, 0.5, 0.1)
    (-0.45, -0.9, -1.0)
    """
    for name, value in (
        ("depth", depth_mm),
        ("step_down", step_down_mm),
        ("last_pass", last_pass_mm),
    ):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise OptionError(
                f"{value:g} mm is not above 0", where=f"key {name}", mend="give a number above 0"
            )
    rest_mm = depth_mm
    if last_pass_mm is not None:
        _check_last(depth_mm, step_down_mm, last_pass_mm)
        rest_mm = depth_mm - last_pass_mm
    step = math.inf if step_down_mm is None else step_down_mm
    # A remainder above the last pass that is only rounding gets no pass of its own.
    if rest_mm <= PASS_SLACK * depth_mm:
        return (-depth_mm,)
    passes = rest_mm / step * (1.0 - PASS_SLACK)
    if passes > MAX_PASSES:
        raise OptionError(
            f"{step:g} mm makes more than {MAX_PASSES} passes of {depth_mm:g} mm",
            where="key step_down",
            mend="give a larger step",
        )
    count = max(1, math.ceil(passes))
    above = tuple(-rest_mm * step / count for step in range(1, count))
    return (*above, -depth_mm) if last_pass_mm is None else (*above, -rest_mm, -depth_mm)


def carved_levels(
    depth_mm: float, step_down_mm: float | None, last_pass_mm: float | None
) -> tuple[float, ...]:
    """Return the z of all passes of a V bit, mm, which moves inwards from the wall as it goes
    down.

    A pass whose tip is d deeper than the one before runs d·tan α farther in (α the half angle of
    the bit). Under its tip the earlier one has cut d less deep than its own depth, so that the tip
    takes 2 d: passes after the first are no deeper than half the step down.

    >>> [round(z, 6) for z in carved_levels(0.9, 0.3, None)]
    [-0.3, -0.45, -0.6, -0.75, -0.9]
    """
    even_levels = levels(depth_mm, step_down_mm, last_pass_mm)
    passes = list(even_levels[:1])
    for above, z in pairwise(even_levels):
        if step_down_mm is not None and 2.0 * (above - z) > step_down_mm * (1.0 + PASS_SLACK):
            passes.append(0.5 * (above + z))
        passes.append(z)
    return tuple(passes)


def _check_last(depth_mm: float, step_down_mm: float | None, last_pass_mm: float) -> None:
    for name, limit in (("depth", depth_mm), ("step down", step_down_mm)):
        if limit is not None and last_pass_mm > limit * (1.0 + PASS_SLACK):
            raise OptionError(
                f"a last pass of {last_pass_mm:g} mm is deeper than the {name} of {limit:g} mm",
                where="key last_pass",
                mend=f"give {limit:g} mm or less",
            )
