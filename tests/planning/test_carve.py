"""Carving: what the cone cuts is the region, no more, and as much of it as there can be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.distance import nearest
from camtool.geometry.findings import ContourCode
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.importers.read import read_drawing
from camtool.operations.vcarve.work import CARVE_TOLERANCE_MM, vcarve
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Chosen, CutRun, Feeds, Fixed, Setting, Work
from camtool.planning.job import Job, Operation, Tool
from camtool.planning.plan import plan
from camtool.records import replace
from camtool.target.registry import load_target
from tests.drawings import drawing_of
from tests.oracles import contours as shapes
from tests.oracles.carved import area_of, dense, swept
from tests.strategies import contours, examples

CHORD_MM = 1e-3
STEP_MM = 0.1
DISC_SHARE = 2e-3
"""The oracle's discs are polygons: they cover this much less than the region, at most."""

OBLONG_WITH_ISLANDS = [
    shapes.OBLONG,
    shapes.closed((3, 3), (3, 6), (6, 6), (6, 3)),
    shapes.closed((12, 4, 1), (16, 4, 1)),
]
RING = [shapes.CIRCLE, shapes.closed((-4, 0, 1), (4, 0, 1))]
SHAPES = {
    "circle": [shapes.CIRCLE],
    "slot": [shapes.SLOT],
    "square": [shapes.SQUARE],
    "oblong": [shapes.OBLONG],
    "filleted": [shapes.FILLETED],
    "ell": [shapes.ELL],
    "dumbbell": [shapes.DUMBBELL],
    "keyhole": [shapes.KEYHOLE],
    "lens": [shapes.LENS],
    "crescent": [shapes.CRESCENT],
    "notch": [shapes.NOTCH],
    "spike": [shapes.SPIKE],
    "star": [shapes.star(5, 2.0, 6.0)],
    "comb": [shapes.comb(3)],
    "ring": RING,
    "islands": OBLONG_WITH_ISLANDS,
}


def chosen_of(paths: Sequence[Polyline]) -> Chosen:
    nesting, rows = Nesting(Polylines.of(paths)), np.arange(len(paths))
    names = tuple(f"PATH {index}" for index in rows)
    return Chosen(nesting, rows, names, np.empty((0, 2)), (), np.zeros(len(rows), bool))


def setting_of(*levels: float, angle: float = math.pi / 2, **tool: float) -> Setting:
    bit = Tool(kind="v", tip_angle_rad=angle, **tool)
    operation = Operation(kind="vcarve", name="carve", tool=bit)
    return Setting(operation, Feeds(100.0, 100.0), levels or (-100.0,), 5.0)


def runs_of(work: Work) -> list[CutRun]:
    return [run for item in work.items if isinstance(item, Fixed) for run in item.runs]


def gouge(work: Work, paths: Sequence[Polyline], setting: Setting) -> float:
    """Largest distance by which the cone cuts beyond the region at the surface, mm."""
    tool = setting.operation.tool
    assert tool.tip_angle_rad is not None
    boundary = Segments.of(Polylines.of(paths))
    region = area_of(Polylines.of(paths), CHORD_MM).buffer(CHORD_MM)
    shapely.prepare(region)
    worst = 0.0
    for run in runs_of(work):
        points = dense(run, STEP_MM)
        radius = 0.5 * tool.tip_diameter_mm - points[:, 2] * math.tan(0.5 * tool.tip_angle_rad)
        worst = max(worst, float((radius - nearest(points[:, :2], boundary).distance).max()))
        assert shapely.contains_xy(region, points[:, :2]).all()
    return worst


def uncut(work: Work, paths: Sequence[Polyline], setting: Setting) -> shapely.Geometry:
    tool = setting.operation.tool
    assert tool.tip_angle_rad is not None
    slope, tip = math.tan(0.5 * tool.tip_angle_rad), 0.5 * tool.tip_diameter_mm
    return area_of(Polylines.of(paths), CHORD_MM).difference(
        swept(runs_of(work), slope, tip, STEP_MM)
    )


def turned(
    path: Polyline, angle: float = 0.7, scale: float = 1.0, mirror: bool = False
) -> Polyline:
    x, y, bulge = path.vertices.T * np.array([[1.0], [-1.0 if mirror else 1.0], [1.0]])
    c, s = scale * math.cos(angle), scale * math.sin(angle)
    sign = -1.0 if mirror else 1.0
    return Polyline(np.column_stack([c * x - s * y, s * x + c * y, sign * bulge]), path.closed)


