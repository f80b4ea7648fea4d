"""Adaptive pockets that begin in air: beside the stock, or where others have cleared."""

from __future__ import annotations

import math

import ezdxf
import numpy as np
import pytest
import shapely

import camtool
from camtool.geometry.measure import length
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, rotate
from camtool.planning.adaptive import _Clearing, adaptive_legs, mirrored, rings_of
from camtool.planning.findings import PlanningCode
from camtool.planning.items import CutRun, Step
from camtool.planning.job import Entry, Job, Operation, Stock, Tool
from camtool.planning.plan import planned
from tests.drawings import drawing_of
from tests.oracles import swept as oracle
from tests.oracles.contours import closed
from tests.oracles.engaged import greatest_engagement
from tests.oracles.swept import area_of, at_depth, gouges, opened
from tests.paths import moved
from tests.planning.pocket_cases import region_of

FINE = Tool(3.0, number=1)
WIDE = Tool(8.0, number=2)
LIMIT = math.radians(50.0)
OWN = (("strategy", "adaptive"), ("engagement_rad", LIMIT))
HELIX = Entry("helix", angle_rad=math.radians(5.0))
STOCK = Stock(8.0, (0.0, 0.0), (40.0, 30.0))
CHORD_RAD = 0.05
SAG = 1e-4
"""Chords are a hundredth of what may be left, or less, from their arcs."""
RADIUS = 0.5 * FINE.diameter_mm


def box(x: float, y: float, right: float, high: float) -> Polyline:
    return closed((x, y), (right, y), (right, high), (x, high))


def adaptive(**more: object) -> Operation:
    settings = {"depth_mm": 2.0, "entry": HELIX, "own": OWN, "tool": FINE} | more
    return Operation(kind="pocket", name="fine", plunge_feed_mm_min=60.0, **settings)  # type: ignore[arg-type]


def passes(**more: object) -> Operation:
    settings = {"kind": "pocket", "depth_mm": 2.0, "entry": HELIX, "tool": WIDE} | more
    return Operation(name="wide", plunge_feed_mm_min=60.0, **settings)  # type: ignore[arg-type]


def steps_of(
    paths: list[Polyline], *operations: Operation, stock: Stock | None = None, layers: str = ""
) -> tuple[Step, ...]:
    machine = camtool.load_target("linuxcnc").machine
    drawing = drawing_of(paths, list(layers) or None)
    return planned(drawing, Job(operations, stock=stock), machine).steps


def swept(paths: list[Polyline], radius_mm: float) -> shapely.Geometry:
    return oracle.swept(paths, radius_mm, CHORD_RAD, SAG)


def check(
    runs: list[CutRun], paths: list[Polyline], air: shapely.Geometry, z: float = -2.0
) -> None:
    """All that the tool reaches is cleared or air; it goes down in air and straight, stays in the
    contour, and keeps the limit from there on."""
    region = region_of(paths)
    area = opened(area_of(region), RADIUS, CHORD_RAD)
    cleared = swept(at_depth(runs, z), RADIUS)
    still_there = area.difference(shapely.union(cleared, air))
    assert still_there.area < 3e-3 * area.area
    assert gouges(runs, region, RADIUS) == []
    assert {run.vertices[0, 2] for run in runs} == {z}
    for number in {0, len(runs) - 1}:
        disc = shapely.Point(runs[number].vertices[0, :2]).buffer(RADIUS - 0.02)
        before = swept(at_depth(runs[:number], z), RADIUS)
        assert disc.difference(shapely.union(air, before)).area < 1e-3
    assert greatest_engagement(runs, RADIUS, 4e-3 * RADIUS, air) <= 1.02 * LIMIT


def beside(stock: Stock) -> shapely.Geometry:
    assert stock.box_mm is not None
    return shapely.box(-100.0, -100.0, 200.0, 200.0).difference(shapely.box(*stock.box_mm))


OPEN = {
    "right": [box(30, 8, 44, 20)],
    "corner with an island": [box(25, 15, 44, 34), closed((31, 21), (35, 22), (31, 25))],
    "through": [box(-4, 10, 44, 20)],
    "part by part": [closed((-4, 5), (44, 5), (44, 25), (30, 25), (30, 15.02), (-4, 15.02))],
    "all round an island": [box(-5, -5, 45, 35), box(15, 10, 25, 20)],
}


@pytest.mark.parametrize(
    ("name", "direction"), [("right", "climb"), ("corner with an island", "conventional")]
)
def test_the_tool_comes_from_beside_the_stock(name: str, direction: str) -> None:
    (step,) = steps_of(OPEN[name], adaptive(direction=direction), stock=STOCK)
    check(list(step.runs), OPEN[name], beside(STOCK))


