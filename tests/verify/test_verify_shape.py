"""The machined shape against the wanted one: rings and strips, by formula."""

import math

import numpy as np
import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.verify.cuts import CutMoves, cut_moves
from camtool.verify.shape import MOST_MOVES, machined_shape, points_wanted
from camtool.verify.trace import Trace
from camtool.verify.verify import VerifyOptions, verify
from tests.oracles.path_machine import path_machine


def circle(radius: float) -> CutMoves:
    b = ToolpathBuilder((radius, 0.0, -1.0))
    b.arc(radius, 0.0, centre=(0.0, 0.0), ccw=True, feed=1.0)
    return cut_moves(b.finish(), flat_cuts=False)


def strip(length: float) -> CutMoves:
    b = ToolpathBuilder((0.0, 0.0, -1.0)).line(length, 0.0, feed=1.0)
    return cut_moves(b.finish(), flat_cuts=False)


def trace(points: np.ndarray) -> Trace:
    count = len(points)
    cutting = np.arange(count) > 0
    return Trace(points, np.zeros(count), np.zeros(count, dtype=np.int64), cutting)


def round_about(radius: float, count: int = 4000) -> Trace:
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    return trace(radius * np.column_stack([np.cos(angle), np.sin(angle)]))


@pytest.mark.parametrize("more", [0.02, -0.03])
def test_a_ring_too_large_or_too_small(more: float) -> None:
    radius, tool = 2.0, 0.5
    shape = machined_shape(round_about(radius + more), circle(radius), 2.0 * tool)
    assert shape is not None
    outer = math.pi * abs((radius + more + tool) ** 2 - (radius + tool) ** 2)
    inner = math.pi * abs((radius + more - tool) ** 2 - (radius - tool) ** 2)
    over, under = (outer, inner) if more > 0 else (inner, outer)
    assert shape.overcut_mm2 == pytest.approx(over, rel=0.02)
    assert shape.undercut_mm2 == pytest.approx(under, rel=0.02)
    assert shape.overcut_mm == pytest.approx(abs(more), abs=2.0 * shape.tolerance_mm)
    assert shape.undercut_mm == pytest.approx(abs(more), abs=2.0 * shape.tolerance_mm)


def test_a_cut_that_ends_early_leaves_its_end() -> None:
    shape = machined_shape(trace(np.array([[0.0, 0.0], [4.9, 0.0]])), strip(5.0), 1.0)
    assert shape is not None
    assert shape.overcut_mm2 == 0.0
    assert shape.overcut_mm == 0.0
    assert shape.undercut_mm2 == pytest.approx(0.1 * 1.0, rel=0.01)
    assert shape.undercut_mm == pytest.approx(0.1, abs=2.0 * shape.tolerance_mm)


def test_the_wanted_shape_itself_is_neither_over_nor_under() -> None:
    shape = machined_shape(round_about(3.0, 20_000), circle(3.0), 0.3)
    assert shape is not None
    assert (shape.overcut_mm2, shape.overcut_mm) == (0.0, 0.0)
    assert (shape.undercut_mm2, shape.undercut_mm) == (0.0, 0.0)


def test_moves_in_the_air_cut_nothing() -> None:
    path = trace(np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 9.0], [0.0, 9.0]]))
    path.cutting[2] = False
    shape = machined_shape(path, strip(5.0), 1.0)
    assert shape is not None
    # The line at y = 9 is cut too; the way there is not.
    assert shape.overcut_mm2 == pytest.approx(5.0 + math.pi / 4.0, rel=0.01)
    assert shape.overcut_mm == pytest.approx(9.0, abs=2.0 * shape.tolerance_mm)


def test_nothing_cut_is_no_shape() -> None:
    still = trace(np.array([[0.0, 0.0]]))
    assert machined_shape(still, strip(5.0), 1.0) is None
    nothing = cut_moves(ToolpathBuilder().finish(), flat_cuts=False)
    assert machined_shape(round_about(1.0), nothing, 1.0) is None


def test_a_trace_needs_points_for_its_smallest_arcs_and_its_ends() -> None:
    few = points_wanted(circle(5.0), 1.0)
    many = points_wanted(circle(0.05), 1.0)
    assert few is not None
    assert many is not None
    # √(8 r tolerance): ten times finer chords on a way that is a hundred times shorter.
    assert few / many == pytest.approx(10.0, rel=0.05)
    assert points_wanted(strip(5.0), 1.0) == 2
    assert points_wanted(strip(5.0), 0.0) is None


def test_what_is_too_much_work_has_no_shape() -> None:
    b = ToolpathBuilder((0.0, 0.0, -1.0))
    for number in range(MOST_MOVES + 2):
        b.line(float(number % 7), float(number), feed=1.0)
    long = cut_moves(b.finish(), flat_cuts=False)
    assert points_wanted(long, 1.0) is None
    assert points_wanted(circle(5000.0), 0.001) is None


def test_the_shape_of_a_long_way_of_small_arcs_is_true() -> None:
    b = ToolpathBuilder().rapid(z=1.0).rapid(0.0, 0.0).line(z=-1.0, feed=60.0)
    for number in range(100):
        x = 0.2 * (number + 1)
        b.arc(x, 0.0, centre=(x - 0.1, 0.0), ccw=number % 2 == 0, feed=60.0)
    path = b.rapid(z=1.0).finish()
    machine = path_machine("axes.x.coded_step_mm=0.0005", "axes.y.coded_step_mm=0.0005")
    options = VerifyOptions(tool_diameter_mm=0.05, trace_points=50)
    found = verify(path, machine, wanted=path, options=options).report.shape
    assert found is not None
    assert max(found.overcut_um, found.undercut_um) < 1.0
