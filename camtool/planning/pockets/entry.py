"""Ways of a pocket lowered to all its levels: the tool goes down straight, on a ramp or a helix.

At each level the tool goes down from the floor of the level before (at first from the stock's
top), follows the way, and comes back over the new floor to where it goes down again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from camtool.geometry.distance import points_to_segments
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polyline
from camtool.planning.contours.along import Along
from camtool.planning.contours.ramps import feeds_along
from camtool.planning.items import Run, Setting
from camtool.planning.pockets.parts import pole
from camtool.planning.pockets.route import Rails, route

HELIX_MOST = 0.5
"""The largest radius of a helix when none is asked for, over the tool's radius."""

HELIX_LEAST = 0.1
"""The smallest radius of a helix that is worth it, over the tool's radius."""

HELIX_MOST_TURNS = 200
"""A helix of more turns than this at one level is not made."""

RAMP_MOST_LAPS = 20
"""A ramp that would go to and fro on the whole way more often than this becomes a plunge."""

Link = Callable[[Floats, Floats], Floats | None]
"""From a place (2,) to another: (k, 3) over the floor, or None when there is no way."""


@dataclass(frozen=True, eq=False)
class Down:
    """How the tool goes down: the middle (2,) and radius of a helix; or a ramp; or neither (a
    plunge). `changed` says what did not fit, "" when all does."""

    centre: Floats | None = None
    radius_mm: float = 0.0
    ramp: bool = False
    changed: str = ""


def down_for(way: Floats, middle: Rails | None, whole: Rails | None, setting: Setting) -> Down:
    """What fits of the entry that is asked for: a helix about the middle of a region that keeps
    to the whole region; else a ramp along the way; else a plunge."""
    entry = setting.operation.entry
    if entry.kind == "plunge":
        return Down()
    if entry.kind == "helix" and middle is not None and whole is not None:
        radius = setting.operation.tool.radius_mm
        wanted = HELIX_MOST * radius if entry.radius_mm is None else entry.radius_mm
        centre = pole(middle.region)
        room = float(points_to_segments(centre[None, :], whole.segments).min())
        fits = min(wanted, room)
        turns = _descent(setting) / (2.0 * math.pi * max(fits, POSITION_EPS_MM))
        if fits >= min(HELIX_LEAST * radius, wanted) and turns <= HELIX_MOST_TURNS:
            smaller = entry.radius_mm is not None and fits < wanted
            changed = f"a helix of {fits:.4g} mm instead of {wanted:g} mm" if smaller else ""
            return Down(centre, fits, changed=changed)
    changed = "a ramp instead of a helix" if entry.kind == "helix" else ""
    if 0.5 * _descent(setting) <= RAMP_MOST_LAPS * Along.of(Polyline(way)).total_mm:
        return Down(ramp=True, changed=changed)
    return Down(changed=f"a plunge instead of a {entry.kind}")


def lowered(way: Floats, down: Down, link: Link, setting: Setting, name: str) -> list[Run]:
    """The runs that follow a way (n, 3) at all levels: one, unless there is no link back."""
    runs: list[Run] = []
    parts: list[Floats] = []
    for above, level in pairwise((0.0, *setting.levels_mm)):
        entry = _entry(way, down, link, (above, level), setting)
        back = link(way[-1, :2], entry[0, :2]) if parts else None
        if parts and back is None:
            runs.append(_run(parts, setting, name))
            parts = []
        if back is not None:
            parts.append(_at(back, above))
        parts += [entry, _at(way, level)]
    return [*runs, _run(parts, setting, name)]


def _entry(
    way: Floats, down: Down, link: Link, heights: tuple[float, float], setting: Setting
) -> Floats:
    """(k, 4) from the floor above down to the beginning of the way."""
    above, level = heights
    begin = way[0, :2]
    drop = above - level
    slope = math.tan(setting.operation.entry.angle_rad)
    if down.ramp:
        return _ramp(way, drop / slope, heights)
    if down.centre is not None:
        helix = _helix(down.centre, down.radius_mm, begin, drop / slope)
        across = link(helix[-1, :2], begin)
        if across is not None:
            flat = _at(across, level)
            return _joined([np.insert(helix, 2, _sloping(helix, heights), axis=1), flat])
    if above == 0.0:
        return np.array([[*begin, level, 0.0]])
    return np.array([[*begin, above, 0.0], [*begin, level, 0.0]])


def _helix(centre: Floats, radius: float, towards: Floats, length: float) -> Floats:
    """(k, 3) arcs CCW about a centre of this length in all; the last ends nearest to a place."""
    arm = towards - centre
    end = math.atan2(arm[1], arm[0])
    sweep = length / radius
    count = max(1, math.ceil(sweep / math.pi))
    angles = end - sweep + sweep / count * np.arange(count + 1)
    bulge = np.full(count + 1, math.tan(0.25 * sweep / count))
    bulge[-1] = 0.0
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([points, bulge])


def _ramp(way: Floats, length: float, heights: tuple[float, float]) -> Floats:
    """(k, 4) to and fro along the beginning of the way, down to where it begins."""
    along = Along.of(Polyline(way))
    laps = max(1, math.ceil(0.5 * length / along.total_mm))
    reach = 0.5 * length / laps
    forth = along.piece(0.0, reach)
    flat = _joined([forth, along.piece(reach, 0.0)] * laps)
    return np.insert(flat, 2, _sloping(flat, heights), axis=1)


def _descent(setting: Setting) -> float:
    """The length of the slope, seen from above, at the deepest step, mm."""
    drop = max(above - level for above, level in pairwise((0.0, *setting.levels_mm)))
    return drop / math.tan(setting.operation.entry.angle_rad)


def _sloping(flat: Floats, heights: tuple[float, float]) -> Floats:
    """(k,) z of an open path (k, 3) that slopes evenly from one height to another."""
    done = Along.of(Polyline(flat)).reach
    above, level = heights
    return np.asarray(above + (level - above) * done / done[-1])


def _at(flat: Floats, z: float) -> Floats:
    """(k, 4) an open path (k, 3) at one height."""
    return np.insert(flat, 2, z, axis=1)


def _joined(parts: list[Floats]) -> Floats:
    """Open paths, each of which begins where the one before it ends, as one."""
    return np.concatenate([*(part[:-1] for part in parts[:-1]), parts[-1]])


def _run(parts: list[Floats], setting: Setting, name: str) -> Run:
    vertices = _joined(parts)
    feeds = setting.feeds
    return Run(vertices, feeds_along(vertices, feeds), feeds.plunge_mm_min, name)


def over_floor(rails: Rails) -> Link:
    """Links that stay in a region of the tool's middle."""
    return lambda start, end: route(start, end, rails)


def back_along(way: Floats) -> Link:
    """Links back along the way itself, from its end to its beginning."""
    along = Along.of(Polyline(way))

    def link(start: Floats, end: Floats) -> Floats | None:
        if np.hypot(*(end - start)) <= POSITION_EPS_MM:
            return np.array([[*start, 0.0]])
        return along.piece(along.total_mm, 0.0)

    return link
