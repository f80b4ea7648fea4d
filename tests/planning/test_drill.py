"""Drilling: which places become holes, and how the drill goes down."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Severity
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines
from camtool.operations.drill.work import drill
from camtool.planning.findings import PlanningCode
from camtool.planning.holes import (
    HOLE_SIZE_MM,
    PECK_CLEARANCE_MM,
    PECK_TOP_MM,
    SAME_HOLE_MM,
    circle_of,
    peck_depths,
)
from camtool.planning.items import Chosen, CutRun, Feeds, Fixed, Setting, Work
from camtool.planning.job import Operation, Tool
from tests.oracles import contours as shapes


def circle(x: float, y: float, diameter: float, arcs: int = 2, turn: float = 1.0) -> Polyline:
    angle = turn * np.arange(arcs) * 2.0 * math.pi / arcs + 0.3
    points = np.array([x, y]) + 0.5 * diameter * np.column_stack([np.cos(angle), np.sin(angle)])
    bulge = np.full(arcs, turn * math.tan(0.5 * math.pi / arcs))
    return Polyline(np.column_stack([points, bulge]), closed=True)


def chosen_of(
    paths: Sequence[Polyline] = (), points: Sequence[tuple[float, float]] = ()
) -> Chosen:
    names = tuple(f"PATH {index}" for index in range(len(paths)))
    marks = tuple(f"POINT {index}" for index in range(len(points)))
    places = np.array(points, dtype=np.float64).reshape(-1, 2)
    return Chosen(
        Nesting(Polylines.of(paths)),
        10 + np.arange(len(paths)),
        names,
        places,
        marks,
        np.zeros(len(paths), bool),
    )


def setting_of(depth: float = 3.0, safe_z: float = 5.0, **settings: object) -> Setting:
    settings.setdefault("tool", Tool(1.0, "drill"))
    operation = Operation(kind="drill", name="holes", **settings)  # type: ignore[arg-type]
    return Setting(operation, Feeds(100.0, 40.0), (-depth,), safe_z)


def holes_of(work: Work) -> list[tuple[float, float]]:
    return [tuple(run.vertices[0, :2].round(9).tolist()) for run in runs_of(work)]


def runs_of(work: Work) -> list[CutRun]:
    return [run for item in work.items if isinstance(item, Fixed) for run in item.runs]


def test_marks_and_circles_are_one_item_each() -> None:
    work = drill(chosen_of([circle(5, 6, 1.0)], [(1, 2), (3, 4)]), setting_of())
    assert sorted(holes_of(work)) == [(1, 2), (3, 4), (5, 6)]
    assert not work.findings
    named = {item.name: item.source for item in work.items}
    assert named == {"POINT 0": -1, "POINT 1": -1, "PATH 0": 10}
    assert all(isinstance(item, Fixed) and len(item.runs) == 1 for item in work.items)


def test_without_pecks_the_hole_is_one_plunge_with_a_dwell() -> None:
    (run,) = runs_of(drill(chosen_of(points=[(1, 2)]), setting_of(dwell_s=0.5)))
    assert run.vertices.tolist() == [[1, 2, -3, 0]]
    assert (run.plunge_mm_min, run.dwell_s) == (40.0, 0.5)


def test_pecks_come_up_as_rapids_and_go_back_to_just_above_the_last_depth() -> None:
    (run,) = runs_of(drill(chosen_of(points=[(1, 2)]), setting_of(peck_mm=1.2)))
    back = PECK_CLEARANCE_MM
    heights = [-1, PECK_TOP_MM, back - 1, -2, PECK_TOP_MM, back - 2, -3]
    assert run.vertices[:, 2] == pytest.approx(heights)
    rapid = [True, True, False, True, True, False]
    assert np.isnan(run.feed_mm_min).tolist() == rapid
    assert set(run.feed_mm_min[[2, 5]].tolist()) == {40.0}


def test_pecks_of_a_small_machine_keep_below_safe_z_and_off_the_bottom() -> None:
    setting = setting_of(depth=0.2, safe_z=0.1, peck_mm=0.1)
    (run,) = runs_of(drill(chosen_of(points=[(0, 0)]), setting))
    assert run.vertices[:, 2] == pytest.approx([-0.1, 0.1, -0.05, -0.2])


@given(st.floats(0.01, 50.0), st.floats(0.005, 60.0))
def test_pecks_are_equal_no_deeper_than_told_and_as_few_as_can_be(
    depth: float, peck: float
) -> None:
    depths = peck_depths(depth, peck)
    steps = np.diff([0.0, *depths])
    assert depths[-1] == depth
    assert steps == pytest.approx(np.full(len(steps), depth / len(steps)))
    assert steps.max() <= peck * (1.0 + 1e-6)
    assert len(steps) == 1 or depth / (len(steps) - 1) > peck * (1.0 - 1e-6)


def test_a_whole_number_of_pecks_stays_that_number_whatever_rounding_says() -> None:
    assert all(len(peck_depths(count * 0.1, 0.1)) == count for count in range(1, 200))


def test_places_drawn_twice_are_drilled_once_and_circles_go_before_marks() -> None:
    near = 0.5 * SAME_HOLE_MM
    paths = [circle(0, 0, 1.0), circle(0, 0, 1.0), circle(9, 0, 1.0)]
    work = drill(chosen_of(paths, [(0, near), (20, 0), (20, 0)]), setting_of())
    assert sorted(item.name for item in work.items) == ["PATH 0", "PATH 2", "POINT 1"]
    assert not work.findings


def test_of_concentric_circles_the_one_like_the_drill_counts() -> None:
    paths = [circle(0, 0, 0.6), circle(0, 0, 1.0), circle(0, 0, 0.8)]
    work = drill(chosen_of(paths), setting_of())
    assert [item.name for item in work.items] == ["PATH 1"]
    assert not work.findings


def test_larger_circles_are_named_and_not_drilled() -> None:
    paths = [circle(0, 0, 1.0), circle(9, 0, 4.0), circle(0, 9, 6.0)]
    work = drill(chosen_of(paths), setting_of())
    assert holes_of(work) == [(0, 0)]
    (finding,) = work.findings
    assert (finding.code, finding.severity) == (PlanningCode.NOT_DRILLED, Severity.WARNING)
    assert finding.where == "PATH 1, PATH 2"
    assert finding.measured == pytest.approx(6.0)
    assert finding.limit == 1.0


def test_the_largest_hole_may_be_wider_than_the_drill_and_both_sizes_are_told() -> None:
    paths = [circle(0, 0, 4.0), circle(9, 0, 6.0)]
    work = drill(chosen_of(paths), setting_of(max_hole_mm=5.0))
    assert holes_of(work) == [(0, 0)]
    assert [finding.code for finding in work.findings] == [
        PlanningCode.NOT_DRILLED,
        PlanningCode.HOLE_SIZE,
    ]
    size = work.findings[1]
    assert "4 mm" in size.message
    assert "1 mm" in size.message
    assert (size.measured, size.limit) == (1.0, 4.0)


def test_a_circle_as_wide_as_the_drill_fits_within_the_tolerance_only() -> None:
    fits = circle(0, 0, 1.0 + 0.9 * HOLE_SIZE_MM)
    assert not drill(chosen_of([fits]), setting_of()).findings
    wide = circle(0, 0, 1.0 + 1.1 * HOLE_SIZE_MM)
    assert drill(chosen_of([wide]), setting_of()).findings


def test_a_drill_of_no_width_takes_any_circle_in_silence() -> None:
    work = drill(chosen_of([circle(0, 0, 40.0)]), setting_of(tool=Tool()))
    assert holes_of(work) == [(0, 0)]
    assert not work.findings


def test_other_paths_are_named_and_nothing_to_drill_is_an_error() -> None:
    paths = [shapes.SQUARE, shapes.opened((0, 0), (1, 0)), shapes.LENS, shapes.SLOT]
    work = drill(chosen_of(paths), setting_of())
    assert not work.items
    others, nothing = work.findings
    assert others.code is PlanningCode.NOT_DRILLED
    assert others.where == "PATH 0, PATH 1, PATH 2 and 1 more"
    assert (nothing.code, nothing.severity) == (PlanningCode.NOTHING_DRAWN, Severity.ERROR)
    assert "holes" in nothing.where


@pytest.mark.parametrize("arcs", [2, 3, 4, 7])
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_circles_of_any_number_of_arcs_either_way_round(arcs: int, turn: float) -> None:
    found = circle_of(circle(3.0, -2.0, 5.0, arcs, turn))
    assert found is not None
    assert found[0] == pytest.approx((3.0, -2.0))
    assert found[1] == pytest.approx(5.0)


@pytest.mark.parametrize(
    "path",
    [
        Polyline(circle(0, 0, 5.0, 4).vertices, closed=False),
        Polyline(circle(0, 0, 5.0, 4).vertices * np.array([1.0, 1.01, 1.0]), closed=True),
        Polyline(circle(0, 0, 5.0, 40).vertices * np.array([1.0, 1.0, 0.0]), closed=True),
        Polyline(np.tile(circle(0, 0, 5.0, 2).vertices, (2, 1)), closed=True),
        shapes.CRESCENT,
    ],
    ids=["open", "squeezed", "chords", "twice round", "crescent"],
)
def test_what_is_no_circle(path: Polyline) -> None:
    assert circle_of(path) is None