@pytest.mark.parametrize("name", SHAPES)
def test_the_cone_cuts_the_region_and_nothing_else(name: str) -> None:
    paths, setting = SHAPES[name], setting_of()
    work = vcarve(chosen_of(paths), setting)
    assert not work.findings
    assert gouge(work, paths, setting) <= CARVE_TOLERANCE_MM
    left = uncut(work, paths, setting)
    assert left.area <= DISC_SHARE * area_of(Polylines.of(paths), CHORD_MM).area


@pytest.mark.parametrize("name", ["ell", "keyhole", "notch", "islands"])
def test_the_same_for_a_drawing_turned_mirrored_scaled_reversed_and_begun_elsewhere(
    name: str,
) -> None:
    setting = setting_of()
    wanted = _cut_length(vcarve(chosen_of(SHAPES[name]), setting))
    for change in (
        lambda path: turned(path),
        lambda path: turned(path, mirror=True),
        lambda path: turned(path, scale=0.1),
        lambda path: Polyline(np.roll(path.vertices, 1, axis=0), True),
        lambda path: _reversed(path),
    ):
        paths = [change(path) for path in SHAPES[name]]
        scale = np.ptp(paths[0].vertices[:, 0]) and _size(paths) / _size(SHAPES[name])
        work = vcarve(chosen_of(paths), setting)
        assert gouge(work, paths, setting) <= CARVE_TOLERANCE_MM
        assert _cut_length(work) / scale == pytest.approx(wanted, rel=5e-3)


def _size(paths: Sequence[Polyline]) -> float:
    return math.sqrt(area_of(Polylines.of(paths), CHORD_MM).area)


def _reversed(path: Polyline) -> Polyline:
    x, y, bulge = path.vertices[::-1].T
    return Polyline(np.column_stack([x, y, -np.roll(bulge, -1)]), True)


def _cut_length(work: Work) -> float:
    """Length in the plane of what is carved, each place once."""
    lines = [shapely.LineString(dense(run, STEP_MM)[:, :2]) for run in runs_of(work)]
    return float(shapely.union_all(shapely.set_precision(lines, 1e-6)).length)


def test_corners_climb_to_the_surface_exactly() -> None:
    work = vcarve(chosen_of([shapes.star(5, 2.0, 6.0)]), setting_of())
    points = np.concatenate([run.vertices for run in runs_of(work)])
    for tip in shapes.star(5, 2.0, 6.0).vertices[::2, :2]:
        at = points[np.hypot(*(points[:, :2] - tip).T) <= 1e-12]
        assert len(at)
        assert np.all(at[:, 2] == 0.0)


@pytest.mark.parametrize("degrees", [20.0, 60.0, 90.0, 120.0])
def test_a_slot_is_as_deep_as_its_width_asks(degrees: float) -> None:
    angle = math.radians(degrees)
    (run,) = runs_of(vcarve(chosen_of([shapes.SLOT]), setting_of(angle=angle)))
    assert run.vertices[:, 2] == pytest.approx(-5.0 / math.tan(0.5 * angle), rel=1e-12)
    ends = sorted(run.vertices[:, :2].tolist())
    assert ends == [pytest.approx([0.0, 5.0]), pytest.approx([20.0, 5.0])]


def test_a_circle_is_one_plunge_in_its_middle() -> None:
    (run,) = runs_of(vcarve(chosen_of([turned(shapes.CIRCLE, scale=0.2)]), setting_of()))
    assert run.vertices == pytest.approx(np.array([[0.0, 0.0, -2.0, 0.0]]))


def test_a_ring_is_one_round_at_one_depth() -> None:
    (run,) = runs_of(vcarve(chosen_of(RING), setting_of()))
    assert run.vertices[:, 2] == pytest.approx(-3.0)
    assert np.hypot(*run.vertices[:, :2].T) == pytest.approx(7.0, abs=1e-6)
    assert run.vertices[0, :2] == pytest.approx(run.vertices[-1, :2], abs=1e-6)


