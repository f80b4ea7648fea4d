"""Chamfers: the bevel that the cone of a V bit leaves, against the surface cut by brute force."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Operation, Placement, Stock, Tool
from camtool.planning.plan import Plan, planned
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles.run_sweep import dense
from tests.planning.test_drill import circle
from tests.strategies import examples

BIT = Tool(6.0, "v", tip_angle_rad=math.radians(90.0))


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_target("linuxcnc").machine


def chamfer_of(width: float, **said: object) -> Operation:
    said.setdefault("tool", BIT)
    return Operation(kind="chamfer", chamfer_mm=width, **said)  # type: ignore[arg-type]


def polygon(*places: tuple[float, float]) -> Polyline:
    return Polyline(np.array([(x, y, 0.0) for x, y in places]), closed=True)


def surface(plan: Plan, points: Floats) -> Floats:
    """(P,) the height of the stock at places (P, 2) after the cut: of all cones along the path
    the lowest flank."""
    tool = plan.job.operations[0].tool
    assert tool.tip_angle_rad is not None
    slope = math.tan(0.5 * tool.tip_angle_rad)
    low = np.zeros(len(points))
    for step in plan.steps:
        for run in step.runs:
            tips = dense(run, 400)
            for begin in range(0, len(tips), 500):
                x, y, z = tips[begin : begin + 500, :, None].transpose(1, 0, 2)
                away = np.hypot(points[:, 0] - x, points[:, 1] - y)
                flank = z + np.maximum(away - 0.5 * tool.tip_diameter_mm, 0.0) / slope
                low = np.minimum(low, flank.min(axis=0))
    return low


@examples(25)
@given(
    width=st.floats(0.1, 1.2),
    offset=st.floats(0.02, 0.6),
    angle=st.floats(40.0, 120.0),
    tip=st.sampled_from([0.0, 0.2]),
    turn=st.floats(0.0, 6.0),
    backwards=st.booleans(),
    step_down=st.none() | st.floats(0.1, 1.0),
    seed=st.integers(0, 2**16),
)
def test_the_bevel_is_as_wide_as_wanted_and_ends_at_the_drawn_line(
    machine: Machine,
    width: float,
    offset: float,
    angle: float,
    tip: float,
    turn: float,
    backwards: bool,
    step_down: float | None,
    seed: int,
) -> None:
    tool = Tool(20.0, "v", math.radians(angle), tip)
    plate = polygon((0, 0), (20, 0), (24, 9), (12, 14), (0, 11))
    paths = [plate, circle(8, 6, 5.0)]
    if backwards:
        paths = [Polyline(path.vertices[::-1] * [1, 1, 0], True) for path in paths[:1]]
        paths.append(circle(8, 6, 5.0, turn=-1.0))
    operation = chamfer_of(width, tool=tool, tip_offset_mm=offset, step_down_mm=step_down)
    job = Job((operation,), Placement(rotate_rad=turn))
    plan = planned(drawing_of(paths), job, machine)
    assert [
        finding for finding in plan.toolpath.findings if finding.code != PlanningCode.CUT_DOUBTFUL
    ] == []
    part = shapely.Polygon(plate.vertices[:, :2]).difference(
        shapely.Point(8, 6).buffer(2.5, quad_segs=512)
    )
    part = shapely.affinity.rotate(part, turn, origin=(0, 0), use_radians=True)
    random = np.random.default_rng(seed)
    low, high = np.array(part.bounds).reshape(2, 2)
    points = low + random.uniform(size=(300, 2)) * (high - low)
    points = points[shapely.contains_xy(part, *points.T)]
    inside = shapely.distance(part.boundary, shapely.points(points))
    far = inside > 0.05  # where the distance of two dense places counts little
    points, inside = points[far], inside[far]
    slope = math.tan(math.radians(0.5 * angle))
    wanted = np.minimum(0.0, (inside - width) / slope)
    # Dense places along arcs and edges, and the chords of the hole, leave some micrometres.
    assert surface(plan, points) == pytest.approx(wanted, abs=0.02 / slope)


def test_passes_run_along_one_line_and_the_last_is_as_deep_as_the_width_makes_it(
    machine: Machine,
) -> None:
    job = Job((chamfer_of(1.0, step_down_mm=0.4, tip_offset_mm=0.1),))
    plan = planned(drawing_of([circle(0, 0, 10.0)]), job, machine)
    (step,) = plan.steps
    (run,) = step.runs
    heights = run.vertices[:, 2]
    assert sorted(set(np.round(heights, 9))) == pytest.approx([-1.1, -1.1 * 2 / 3, -1.1 / 3])
    away = np.hypot(run.vertices[:, 0], run.vertices[:, 1])
    assert away == pytest.approx(5.1, abs=1e-6)


def test_no_edge_of_another_contour_is_broken(machine: Machine) -> None:
    """Between the wall of a slot that is profiled and the chamfered part, 0.8 mm apart, the bit of
    the bevel is 1.1 mm wide on its side."""
    near = [
        polygon((0, 0), (10, 0), (10, 10), (0, 10)),
        polygon((10.8, 0), (20, 0), (20, 10), (10.8, 10)),
    ]
    drawing = drawing_of(near, layers=("part", "other"))
    other = Operation(name="other", layers=("other",), tool=Tool(0.2))

    def gouges(width: float) -> list[float]:
        job = Job((chamfer_of(width, layers=("part",), name="edge"), other))
        found = planned(drawing, job, machine).toolpath.findings
        return [float(each.measured or 0.0) for each in found if each.code == ProgramCode.GOUGE]

    assert gouges(0.5) == []
    assert gouges(1.0) == pytest.approx([0.7])


def test_open_paths_are_left_out_and_said(machine: Machine) -> None:
    line = Polyline(np.array([[30.0, 0, 0], [40, 0, 0]]))
    job = Job((chamfer_of(0.5),))
    toolpath = planned(drawing_of([circle(0, 0, 10), line]), job, machine).toolpath
    (said,) = [each for each in toolpath.findings if each.code == PlanningCode.NOT_CHAMFERED]
    assert said.measured == 1
    assert toolpath.end[toolpath.is_feed, 0].max() < 6.0
    nothing = planned(drawing_of([line]), job, machine).toolpath
    assert PlanningCode.NOTHING_DRAWN in {finding.code for finding in nothing.findings}


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"chamfer_mm": None}, "has no width"),
        ({"tool": Tool(6.0)}, "needs a V bit"),
        ({"tool": Tool(6.0, "v")}, "needs a V bit, and its angle"),
        ({"chamfer_mm": 2.95}, "needs a bit of 6.1 mm"),
        ({"depth_mm": 0.5}, "a depth of 0.5 mm is given too"),
        ({"tip_offset_mm": 0.0}, "is not above 0"),
        ({"chamfer_mm": -1.0}, "is not above 0"),
    ],
)
def test_what_no_chamfer_can_be_is_refused(said: dict[str, object], message: str) -> None:
    with pytest.raises(OptionError, match=re.escape(message)):
        Job((replace(chamfer_of(0.5), **said),))  # type: ignore[arg-type]


def test_the_program_of_each_g_code_machine_is_verified() -> None:
    drawing = drawing_of([polygon((0, 0), (30, 0), (30, 20), (0, 20)), circle(10, 10, 6.0)])
    job = Job((chamfer_of(0.5, spindle_rpm=9000.0, plunge_feed_mm_min=50.0),), stock=Stock(3.0))
    for name in ("grbl", "linuxcnc"):
        run = post_drawing(drawing, job, load_target(name))
        assert [finding for finding in run.findings if finding.severity.name == "ERROR"] == []
        assert b"Z-0.6" in run.program.data
