"""What a run of the tool cuts, the plain way: many points along it, one after the other."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats
from camtool.findings import Finding
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.contours import runs_of as cut_of
from camtool.planning.items import Contour, CutRun
from camtool.planning.leads import KeepOut
from tests.oracles.arcs import FLAT, centre_of


def runs_of(contour: Contour, path: Polyline) -> tuple[list[CutRun], list[Finding]]:
    """The runs that cut a contour that keeps away from nothing else, and what is said of them."""
    nothing = KeepOut(Polylines.of([]), np.empty(0, dtype=np.bool_))
    cut = cut_of([contour], np.zeros(1, dtype=np.int64), Polylines.of([path]), nothing)
    return list(cut.runs), list(cut.findings)


def run_points(vertices: Floats, step_mm: float) -> Floats:
    """(n, 3) places along vertices (k, 4) of x, y, z, bulge, not farther apart than the step.

    On an arc the angle, and with it z, goes evenly.
    """
    rows = [vertices[:1, :3]]
    for here, there in pairwise(vertices):
        size = move_length(here, there)
        share = np.linspace(0.0, 1.0, max(2, math.ceil(size / step_mm) + 1))[1:, None]
        z = here[2] + share * (there[2] - here[2])
        if abs(here[3]) < FLAT:
            rows.append(np.hstack([here[:2] + share * (there[:2] - here[:2]), z]))
            continue
        centre, radius = centre_of(here[:2], there[:2], float(here[3]))
        start = math.atan2(*(here[:2] - centre)[::-1])
        angle = start + share * 4.0 * math.atan(here[3])
        rows.append(np.hstack([centre + radius * np.hstack([np.cos(angle), np.sin(angle)]), z]))
    return np.concatenate(rows)


def move_length(here: Floats, there: Floats) -> float:
    """Length of one move between rows of x, y, z, bulge, seen from above; z when straight down."""
    chord = float(np.hypot(*(there[:2] - here[:2])))
    if chord == 0.0:
        return abs(float(there[2] - here[2]))
    if abs(here[3]) < FLAT:
        return chord
    _, radius = centre_of(here[:2], there[:2], float(here[3]))
    return radius * 4.0 * math.atan(abs(here[3]))


def steepest(vertices: Floats) -> float:
    """The steepest slope (fall over length) of all moves down that are not straight down."""
    slopes = [0.0]
    for here, there in pairwise(vertices):
        if (here[:2] != there[:2]).any():
            slopes.append(float(here[2] - there[2]) / move_length(here, there))
    return max(slopes)


def cut_over(runs: Iterable[CutRun], places: Floats, step_mm: float) -> tuple[Floats, float]:
    """Return the lowest height (J,) of the tool over these places of a contour (J, 2), and the
    largest depth that one pass removes there. Points of the run farther than 2 steps from every
    place are ignored."""
    low = np.zeros(len(places))
    most = 0.0
    for run in runs:
        points = run_points(run.vertices, step_mm)
        for begin in range(0, len(points), 500):
            some = points[begin : begin + 500]
            apart = np.hypot(*(some[:, None, :2] - places[None]).transpose(2, 0, 1))
            for (_, _, z), distances in zip(some.tolist(), apart, strict=True):
                at = int(distances.argmin())
                if distances[at] <= 2.0 * step_mm:
                    most = max(most, low[at] - z)
                    low[at] = min(low[at], z)
    return low, most


def most_at_a_time(vertices: Floats, total_mm: float, cells: int) -> float:
    """The most that a run round a closed path of this length takes away anywhere at a time.

    The run only goes forwards: how far it has come tells where on the path it is.
    """
    low = np.zeros(cells)
    most = came = 0.0
    for here, there in pairwise(vertices):
        if (here[:2] == there[:2]).all():
            continue
        size = move_length(here, there)
        first = math.ceil(came / total_mm * cells)
        for cell in range(first, math.ceil((came + size) / total_mm * cells)):
            share = (cell / cells * total_mm - came) / size
            z = float(here[2] + share * (there[2] - here[2]))
            most = max(most, low[cell % cells] - z)
            low[cell % cells] = min(low[cell % cells], z)
        came += size
    return most
