"""Straight walls stay straight in the last decimal, though it be a tie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.job import Tabs, job_of
from camtool.planning.link import ROUNDED_DECIMALS
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind
from tests.drawings import drawing_of

EIGHTH = 3.175


@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "valcnc"])
@settings(max_examples=25, deadline=None)
@given(
    st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
    st.tuples(st.integers(120, 190), st.integers(120, 180)),
    st.sampled_from(["inside", "outside"]),
    st.booleans(),
)
def test_walls_along_an_axis_are_written_straight(
    target: str, corner: tuple[int, int], size: tuple[int, int], side: str, tabs: bool
) -> None:
    (x, y), (w, h) = np.array(corner) / 10.0, np.array(size) / 10.0
    box = Polyline(np.array([[x, y, 0], [x + w, y, 0], [x + w, y + h, 0], [x, y + h, 0.0]]), True)
    job = job_of(
        tool_diameter_mm=EIGHTH,
        side=side,
        depth_mm=2.0,
        step_down_mm=1.0,
        tabs=Tabs(count=2, width_mm=1.0) if tabs else None,
        origin="lower-left",
    )
    made = post_drawing(drawing_of([box]), job, load_target(target), check=False).decoded
    assert made is not None
    lines = (made.kind == Kind.LINE) & (np.hypot(*(made.end - made.starts)[:, :2].T) > 0.01)
    assert lines.any()
    # Of each line along an axis one coordinate does not change at all.
    assert np.abs((made.end - made.starts)[lines, :2]).min(axis=1).max() == 0.0
    # And the wall has this coordinate in all passes: four walls, four numbers.
    across = np.abs((made.end - made.starts)[lines, :2]).argmin(axis=1)
    numbers = made.end[lines, :2][np.arange(lines.sum()), across]
    assert len({(k, v) for k, v in zip(across.tolist(), numbers.tolist(), strict=True)}) == 4


def test_places_lie_on_a_grid_far_below_any_tolerance() -> None:
    ring = Polyline(np.array([[0.1, 0, 1.0], [10 / 3, 0, 1.0]]), True)
    from camtool.planning.plan import planned

    machine = load_target("grbl").machine
    path = planned(drawing_of([ring]), job_of(tool_diameter_mm=EIGHTH, rotate_rad=0.3), machine)
    for places in (path.toolpath.end, path.toolpath.centre):
        known = places[np.isfinite(places)]
        assert np.array_equal(known, np.round(known, ROUNDED_DECIMALS))
        assert not np.signbit(known[known == 0.0]).any()
