"""The whole way from drawing and job to toolpath."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Code, Severity
from camtool.geometry.drawing import Mark
from camtool.geometry.measure import path_lengths
from camtool.geometry.polylines import Polyline, reverse
from camtool.machine.model import Machine
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Lead, Operation, Tool, job_of
from camtool.planning.plan import plan, planned
from camtool.records import replace
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.drawings import drawing_of
from tests.strategies import contours, open_contours

SAFE, DEPTH = 0.2, 0.02  # the machine's own


def _circle(x: float, y: float, radius: float) -> Polyline:
    return Polyline(np.array([[x - radius, y, 1.0], [x + radius, y, 1.0]]), closed=True)


def _box(x0: float, y0: float, x1: float, y1: float) -> Polyline:
    return Polyline(np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0.0]]), True)


def _kinds(toolpath: Toolpath) -> list[str]:
    return [Kind(kind).name for kind in toolpath.kind.tolist()]


def _errors(toolpath: Toolpath) -> list[Code]:
    return [f.code for f in toolpath.findings if f.severity == Severity.ERROR]


def test_a_circle_is_up_across_down_round_up_home(machine: Machine) -> None:
    toolpath = plan(drawing_of([_circle(2, 1, 1)], ["CUT"]), job_of(), machine)
    rows = [(row.kind.name, row.end, row.feed, row.source) for row in toolpath]
    name = "CUT/PATH 0"
    assert rows == [
        ("RAPID", (0, 0, SAFE), None, ""),
        ("RAPID", (1, 1, SAFE), None, name),
        ("LINE", (1, 1, -DEPTH), 0.8, name),
        ("ARC_CCW", (1, 1, -DEPTH), 0.8, name),
        ("RAPID", (1, 1, SAFE), None, name),
        ("RAPID", (0, 0, SAFE), None, ""),
        ("END", (0, 0, SAFE), None, ""),
    ]
    assert toolpath.centre[3] == pytest.approx([2, 1], abs=1e-12)
    assert toolpath.findings == ()


def test_a_circle_drawn_clockwise_is_cut_clockwise(machine: Machine) -> None:
    toolpath = plan(drawing_of([reverse(_circle(2, 1, 1))]), job_of(), machine)
    assert _kinds(toolpath)[3] == "ARC_CW"


def test_the_job_is_heard(machine: Machine) -> None:
    job = job_of(
        feed_mm_min=1.0,
        plunge_feed_mm_min=0.4,
        safe_z_mm=0.5,
        depth_mm=0.1,
        spindle_rpm=2000.0,
        tool_diameter_mm=0.2,
        origin="centre",
    )
    toolpath = plan(drawing_of([_circle(20, 10, 1)]), job, machine)
    assert _kinds(toolpath) == [
        "RAPID",
        "SPINDLE_CW",
        "RAPID",
        "LINE",
        "ARC_CCW",
        "RAPID",
        "SPINDLE_OFF",
        "RAPID",
        "END",
    ]
    assert toolpath.value[1] == 2000.0
    assert toolpath.end[:, 2].tolist() == [0.5, 0.5, 0.5, -0.1, -0.1, 0.5, 0.5, 0.5, 0.5]
    assert toolpath.feed[3:5].tolist() == [0.4, 1.0]
    assert toolpath.end[4, :2] == pytest.approx([-1.1, 0.0])


def test_plunges_run_at_the_feed_of_the_cut_unless_told(machine: Machine) -> None:
    toolpath = plan(drawing_of([_circle(2, 1, 1)]), job_of(feed_mm_min=0.3), machine)
    assert toolpath.feed[toolpath.is_feed].tolist() == [0.3, 0.3]


@pytest.mark.parametrize("which", [0, 1])
def test_a_feed_above_the_highest_is_refused_with_one_that_works(
    machine: Machine, which: int
) -> None:
    made = drawing_of([_circle(2, 1, 1)])

    def job(feed: float) -> Job:
        return job_of(feed_mm_min=feed) if which == 0 else job_of(plunge_feed_mm_min=feed)

    with pytest.raises(OptionError, match=r"1\.394 mm/min") as caught:
        plan(made, job(1.4), machine)
    assert "1.3 or less" in caught.value.mend
    plan(made, job(machine.max_feed_mm_min), machine)
    plan(made, job(1.3), machine)


def test_a_part_beyond_the_travel_is_an_error_with_a_mend(machine: Machine) -> None:
    toolpath = plan(drawing_of([_circle(9, 6, 2)]), job_of(), machine)
    assert _errors(toolpath) == [ProgramCode.OUT_OF_TRAVEL, ProgramCode.OUT_OF_TRAVEL]
    first = toolpath.findings[0]
    assert (first.limit, first.unit) == (10.0, "mm")
    assert first.measured == pytest.approx(11.0)
    assert first.where.startswith("axis X")
    assert "--origin lower-left" in first.message
    assert (
        _errors(plan(drawing_of([_circle(9, 6, 2)]), job_of(origin="lower-left"), machine)) == []
    )


def test_part_zero_belongs_to_the_travel(machine: Machine) -> None:
    # 2 mm wide, but 12 mm from where the tool starts.
    assert _errors(plan(drawing_of([_circle(11, 1, 1)]), job_of(), machine)) == [
        ProgramCode.OUT_OF_TRAVEL
    ]


def test_a_part_as_large_as_the_travel_fits(machine: Machine) -> None:
    assert _errors(plan(drawing_of([_box(0, 0, 10, 7)]), job_of(), machine)) == []
    assert _errors(plan(drawing_of([_box(0, 0, 10, 7.001)]), job_of(), machine)) == [
        ProgramCode.OUT_OF_TRAVEL
    ]


def test_arcs_count_with_their_extremes(machine: Machine) -> None:
    # Its vertices lie within 10 mm, but the left of its half circle is at −3.5.
    bow = Polyline(np.array([[0.0, 0, -1], [0, 7, 0], [6.6, 7, 0]]))
    assert _errors(plan(drawing_of([bow]), job_of(), machine)) == [ProgramCode.OUT_OF_TRAVEL]


def test_when_no_contour_is_left_that_is_an_error(machine: Machine) -> None:
    job = job_of(tool_diameter_mm=3.0, side="inside")
    toolpath = plan(drawing_of([_circle(2, 1, 1)]), job, machine)
    codes = [finding.code for finding in toolpath.findings]
    assert codes == [PlanningCode.CONTOUR_TOO_SMALL, PlanningCode.NOTHING_DRAWN]
    assert _errors(toolpath) == [PlanningCode.NOTHING_DRAWN]


def test_an_empty_drawing_gives_no_cuts(machine: Machine) -> None:
    toolpath = plan(drawing_of([]), job_of(), machine)
    assert _kinds(toolpath) == ["RAPID", "RAPID", "END"]
    assert toolpath.findings == ()


def test_findings_of_the_contours_are_kept(machine: Machine) -> None:
    job = job_of(tool_diameter_mm=0.5)
    toolpath = plan(drawing_of([_circle(2, 2, 1), _circle(4.3, 2, 1)]), job, machine)
    assert PlanningCode.UNREACHED in [finding.code for finding in toolpath.findings]


@given(st.lists(st.one_of(contours(), open_contours()), min_size=1, max_size=4))
def test_every_contour_is_cut_once_at_depth_and_rapids_stay_up(
    machine: Machine, paths: list[Polyline]
) -> None:
    made = drawing_of(paths)
    toolpath = plan(made, job_of(), machine)
    starts, ends = toolpath.starts, toolpath.end
    level = starts[:, 2] == ends[:, 2]
    cutting = toolpath.is_feed & level
    assert (ends[cutting, 2] == -DEPTH).all()
    rapids = (toolpath.kind == Kind.RAPID) & level
    assert (ends[rapids, 2] == SAFE).all()
    # A move changes either the place or the height.
    assert (starts[~level, :2] == ends[~level, :2]).all()
    size = np.where(
        toolpath.is_arc,
        np.abs(toolpath.sweeps()) * np.hypot(*(starts[:, :2] - toolpath.centre).T),
        np.hypot(*(ends - starts)[:, :2].T),
    )
    for index, wanted in enumerate(path_lengths(made.paths)):
        mine = np.array([toolpath.text(row) == f"0/PATH {index}" for row in range(len(toolpath))])
        assert size[mine & cutting].sum() == pytest.approx(wanted, rel=1e-6)
    assert math.isclose(np.abs(ends[-1] - [0.0, 0.0, SAFE]).max(), 0.0)


def test_single_points_are_named_and_alone_they_are_nothing_to_cut(machine: Machine) -> None:
    point = Mark((1.0, 2.0), "DRILL", "", "POINT 1")
    circle = replace(drawing_of([_circle(2, 1, 1)], ["CUT"]), marks=(point,))
    assert [f.code for f in plan(circle, job_of(), machine).findings] == [
        PlanningCode.MARKS_NOT_CUT
    ]
    alone = replace(drawing_of([], []), marks=(point,))
    assert _errors(plan(alone, job_of(), machine)) == [PlanningCode.NOTHING_DRAWN]


def test_leads_keep_out_of_what_other_operations_leave(machine: Machine) -> None:
    near = Operation(layers=("B",), tool=Tool(0.2), side="outside")
    lead = Lead("arc", 0.3)
    round_it = Operation(
        layers=("A",), tool=Tool(0.2), side="outside", lead_in=lead, start=(1.5, 3.0)
    )
    made = drawing_of([_box(1, 1, 2, 3), _box(1, 3.3, 2, 4)], ["A", "B"])
    for operations, told in (((round_it,), False), ((round_it, near), True)):
        codes = [f.code for f in plan(made, Job(operations), machine).findings]
        assert (PlanningCode.LEAD_LEFT_OUT in codes) is told


def test_rapids_are_counted_through_all_operations(machine: Machine) -> None:
    made = drawing_of([_circle(3, 1, 1), _circle(6, 1, 1)], ["A", "B"])
    one = planned(made, Job((Operation(),)), machine)
    two = planned(made, Job((Operation(layers=("A",)), Operation(layers=("B",)))), machine)
    for made_plan in (one, two):
        toolpath = made_plan.toolpath
        flat = (toolpath.kind == Kind.RAPID) & (toolpath.starts[:, 2] == toolpath.end[:, 2])
        way = np.hypot(*(toolpath.end - toolpath.starts)[flat, :2].T).sum()
        assert way == pytest.approx(sum(s.rapid_mm for s in made_plan.steps))
