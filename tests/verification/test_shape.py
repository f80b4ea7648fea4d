"""The machined shape against the wanted one: rings and strips, by formula."""

import math

import numpy as np
import pytest
import shapely

from camtool.findings import Severity
from camtool.geometry.offset import swept_outline
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.drawn import kept_of
from camtool.planning.job import Tool, job_of
from camtool.planning.plan import planned
from camtool.simulation.motion import ALL
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.wanted import ProtectedRegion
from camtool.verification.cuts import CutMoves, cut_moves
from camtool.verification.findings import VerificationCode
from camtool.verification.shape import (
    MAX_CROSSINGS,
    MAX_MOVES,
    CommandedMotion,
    Cutter,
    MachinedShape,
    cutter_of,
    machined_shape,
    points_wanted,
    wanted_shape,
)
from camtool.verification.slides import SlideTrace
from camtool.verification.verify import Verification, VerifyOptions
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.oracles.path_machine import path_machine
from tests.oracles.stock_jobs import moved, rectangle
from tests.targets import verify


def shape_of(made: SlideTrace, cuts: CutMoves, diameter_mm: float) -> MachinedShape | None:
    wanted = wanted_shape(cuts, Cutter(diameter_mm))
    motion = CommandedMotion(cuts.toolpath, path_machine(), ALL)
    return None if wanted is None else machined_shape(made, motion, wanted)


def circle(radius: float) -> CutMoves:
    b = ToolpathBuilder((radius, 0.0, -1.0))
    b.arc(radius, 0.0, centre=(0.0, 0.0), ccw=True, feed=1.0)
    return cut_moves(b.finish(), flat_cuts=False)


def strip(length: float) -> CutMoves:
    b = ToolpathBuilder((0.0, 0.0, -1.0)).line(length, 0.0, feed=1.0)
    return cut_moves(b.finish(), flat_cuts=False)


def trace(points: np.ndarray) -> SlideTrace:
    count = len(points)
    cutting = np.arange(count) > 0
    return SlideTrace(points, np.zeros(count), np.zeros(count, dtype=np.int64), cutting)


def round_about(radius: float, count: int = 4000) -> SlideTrace:
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    return trace(radius * np.column_stack([np.cos(angle), np.sin(angle)]))


@pytest.mark.parametrize("more", [0.02, -0.03])
def test_a_ring_too_large_or_too_small(more: float) -> None:
    radius, tool = 2.0, 0.5
    shape = shape_of(round_about(radius + more), circle(radius), 2.0 * tool)
    assert shape is not None
    outer = math.pi * abs((radius + more + tool) ** 2 - (radius + tool) ** 2)
    inner = math.pi * abs((radius + more - tool) ** 2 - (radius - tool) ** 2)
    over, under = (outer, inner) if more > 0 else (inner, outer)
    assert shape.overcut_mm2 == pytest.approx(over, rel=0.02)
    assert shape.undercut_mm2 == pytest.approx(under, rel=0.02)
    assert shape.overcut_mm == pytest.approx(abs(more), abs=2.0 * shape.tolerance_mm)
    assert shape.undercut_mm == pytest.approx(abs(more), abs=2.0 * shape.tolerance_mm)


def test_passes_that_differ_by_rounding_cover_what_one_of_them_does() -> None:
    angles = [(np.arange(401) + 0.5 * k) * 2.0 * math.pi / 400 for k in range(3)]
    passes = [
        (5.02 + 1e-7 * k) * np.column_stack([np.cos(angle), np.sin(angle)])
        for k, angle in enumerate(angles)
    ]
    joint = [np.column_stack([each, np.zeros(401)]) for each in passes]
    # The outline of all three is not found at once ...
    assert swept_outline(Polylines.of(Polyline(each, closed=False) for each in joint), 0.5) is None
    points = np.concatenate(passes)
    cutting = np.arange(len(points)) % 401 > 0
    row = np.repeat(np.arange(3), 401)
    made = SlideTrace(points, np.zeros(len(points)), row, cutting)
    shape, alone = shape_of(made, circle(5.0), 1.0), shape_of(trace(passes[0]), circle(5.0), 1.0)
    # ... but that of each is, and all of them cover one ring.
    assert shape is not None
    assert alone is not None
    assert shape.overcut_mm2 == pytest.approx(2.0 * math.pi * 5.51 * 0.02, rel=0.02)
    assert shape.overcut_mm2 == pytest.approx(alone.overcut_mm2, rel=0.01)
    assert shape.undercut_mm == pytest.approx(0.02, abs=2.0 * shape.tolerance_mm)


