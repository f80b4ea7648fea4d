"""How far toolpaths reach, against very many points of their arcs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, toolpath_extents


def test_nothing_reaches_only_its_start() -> None:
    path = ToolpathBuilder(start=(1.0, 2.0, 3.0)).finish()
    assert toolpath_extents(path).tolist() == [[1, 1], [2, 2], [3, 3]]


def test_moves_and_start_are_included() -> None:
    path = ToolpathBuilder().rapid(z=2.0).rapid(5, -1).line(z=-0.5, feed=1).event(Kind.END)
    assert toolpath_extents(path.finish()).tolist() == [[0, 5], [-1, 0], [-0.5, 2]]


@pytest.mark.parametrize("ccw", [True, False])
def test_a_full_circle_reaches_all_round(ccw: bool) -> None:
    path = ToolpathBuilder().rapid(3, 0).arc(3, 0, centre=(5, 0), ccw=ccw, feed=1).finish()
    assert toolpath_extents(path)[:2].tolist() == [[0, 7], [-2, 2]]


@pytest.mark.parametrize(("ccw", "box"), [(True, [[0, 1], [0, 1]]), (False, [[-1, 1], [-1, 1]])])
def test_a_quarter_reaches_to_its_ends_and_the_rest_all_round(
    ccw: bool, box: list[list[float]]
) -> None:
    path = ToolpathBuilder(start=(1, 0, 0)).arc(0, 1, centre=(0, 0), ccw=ccw, feed=1).finish()
    assert toolpath_extents(path)[:2].tolist() == box


@given(
    st.floats(-math.pi, math.pi),
    st.floats(0.01, 2.0 * math.pi - 0.01),
    st.floats(0.1, 9.0),
    st.booleans(),
)
def test_arcs_reach_as_far_as_very_many_of_their_points(
    begin: float, sweep: float, radius: float, ccw: bool
) -> None:
    centre = np.array([3.0, -2.0])
    angles = begin + np.linspace(0.0, sweep if ccw else -sweep, 5001)
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    (x0, y0), (x1, y1) = points[0].tolist(), points[-1].tolist()
    path = ToolpathBuilder(start=(x0, y0, 0.0))
    path.arc(x1, y1, centre=(3.0, -2.0), ccw=ccw, feed=1.0)
    box = toolpath_extents(path.finish())[:2]
    assert box[:, 0] == pytest.approx(points.min(axis=0), abs=1e-5)
    assert box[:, 1] == pytest.approx(points.max(axis=0), abs=1e-5)