@pytest.mark.parametrize("depth", [0.5, 1.0, 2.5])
def test_limited_depth_leaves_a_floor_that_is_the_inner_offset(depth: float) -> None:
    setting = setting_of(-depth)
    work = vcarve(chosen_of(OBLONG_WITH_ISLANDS), setting)
    assert min(run.vertices[:, 2].min() for run in runs_of(work)) == pytest.approx(-depth)
    (finding,) = work.findings
    assert finding.code is PlanningCode.DEPTH_LIMITED
    floor = area_of(Polylines.of(OBLONG_WITH_ISLANDS), CHORD_MM).buffer(-depth, quad_segs=200)
    assert finding.measured == pytest.approx(floor.area, rel=2e-3)
    assert gouge(work, OBLONG_WITH_ISLANDS, setting) <= CARVE_TOLERANCE_MM
    left = uncut(work, OBLONG_WITH_ISLANDS, setting)
    assert left.difference(floor.buffer(-depth + 2e-2)).area < 0.05


def test_the_width_of_the_bit_limits_as_depth_does() -> None:
    by_width = vcarve(chosen_of([shapes.OBLONG]), setting_of(diameter_mm=4.0))
    by_depth = vcarve(chosen_of([shapes.OBLONG]), setting_of(-2.0))
    assert [f.code for f in by_width.findings] == [PlanningCode.DEPTH_LIMITED]
    assert by_width.findings[0].measured == pytest.approx(16.0 * 6.0)
    for one, other in zip(runs_of(by_width), runs_of(by_depth), strict=True):
        assert one.vertices == pytest.approx(other.vertices, abs=1e-9)


def test_passes_go_down_and_cut_the_same_as_one() -> None:
    once, setting = setting_of(), setting_of(-1.0, -2.0, -5.0)
    work = vcarve(chosen_of([shapes.OBLONG]), setting)
    assert not work.findings
    deepest = [run.vertices[:, 2].min() for run in runs_of(work)]
    assert deepest == sorted(deepest, reverse=True)
    assert {round(z, 9) for z in deepest} == {-1.0, -2.0, -5.0}
    assert gouge(work, [shapes.OBLONG], setting) <= CARVE_TOLERANCE_MM
    whole = uncut(vcarve(chosen_of([shapes.OBLONG]), once), [shapes.OBLONG], once)
    assert uncut(work, [shapes.OBLONG], setting).area == pytest.approx(whole.area, abs=0.01)


def test_a_flat_tip_leaves_corners_and_stays_out_of_narrow_places() -> None:
    setting = setting_of(tip_diameter_mm=1.0)
    thin = shapes.closed((30, 0), (39, 0), (39, 0.9), (30, 0.9))
    work = vcarve(chosen_of([shapes.SQUARE, thin]), setting)
    assert [f.code for f in work.findings] == [
        PlanningCode.UNREACHED,
        PlanningCode.CONTOUR_TOO_SMALL,
    ]
    corners = 4.0 * 0.25 * (1.0 - 0.25 * math.pi)
    assert work.findings[0].measured == pytest.approx(corners, rel=1e-6)
    assert work.findings[1].measured == pytest.approx(0.9)
    assert len(work.items) == 1
    assert gouge(work, [shapes.SQUARE], setting) <= CARVE_TOLERANCE_MM
    assert uncut(work, [shapes.SQUARE], setting).area == pytest.approx(corners, abs=0.01)


def test_an_island_in_a_hole_is_an_item_of_its_own() -> None:
    inner = turned(shapes.SQUARE, 0.0, 0.2)
    work = vcarve(chosen_of([*RING, inner]), setting_of())
    assert [item.name for item in work.items] == ["PATH 0", "PATH 2"]
    assert [item.source for item in work.items] == [0, 2]


def test_corners_are_cut_there_and_back_without_coming_up() -> None:
    high, low = (replace(setting_of(), safe_z_mm=z) for z in (8.0, 0.01))
    assert len(runs_of(vcarve(chosen_of([shapes.OBLONG]), high))) == 1
    assert len(runs_of(vcarve(chosen_of([shapes.OBLONG]), low))) == 3


def test_a_polygon_of_many_sides_is_carved_like_the_circle_that_it_stands_for() -> None:
    angle = np.arange(200) * (2.0 * np.pi / 200)
    polygon = Polyline(
        np.column_stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), np.zeros(200)]), True
    )
    (run,) = runs_of(vcarve(chosen_of([polygon]), setting_of()))
    assert np.abs(run.vertices[:, :2]).max() < 1e-3


def test_steep_moves_keep_to_the_plunge_feed() -> None:
    slow = replace(setting_of(angle=math.radians(20.0)), feeds=Feeds(100.0, 10.0))
    for run in runs_of(vcarve(chosen_of([shapes.SQUARE]), slow)):
        step = np.diff(run.vertices[:, :3], axis=0)
        rate = run.feed_mm_min * np.abs(step[:, 2]) / np.linalg.norm(step, axis=1)
        assert np.all(rate <= 10.0 * (1.0 + 1e-9))
        assert np.all(run.feed_mm_min <= 100.0)