def test_a_cut_that_ends_early_leaves_its_end() -> None:
    shape = shape_of(trace(np.array([[0.0, 0.0], [4.9, 0.0]])), strip(5.0), 1.0)
    assert shape is not None
    assert shape.overcut_mm2 == 0.0
    assert shape.overcut_mm == 0.0
    assert shape.undercut_mm2 == pytest.approx(0.1 * 1.0, rel=0.01)
    assert shape.undercut_mm == pytest.approx(0.1, abs=2.0 * shape.tolerance_mm)


def test_the_wanted_shape_itself_is_neither_over_nor_under() -> None:
    shape = shape_of(round_about(3.0, 20_000), circle(3.0), 0.3)
    assert shape is not None
    assert (shape.overcut_mm2, shape.overcut_mm) == (0.0, 0.0)
    assert (shape.undercut_mm2, shape.undercut_mm) == (0.0, 0.0)


def test_a_small_step_back_at_a_corner_widens_nothing() -> None:
    # As a reversal leaves it; a buffer of the whole line would cover 0.1 mm² more.
    places = np.array([[0.0, 10.0], [0.0, 0.0], [0.0, 0.02], [10.0, 0.02]])
    b = ToolpathBuilder((*places[0].tolist(), -1.0))
    for x, y in places[1:].tolist():
        b.line(x, y, feed=1.0)
    shape = shape_of(trace(places), cut_moves(b.finish(), flat_cuts=False), 6.0)
    assert shape is not None
    assert (shape.overcut_mm2, shape.overcut_mm) == (0.0, 0.0)
    assert (shape.undercut_mm2, shape.undercut_mm) == (0.0, 0.0)


def test_moves_in_the_air_cut_nothing() -> None:
    path = trace(np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 9.0], [0.0, 9.0]]))
    path.cutting[2] = False
    shape = shape_of(path, strip(5.0), 1.0)
    assert shape is not None
    # The line at y = 9 is cut too; the way there is not.
    assert shape.overcut_mm2 == pytest.approx(5.0 + math.pi / 4.0, rel=0.01)
    assert shape.overcut_mm == pytest.approx(9.0, abs=2.0 * shape.tolerance_mm)


def test_nothing_cut_is_no_shape() -> None:
    still = trace(np.array([[0.0, 0.0]]))
    assert shape_of(still, strip(5.0), 1.0) is None
    nothing = cut_moves(ToolpathBuilder().finish(), flat_cuts=False)
    assert shape_of(round_about(1.0), nothing, 1.0) is None


def test_a_trace_needs_points_for_its_smallest_arcs_and_its_ends() -> None:
    few = points_wanted(circle(5.0), Cutter(1.0))
    many = points_wanted(circle(0.05), Cutter(1.0))
    assert few is not None
    assert many is not None
    # √(8 r tolerance): ten times finer chords on a way that is a hundred times shorter.
    assert few / many == pytest.approx(10.0, rel=0.05)
    assert points_wanted(strip(5.0), Cutter(1.0)) == 2
    assert points_wanted(strip(5.0), None) is None


def test_what_is_too_much_work_has_no_shape() -> None:
    b = ToolpathBuilder((0.0, 0.0, -1.0))
    for number in range(MAX_MOVES + 2):
        b.line(float(number % 7), float(number), feed=1.0)
    long = cut_moves(b.finish(), flat_cuts=False)
    assert points_wanted(long, Cutter(1.0)) is None
    assert points_wanted(circle(5000.0), Cutter(0.001)) is None


@pytest.mark.parametrize(("count", "has_shape"), [(200, True), (300, False)])
def test_lines_that_cross_each_other_too_often_have_no_shape(count: int, has_shape: bool) -> None:
    b = ToolpathBuilder((0.0, 0.0, -1.0))
    for number in range(count):  # each of the lines across meets all of those up
        b.rapid(-1.0, number + 0.5).line(count + 1.0, number + 0.5, feed=1.0)
        b.rapid(number + 0.5, -1.0).line(number + 0.5, count + 1.0, feed=1.0)
    cuts = cut_moves(b.finish(), flat_cuts=False)
    assert count**2 > MAX_CROSSINGS or has_shape
    assert (points_wanted(cuts, Cutter(0.1)) is not None) == has_shape


