"""The machined shape against the wanted one: rings and strips, by formula."""

import math

import numpy as np
import pytest

from camtool.toolpath.builder import ToolpathBuilder
from camtool.verify.cuts import CutMoves, cut_moves
from camtool.verify.shape import machined_shape
from camtool.verify.trace import Trace


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
