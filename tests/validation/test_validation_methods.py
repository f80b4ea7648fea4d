"""Tabla 7 of the PIC thesis, and its decision matrix, from programs that are run.

Lnnn are lines of the thesis. The tables go into docs/validation.md.
"""

from __future__ import annotations

from functools import cache
from typing import get_args

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.dialect import Interpolator

from camtool.pipeline import Judging, verify_program
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.report import Report
from tests.oracles.motion_rows import rows_of
from tests.targets import simulate
from tests.validation.page import check

STEP_MM = 0.00014
BLU_NM = 140.0

ITERATIONS = {"stairs": 240, "dda": 188, "dsm": 168}
ERRORS_NM = {"stairs": 140.0, "dda": 140.0, "dsm": 70.0}
MICROSECONDS = {"stairs": 3.2, "dda": 6.8, "dsm": 8.6}
"""Tabla 7, L1438-1458: a full circle; time of an iteration on the PIC."""
GRADES: dict[Interpolator, tuple[float, ...]] = {
    "dda": (8.0, 9.0, 8.8, 7.0, 84.4),
    "stairs": (6.0, 9.0, 5.7, 10.0, 72.1),
    "dsm": (9.0, 9.5, 10.0, 5.0, 90.5),
}
"""Tabla 9, L1514-1556: simulation, error, iterations, time, total."""
WEIGHTS = (3.0, 3.0, 3.0, 1.0)
"""Tabla 8, the same lines."""
LARGEST_RADIUS = 300
"""Steps, of the circles on which the DDA's error is looked for: 42 µm."""


@cache
def circle_of_30(method: Interpolator) -> Report:
    """The circle of 30 steps, clockwise, as a program."""
    target = load_target("pic-mmh")
    at, radius = 100 * STEP_MM, 30 * STEP_MM
    path = ToolpathBuilder().rapid(at, at + radius).line(z=-0.0014, feed=0.8)
    path.arc(at, at + radius, centre=(at, at), ccw=False, feed=0.8)
    data = target.target.write(path.rapid(z=0.0014).finish(), target.machine).data
    judging = Judging(interpolator=method, effects=IDEAL)
    return verify_program(data, target, source="circle.pic", judging=judging).report


def iterations(method: Interpolator) -> int:
    """Of the circle alone."""
    target = load_target("pic-mmh", settings=[f"controller.arcs={method}"])
    path = ToolpathBuilder((0.0, 30 * STEP_MM, 0.0))
    path.arc(0.0, 30 * STEP_MM, centre=(0.0, 0.0), ccw=False, feed=0.8)
    (row,) = rows_of(simulate(path.finish(), target.machine))
    return row.iterations


def error_nm(method: Interpolator) -> float:
    """The largest radial error of the circle of 30 steps."""
    (ring,) = circle_of_30(method).circles
    assert ring.Fmax_um is not None
    assert ring.Fmin_um is not None
    return max(ring.Fmax_um, -ring.Fmin_um) * 1000.0


@cache
def worst_steps(method: Interpolator) -> float:
    """The largest radial error of all full circles of up to LARGEST_RADIUS steps, in steps."""
    path = ToolpathBuilder((0.0, STEP_MM, 0.0))
    for radius in range(1, LARGEST_RADIUS + 1):
        top = radius * STEP_MM
        path.line(0.0, top, feed=0.8)
        path.arc(0.0, top, centre=(0.0, 0.0), ccw=False, feed=0.8)
    toolpath, machine = path.finish(), load_target("pic-mmh").machine
    rows = rows_of(simulate(toolpath, machine, Options(method, IDEAL, 1 << 12)))
    arcs = [row for row, is_arc in zip(rows, toolpath.is_arc, strict=True) if is_arc]
    return max(
        float(np.abs(np.hypot(*row.commanded[:, :2].T) / STEP_MM - radius).max())
        for radius, row in enumerate(arcs, start=1)
    )


def test_table_7(bless: bool) -> None:
    """Counts to the iteration; errors are below what is printed, but for the DDA's."""
    rows = []
    for method in ("stairs", "dda", "dsm"):
        count, found, worst = iterations(method), error_nm(method), worst_steps(method)
        assert count == ITERATIONS[method]
        assert (worst * BLU_NM <= ERRORS_NM[method]) == (method != "dda")
        rows.append(
            [
                {"stairs": "stairs", "dda": "DDA", "dsm": "direct search"}[method],
                str(ITERATIONS[method]),
                str(count),
                f"{ERRORS_NM[method]:.0f}",
                f"{found:.0f}",
                f"{worst * BLU_NM:.0f}",
                f"{worst:.3f}",
            ]
        )
    assert worst_steps("dda") == pytest.approx(1.155, abs=0.0005)
    assert set(ITERATIONS) == set(get_args(Interpolator))
    heads = [
        "method",
        "iterations printed",
        "found",
        "error printed, nm",
        "R 30 steps",
        "worst of R 1 … 300",
        "in steps",
    ]
    check("table-7", heads, rows, bless)


def graded(method: Interpolator, error_steps: float) -> tuple[float, float, float, float]:
    """The thesis's own rules (L1539-1565). The first grade was given by eye."""
    slowest = max(MICROSECONDS.values())
    more = (iterations(method) / iterations("dsm") - 1.0) * 100.0
    return (
        GRADES[method][0],
        10.0 - error_steps,
        10.0 - 0.1 * more,
        min(10.0, 5.0 + (slowest - MICROSECONDS[method]) / 0.86),
    )


def total(grades: tuple[float, ...]) -> float:
    return sum(w * g for w, g in zip(WEIGHTS, grades, strict=True))


def test_the_decision_matrix(bless: bool) -> None:
    """Tablas 8 and 9 from our iterations; with the errors that are printed, and with ours."""
    rows, with_ours = [], {}
    for method, (*grades, printed) in GRADES.items():
        said = graded(method, ERRORS_NM[method] / BLU_NM)
        assert said == pytest.approx(grades, abs=0.1)
        assert total(said) == pytest.approx(printed, abs=0.15)
        ours = graded(method, worst_steps(method))
        with_ours[method] = total(ours)
        rows.append(
            [
                {"stairs": "stairs", "dda": "DDA", "dsm": "direct search"}[method],
                ", ".join(f"{g:g}" for g in grades),
                ", ".join(f"{g:.1f}" for g in said),
                f"{printed:.1f}",
                f"{total(said):.1f}",
                f"{total(ours):.1f}",
            ]
        )
    assert with_ours["dsm"] > with_ours["dda"] > with_ours["stairs"]
    heads = [
        "method",
        "grades printed",
        "found",
        "total printed",
        "found",
        "with the worst errors found",
    ]
    check("matrix", heads, rows, bless)
