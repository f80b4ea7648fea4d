"""What the tests of reversals share: shapes, contours, and what a machine makes of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.planning.items import Contour, CutRun, Feeds, Item, Runs, Setting
from camtool.planning.job import Job, Operation
from camtool.planning.link import link
from camtool.planning.paths import flat_path
from camtool.planning.reversing import Approaches, least_reversal_mm, parts_of, reversals_along
from camtool.planning.settings import setting_of
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from camtool.verification.report import Report
from tests.targets import verify

DEPTH_MM = 0.02
PIC = load_target("pic-mmh")

LEAST_TURN_MM = 1e-6
"""How far back an axis must come for a reversal, where no machine says how fine its steps are."""


def reversals_of(cut: Polyline | CutRun, machine: Machine | None = None) -> tuple[int, int]:
    """Count the reversals of X and Y between the first point of a path or run and its last one.

    What comes back by less than half a step of the machine (`LEAST_TURN_MM` without one) is no
    reversal; nor is the first motion, which an approach takes care of.
    """
    path = flat_path(cut.vertices) if isinstance(cut, CutRun) else cut
    if path is None:
        return 0, 0
    parts = parts_of(path)
    least = (LEAST_TURN_MM,) * 2
    if machine is not None:
        least = least_reversal_mm(machine.axes.x), least_reversal_mm(machine.axes.y)
    x, y = (reversals_along(parts.places[:, axis], path.closed, least[axis]) for axis in (0, 1))
    return x.count_within(len(parts)), y.count_within(len(parts))


def setting(levels: int = 1, **operation: Any) -> Setting:
    depths = tuple(-DEPTH_MM * (level + 1) / levels for level in range(levels))
    return Setting(Operation(**operation), Feeds(0.8, 0.8), depths, 0.2)


def contour(
    path: Polyline, levels: int = 1, left: bool | None = None, **operation: Any
) -> Contour:
    return Contour(
        path,
        setting(levels, **operation),
        "test",
        0,
        reversible=not path.closed,
        material_left=left,
    )


def run_of(path: Polyline) -> CutRun:
    flat_path = path.vertices
    if path.closed:
        flat_path = np.concatenate([flat_path, flat_path[:1]])
    vertices = np.insert(flat_path, 2, -DEPTH_MM, axis=1)
    vertices[-1, 3] = 0.0
    return CutRun(vertices, np.full(len(vertices) - 1, 0.8), 0.8, "test")


def toolpath(paths: Sequence[Polyline], machine: Machine, *, approach: bool) -> Toolpath:
    """The paths cut one after the other, each from its first point."""
    runs = [run_of(path) for path in paths]
    come = Approaches(machine) if approach else None
    setting = setting_of(Operation(), Job(safe_z_mm=0.2), machine)
    return link([(setting, Runs.of(runs))], machine, lambda: come).finish()


def judged(
    paths: Sequence[Polyline], wanted: Sequence[Polyline], machine: Machine, *, approach: bool
) -> Report:
    """The paths as the PIC machine cuts them, compared with the wanted ones."""
    program = PIC.target.write(toolpath(paths, machine, approach=approach), machine)
    decoded = PIC.target.read(program.data, machine)
    whole = toolpath(wanted, machine, approach=False)
    return verify(decoded, machine, wanted=whole).report


def cutting_reversals(report: Report) -> int:
    return report.reversals.cutting.x + report.reversals.cutting.y


def paths_of(items: Sequence[Item]) -> list[Polyline]:
    assert all(isinstance(item, Contour) for item in items)
    return [item.path for item in items if isinstance(item, Contour)]


def with_play(machine: Machine, **changes: float) -> Machine:
    """The machine with other `backlash_mm` or `compensation_mm` in X and Y (or with an `x_` or
    `y_` before, in one of them)."""
    axes = {}
    for name in ("x", "y"):
        of_axis = {
            key.removeprefix(f"{name}_"): value
            for key, value in changes.items()
            if not key.startswith(("y_", "x_")) or key.startswith(f"{name}_")
        }
        axes[name] = replace(getattr(machine.axes, name), **of_axis)
    return replace(machine, axes=replace(machine.axes, **axes))


def polygon(*points: tuple[float, float]) -> Polyline:
    return Polyline(np.array([(x, y, 0.0) for x, y in points]), True)


def square(side_mm: float = 1.0) -> Polyline:
    return polygon((0.0, 0.0), (side_mm, 0.0), (side_mm, side_mm), (0.0, side_mm))


def circle(radius_mm: float = 0.5, start_rad: float = 0.0) -> Polyline:
    x, y = radius_mm * math.cos(start_rad), radius_mm * math.sin(start_rad)
    return Polyline(np.array([[x, y, 1.0], [-x, -y, 1.0]]), True)


def star(points: int = 5, radius_mm: float = 0.5) -> Polyline:
    angle = np.arange(2 * points) * math.pi / points + 0.1
    radius = np.where(np.arange(2 * points) % 2 == 0, 1.0, 0.4) * radius_mm
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle])
    return Polyline(ring, True)


def gear(teeth: int = 8, radius_mm: float = 0.5) -> Polyline:
    """Teeth with arcs at their tips and roots."""
    step = math.pi / teeth
    angle = (np.arange(2 * teeth)[:, None] * step + np.array([0.2, 0.8]) * step).ravel()
    tips = np.repeat(np.arange(2 * teeth) % 2 == 0, 2)
    radius = np.where(tips, 1.0, 0.8) * radius_mm
    bulge = np.where(np.arange(4 * teeth) % 2 == 0, math.tan(0.6 * step / 4.0), 0.0)
    return Polyline(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), bulge]), True)


def letter_s(height_mm: float = 1.0) -> Polyline:
    """An S as an outline of arcs and lines, its ends cut off straight."""
    quarter = math.tan(math.pi / 8.0)
    outline = [
        (0.9, 0.8, 0.0),
        (0.7, 0.8, quarter),
        (0.5, 1.0, quarter),
        (0.3, 0.8, quarter),
        (0.5, 0.6, -quarter),
        (0.9, 0.2, -quarter),
        (0.5, -0.2, -quarter),
        (0.1, 0.2, 0.0),
        (0.3, 0.2, quarter),
        (0.5, 0.0, quarter),
        (0.7, 0.2, quarter),
        (0.5, 0.4, -quarter),
        (0.1, 0.8, -quarter),
        (0.5, 1.2, -quarter),
    ]
    return Polyline(np.array(outline) * np.array([height_mm, height_mm, 1.0]) / 1.4, True)


def letter_e(height_mm: float = 1.0) -> Polyline:
    points = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (2.5, 2), (2.5, 3), (1, 3), (1, 4), (3, 4)]
    scaled = [(x * height_mm / 5.0, y * height_mm / 5.0) for x, y in [*points, (3, 5), (0, 5)]]
    return polygon(*scaled)


def letter_v(height_mm: float = 1.0) -> Polyline:
    points = [(2, 0), (3, 0), (5, 5), (4, 5), (2.5, 1), (1, 5), (0, 5)]
    return polygon(*[(x * height_mm / 5.0, y * height_mm / 5.0) for x, y in points])
