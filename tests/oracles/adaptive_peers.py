"""Adaptive clearing by other programs, each in a process of its own: paths of the tool's centre.

FreeCAD      its module area.so, of FREECAD_LIB (Debian's freecad-python3 without it)
hsm_nibble   a folder named by HSM_NIBBLE, with it and pyvoronoi in it
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from tests.oracles.engagement import Stay

FREECAD = Path(os.environ.get("FREECAD_LIB", "/usr/lib/freecad-python3/lib"))
DEBIAN_PYTHON = "/usr/bin/python3"
HSM_NIBBLE = os.environ.get("HSM_NIBBLE", "")
MOST_SECONDS = 300

ACCURACY = 0.1
"""FreeCAD's own default of what it calls accuracy."""

CUTTING, LINK = 0, 1
"""Its kinds of a path that cuts, and of one at depth through what is cleared; others retract."""

_FREECAD = """
import json, sys, time
asked = json.load(sys.stdin)
sys.path.insert(0, asked["folder"])
import area
work = area.Adaptive2d()
work.toolDiameter = asked["diameter"]
work.helixRampDiameter = 0.5 * asked["diameter"]
work.stepOverFactor = asked["share"]
work.tolerance = asked["accuracy"]
work.stockToLeave, work.keepToolDownDistRatio = 0.0, 3.0
work.forceInsideOut, work.finishingProfile = False, asked["finish"]
work.opType = area.AdaptiveOperationType.ClearingInside
begin = time.process_time()
regions = work.Execute([asked["stock"]], asked["paths"], lambda so_far: False)
seconds = time.process_time() - begin
print()
print(json.dumps([seconds, [
    [list(each.HelixCenterPoint), [[int(kind), way] for kind, way in each.AdaptivePaths]]
    for each in regions
]]))
"""

_HSM = """
import json, sys
asked = json.load(sys.stdin)
sys.path.insert(0, asked["folder"])
import shapely
from hsm_nibble import geometry
from hsm_nibble.arc_utils import ArcDir, LineData, MoveStyle
centres = shapely.from_wkt(asked["centres"])
work = geometry.Pocket(centres, step=asked["step"], winding_dir=ArcDir.CCW)
print()
print(json.dumps([
    [isinstance(each, LineData) and each.move_style != MoveStyle.CUT, list(each.path.coords)]
    for each in work.path
]))
"""


class Clearing(NamedTuple):
    """The stays of a tool, and which of them begin with an entry."""

    stays: list[Stay]
    is_entry: list[bool]


def _run(python: str, script: str, asked: dict[str, Any]) -> Any:
    done = subprocess.run(
        [python, "-c", script],
        input=json.dumps(asked),
        capture_output=True,
        text=True,
        timeout=MOST_SECONDS,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def _ring(centre: Sequence[float], radius_mm: float) -> Stay:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    points = np.array(centre) + radius_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    return Stay(points, np.empty((0, 3)))


def _moving(way: Sequence[Sequence[float]]) -> Stay:
    """Return a path without points that repeat the one before."""
    points = np.array(way)
    moved = np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-9)
    return Stay(points[moved], np.empty((0, 3)))


class Plan(NamedTuple):
    """What FreeCAD plans for an area, and the processor time of that, s: for each region where its
    helix is, and its ways, each of a kind (CUTTING, LINK) and with its points."""

    seconds: float
    regions: list[tuple[list[float], list[tuple[int, list[list[float]]]]]]


def freecad_plan(area: shapely.Polygon, radius_mm: float, share: float, *, finish: bool) -> Plan:
    """Clear an area with FreeCAD; `share` of the tool's diameter is its step-over."""
    rings = [shapely.get_coordinates(ring).tolist() for ring in (area.exterior, *area.interiors)]
    stock = shapely.get_coordinates(shapely.box(*shapely.buffer(area, 10.0).bounds)).tolist()
    asked = {"folder": str(FREECAD), "diameter": 2.0 * radius_mm, "share": share}
    asked |= {"accuracy": ACCURACY, "finish": finish, "stock": stock, "paths": rings}
    return Plan(*_run(DEBIAN_PYTHON, _FREECAD, asked))


def freecad(area: shapely.Polygon, radius_mm: float, share: float, *, finish: bool) -> Clearing:
    """Return the cuts of `freecad_plan`, as FreeCAD calls them; a helix clears a ring of half the
    tool's diameter."""
    stays, is_entry = list[Stay](), list[bool]()
    for centre, ways in freecad_plan(area, radius_mm, share, finish=finish).regions:
        cuts = [_moving(way) for kind, way in ways if kind == CUTTING]
        stays += [_ring(centre, 0.5 * radius_mm), *(cut for cut in cuts if len(cut.points) > 1)]
        is_entry += [number < 2 for number in range(len(stays) - len(is_entry))]
    return Clearing(stays, is_entry)


def hsm_nibble(area: shapely.Polygon, radius_mm: float, share: float) -> Clearing:
    """Clear an area with hsm_nibble, whose paths are those of a point within a region: that of the
    tool's centre."""
    centres = shapely.buffer(area, -radius_mm, quad_segs=64)
    asked = {"folder": HSM_NIBBLE, "centres": centres.wkt, "step": 2.0 * radius_mm * share}
    lines: list[list[list[float]]] = [[]]
    for is_rapid, points in _run(sys.executable, _HSM, asked):
        if is_rapid:
            lines.append([])
        else:
            lines[-1] += points
    stays = [stay for stay in map(_moving, filter(None, lines)) if len(stay.points) > 1]
    return Clearing(stays, [number == 0 for number in range(len(stays))])