@pytest.mark.slow
@pytest.mark.parametrize("name", OPEN)
def test_open_pockets_of_all_kinds(name: str) -> None:
    (step,) = steps_of(OPEN[name], adaptive(), stock=STOCK)
    check(list(step.runs), OPEN[name], beside(STOCK))


@pytest.mark.slow
@pytest.mark.parametrize("high", [12.5, 20.0])
def test_pockets_that_overhang_by_just_a_tool_are_not_cut_too_wide(high: float) -> None:
    """Links there have radii of some hundredths of a millimetre."""
    paths = [box(30, 8, 43, high)]
    (step,) = steps_of(paths, adaptive(), stock=STOCK)
    assert gouges(list(step.runs), region_of(paths), RADIUS) == []


@pytest.mark.parametrize("beyond_mm", [-1e-3, 1e-3, 2e-3])
@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_arcs_that_bulge_out_of_the_region_between_their_ends_are_no_links(
    turn: int, beyond_mm: float
) -> None:
    """Arcs shorter than the steps at which a path would be sampled, at each side of a square."""
    clearing = _Clearing(Polylines.of([box(0, 0, 10, 10)]), RADIUS, LIMIT)
    clearing.add(rings_of(Polylines.of([box(-5, -5, 15, 15)]), RADIUS))
    y = 10.0 + beyond_mm - 0.008
    link = np.array([[5.0, 9.0, 0.0], [5.0, y, -1.0], [5.016, y, 0.0], [5.016, 9.0, 0.0]])
    corners = link[:, 0] - 5.0 + 1j * (link[:, 1] - 5.0)
    turned = corners * 1j**turn
    link[:, :2] = np.column_stack([turned.real, turned.imag]) + 5.0
    assert clearing.is_clear(link) == (beyond_mm < 0.0)


def test_links_begin_within_the_region() -> None:
    clearing = _Clearing(Polylines.of([box(0, 0, 10, 10), box(3, 3, 6, 6)]), RADIUS, LIMIT)
    clearing.add(rings_of(Polylines.of([box(-5, -5, 15, 15)]), RADIUS))
    for x, is_clear in ((1.0, True), (4.0, False), (12.0, False)):
        assert clearing.is_clear(np.array([[x, 4.0, 0.1], [x, 5.0, 0.0]])) == is_clear


def test_without_a_place_beside_the_stock_it_begins_with_a_helix() -> None:
    (step,) = steps_of([box(32, 8, 42.9, 18)], adaptive(), stock=STOCK)
    assert [run.vertices[0, 2] for run in step.runs if run.vertices[0, 2] == 0.0] == [0.0]
    (step,) = steps_of([box(32, 8, 43.3, 18)], adaptive(), stock=STOCK)
    assert {run.vertices[0, 2] for run in step.runs} == {-2.0}


PLATE = [box(0, 0, 30, 20), box(14, 8, 18, 12)]


