"""Which contours of an operation have tabs: parts have, holes and open paths beside them not."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.findings import Code, Finding
from camtool.geometry.polylines import Polyline
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
    """How many tabs each contour has: how often its tool comes up to their top."""
    plan = planned(drawing_of(paths), job, load_target("grbl").machine)
    top = -job.operations[0].depth_mm + job.operations[0].tabs.height_mm
    found: dict[str, int] = {}
    for step in plan.steps:
        for run in step.runs:
            z = run.vertices[:, 2]
            up = np.count_nonzero((z[1:] == top) & (z[:-1] < top - 1e-9))
            found[run.name] = found.get(run.name, 0) + int(up)
    return found, [each for each in plan.toolpath.findings if each.code == Code.TAB_LEFT_OUT]


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
