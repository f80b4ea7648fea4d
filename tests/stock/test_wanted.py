"""The wanted solid against shapely's regions, slow cutting of needles, and dense points."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.geometry.polylines import Polyline
from camtool.planning.job import Job, Lead, Operation, Stock, Tabs, Tool
from camtool.planning.plan import Plan, planned
from camtool.records import replace
from camtool.stock.wanted import DEFAULT_WALL_MM, WantedSolid, wanted_solid
from camtool.target.registry import load_target
from tests.drawings import drawing_of
from tests.oracles.contours import closed, opened
from tests.oracles.stock import Cutter, moves_of
from tests.oracles.stock import Stock as Needles
from tests.oracles.stock_jobs import circle, random_job, rectangle
from tests.planning.test_stock import operation_of
from tests.strategies import examples

SEEDS = (1, 6, 7, 9, 11, 13, 21, 27, 30, 34, 40, 52)
"""Random jobs of each kind whose plan has no finding."""

ALIKE_MM = 2e-3
"""Programs have numbers of four decimals, and the stock is measured at needles."""

MILL = Tool(4.0)
V_BIT = Tool(6.0, "v", math.radians(60.0))
SQUARE = closed((0, 0), (20, 0), (20, 20), (0, 20))


def plan_of(paths: list[Polyline], *operations: Operation, stock: Stock | None = None) -> Plan:
    target = load_target("linuxcnc")
    return planned(drawing_of(paths), Job(operations, stock=stock), target.machine)


def solid_of(paths: list[Polyline], *operations: Operation) -> WantedSolid:
    return wanted_solid(plan_of(paths, *operations).steps)


def band(solid: WantedSolid, x: float, y: float) -> list[float]:
    found: list[float] = solid.bands(np.array([[x, y]]))[0].tolist()
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_random_jobs_leave_the_solid_that_they_should(seed: int) -> None:
    asked = random_job(np.random.default_rng(seed))
    target = load_target("linuxcnc")
    plan = plan_of([closed(*path) for path in asked.paths], operation_of(asked))
    data = target.target.write(plan.toolpath, target.machine).data.decode()
    stock = Needles((-12.0, -12.0), (60.0, 60.0), 0.2)
    for move in moves_of(data):
        stock.cut(move, asked.cutter)
    height, (low, high) = stock.height.ravel(), wanted_solid(plan.steps).bands(stock.points).T
    assert (low - height).max() <= ALIKE_MM
    assert (height - high).max() <= ALIKE_MM
    # It asks for nearly all that is cut but for what a bit leaves between its walls.
    cut = height < -ALIKE_MM
    assert np.isfinite(high[cut]).mean() > (0.4 if asked.kind == "vcarve" else 0.85)
    # Cut a tenth deeper it would be too deep everywhere, but for where tabs are.
    if asked.tabs is None:
        assert (low - height + 0.1)[cut & np.isfinite(high)].min() > 0.0


def region(kind: str) -> tuple[WantedSolid, shapely.Geometry, shapely.Geometry]:
    """A solid, and the regions that may and must be cut 2 mm deep."""
    hole = shapely.Polygon([(6, 6), (14, 6), (14, 14), (6, 14)])
    part = shapely.Polygon([(0, 0), (20, 0), (20, 20), (0, 20)]) - hole
    paths = [SQUARE, closed((6, 6), (14, 6), (14, 14), (6, 14))]
    fine = 64
    if kind == "pocket":
        solid = solid_of(paths, Operation(kind="pocket", tool=MILL, depth_mm=2.0))
        return solid, part, part.buffer(-2.0, quad_segs=fine).buffer(2.0, quad_segs=fine)
    lead = Lead("line", 3.0)
    operation = Operation(tool=MILL, depth_mm=2.0, allowance_mm=0.5, lead_in=lead)
    solid = solid_of(paths, operation)
    centre = part.buffer(2.5, quad_segs=fine).boundary
    must = centre.buffer(2.0, quad_segs=fine)
    rest = part.buffer(0.5, quad_segs=fine)
    return solid, part.buffer(7.5, quad_segs=fine) - rest, must


@pytest.mark.parametrize("kind", ["pocket", "profile"])
def test_layers_are_the_regions_of_shapely(kind: str) -> None:
    solid, may, must = region(kind)
    points = np.random.default_rng(1).uniform(-12.0, 32.0, (20_000, 2))
    low, high = solid.bands(points).T
    places = shapely.points(points)
    for found, wanted in ((low < 0.0, may), (np.isfinite(high), must)):
        clear = shapely.distance(places, wanted.boundary) > DEFAULT_WALL_MM + 1e-3
        assert clear.sum() > 19_000
        assert (found == shapely.contains(wanted, places))[clear].all()
    assert set(low) == {0.0, -2.0}
    assert set(high) == {np.inf, -2.0}


def test_walls_are_judged_beyond_a_narrow_band() -> None:
    solid = solid_of([SQUARE], Operation(kind="pocket", tool=MILL, depth_mm=2.0))
    wall = DEFAULT_WALL_MM
    assert band(solid, -0.9 * wall, 10.0) == [-2.0, np.inf]
    assert band(solid, -1.1 * wall, 10.0) == [0.0, np.inf]
    assert band(solid, 0.9 * wall, 10.0) == [-2.0, np.inf]
    assert band(solid, 1.1 * wall, 10.0) == [-2.0, -2.0]


def test_a_carving_slopes_as_its_bit_does() -> None:
    solid = replace(
        solid_of([SQUARE], Operation(kind="vcarve", tool=V_BIT, depth_mm=3.0)), wall_mm=0.0
    )
    slope = math.tan(math.radians(30.0))
    for x in (0.1, 0.5, 1.0):
        assert band(solid, x, 10.0) == pytest.approx([-x / slope] * 2)
    # Beyond the width at the depth of 3 mm a floor is left, which may be cut so deep.
    assert band(solid, 3.0, 10.0) == [-3.0, np.inf]


def test_a_chamfer_slopes_down_to_the_line() -> None:
    operation = Operation(
        kind="chamfer", tool=V_BIT, chamfer_mm=1.0, tip_offset_mm=0.2, side="outside"
    )
    solid = replace(solid_of([SQUARE], operation), wall_mm=0.0)
    slope = math.tan(math.radians(30.0))
    assert band(solid, 0.5, 10.0) == pytest.approx([-0.5 / slope] * 2)
    assert band(solid, 1.01, 10.0)[0] == 0.0
    assert band(solid, 0.0, 10.0)[0] == pytest.approx(-1.0 / slope)
    assert band(solid, -0.1, 10.0)[0] == pytest.approx(-1.1 / slope)


def test_a_drill_leaves_its_cone_and_a_groove_its_width() -> None:
    drill = Operation(
        kind="drill", tool=Tool(3.0, "drill", math.radians(118.0)), depth_mm=5.0, max_hole_mm=4.0
    )
    line = Operation(kind="engrave", layers=("LINE",), tool=MILL, depth_mm=1.0)
    paths = [closed(*circle(0.0, 0.0, 1.5)), opened((10, 0), (30, 0))]
    plan = planned(
        drawing_of(paths, ["HOLE", "LINE"]),
        Job((replace(drill, layers=("HOLE",)), line)),
        load_target("linuxcnc").machine,
    )
    solid = replace(wanted_solid(plan.steps), wall_mm=0.0)
    cone = math.tan(math.radians(59.0))
    assert band(solid, 0.0, 1.0) == pytest.approx([1.0 / cone - 5.0] * 2, abs=1e-5)
    assert band(solid, 0.0, 1.6) == [0.0, np.inf]
    assert band(solid, 20.0, 1.99) == [-1.0, -1.0]
    assert band(solid, 20.0, 2.01) == [0.0, np.inf]
    assert solid.cut_by((20.0, 1.0)) == "engrave"
    assert solid.cut_by((0.0, 1.0)) == "drill"


def test_tabs_may_stand_and_the_lowest_operation_counts() -> None:
    outline = Operation(
        tool=MILL, depth_mm=3.0, tabs=Tabs(count=2, height_mm=1.0), layers=("OUT",)
    )
    floor = Operation(kind="pocket", tool=MILL, depth_mm=1.0, layers=("IN",))
    inner = closed(*rectangle(30.0, 10.0))
    paths = [SQUARE, inner]
    plan = planned(
        drawing_of(paths, ["OUT", "IN"]), Job((outline, floor)), load_target("linuxcnc").machine
    )
    solid = wanted_solid(plan.steps)
    assert band(solid, 22.0, 15.0) == [-3.0, -2.0]
    assert band(solid, 22.0, 5.0) == [-3.0, -2.0]
    assert band(solid, 10.0, 5.0) == [-1.0, -1.0]
    assert band(solid, 10.0, 15.0) == [0.0, np.inf]


def test_facing_lowers_all_of_the_stock() -> None:
    stock = Stock(6.0, (-5.0, -5.0), (30.0, 30.0))
    plan = plan_of([SQUARE], Operation(kind="facing", tool=MILL, depth_mm=0.5), stock=stock)
    solid = wanted_solid(plan.steps)
    assert band(solid, 0.0, 0.0) == [-0.5, -0.5]
    assert band(solid, -6.0, 0.0) == [-0.5, np.inf]


def test_what_cuts_no_width_leaves_all() -> None:
    solid = solid_of([SQUARE], Operation(kind="engrave", depth_mm=1.0))
    assert band(solid, 0.0, 0.0) == [0.0, np.inf]
    assert solid.cut_by((0.0, 0.0)) == ""


@examples(40)
@given(seed=st.integers(0, 59), half=st.floats(1e-3, 3.0), place=st.integers(0, 1 << 30))
def test_bounds_hold_over_squares(seed: int, half: float, place: int) -> None:
    asked = random_job(np.random.default_rng(seed))
    if asked.kind == "drill":
        return
    solid = solid_of([closed(*path) for path in asked.paths], operation_of(asked))
    rng = np.random.default_rng(place)
    squares = np.column_stack([rng.uniform(-10.0, 40.0, (20, 2)), np.full(20, half)])
    inner: Floats = rng.uniform(-half, half, (20, 200, 2))
    found = solid.bands((squares[:, None, :2] + inner).reshape(-1, 2)).reshape(20, 200, 2)
    limits = solid.bounds(squares)
    for edge, (least, most) in zip((found[..., 0], found[..., 1]), ((0, 1), (2, 3)), strict=True):
        assert (edge >= limits[:, None, least] - 1e-9).all()
        assert (edge <= limits[:, None, most] + 1e-9).all()


def test_bounds_close_in_on_the_bands() -> None:
    solid = solid_of([SQUARE], Operation(kind="vcarve", tool=V_BIT, depth_mm=3.0))
    points = np.random.default_rng(3).uniform(0.2, 19.8, (500, 2))
    limits = solid.bounds(np.column_stack([points, np.full(500, 1e-7)]))
    bands = solid.bands(points)
    assert limits[:, 0] == pytest.approx(bands[:, 0], abs=1e-6)
    assert limits[:, 1] == pytest.approx(bands[:, 0], abs=1e-6)
    assert limits[:, 3] == pytest.approx(bands[:, 1], abs=1e-6)


def test_reliefs_may_enter_the_corners_and_nothing_beyond() -> None:
    sharp = Operation(tool=MILL, depth_mm=2.0, side="inside")
    relieved = replace(sharp, corners="dogbone")
    diagonal = 1.0 / math.sqrt(2.0)
    for operation, at_mm, low in (
        (sharp, -0.1, 0.0),
        (relieved, 0.0, -2.0),
        (relieved, -0.1, 0.0),
    ):
        assert band(solid_of([SQUARE], operation), at_mm * diagonal, at_mm * diagonal)[0] == low
    # The dog-bone is a disc of 2 mm that touches the corner: beside it, it cuts into the wall.
    centre = 2.0 * diagonal
    edge = centre - math.sqrt(4.0 - (0.8 - centre) ** 2)
    assert edge < -0.1
    solid = solid_of([SQUARE], relieved)
    assert band(solid, edge + 0.02, 0.8)[0] == -2.0
    assert band(solid, edge - 0.02, 0.8)[0] == 0.0


def test_a_blunter_bit_is_seen_in_the_walls() -> None:
    """The slow stock of a carving with a bit of 90° for one of 60° is cut into."""
    operation = Operation(kind="vcarve", tool=V_BIT, depth_mm=2.0)
    plan = plan_of([SQUARE], operation)
    target = load_target("linuxcnc")
    program = target.target.write(plan.toolpath, target.machine).data.decode()
    stock = Needles((-3.0, -3.0), (23.0, 23.0), 0.1)
    for move in moves_of(program):
        stock.cut(move, Cutter(3.0, 1.0))
    low = wanted_solid(plan.steps).bands(stock.points)[:, 0]
    gouge = float((low - stock.height.ravel()).max())
    # At its widest it cuts 2 mm instead of 2 tan 30° to each side of its tip.
    beyond = 2.0 - 2.0 * math.tan(math.radians(30.0))
    assert gouge == pytest.approx(beyond, abs=0.15)


def test_only_the_scallop_of_adaptive_clearing_may_stay() -> None:
    """A square corner keeps 0.9 % of the tool's radius along its bisector; a finishing pass takes
    that. A neck that is wider than the tool by 1 % must be cut all the same."""
    neck = [(0, 0), (8, 0), (8, 3), (12, 3), (12, 0), (20, 0), (20, 8), (12, 8)]
    shape = closed(*neck, (12, 5.02), (8, 5.02), (8, 8), (0, 8))
    own = (("strategy", "adaptive"), ("engagement_rad", 1.0))
    rough = Operation(kind="pocket", tool=Tool(2.0), depth_mm=1.0, own=own)
    # Along the bisector the tool's circle in the corner is 0.4142 mm away from it.
    for operation, high in ((rough, math.inf), (replace(rough, finish_mm=0.1), -1.0)):
        solid = solid_of([shape], operation)
        solid = WantedSolid(solid.may, solid.must, wall_mm=1e-4)
        x = (math.sqrt(2.0) - 1.0 + 0.005) / math.sqrt(2.0)
        assert band(solid, x, x)[1] == high
        x = (math.sqrt(2.0) - 1.0 + 0.012) / math.sqrt(2.0)
        assert band(solid, x, x)[1] == -1.0
        assert band(solid, 10.0, 4.01)[1] == -1.0
