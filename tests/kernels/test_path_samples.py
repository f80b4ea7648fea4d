"""Samples along lines and arcs, and their steps, against the same by arrays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.kernels.lattice import HALF_STEP_GUARD, to_steps
from camtool.kernels.motion import count_steps
from camtool.simulation.samples import ways_of
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import PolarArcs

pytestmark = pytest.mark.checked


@given(st.integers(0, 2**32 - 1))
def test_points_of_lines_arcs_and_helices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    b = ToolpathBuilder(start=tuple(rng.uniform(-9.0, 9.0, 3).tolist()))
    for is_arc in (rng.random(8) < 0.5).tolist():
        x, y, z = rng.uniform(-9.0, 9.0, 3).tolist()
        if is_arc:
            centre = tuple(rng.uniform(-9.0, 9.0, 2).tolist())
            b.arc(x, y, z, centre=centre, ccw=bool(rng.random() < 0.5), feed=1.0)
        else:
            b.line(x, y, z, feed=1.0)
    path = b.finish()
    arms = PolarArcs(path, path.is_arc)
    row, share = rng.integers(8, size=40), np.append(rng.random(39), 1.0)
    points = np.empty((40, 3))
    ways_of(path, arms).fill(row, share, points)
    starts, ends = path.starts_of(row), path.end[row]
    expected = starts + share[:, None] * (ends - starts)
    on_arc = np.flatnonzero(path.is_arc[row])
    expected[on_arc] = arms.points(np.searchsorted(arms.row, row[on_arc]), share[on_arc])
    assert points == pytest.approx(expected, abs=1e-12)
    assert points[-1].tolist() == ends[-1].tolist()


@given(st.integers(0, 2**32 - 1))
def test_steps_of_points(seed: int) -> None:
    """Halves of steps among them, on both sides of zero."""
    rng = np.random.default_rng(seed)
    step_mm = np.array([0.00014, 0.005, 0.0025])
    points = rng.integers(-20, 20, size=(30, 3)) * 0.5 * step_mm
    counts = np.empty((30, 3), dtype=np.int64)
    count_steps(points, step_mm, HALF_STEP_GUARD, counts)
    steps = np.column_stack([to_steps(points[:, k], step_mm[k]) for k in range(3)])
    expected = np.abs(np.diff(steps, axis=0, prepend=steps[:1])).cumsum(axis=0)
    assert counts.tolist() == expected.tolist()
