"""Finishing passes: what the two stages leave and take, where the tool comes in, and in how many
passes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Step
from camtool.planning.job import Job, Operation, Stock, Tabs, Tool
from camtool.planning.plan import planned
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles.run_sweep import dense, swept

SLACK = 0.02
"""Places on runs are some hundredths apart, and buffers are polygons."""


def box(x: float, y: float, u: float, v: float) -> Polyline:
    return Polyline(np.array([[x, y, 0], [u, y, 0], [u, v, 0], [x, v, 0.0]]), True)


def turned(path: Polyline, angle: float, mirrored: bool) -> Polyline:
    cos, sin = math.cos(angle), math.sin(angle)
    points = path.vertices[:, :2] @ np.array([[cos, sin], [-sin, cos]])
    points[:, 0] *= -1.0 if mirrored else 1.0
    bulge = path.vertices[:, 2] * (-1.0 if mirrored else 1.0)
    return Polyline(np.column_stack([points, bulge]), closed=True)


def stages(machine: Machine, paths: list[Polyline], **settings: object) -> tuple[Step, Step]:
    settings.setdefault("tool", Tool(0.3))
    operation = Operation(**settings)  # type: ignore[arg-type]
    rough, finish = planned(drawing_of(paths), Job((operation,)), machine).steps
    return rough, finish


ELL = [[0, 0, 0], [4, 0, 0], [4, 1.5, 0.4], [2, 3, 0], [0, 3, 0.0]]


@given(
    kind=st.sampled_from(["profile inside", "profile outside", "pocket"]),
    finish=st.floats(0.01, 0.07),
    last=st.sampled_from([0.3, 0.29]),
    angle=st.floats(0.0, 6.0),
    mirrored=st.booleans(),
    direction=st.sampled_from(["drawn", "climb", "conventional"]),
)
def test_the_first_stage_leaves_so_much_and_the_second_takes_it(
    machine: Machine,
    kind: str,
    finish: float,
    last: float,
    angle: float,
    mirrored: bool,
    direction: str,
) -> None:
    path = turned(Polyline(np.array(ELL), closed=True), angle, mirrored)
    side = kind.partition(" ")[2]
    rough, done = stages(
        machine,
        [path],
        kind=kind.partition(" ")[0],
        finish_mm=finish,
        finish_tool=Tool(last),
        depth_mm=0.4,
        step_down_mm=0.1,
        direction=direction,
        **({"side": side} if side else {}),
    )
    points = dense(_as_run(path))[:, :2]
    shape = shapely.Polygon(points).buffer(0.0)
    rim = shape.exterior
    first, second = swept(rough.runs, 0.15, below=0.39), swept(done.runs, 0.5 * last, below=0.39)
    # Nothing beyond the wall, and all beside it.
    wrong_side = shape if side == "outside" else shapely.box(-99, -99, 99, 99).difference(shape)
    assert not first.intersects(wrong_side.buffer(finish - SLACK))
    assert not second.buffer(-SLACK).intersects(wrong_side)
    assert rim.distance(first) == pytest.approx(finish, abs=SLACK)
    assert rim.distance(second) < SLACK
    # The second stage cuts nothing but what was left, and comes in through what was cleared.
    new = second.difference(first.buffer(SLACK)).buffer(-0.5 * SLACK).buffer(0.5 * SLACK)
    assert new.difference(rim.buffer(2.0 * finish + SLACK)).is_empty
    for run in done.runs:
        start = shapely.Point(run.vertices[0, :2]).buffer(0.5 * last - SLACK)
        assert first.covers(start)
        assert run.vertices[:, 2].tolist() == [-0.4] * len(run.vertices)
    assert rough.setting.levels_mm == pytest.approx([-0.1, -0.2, -0.3, -0.4])


def _as_run(path: Polyline) -> object:
    from camtool.planning.items import CutRun

    rows = np.concatenate([path.vertices, path.vertices[:1]])
    vertices = np.column_stack([rows[:, :2], np.full(len(rows), -1.0), rows[:, 2]])
    return CutRun(vertices, np.ones(len(rows) - 1), 1.0, "path")


@pytest.mark.parametrize(("gap", "told"), [(2.3, False), (2.15, True), (1.9, True)])
def test_roughing_into_a_neighbour_is_told(machine: Machine, gap: float, told: bool) -> None:
    """The tool of 2 mm has room between the parts, but not while it leaves 0.2 mm on one."""
    parts = [box(0.0, 0.0, 10.0, 10.0), box(10.0 + gap, 0.0, 20.0 + gap, 10.0)]
    cut = Operation(side="outside", tool=Tool(2.0), finish_mm=0.2, depth_mm=1.0)
    steps = planned(drawing_of(parts), Job((cut,)), machine).steps
    found = [each for step in steps for each in step.findings if each.code is ProgramCode.GOUGE]
    assert bool(found) is told
    solid = shapely.union_all([shapely.Polygon(path.vertices[:, :2]) for path in parts])
    for step in steps:
        deep = shapely.intersection(swept(step.runs, 1.0), solid).area
        assert (deep > 1e-3) == any(each.code is ProgramCode.GOUGE for each in step.findings)


def test_a_bore_is_finished_along_its_wall(machine: Machine) -> None:
    circle = Polyline(np.array([[1, 2, 1.0], [3, 2, 1.0]]), closed=True)
    rough, done = stages(machine, [circle], kind="bore", finish_mm=0.05, depth_mm=0.5)
    (run,) = done.runs
    assert run.vertices[:, 2].tolist() == [-0.5] * len(run.vertices)
    away = np.hypot(*(dense(run)[:, :2] - [2, 2]).T)
    assert away.max() == pytest.approx(0.85)
    assert away.min() == pytest.approx(0.8, abs=0.002)  # the arc begins square to the wall
    assert max(np.hypot(*(dense(each)[:, :2] - [2, 2]).T).max() for each in rough.runs) == (
        pytest.approx(0.8)
    )
    assert (run.vertices[1:-2, 3] > 0.0).all()  # climb


def test_where_roughing_does_not_get_the_wall_is_cut_in_passes(machine: Machine) -> None:
    # A corridor with room for the tool, and none for what is left on both of its walls.
    path = Polyline(
        np.array(
            [[0, 0, 0], [2, 0, 0], [2, 0.9, 0], [4, 0.9, 0], [4, 1.23, 0], [2, 1.23, 0],
             [2, 2, 0], [0, 2, 0.0]]
        ),
        closed=True,
    )  # fmt: skip
    settings = {"kind": "pocket", "finish_mm": 0.05, "depth_mm": 0.5, "step_down_mm": 0.1}
    done = stages(machine, [path], **settings)[1]
    (finding,) = (each for each in done.findings if each.code == PlanningCode.FINISH_IN_PASSES)
    assert "in 5 passes" in finding.message
    assert finding.measured == pytest.approx(2.0, abs=0.4)
    heights = np.unique(done.runs.vertices[:, 2])
    assert heights == pytest.approx([-0.5, -0.4, -0.3, -0.2, -0.1])
    plain = stages(machine, [box(0, 0, 2, 2)], **settings)[1]
    assert not [each for each in plain.findings if each.code == PlanningCode.FINISH_IN_PASSES]


def test_a_part_that_lost_tabs_in_the_roughing_is_told(machine: Machine) -> None:
    """Two parts so near that the tool runs between them only when it finishes: it roughs round
    both in one contour, whose two tabs stand on one or the other."""
    tabs = Tabs(count=2, width_mm=0.3, height_mm=0.2)
    settings = {"finish_mm": 0.05, "depth_mm": 0.5, "step_down_mm": 0.1, "tabs": tabs}
    near = [box(0, 0, 3, 3), box(3.32, 0, 6, 3)]
    rough, done = stages(machine, near, **settings)
    lost = [each for each in done.findings if each.code == PlanningCode.TAB_LEFT_OUT]
    assert len(rough.bridges) == 2
    assert lost
    assert all("instead of 2: roughing makes them" in each.message for each in lost)
    apart = [box(0, 0, 3, 3), box(4, 0, 7, 3)]
    assert not stages(machine, apart, **settings)[1].findings


def test_tabs_of_the_first_stage_stay(machine: Machine) -> None:
    rough, done = stages(
        machine,
        [box(0, 0, 6, 4)],
        finish_mm=0.05,
        depth_mm=0.5,
        tabs=Tabs(count=2, width_mm=0.6, height_mm=0.2),
    )
    assert len(rough.bridges) == 2
    assert not done.findings
    low = swept(done.runs, 0.15, below=0.31)
    for bridge in rough.bridges:
        across = np.array([-bridge.ahead[1], bridge.ahead[0]])
        ends = [bridge.centre + s * (bridge.half_width_mm - SLACK) * bridge.ahead for s in (-1, 1)]
        wide = shapely.LineString(ends)
        for aside in (-0.2, 0.0, 0.2):
            assert not low.intersects(shapely.affinity.translate(wide, *(aside * across)))


def test_the_job_says_what_each_stage_does() -> None:
    operation = Operation(
        name="edge",
        tool=Tool(3.0),
        finish_mm=0.2,
        finish_feed_mm_min=50.0,
        finish_spindle_rpm=9000.0,
        feed_mm_min=100.0,
        spindle_rpm=6000.0,
        allowance_mm=0.1,
        breakthrough_mm=0.5,
        finish_tool=Tool(2.0),
    )
    job = Job((operation,), stock=Stock(3.0))
    rough, done = job.operations
    assert (rough.allowance_mm, rough.feed_mm_min, rough.tool) == (
        pytest.approx(0.3),
        100.0,
        Tool(3.0),
    )
    assert (done.allowance_mm, done.feed_mm_min, done.tool) == (0.1, 50.0, Tool(2.0))
    assert (rough.spindle_rpm, done.spindle_rpm) == (6000.0, 9000.0)
    assert (rough.name, done.name, rough.depth_mm, done.depth_mm) == (
        "edge",
        "edge finish",
        3.5,
        3.5,
    )
    assert Job(job.operations).operations == job.operations


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"finish_feed_mm_min": 3.0}, "has no effect without finish"),
        ({"finish_spindle_rpm": 3.0}, "has no effect without finish"),
        ({"finish_tool": Tool(1.0)}, "has no effect without finish"),
        ({"finish_mm": 0.3}, "more than a quarter of the tool of 1 mm"),
        ({"finish_mm": 0.1, "finish_tool": Tool(2.0)}, "does not fit where one of 1 mm cleared"),
        ({"finish_mm": 0.1, "side": "on"}, "leaves nothing on a wall"),
        ({"finish_mm": 0.0}, "not above 0"),
    ],
)
def test_what_no_finishing_pass_can_be(settings: dict[str, object], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        Job((Operation(tool=Tool(1.0), **settings),))  # type: ignore[arg-type]


def test_holes_without_tabs_are_told_with_a_finishing_pass_too(machine: Machine) -> None:
    """The piece of a window comes loose, whether its wall is finished or not."""
    paths = [box(0, 0, 22, 26), box(6, 6, 14, 18)]
    for finish_mm in (None, 0.15):
        operation = Operation(tool=Tool(3.0), depth_mm=6.0, finish_mm=finish_mm, tabs=Tabs(2))
        findings = planned(drawing_of(paths), Job((operation,)), machine).toolpath.findings
        codes = [finding.code for finding in findings]
        assert codes.count(PlanningCode.TAB_LEFT_OUT) == 1, finish_mm
