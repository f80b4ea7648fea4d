"""Adaptive clearing beside FreeCAD's: time of planning, and of cutting at equal engagement.

Run it by `pytest -m benchmark -s tests/benchmarks/test_adaptive_speed.py`. FreeCAD's planner is
its own library in a process of its own. One formula is the clock of both: cuts at one feed, links
at depth at another, and for each time the tool comes up the way there, up and down at the rate of
rapids; accelerations are left out, and so is the way down into the stock but for the level turn at
its end, which FreeCAD's programs make too (Mod/Path/PathScripts/PathAdaptive.py). camtool's limit
is the greatest engagement of FreeCAD's cuts, measured by the kernel that proves ours.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest

from camtool.arrays import Bools, Floats
from camtool.kernels.engagement import Cleared
from camtool.planning.items import CutRun
from camtool.planning.job import Entry
from tests.oracles.adaptive_peers import CUTTING, FREECAD, LINK, freecad_plan
from tests.oracles.contours import CIRCLE, SQUARE
from tests.oracles.engagement import CHORD_SHARE, chords_of
from tests.oracles.swept import area_of
from tests.paths import moved, scaled
from tests.planning.pocket_cases import region_of, runs_of, work_of
from tests.validation.test_validation_adaptive import SHAPES, Shape

pytestmark = [
    pytest.mark.benchmark,
    pytest.mark.skipif(
        not (FREECAD / "area.so").exists(),
        reason="FreeCAD's area.so is missing: apt-get install freecad-python3 brings it",
    ),
]

FEED_MM_MIN, LINK_FEED_MM_MIN, RAPID_MM_MIN = 600.0, 2000.0, 3000.0
HOP_MM = 6.0
"""The tool comes up so far."""

THICK_SHARE = 4e-3
COARSE_RAD = math.radians(0.5)
ISLANDS = [
    scaled(SQUARE, 10.0),
    moved(scaled(SQUARE, 2.0), 15.0, 15.0),
    moved(scaled(CIRCLE, 1.0), 72.0, 25.0),
    moved(scaled(CIRCLE, 0.8), 27.0, 72.0),
    moved(scaled(SQUARE, 1.5), 62.0, 62.0),
]
CASES = {
    "100 x 100 mm, four islands": Shape(ISLANDS, 3.0, 0.1),
    **{
        name: SHAPES[name] for name in ("inner corner", "letter B", "letter E", "slot of 10.16 mm")
    },
}


class Travel(NamedTuple):
    """Lengths of cuts, of links at depth and of ways above, mm; how often the tool comes up; and
    the greatest engagement of the cuts behind the entries, rad."""

    cut_mm: float
    link_mm: float
    above_mm: float
    retracts: int
    greatest: float

    @property
    def minutes(self) -> float:
        above = self.above_mm + 2.0 * HOP_MM * self.retracts
        return self.cut_mm / FEED_MM_MIN + self.link_mm / LINK_FEED_MM_MIN + above / RAPID_MM_MIN


def length_of(points: Floats) -> float:
    return float(np.hypot(*np.diff(points[:, :2], axis=0).T).sum())


def greatest_engagement(stays: Sequence[tuple[Floats, Bools]], radius_mm: float) -> float:
    """Return the greatest engagement of the moves of stays, points (n, 2) and which moves count
    (n - 1,)."""
    every = np.concatenate([points for points, _ in stays])
    extents = np.stack([every.min(axis=0), every.max(axis=0)])
    cleared = Cleared(extents, radius_mm, np.array([-np.inf, -np.inf, np.inf, np.inf]))
    greatest = 0.0
    for points, counts in stays:
        count = len(points) - 1
        flat = np.column_stack([np.full(count, radius_mm), np.zeros((count, 4))])
        rows = np.column_stack([points[:-1], points[1:], flat])
        for part in np.split(np.arange(count), np.flatnonzero(np.diff(counts)) + 1):
            if not counts[part].all():
                cleared.add(rows[part])
                continue
            angles = cleared.judge(
                rows[part],
                np.ones(len(part), dtype=np.bool_),
                THICK_SHARE * radius_mm,
                math.pi,
                COARSE_RAD,
                coarse_rad=COARSE_RAD,
                known_rad=greatest,
            )
            greatest = max(greatest, float(angles.max()))
    return greatest


def behind_entry(points: Floats, radius_mm: float) -> Bools:
    """True (n - 1,) for moves farther along than the tool's circumference."""
    reach = np.cumsum(np.hypot(*np.diff(points, axis=0).T))
    return np.asarray(reach > math.tau * radius_mm)


