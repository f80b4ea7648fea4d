"""Which contours of an operation have tabs: parts have, holes and open paths beside them not."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.polylines import Polyline
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Tabs, job_of
from camtool.planning.plan import planned
from camtool.target.registry import load_target
from tests.drawings import drawing_of


def _box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline(np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]]), True)


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), True)


PLATE, WINDOW = _box(0, 0, 80, 60), _box(20, 20, 60, 40)
BORES = [_circle(x, 10, 2) for x in (10, 40, 70)]
OPEN = Polyline(np.array([[100, 0, 0], [140, 0, 0.0]]))
SMALL = _box(100, 20, 104, 24)


def _tabbed(job: Job, *paths: Polyline) -> tuple[dict[str, int], list[Finding]]:
    """Count the tabs of each contour, by the rises of its tool to their top."""
    plan = planned(drawing_of(paths), job, load_target("grbl").machine)
    top = -job.operations[0].depth_mm + job.operations[0].tabs.height_mm
    found: dict[str, int] = {}
    for step in plan.steps:
        for run in step.runs:
            z = run.vertices[:, 2]
            up = np.count_nonzero((z[1:] == top) & (z[:-1] < top - 1e-9))
            found[run.name] = found.get(run.name, 0) + int(up)
    return found, [
        each for each in plan.toolpath.findings if each.code == PlanningCode.TAB_LEFT_OUT
    ]


def _job(**more: object) -> Job:
    said = {"tool_diameter_mm": 3.175, "depth_mm": 3.0, "tabs": Tabs(count=4, width_mm=2.0)}
    return job_of(**said | more)


def test_holes_open_paths_and_short_contours_go_without() -> None:
    paths = (PLATE, WINDOW, *BORES, OPEN, SMALL)
    tabs, findings = _tabbed(_job(), *paths)
    assert tabs == {"0/PATH 0": 4} | {f"0/PATH {k}": 0 for k in (1, 2, 3, 4, 5)} | {"0/PATH 6": 4}
    (finding,) = findings
    assert finding.measured == 5.0
    assert "5 contours get no tabs: 4 holes, 1 open;" in finding.message
    wide = _job(tabs=Tabs(count=4, width_mm=8.0))
    tabs, (finding,) = _tabbed(wide, *paths)
    assert tabs["0/PATH 0"] == 4
    assert tabs["0/PATH 6"] == 0
    assert "4 holes, 1 open, 1 too short" in finding.message


@pytest.mark.parametrize("job", [_job(side="inside"), _job(tabs=Tabs(spacing_mm=40.0))])
def test_windows_cut_on_their_own_have_the_tabs_that_are_asked_for(job: Job) -> None:
    tabs, findings = _tabbed(job, WINDOW)
    assert tabs["0/PATH 0"] >= 3
    assert findings == []


def test_open_paths_on_their_own_have_tabs() -> None:
    tabs, findings = _tabbed(_job(), OPEN)
    assert tabs == {"0/PATH 0": 4}
    assert findings == []


def test_tabs_that_no_contour_carries_are_an_error() -> None:
    with pytest.raises(OptionError, match="longer than the contour"):
        _tabbed(_job(), _box(0, 0, 1, 1), _circle(9, 9, 1))


def _places(job: Job, *paths: Polyline) -> list[tuple[str, float, float]]:
    plan = planned(drawing_of(paths), job, load_target("grbl").machine)
    found = [bridge for step in plan.steps for bridge in step.bridges]
    return sorted((each.name, *each.centre.round(6).tolist()) for each in found)


def test_tabs_by_hand_stand_next_to_their_places() -> None:
    tabs = Tabs(at_mm=((40.0, 3.0), (80.0, 30.0), (100.0, 22.0), (20.0, 30.5)), width_mm=2.0)
    found = _places(_job(tabs=tabs), PLATE, WINDOW, SMALL)
    half = 1.5875
    assert found == [
        ("0/PATH 0", 40.0, -half),
        ("0/PATH 0", 80.0 + half, 30.0),
        ("0/PATH 1", 20.0 + half, 30.5),
        ("0/PATH 2", 100.0 - half, 22.0),
    ]


def test_a_tab_by_hand_at_a_corner_moves_to_where_it_fits() -> None:
    tabs = Tabs(at_mm=((0.0, 0.5),), width_mm=2.0)
    ((_, x, y),) = _places(_job(tabs=tabs), PLATE)
    # The bridge and the slot beside it end where the corner begins, or a bit farther.
    assert x == pytest.approx(-1.5875)
    assert 1.0 + 1.5875 <= y < 4.5


def test_a_tab_by_hand_that_is_near_to_nothing_is_an_error() -> None:
    tabs = Tabs(at_mm=((40.0, 0.0), (40.0, -9.0)))
    with pytest.raises(OptionError, match=r"the tab at X 40 Y -9 is 7\.412 mm from the nearest"):
        _places(_job(tabs=tabs), PLATE)


@pytest.mark.parametrize("side", ["outside", "inside"])
@pytest.mark.parametrize("ramped", [False, True])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7])
@pytest.mark.parametrize("angle", [0.0, 0.7])
@pytest.mark.parametrize("mirrored", [False, True])
def test_no_tab_of_a_polygon_lies_across_a_corner(
    side: str, ramped: bool, count: int, angle: float, mirrored: bool
) -> None:
    corners = np.array([[0, 0], [50, 0], [50, 8], [70, 8], [70, 40], [30, 55], [0, 40.0]])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = corners @ turn * [-1.0 if mirrored else 1.0, 1.0]
    path = Polyline(np.column_stack([corners, np.zeros(len(corners))]), True)
    tabs = Tabs(count=count, width_mm=3.0, height_mm=1.0, ramped=ramped)
    job = _job(tabs=tabs, side=side)
    plan = planned(drawing_of([path]), job, load_target("grbl").machine)
    bridges = [bridge for step in plan.steps for bridge in step.bridges]
    assert len(bridges) == count
    assert not [each for each in plan.toolpath.findings if each.code == PlanningCode.TAB_LEFT_OUT]
    reach = 1.5 + 1.5875 + (1.0 if ramped else 0.0)
    for bridge in bridges:
        # Seen along its wall, no corner is as near as the tab and its slopes are long.
        ends = np.roll(corners, -1, axis=0) - corners
        for corner, side_of in zip(corners, ends, strict=True):
            along = side_of / np.hypot(*side_of)
            if abs(along @ bridge.ahead) < 1.0 - 1e-9:
                continue
            across = (bridge.centre - corner) @ np.array([-along[1], along[0]])
            if abs(abs(across) - 1.5875) > 1e-6:
                continue
            at, size = (bridge.centre - corner) @ along, np.hypot(*side_of)
            assert reach - 1e-6 <= at <= size - reach + 1e-6