@pytest.mark.parametrize(
    ("paths", "wide"),
    [(PLATE, {}), ([box(0, 0, 28, 18)], {"own": OWN})],
    ids=["passes", "adaptive"],
)
def test_behind_a_wider_tool_only_the_rest_is_cut(
    paths: list[Polyline], wide: dict[str, object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Far less is cut than by fronts, which clear rests, in the whole pocket."""
    monkeypatch.setattr("camtool.planning.adaptive.PURSUED_ROOM_SHARE", math.inf)
    first, rest = steps_of(paths, passes(**wide), adaptive(rest="wide", depth_mm=None), stock=None)
    (alone,) = steps_of(paths, adaptive())
    air = swept(at_depth(list(first.runs), -2.0), 4.0)
    check(list(rest.runs), paths, air)
    assert len(rest.runs) == 1
    assert cut_mm(rest) < 0.3 * cut_mm(alone)


def cut_mm(step: Step) -> float:
    lines = at_depth(list(step.runs), -2.0)
    return sum(float(np.hypot(*np.diff(line.vertices[:, :2], axis=0).T).sum()) for line in lines)


def test_what_others_cleared_is_air_as_far_as_they_are_deep_enough() -> None:
    paths = [box(0, 0, 18, 12), box(0, 0, 9, 12), closed((11, 6, 1), (16, 6, 1))]
    layers = "PAB"
    before = (
        passes(layers=("A",), depth_mm=1.0),
        Operation(kind="bore", name="hole", tool=FINE, layers=("B",), depth_mm=2.0),
    )
    *firsts, last = steps_of(
        paths, *before, adaptive(layers=("P",), step_down_mm=1.0), layers=layers
    )
    pocketed, bored = (
        swept(at_depth(list(step.runs), z), step.operation.tool.radius_mm)
        for step, z in zip(firsts, (-1.0, -2.0), strict=True)
    )
    levels = [[run for run in last.runs if run.vertices[0, 2] == z] for z in (-1.0, -2.0)]
    assert sum(map(len, levels)) == len(last.runs)
    check(levels[0], paths[:1], shapely.union(pocketed, bored), -1.0)
    check(levels[1], paths[:1], bored, -2.0)


def test_what_is_all_cleared_is_not_cut_again() -> None:
    _, last = steps_of(PLATE, adaptive(), adaptive())
    assert not len(last.runs)
    assert [each.code for each in last.findings] == [PlanningCode.NO_REST]


def test_levels_that_were_faced_are_left_out() -> None:
    facing = Operation(kind="facing", name="top", tool=WIDE, depth_mm=1.0)
    inner = [box(10, 8, 30, 22)]
    _, last = steps_of(inner, facing, adaptive(step_down_mm=1.0), stock=STOCK)
    assert {float(run.vertices[:, 2].min()) for run in last.runs} == {-2.0}


def test_turned_and_mirrored_pockets_are_cleared_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """The order of strokes of fronts may differ, the strokes do not."""
    monkeypatch.setattr("camtool.planning.adaptive.PURSUED_ROOM_SHARE", math.inf)

    def cut(paths: list[Polyline], air: Polylines) -> float:
        region = offset_shape(region_of(paths), RADIUS)
        clearing = adaptive_legs(region, 0.7, RADIUS, LIMIT, air)
        assert clearing.helix_mm == 0.0
        strokes = [leg.vertices for stay in clearing.stays for leg in stay if leg.cuts]
        return sum(length(Polyline(each)) for each in strokes)

    def turned(paths: list[Polyline], angle: float, flipped: bool) -> Polylines:
        there = Polylines.of([rotate(moved(path, -3.0, 2.0), angle) for path in paths])
        return mirrored(there) if flipped else there

    paths = [box(27, 8, 44, 20), closed((33, 13, 1), (36, 13, 1))]
    air = [box(40, -30, 90, 60), closed((31, 16, 1), (28, 16, 1))]
    expected = cut(paths, Polylines.of(air))
    for turn in ((0.5, False), (2.0, True)):
        there = cut(list(turned(paths, *turn)), turned(air, *turn))
        assert there == pytest.approx(expected, rel=0.02), turn


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
@pytest.mark.parametrize("case", ["open", "rest"])
def test_the_limit_is_proved_on_the_predicted_slides(case: str, target: str) -> None:
    document = ezdxf.new(units=ezdxf.units.MM)
    x, y, right, high = (40, 20, 95, 45) if case == "open" else (5, 5, 75, 55)
    document.modelspace().add_lwpolyline(
        [(x, y), (right, y), (right, high), (x, high)], close=True
    )
    more = {"tool": Tool(6.0, number=1), "spindle_rpm": 9000.0}
    operations = (adaptive(**more),)
    if case == "rest":
        rough = passes(tool=Tool(14.0, number=2), spindle_rpm=9000.0)
        operations = (rough, adaptive(rest="wide", depth_mm=None, **more))
    stock = Stock(8.0, (0.0, 0.0), (80.0, 60.0))
    run = camtool.post(document, camtool.load_target(target), Job(operations, stock=stock))
    names = {finding.code.name for finding in run.findings}
    assert "ENGAGEMENT_KEPT" in names
    bad = {"ENGAGEMENT_TOO_HIGH", "MATERIAL_LEFT", "CUT_TOO_DEEP", "GOUGE", "RAPID_IN_STOCK"}
    assert not bad & names


@pytest.mark.parametrize("strategy", ["adaptive", "passes"])
def test_sizes_of_an_open_pocket_end_at_the_edge_of_the_stock(strategy: str) -> None:
    """Of a pocket drawn beyond the stock, by what a tool does not reach, the part keeps 20 mm."""
    own = OWN if strategy == "adaptive" else ()
    operation = adaptive(spindle_rpm=9000.0, own=own)
    document = ezdxf.new(units=ezdxf.units.MM)
    document.modelspace().add_lwpolyline([(20, 5), (47.3, 5), (47.3, 25), (20, 25)], close=True)
    run = camtool.post(document, "grbl", Job((operation,), stock=STOCK))
    assert run.report is not None
    sizes = {each.name: each for each in run.report.dimensions}
    for name, nominal_mm in (("part X", 20.0), ("part Y", 20.0)):
        assert sizes[name].nominal_mm == pytest.approx(nominal_mm)
        assert sizes[name].predicted_mm == pytest.approx(nominal_mm, abs=0.01)
    whole = camtool.post(document, "grbl", Job((operation,)))
    assert whole.report is not None
    assert whole.report.dimensions[0].nominal_mm == pytest.approx(27.3)
