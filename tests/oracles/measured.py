"""A coupon as the machine's mechanics cut it, and what a microscope reads on it.

The tool follows each path of a sheet densely, with rapids between; the slides are those of
`camtool.simulation.mechanics`. Readings are taken from where the edges lie, not from equations.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from camtool.calibration.coupons import CouponSheet, SheetPath
from camtool.machine.model import Machine
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL

CHORD_RAD = 0.0005


def readings(
    sheet: CouponSheet, machine: Machine, *, backwards: bool = False
) -> list[dict[str, Any]]:
    """The tables of the sheet, filled in; `backwards`: open paths are cut from their other end."""
    mechanics = Mechanics(machine, np.zeros(3), ALL)
    return [
        {**table, **_read(kind, path, table, *_cut(path, mechanics, backwards))}
        for path, (kind, table) in zip(sheet.paths, sheet.tables, strict=True)
    ]


def _cut(path: SheetPath, mechanics: Mechanics, backwards: bool) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2) slides along the path, and (V,) the sample that ends at each vertex as drawn."""
    vertices = list(path.vertices)
    if backwards and not path.closed:
        vertices = vertices[::-1]
    # What is closed goes round twice: how the tool came to the start of a circle is forgotten.
    ring = [*vertices, *vertices, vertices[0]] if path.closed else vertices
    runs = [np.array([ring[0][:2]])]
    for (x1, y1, bulge), (x2, y2, _) in pairwise(ring):
        runs.append(_dense(complex(x1, y1), complex(x2, y2), bulge))
    points = np.concatenate(runs)
    ends = np.cumsum([len(run) for run in runs]) - 1
    commanded = np.column_stack([points, np.zeros(len(points))])
    slide, _ = mechanics.follow(commanded, np.array([0, len(commanded)]))
    return slide[:, :2], ends[::-1] if backwards and not path.closed else ends


def _dense(start: complex, end: complex, bulge: float) -> np.ndarray:
    if bulge == 0.0:
        return np.array([[end.real, end.imag]])  # the play operator needs no more of a line
    assert bulge == 1.0, "circles of two halves"
    middle = 0.5 * (start + end)
    angles = np.linspace(0.0, math.pi, math.ceil(math.pi / CHORD_RAD) + 1)[1:]
    points = middle + (start - middle) * np.exp(1j * angles)
    return np.column_stack([points.real, points.imag])


def _read(
    kind: str, path: SheetPath, table: dict[str, Any], slide: np.ndarray, at: np.ndarray
) -> dict[str, Any]:
    corners = slide[at]
    if kind == "circles":
        return {"diameters_mm": _diameters(slide[at[2] :], table["angles_deg"])}
    if kind == "squares":
        return _square(corners)
    axis = "xy".index(table["axis"])
    if kind == "lines":
        lower = abs(corners[3, axis] - corners[2, axis])
        upper = abs(corners[4, axis] - corners[5, axis])
        return {"first_mm": lower, "second_mm": upper}
    marks = len(table["nominal_mm"]) + 1
    strokes = [corners[k : k + 2] for k in range(1, 1 + 2 * marks, 2)]
    others = [corners[k : k + 2] for k in range(3 + 2 * marks, 3 + 4 * marks, 2)][::-1]
    across = 1 - axis
    low = strokes[1][:, across].mean()  # the microscope's table moves by what its scale says
    lower = [_at(stroke, low, axis) for stroke in strokes]
    upper = [_at(stroke, low + table["rows_apart_mm"], axis) for stroke in others]
    return {
        "forward_mm": [place - lower[0] for place in lower[1:]],
        "backward_mm": [place - lower[0] for place in upper[1:]],
    }


def _at(stroke: np.ndarray, level: float, axis: int) -> float:
    """Return the place at which a stroke across an axis reaches a level."""
    (a, b), across = stroke, 1 - axis
    return float(a[axis] + (b - a)[axis] * (level - a[across]) / (b - a)[across])


def _square(corners: np.ndarray) -> dict[str, Any]:
    """Corners are where edges cross; each edge is the straight line through two of its places."""
    right, top = (corners[1], corners[2]), (corners[2], corners[3])
    left, bottom = (corners[3], corners[4]), (corners[4], corners[5])
    upper_right, upper_left = _crossing(right, top), _crossing(top, left)
    lower_left, lower_right = _crossing(left, bottom), _crossing(bottom, right)
    return {
        "dx_mm": float(upper_right[0] - upper_left[0]),
        "dy_mm": float(upper_left[1] - lower_left[1]),
        "diagonals_mm": [math.dist(lower_left, upper_right), math.dist(upper_left, lower_right)],
    }


def _crossing(
    one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the crossing of two straight lines, each through two places."""
    (a, b), (c, d) = one, other
    part = np.linalg.solve(np.column_stack([b - a, c - d]), c - a)[0]
    return a + part * (b - a)


def _diameters(slide: np.ndarray, angles_deg: list[float]) -> list[float]:
    """Through the middle of the extremes, from line to line."""
    middle = 0.5 * (slide.min(axis=0) + slide.max(axis=0))
    arm = slide - middle
    angle = np.degrees(np.arctan2(arm[:, 1], arm[:, 0])) % 360.0
    order = np.argsort(angle)
    far, radius = angle[order], np.hypot(arm[:, 0], arm[:, 1])[order]
    there = np.interp(angles_deg, far, radius)
    back = np.interp(np.array(angles_deg) + 180.0, far, radius)
    return (there + back).tolist()
