"""Contours linked to one toolpath: up, across, down, cut, and so on; home at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.planning.arcs import cuts
from camtool.planning.job import Job
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

FEED_TOLERANCE = 1e-9
"""A feed may exceed the highest one by this part of it: by rounding alone."""


@dataclass(frozen=True)
class Heights:
    """Z above the stock for rapids, and of the cut below it, mm; part zero lies on the stock."""

    safe_z_mm: float
    cut_z_mm: float


@dataclass(frozen=True)
class Feeds:
    """Feeds of cuts and of plunges, mm/min."""

    cut_mm_min: float
    plunge_mm_min: float


def heights_of(job: Job, machine: Machine) -> Heights:
    """The job's heights, or the machine's where the job is silent."""
    safe = machine.defaults.safe_z_mm if job.safe_z_mm is None else job.safe_z_mm
    depth = machine.defaults.cut_depth_mm if job.depth_mm is None else job.depth_mm
    return Heights(safe, -depth)


def feeds_of(job: Job, machine: Machine) -> Feeds:
    """The job's feeds, or the machine's; OptionError naming the highest feed when above it.

    Plunges that the job is silent about run at the feed of the cut, or at the highest that Z can.
    """
    cut = machine.feed.default_mm_min if job.feed_mm_min is None else job.feed_mm_min
    plunge = cut if job.plunge_feed_mm_min is None else job.plunge_feed_mm_min
    if job.plunge_feed_mm_min is None and _above(cut, machine.max_plunge_mm_min):
        plunge = _sayable(machine.max_plunge_mm_min, machine)
    for name, flag, feed, highest in (
        ("feed", "--feed", cut, machine.max_feed_mm_min),
        ("plunge feed", "--plunge-feed", plunge, machine.max_plunge_mm_min),
    ):
        if _above(feed, highest):
            raise OptionError(
                f"{name} {feed:g} mm/min is above {highest:.4g} mm/min, the highest of"
                f" {machine.target.name}",
                mend=f"use {flag} {_sayable(highest, machine):g} or less",
            )
    return Feeds(cut, plunge)


def _above(feed: float, highest: float) -> bool:
    return feed > highest * (1.0 + FEED_TOLERANCE)


def _sayable(highest_mm_min: float, machine: Machine) -> float:
    """The highest feed not above the highest that the dialect can say."""
    unit = machine.feed.unit_mm_min
    return highest_mm_min // unit * unit or highest_mm_min


def link(
    paths: Sequence[Polyline],
    names: Sequence[str],
    job: Job,
    heights: Heights,
    feeds: Feeds,
) -> ToolpathBuilder:
    """All moves of a program: the tool starts at part zero on the stock and ends above it.

    Each path is cut in one pass as it runs; `names` are the provenance of their rows.
    """
    builder = ToolpathBuilder().rapid(z=heights.safe_z_mm)
    if job.spindle_rpm is not None:
        builder.event(Kind.SPINDLE_CW, job.spindle_rpm)
    for path, name in zip(paths, names, strict=True):
        builder.source = name
        _cut_one(builder, path, heights, feeds)
    builder.source = ""
    if job.spindle_rpm is not None:
        builder.event(Kind.SPINDLE_OFF)
    return builder.rapid(0.0, 0.0).event(Kind.END)


def _cut_one(builder: ToolpathBuilder, path: Polyline, heights: Heights, feeds: Feeds) -> None:
    x, y = path.start.tolist()
    builder.rapid(x, y).line(z=heights.cut_z_mm, feed=feeds.plunge_mm_min)
    for cut in cuts(path):
        if cut.centre is None:
            builder.line(*cut.end, feed=feeds.cut_mm_min)
        else:
            builder.arc(*cut.end, centre=cut.centre, ccw=cut.ccw, feed=feeds.cut_mm_min)
    builder.rapid(z=heights.safe_z_mm)
