"""Straight walls stay straight in the last decimal, though it be a tie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.items import RAPID, CutRun, Runs
from camtool.planning.job import Tabs, job_of
from camtool.planning.link import ROUNDED_DECIMALS, Approach, link
from camtool.planning.settings import setting_of
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import COLUMNS, Kind
from tests.drawings import drawing_of
from tests.strategies import examples, polylines

EIGHTH = 3.175
MACHINE = load_target("grbl").machine


@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "valcnc"])
@examples(25)
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


@st.composite
def _runs(draw: st.DrawFn) -> Runs:
    """Runs along paths, some of them holes, with rapids and dwells."""
    each = []
    for path in draw(st.lists(polylines(), min_size=1, max_size=6)):
        vertices = np.insert(path.vertices, 2, -draw(st.sampled_from([0.0, 1.0, 2.5])), axis=1)
        if draw(st.booleans()):
            vertices[-1, 2] -= 1.0
        feed = np.full(len(vertices) - 1, draw(st.sampled_from([5.0, 7.0, RAPID])))
        run = CutRun(vertices, feed, 3.0, draw(st.sampled_from(["", "a", "b"])))
        hole = CutRun(vertices[:1], feed[:0], 2.0, "hole", draw(st.sampled_from([0.0, 0.5])))
        each += draw(st.permutations([run, hole]))
    return Runs.of(each)


@given(_runs(), st.integers(1, 9), st.booleans())
def test_runs_that_are_linked_in_lots_are_those_that_are_linked_together(
    runs: Runs, at_once: int, approached: bool
) -> None:
    def approaches() -> Approach:
        seen: list[str] = []

        def approach(run: CutRun) -> tuple[float, float] | None:
            seen.append(run.name)
            return (float(len(seen)), 0.5) if len(seen) % 3 else None

        return approach

    def linked() -> ToolpathBuilder:
        job = job_of(safe_z_mm=4.0)
        work = [(setting_of(job.operations[0], job, MACHINE), runs)] * 2
        return link(work, MACHINE, approaches if approached else None)

    together = linked()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("camtool.planning.link.VERTICES_AT_ONCE", at_once)
        in_lots = linked()
    one, other = together.finish(), in_lots.finish()
    for name in COLUMNS:
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True), name
    assert one.texts == other.texts
    assert np.array_equal(together.runs, in_lots.runs)