def peer_travel(shape: Shape) -> tuple[float, Travel]:
    """FreeCAD's planning time, s, and what its tool travels."""
    area = area_of(region_of(shape.paths)).simplify(1e-4 * shape.radius_mm)
    plan = freecad_plan(area, shape.radius_mm, shape.share, finish=False)
    cut = link = above = 0.0
    retracts, stays = 0, list[tuple[Floats, Bools]]()
    angle = np.linspace(0.0, math.tau, 200)
    for number, (centre, ways) in enumerate(plan.regions):
        retracts += number > 0
        ring = np.array(centre) + 0.5 * shape.radius_mm * np.column_stack(
            [np.cos(angle), np.sin(angle)]
        )
        stays.append((ring, np.zeros(len(ring) - 1, dtype=np.bool_)))
        cut += length_of(ring)
        is_first, at = True, ring[-1]
        for kind, way in ways:
            points = np.array([at, *way])
            points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-9)]
            at = points[-1]
            if len(points) < 2:
                continue
            if kind == CUTTING:
                cut += length_of(points)
                counts = np.ones(len(points) - 1, dtype=np.bool_)
                stays.append(
                    (points, behind_entry(points, shape.radius_mm) if is_first else counts)
                )
                is_first = False
            elif kind == LINK:
                link += length_of(points)
            else:
                above += length_of(points)
                retracts += 1
    return plan.seconds, Travel(
        cut, link, above, retracts, greatest_engagement(stays, shape.radius_mm)
    )


def own_runs(shape: Shape, limit: float) -> list[CutRun]:
    own = (
        ("strategy", "adaptive"),
        ("engagement_rad", limit),
        ("link_feed_mm_min", LINK_FEED_MM_MIN),
    )
    entry = Entry("helix", angle_rad=math.radians(5.0))
    return runs_of(work_of(shape.paths, 2.0 * shape.radius_mm, own=own, entry=entry))


def own_travel(shape: Shape, limit: float) -> tuple[float, Travel]:
    """camtool's planning time, s, and what its tool travels, by the feeds of its moves."""
    begin = time.process_time()
    runs = own_runs(shape, limit)
    seconds = time.process_time() - begin
    cut = link = 0.0
    stays = list[tuple[Floats, Bools]]()
    for run in runs:
        points = chords_of(run.vertices, CHORD_SHARE * shape.radius_mm)
        level = points[:, 2] <= points[:, 2].min() + 1e-6
        has_helix = not level.all()
        flat = points[level][:, :2]
        flat = flat[np.append(True, np.hypot(*np.diff(flat, axis=0).T) > 1e-9)]
        counts = np.ones(len(flat) - 1, dtype=np.bool_)
        stays.append((flat, behind_entry(flat, shape.radius_mm) if has_helix else counts))
        for row, (vertex, after) in enumerate(pairwise(run.vertices)):
            if vertex[2] != after[2]:
                continue
            own = length_of(chords_of(np.array([vertex, after]), CHORD_SHARE * shape.radius_mm))
            if run.feed_mm_min[row] == LINK_FEED_MM_MIN:
                link += own
            else:
                cut += own
    ends = [(one.vertices[-1, :2], other.vertices[0, :2]) for one, other in pairwise(runs)]
    above = sum(math.dist(one, other) for one, other in ends)
    greatest = greatest_engagement(stays, shape.radius_mm)
    return seconds, Travel(cut, link, above, len(runs) - 1, greatest)


@pytest.mark.parametrize("name", CASES)
def test_adaptive_clearing_beside_freecad(name: str) -> None:
    shape = CASES[name]
    peer_s, peer = peer_travel(shape)
    own_s, own = own_travel(shape, min(peer.greatest, 0.5 * math.pi))
    print(f"\n{name}, tool {2.0 * shape.radius_mm:g} mm, step-over {shape.share:.0%}")
    for program, seconds, each in (("FreeCAD", peer_s, peer), ("camtool", own_s, own)):
        print(
            f"{program}: planned in {seconds:.2f} s, cuts {each.cut_mm / 1e3:.2f} m, "
            f"links {each.link_mm / 1e3:.2f} m, {each.retracts} retracts, "
            f"greatest {math.degrees(each.greatest):.1f} deg, {each.minutes:.2f} min"
        )
    planning, cutting = own_s / peer_s, own.minutes / peer.minutes
    print(f"camtool / FreeCAD: planning {planning:.2f}, cutting {cutting:.2f}")
    nominal_s, nominal = own_travel(shape, math.acos(1.0 - 2.0 * shape.share))
    print(
        f"camtool at the limit of the step-over: planned in {nominal_s:.2f} s "
        f"({nominal_s / peer_s:.2f}), cuts {nominal.cut_mm / 1e3:.2f} m, "
        f"links {nominal.link_mm / 1e3:.2f} m, {nominal.retracts} retracts, greatest "
        f"{math.degrees(nominal.greatest):.1f} deg, {nominal.minutes:.2f} min "
        f"({nominal.minutes / peer.minutes:.2f})"
    )
    assert own.greatest <= 1.02 * min(peer.greatest, 0.5 * math.pi) + COARSE_RAD
