"""A contour, its start and direction chosen, as runs of the tool: how it goes in, down and out.

    path ──Along──▶ lengths ──ramps: profile of z──▶ ──tabs: raised──▶ lifted ──leads──▶ Run

A closed contour is one run: the way to it, down, round and round, the overlap, the way out. An
open one is one run, to and fro, when it is reversible, and else one run for each pass; the ways to
it and out belong to it at all depths.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Floats, Polyline, Polylines
from camtool.planning.contours.along import Along
from camtool.planning.contours.leads import Leads, leads_of
from camtool.planning.contours.ramps import (
    MOST_LAPS,
    feeds_along,
    laps,
    lifted,
    spiral,
    to_and_fro,
)
from camtool.planning.contours.tabs import Tab, raised, tabs_of
from camtool.planning.items import Contour, Run
from camtool.planning.places import at_place

Heights = tuple[float | None, list[Tab]]
"""What decides the height of the tool: the angle of its ramps (None: it plunges), and the tabs."""


def runs_of(
    contour: Contour, path: Polyline, keep_out: Polylines | None = None
) -> tuple[list[Run], list[Finding]]:
    """The runs that cut a contour, and what did not go as the operation asks.

    `path` is the contour's path from the chosen start in the chosen direction. On the ways to it
    and out, the tool comes nowhere nearer to the lines of `keep_out` than its radius. A ramp
    slopes by the entry's angle. OptionError for tabs that cannot be.
    """
    along = Along.of(path)
    angle, findings = _slope(contour, along)
    tabs, left_out = tabs_of(contour, along)
    if path.closed:
        vertices, leads = _round(contour, along, (angle, tabs), keep_out)
        ways = [vertices]
    else:
        ways, leads = _along(contour, along, (angle, tabs), keep_out)
    feeds = contour.setting.feeds
    runs = [
        Run(vertices, feeds_along(vertices, feeds), feeds.plunge_mm_min, contour.name)
        for vertices in ways
    ]
    return runs, [*findings, *left_out, *leads.findings]


def _round(
    contour: Contour, along: Along, heights: Heights, keep_out: Polylines | None
) -> tuple[Floats, Leads]:
    """The one run (n, 4) round a closed contour."""
    angle, tabs = heights
    levels, overlap = contour.setting.levels_mm, contour.setting.operation.overlap_mm
    total = along.total_mm
    if angle is None:
        profile = laps(total, levels, overlap)
    else:
        profile = spiral(total, levels, overlap, angle)
    leads = leads_of(contour, along, (profile[0][0], profile[-1][0]), keep_out)
    vertices = lifted(along, raised(profile, tabs, total))
    vertices[-1, 3] = leads.away[0, 2] if len(leads.away) else 0.0
    flat = np.insert(leads.to[:-1], 2, vertices[0, 2], axis=1)
    out = np.insert(leads.away[1:], 2, vertices[-1, 2], axis=1)
    return np.concatenate([flat, vertices, out]), leads


def _along(
    contour: Contour, along: Along, heights: Heights, keep_out: Polylines | None
) -> tuple[list[Floats], Leads]:
    """The runs (n, 4) along an open contour."""
    angle, tabs = heights
    levels = contour.setting.levels_mm
    leads = leads_of(contour, along, (0.0, along.total_mm), keep_out)
    vertices = along.path.vertices.copy()
    vertices[-1, 2] = leads.away[0, 2] if len(leads.away) else 0.0
    track = Along.of(Polyline(np.concatenate([leads.to[:-1], vertices, leads.away[1:]])))
    before = float(track.reach[len(leads.to[:-1])])
    stand = [tab.moved(before) for tab in tabs]
    above = (0.0, *levels)
    passes = [levels] if contour.reversible else [(z,) for z in levels]
    profiles = [
        to_and_fro(track.total_mm, each, above[turn], angle) for turn, each in enumerate(passes)
    ]
    return [lifted(track, raised(profile, stand, None)) for profile in profiles], leads


def _slope(contour: Contour, along: Along) -> tuple[float | None, list[Finding]]:
    """The angle of the ramp, None for a plunge; and when a plunge stands for a ramp."""
    operation = contour.setting.operation
    angle = operation.entry.angle_rad
    if operation.entry.kind == "plunge":
        return None, []
    ramp = -contour.setting.levels_mm[-1] / math.tan(angle)
    if ramp <= MOST_LAPS * along.total_mm:
        return angle, []
    finding = Finding(
        Code.ENTRY_CHANGED,
        Severity.WARNING,
        f"a ramp of {ramp:.4g} mm along a contour of {along.total_mm:.4g} mm: the tool plunges",
        where=at_place(contour.name, along.path.start.tolist()),
        measured=ramp,
        limit=MOST_LAPS * along.total_mm,
        unit="mm",
    )
    return None, [finding]