def test_the_shape_of_a_long_way_of_small_arcs_is_true() -> None:
    b = ToolpathBuilder().rapid(z=1.0).rapid(0.0, 0.0).line(z=-1.0, feed=60.0)
    for number in range(100):
        x = 0.2 * (number + 1)
        b.arc(x, 0.0, centre=(x - 0.1, 0.0), ccw=number % 2 == 0, feed=60.0)
    path = b.rapid(z=1.0).finish()
    machine = path_machine("axes.x.coded_step_mm=0.0005", "axes.y.coded_step_mm=0.0005")
    options = VerifyOptions(tool_diameter_mm=0.05, trace_points=50)
    found = verify(path, machine, wanted=path, options=options).report.shape
    assert found is not None
    assert max(found.overcut_um, found.undercut_um) < 1.0


CONE = Tool(kind="v", tip_angle_rad=0.5 * math.pi)
V_BIT = Cutter(6.0, CONE)
ROUNDED = rectangle(17.56, 16.53, 1.0)


def carved(*places: tuple[float, float, float]) -> Toolpath:
    b = ToolpathBuilder().rapid(z=5.0).rapid(*places[0][:2]).line(z=places[0][2], feed=60.0)
    for x, y, z in places[1:]:
        b.line(x, y, z, feed=60.0)
    return b.rapid(z=5.0).finish()


def kept_of_run(path: Toolpath, *walls: Polyline, stays: bool = False) -> ProtectedRegion:
    """Make a run of these moves, with walls outside or inside of which material must stay."""
    feeds = path.is_feed
    ends = np.concatenate([path.starts[feeds][:1], path.end[feeds]])
    run = np.column_stack([ends, np.zeros(len(ends))])
    return ProtectedRegion((run,), Polylines.of(walls), np.full(len(walls), stays), not stays)


def verified(path: Toolpath, kept: ProtectedRegion, nose: Tool | None) -> Verification:
    options = VerifyOptions(tool_diameter_mm=6.0, nose=nose, kept=(kept,))
    return verify(path, path_machine(), wanted=path, options=options)


def test_a_v_bit_is_as_wide_as_it_is_deep() -> None:
    wanted = cut_moves(carved((0, 0, -1), (10, 0, -1), (20, 0, -2)), flat_cuts=False)
    region = wanted_shape(wanted, V_BIT)
    assert region is not None
    # A strip with a half disc of 1 mm at one end, widening to a disc of 2 mm at the other.
    assert shapely.bounds(region.region) == pytest.approx([-1, -2, 22, 2], abs=1e-3)
    assert shapely.contains_xy(region.region, 5.0, 0.99)
    assert not shapely.contains_xy(region.region, 5.0, 1.01)
    deeper = carved((0, 0, -1.1), (10, 0, -1.1), (20, 0, -2.1))
    points = deeper.end[deeper.is_feed][:, :2]
    made = SlideTrace(
        points, np.zeros(3), np.flatnonzero(deeper.is_feed), np.array([False, True, True])
    )
    shape = machined_shape(made, CommandedMotion(deeper, path_machine(), ALL), region)
    assert shape is not None
    assert shape.overcut_mm == pytest.approx(0.1, abs=2.0 * shape.tolerance_mm)
    assert shape.undercut_mm == 0.0


def test_the_height_of_a_v_bit_goes_on_while_its_slide_waits_in_the_backlash() -> None:
    # On the way back the slide is 0.5 mm behind, on which the bit sinks by 0.05 mm: so much wider
    # is the cut everywhere, and it ends 0.5 mm before the wanted one.
    path = carved((0, 0, -1), (10, 0, -1), (0, 0, -2))
    machine = path_machine("axes.x.backlash_mm=0.5")
    options = VerifyOptions(tool_diameter_mm=6.0, nose=CONE)
    shape = verify(path, machine, wanted=path, options=options).report.shape
    assert shape is not None
    assert shape.overcut_um == pytest.approx(50.0 * math.cos(math.atan(0.1)), abs=1.5)
    assert shape.undercut_um == pytest.approx(500.0, abs=1.5)


def test_a_cut_that_comes_up_to_the_surface_ends_as_wide_as_the_flat_tip() -> None:
    bit = Tool(6.0, "v", 2.0 * math.atan(1.0), tip_diameter_mm=0.4)
    cuts = cut_moves(carved((0, 0, -1), (10, 0, 0)), flat_cuts=False)
    wanted = wanted_shape(cuts, Cutter(6.0, bit))
    assert wanted is not None
    assert shapely.bounds(wanted.region) == pytest.approx([-1.2, -1.2, 10.2, 1.2], abs=1e-3)