def test_the_same_drawing_gives_the_same_runs() -> None:
    first, second = (vcarve(chosen_of(OBLONG_WITH_ISLANDS), setting_of(-1.0)) for _ in range(2))
    for one, other in zip(runs_of(first), runs_of(second), strict=True):
        assert one.vertices.tobytes() == other.vertices.tobytes()


def test_paths_that_cross_are_an_error_that_names_the_place() -> None:
    eight = shapes.closed((0, 0), (10, 10), (10, 0), (0, 10))
    for paths in ([eight], [shapes.SQUARE, turned(shapes.SQUARE, 0.3)]):
        work = vcarve(chosen_of(paths), setting_of())
        assert not work.items
        assert {f.code for f in work.findings} == {ContourCode.SELF_CROSSING}
        assert all(f.severity is Severity.ERROR for f in work.findings)
    (first, *_) = vcarve(chosen_of([eight]), setting_of()).findings
    assert "X 5.0000 Y 5.0000" in first.where


@pytest.mark.parametrize("tool", [Tool(3.0), Tool(3.0, "v"), Tool(3.0, "drill", 1.0)])
def test_tools_that_carve_nothing_are_refused_with_the_mend(tool: Tool) -> None:
    operation = Operation(kind="vcarve", name="letters", tool=tool)
    setting = replace(setting_of(), operation=operation)
    with pytest.raises(OptionError, match="V bit") as caught:
        vcarve(chosen_of([shapes.SQUARE]), setting)
    assert caught.value.where == "operation 'letters', key tool"
    assert "tip_angle" in caught.value.mend


def test_what_reading_moved_and_what_carving_leaves_add_up() -> None:
    machine = load_target("linuxcnc").machine
    drawing = drawing_of(RING)
    bit = Tool(6.0, "v", math.radians(60.0))
    job = Job((Operation(kind="vcarve", tool=bit, depth_mm=1.0),))
    moved = replace(drawing, off_mm=np.full((len(drawing.paths.vertices), 2), 0.02))
    for made, off in ((drawing, 0.0), (moved, 0.02)):
        toolpath = plan(made, job, machine)
        assert toolpath.drawn is not None
        cuts = toolpath.is_feed & (toolpath.end[:, 2] < 0.0)
        assert toolpath.drawn.off_mm[cuts] == pytest.approx(off + CARVE_TOLERANCE_MM)


def test_an_open_path_is_refused_by_name() -> None:
    with pytest.raises(OptionError, match="PATH 1 is open") as caught:
        vcarve(chosen_of([shapes.SQUARE, shapes.opened((20, 0), (30, 0))]), setting_of())
    assert "engrave" in caught.value.mend


@given(contours(), st.sampled_from([0.3, 1.5, 100.0]), st.sampled_from([0.0, 0.2]))
@examples(40)
def test_random_contours_are_never_gouged(path: Polyline, depth: float, tip: float) -> None:
    setting = setting_of(-depth, tip_diameter_mm=tip)
    work = vcarve(chosen_of([path]), setting)
    if any(f.code is ContourCode.SELF_CROSSING for f in work.findings):
        return
    assert gouge(work, [path], setting) <= CARVE_TOLERANCE_MM


@pytest.mark.slow
def test_the_sample_logo() -> None:
    drawing = read_drawing(Path(__file__).parents[2] / "samples" / "logo.svg")
    paths = [path for path in drawing.paths if path.closed]
    setting = setting_of()
    work = vcarve(chosen_of(paths), setting)
    assert not work.findings
    assert gouge(work, paths, setting) <= CARVE_TOLERANCE_MM
    assert len(work.items) == 19


def test_paths_that_share_a_side_enclose_nothing_there_and_are_an_error() -> None:
    # Failed once: discs beside the shared side had no end, and the search never came to one.
    inner = Polyline(np.array([[3.0, 3, 0], [4, 3, 0], [4, 4, 0], [3, 4, 0]]), True)
    outer = Polyline(np.array([[6.0, 6, 0], [3, 6, 0], [3, 3, 0], [6, 3, 0]]), True)
    work = vcarve(chosen_of([inner, outer]), setting_of(-0.4))
    assert work.items == ()
    (finding,) = work.findings
    assert (finding.code, finding.severity) == (ContourCode.SELF_CROSSING, Severity.ERROR)