def test_a_bit_of_unknown_width_is_as_wide_as_it_must_be() -> None:
    cuts = cut_moves(carved((0, 0, -1), (10, 0, -3)), flat_cuts=False)
    bit = Tool(kind="v", tip_angle_rad=2.0 * math.atan(0.5), tip_diameter_mm=0.4)
    cutter = cutter_of(VerifyOptions(nose=bit), cuts)
    assert cutter is not None
    assert cutter.nose is bit
    assert cutter.diameter_mm == pytest.approx(3.4)
    assert cutter_of(VerifyOptions(), cuts) is None


def test_a_plan_that_cuts_beyond_the_wall_is_no_less_wrong_for_being_followed() -> None:
    # From the middle of a fillet to a place 1 mm from the wall, 2 mm deep.
    gouging = carved((16.56, 15.53, -1.0), (16.56, 8.7, -2.0))
    found = verified(gouging, kept_of_run(gouging, closed(*ROUNDED)), CONE)
    assert found.report.shape is not None
    assert found.report.shape.overcut_um == pytest.approx(1000.0, abs=5.0)
    (error,) = (each for each in found.findings if each.code is VerificationCode.OVERCUT)
    assert error.severity is Severity.ERROR
    assert error.measured == pytest.approx(1.0, abs=5e-3)
    assert "(18.560, 8.700)" in error.where
    good = carved((16.56, 15.53, -1.0), (15.56, 14.53, -2.0), (15.56, 2.0, -2.0))
    found = verified(good, kept_of_run(good, closed(*ROUNDED)), CONE)
    assert found.report.shape is not None
    assert found.report.shape.overcut_um < 20.0
    assert VerificationCode.OVERCUT not in {each.code for each in found.findings}


@pytest.mark.parametrize(("y", "into"), [(-3.0, 0.0), (-2.95, 0.05)])
def test_an_end_mill_beside_a_part(y: float, into: float) -> None:
    path = carved((0.0, y, -1.0), (17.0, y, -1.0))
    found = verified(path, kept_of_run(path, closed(*ROUNDED), stays=True), None)
    over = [each for each in found.findings if each.code is VerificationCode.OVERCUT]
    assert len(over) == (1 if into else 0)
    assert found.report.shape is not None
    assert found.report.shape.overcut_um == pytest.approx(1000.0 * into, abs=3.0)


def test_what_a_window_and_a_rim_must_leave() -> None:
    rim, window = closed(*rectangle(60.0, 40.0)), closed(*moved(rectangle(30.0, 20.0), 15.0, 10.0))
    job = job_of(tool_diameter_mm=3.0, side="auto", depth_mm=1.0)
    plan = planned(drawing_of([rim, window]), job, load_target("linuxcnc").machine)
    beside_rim, beside_window, free = kept_of(plan.steps)
    assert (len(beside_rim.runs), len(beside_window.runs), len(free.runs)) == (1, 1, 0)
    assert not beside_rim.beyond
    assert beside_window.beyond
    for each in (beside_rim, beside_window):
        assert each.stays.tolist() == [True, False]
        found = wanted_shape(cut_moves(plan.toolpath, flat_cuts=False), Cutter(3.0), (each,))
        assert found is not None
        assert found.beyond_mm == 0.0
    # The other way round each would cut into what stays.
    wrong = ProtectedRegion(beside_window.runs, beside_window.lines, ~beside_window.stays, False)
    found = wanted_shape(cut_moves(plan.toolpath, flat_cuts=False), Cutter(3.0), (wrong,))
    assert found is None or found.beyond_mm > 1.0


@pytest.mark.parametrize("side", ["auto", "outside", "inside"])
def test_open_lines_and_named_sides_are_cut_where_they_are_asked_for(side: str) -> None:
    rim, window = closed(*rectangle(60.0, 40.0)), closed(*moved(rectangle(30.0, 20.0), 15.0, 10.0))
    line = Polyline(np.array([[-5.0, 5.0, 0.0], [65.0, 5.0, 0.0]]), closed=False)
    job = job_of(tool_diameter_mm=3.0, side=side, depth_mm=1.0)
    plan = planned(drawing_of([rim, window, line]), job, load_target("linuxcnc").machine)
    kept = kept_of(plan.steps)
    assert sum(len(each.runs) for each in kept) == 3
    found = wanted_shape(cut_moves(plan.toolpath, flat_cuts=False), Cutter(3.0), kept)
    assert found is not None
    assert found.beyond_mm == 0.0
