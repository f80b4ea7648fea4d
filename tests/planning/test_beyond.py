"""Cuts beyond the line: an allowance below 0, in every kind of operation that has one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.distance import nearest
from camtool.geometry.measure import sample
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.pipeline import post_drawing
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Entry, Job, Lead, Operation, Tabs, Tool, job_of
from camtool.records import replace
from camtool.run import Run
from camtool.target.registry import load_target
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles.swept import FINE_CHORD_RAD, area_of, complaints
from tests.oracles.swept import swept as covered
from tests.planning.pocket_cases import SHAPES, cross, region_of, runs_of, shapes, work_of
from tests.planning.test_profile import R, _box, _circle, _codes, contours
from tests.strategies import contours as star_contours
from tests.strategies import examples

EXACT = "dialect.path=exact-path"
KEPT_MM = 6e-4
"""Chords and grids of the oracle leave this much."""


def posted(paths: list[Polyline], *operations: Operation, **asked: Any) -> Run:
    """The run of these operations, or of one that is asked for, without an error."""
    job = Job(operations) if operations else job_of(**asked)
    run = post_drawing(drawing_of(paths), job, load_target("linuxcnc", settings=(EXACT,)))
    assert not run.failed, [str(each) for each in run.findings]
    assert run.report is not None
    return run


def sizes(run: Run) -> dict[str, tuple[float, float]]:
    """Nominal and predicted sizes by name."""
    assert run.report is not None
    assert run.report.dimensions
    return {each.name: (each.nominal_mm, each.predicted_mm) for each in run.report.dimensions}


@examples(30)
@given(
    path=star_contours(),
    beyond=st.floats(1e-4, 0.9 * R),
    side=st.sampled_from(["outside", "inside", "auto"]),
    joins=st.sampled_from(["round", "mitre", "sharp"]),
    direction=st.sampled_from(["drawn", "climb", "conventional"]),
)
def test_a_profile_runs_as_a_thinner_tool_would(
    path: Polyline, beyond: float, side: str, joins: str, direction: str
) -> None:
    drawing, same = drawing_of([path]), {"side": side, "joins": joins, "direction": direction}
    nearer = contours(drawing, job_of(tool_diameter_mm=2 * R, allowance_mm=-beyond, **same))
    thin = contours(drawing, job_of(tool_diameter_mm=2 * (R - beyond), **same))
    assert len(nearer.lines) == len(thin.lines)
    assert nearer.lines.vertices == pytest.approx(thin.lines.vertices, abs=1e-9)


@examples(30)
@given(
    path=star_contours(),
    beyond=st.floats(0.002, 0.5 * R),
    side=st.sampled_from(["outside", "inside"]),
)
def test_the_wall_lies_so_far_beyond_the_line(path: Polyline, beyond: float, side: str) -> None:
    job = job_of(tool_diameter_mm=2 * R, allowance_mm=-beyond, side=side)
    found = contours(drawing_of([path]), job)
    drawn = area_of(Polylines.of([path]))
    for line in found.lines:
        away = nearest(sample(line, 0.2), Segments.of(path)).distance
        assert away == pytest.approx(R - beyond, abs=1e-5)
    cut = covered(list(found.lines), R, FINE_CHORD_RAD)
    beside = drawn if side == "outside" else shapely.difference(drawn.buffer(2.0), drawn)
    # No deeper than that into what stays, and so deep wherever the tool gets to the line.
    deep = beside.buffer(-beyond - KEPT_MM, quad_segs=64)
    assert shapely.intersection(cut, deep).area < 1e-6
    assert shapely.intersection(cut, beside).area > 0.0 or not len(found.lines)


@pytest.mark.parametrize("pattern", ["contour", "zigzag"])
@pytest.mark.parametrize("shape", ["square", "island off the middle", "star", "letter"])
def test_a_pocket_grows(shape: str, pattern: str) -> None:
    region = region_of(SHAPES[shape])
    runs = runs_of(work_of(SHAPES[shape], 1.3, allowance_mm=-0.05, pattern=pattern))
    assert complaints(runs, offset_shape(region, -0.05), 0.65, -1.0) == []
    if shape == "square":
        assert complaints(runs, region, 0.65, -1.0) != []


@examples(6, 150)
@given(paths=shapes(), diameter_mm=st.floats(0.3, 2.5), share=st.floats(0.01, 0.25))
def test_random_pockets_grow(paths: list[Polyline], diameter_mm: float, share: float) -> None:
    assume(not cross(paths))
    beyond = 0.5 * share * diameter_mm
    work = work_of(paths, diameter_mm, allowance_mm=-beyond)
    runs = runs_of(work)
    assume(runs)
    assume(not any(each.code == ProgramCode.GOUGE for each in work.findings))
    wanted = offset_shape(region_of(paths), -beyond)
    assert complaints(runs, wanted, 0.5 * diameter_mm, -1.0) == []


def test_an_island_that_is_cut_away_wholly_keeps_nothing_beside_it() -> None:
    """It lies so near to the wall that a tool that goes round it would not get through."""
    paths = [_triangle(0.0, 2.0), _triangle(0.6, 0.03125)]
    wanted = offset_shape(region_of(paths), -0.125)
    assert len(wanted) == 1
    runs = runs_of(work_of(paths, 1.0, allowance_mm=-0.125))
    assert complaints(runs, wanted, 0.5, -1.0) == []
    finishing = work_of(paths, 1.0, allowance_mm=-0.125, stage="finish")
    assert len(finishing.items) == 1


def _triangle(x: float, radius_mm: float) -> Polyline:
    angles = np.arange(3) * math.tau / 3
    rows = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    return Polyline(rows * radius_mm + [x, 0.0, 0.0], closed=True)


@pytest.mark.parametrize("kind", ["profile", "pocket"])
def test_a_finishing_pass_cuts_beyond_what_was_roughed(kind: str) -> None:
    run = posted(
        [_box(0, 0, 20, 10)],
        Operation(
            kind=kind,
            side="inside" if kind == "profile" else "auto",
            tool=Tool(3.0, number=1),
            finish_mm=0.2,
            finish_tool=Tool(2.0, number=2),
            allowance_mm=-0.03,
            depth_mm=1.0,
        ),
    )
    assert sizes(run)["part X"] == pytest.approx((20.0, 20.06), abs=2e-3)
    assert run.job is not None
    rough, last = run.job.operations
    assert (rough.allowance_mm, last.allowance_mm) == (pytest.approx(0.17), -0.03)


@pytest.mark.parametrize("corners", ["none", "dogbone", "overcut"])
@pytest.mark.parametrize("joins", ["round", "mitre", "sharp"])
def test_parts_are_smaller_and_holes_larger_in_the_report(joins: str, corners: str) -> None:
    ell = Polyline(
        np.array([[0, 0, 0], [30, 0, 0], [30, 8, 0], [8, 8, 0], [8, 20, 0], [0, 20, 0.0]]), True
    )
    run = posted([ell], tool_diameter_mm=2.0, allowance_mm=-0.02, joins=joins, corners=corners)
    assert sizes(run)["part X"] == pytest.approx((30.0, 29.96), abs=2e-3)
    assert sizes(run)["part Y"] == pytest.approx((20.0, 19.96), abs=2e-3)
    hole = posted([ell], tool_diameter_mm=2.0, side="inside", allowance_mm=-0.02, corners=corners)
    assert sizes(hole)["part X"] == pytest.approx((30.0, 30.04), abs=2e-3)


def test_a_corner_moves_farther_than_a_side_and_a_circle_as_far() -> None:
    half = math.sqrt(200.0)
    diamond = Polyline(
        np.array([[half, 0, 0], [0, half, 0], [-half, 0, 0], [0, -half, 0.0]]), True
    )
    run = posted([diamond], tool_diameter_mm=3.0, allowance_mm=-0.1)
    assert sizes(run)["part X"][1] == pytest.approx(2.0 * (half - 0.1 * math.sqrt(2.0)), abs=2e-3)
    run = posted([_circle(0, 0, 8)], tool_diameter_mm=3.0, allowance_mm=-0.1)
    assert sizes(run)["part X"][1] == pytest.approx(15.8, abs=2e-3)
    for kind in ("bore", "pocket"):
        run = posted([_circle(0, 0, 8)], kind=kind, tool_diameter_mm=3.0, allowance_mm=-0.1)
        assert sizes(run)["part X"][1] == pytest.approx(16.2, abs=2e-3)
    both = [_box(0, 0, 20, 20), _box(21, 0, 41, 20)]  # one contour round two parts
    run = posted(both, tool_diameter_mm=3.175, allowance_mm=-0.02)
    assert sizes(run)["part X"] == pytest.approx((41.0, 40.96), abs=2e-3)


@pytest.mark.parametrize("kind", ["profile", "pocket", "bore"])
def test_what_is_asked_for_is_no_overcut(kind: str) -> None:
    side = {"side": "inside"} if kind == "profile" else {}
    run = posted(
        [_circle(0, 0, 8)],
        kind=kind,
        tool_diameter_mm=3.0,
        allowance_mm=-0.1,
        depth_mm=1.0,
        **side,
    )
    assert run.report is not None
    assert run.report.shape is not None
    assert run.report.shape.overcut_um < 2.0
    assert run.report.shape.undercut_um < 2.0
    told = {each.code for each in run.findings if each.severity >= Severity.WARNING}
    assert told <= {PlanningCode.CUT_DOUBTFUL}


def test_leads_and_tabs_are_as_ever() -> None:
    run = posted(
        [_box(0, 0, 30, 20)],
        tool_diameter_mm=3.0,
        allowance_mm=-0.1,
        depth_mm=2.0,
        lead_in=Lead("arc", 1.0),
        lead_out=Lead("line", 1.0),
        tabs=Tabs(count=2),
        entry=Entry("ramp"),
    )
    codes = {each.code for each in run.findings}
    assert not codes & {PlanningCode.LEAD_LEFT_OUT, PlanningCode.TAB_LEFT_OUT, ProgramCode.GOUGE}


@pytest.mark.parametrize("kind", ["dogbone", "overcut"])
def test_reliefs_reach_as_far_beyond_the_corners(kind: str) -> None:
    job = job_of(tool_diameter_mm=2 * R, side="inside", corners=kind, allowance_mm=-0.05)
    found = contours(drawing_of([_box(0, 0, 4, 3)]), job)
    assert found.findings == ()
    corners = np.array([[0.0, 0.0], [4, 0], [4, 3], [0, 3]])
    away = nearest(corners, Segments.of(found.lines)).distance
    assert away == pytest.approx(R - 0.05, abs=1e-6)


def test_a_corner_start_is_where_the_arc_round_a_corner_begins() -> None:
    for allowance in (-0.05, 0.0, 0.1):
        run = posted([_box(0, 0, 9, 6)], tool_diameter_mm=2.0, start="corner",
                     allowance_mm=allowance)  # fmt: skip
        assert run.wanted is not None
        first = run.wanted.end[np.flatnonzero(run.wanted.end[:, 2] < 0.0)[0], :2]
        away = 1.0 + allowance
        places = [(x, y) for x in (0, 9) for y in (-away, 6 + away)]
        places += [(x, y) for x in (-away, 9 + away) for y in (0, 6)]
        assert min(math.dist(first, place) for place in places) < 1e-6


# ----- neighbours ------------------------------------------------------------------------------


def two(gap: float) -> list[Polyline]:
    """Two parts so far apart."""
    return [_box(0, 0, 4, 3), _box(4 + gap, 0, 8 + gap, 3)]


@pytest.mark.parametrize("side", ["auto", "outside"])
def test_own_walls_are_no_gouges_and_what_is_nearer_is(side: str) -> None:
    drawn = {"side": side, "tool_diameter_mm": 2 * R, "allowance_mm": -0.05}
    # Between them the tool takes 0.05 mm of both.
    fits = contours(drawing_of(two(2 * R - 0.098)), job_of(**drawn))
    assert _codes(fits) == []
    tight = contours(drawing_of(two(2 * R - 0.12)), job_of(**drawn))
    (found,) = (PlanningCode.UNREACHED,) if side == "auto" else (ProgramCode.GOUGE,)
    assert set(_codes(tight)) == {found}


def test_of_other_operations_the_allowance_counts_too() -> None:
    drawing = drawing_of(two(2 * R - 0.098), ["A", "B"])
    both = [
        Operation(
            layers=(layer,), side="outside", tool=Tool(2 * R), allowance_mm=-0.05, depth_mm=1
        )
        for layer in "AB"
    ]
    target = load_target("linuxcnc")

    def gouges(*operations: Operation) -> list[float]:
        found = post_drawing(drawing, Job(operations), target, check=False).findings
        return [each.measured or 0.0 for each in found if each.code == ProgramCode.GOUGE]

    assert gouges(*both) == []
    # The second part keeps its size: what is cut beside the first takes of it.
    assert gouges(both[0], replace(both[1], allowance_mm=0.0)) != []


def test_what_is_thinner_than_two_allowances_is_told() -> None:
    plate, thin = _box(-5, -5, 20, 8), 0.08
    windows = [_box(0, 0, 4, 3), _box(4 + thin, 0, 8 + thin, 3)]
    settings = {"tool_diameter_mm": 2 * R, "allowance_mm": -0.05}
    for paths, more in (([plate, *windows], {}), ([_box(0, 0, 4, thin)], {"side": "outside"})):
        found = contours(drawing_of(paths), job_of(**settings, **more))
        told = [each for each in found.findings if each.code == ProgramCode.GOUGE]
        assert len(told) == 1
        assert "cut away from both sides" in str(told[0])
        wider = contours(drawing_of(paths), job_of(**{**settings, "allowance_mm": -0.03}, **more))
        assert ProgramCode.GOUGE not in _codes(wider)
    walls = [_circle(0, 0, 2), _circle(4 + thin, 0, 2)]
    for kind, some in (
        ("pocket", windows),
        ("pocket", [plate, _box(0, 0, 4, thin)]),
        ("bore", walls),
    ):
        run = posted(some, kind=kind, tool_diameter_mm=0.5, allowance_mm=-0.05, depth_mm=1.0)
        assert [each.severity for each in run.findings if each.code == ProgramCode.GOUGE] == [
            Severity.WARNING
        ]


def test_a_pocket_that_comes_over_a_contour_beside_it_is_told() -> None:
    plate, pocket = _box(0, 0, 20, 10), _box(5, 3, 9, 6)
    hole = _box(9.03, 3, 12, 6)
    own = Operation(kind="pocket", layers=("P",), tool=Tool(1.0), allowance_mm=-0.05, depth_mm=0.5)
    outline = Operation(layers=("O",), tool=Tool(1.0), depth_mm=2.0)

    def gouges(paths: list[Polyline], layers: list[str]) -> list[str]:
        found = post_drawing(
            drawing_of(paths, layers), Job((own, outline)), load_target("linuxcnc"), check=False
        ).findings
        return [str(each) for each in found if each.code == ProgramCode.GOUGE]

    assert gouges([plate, pocket], ["O", "P"]) == []
    (told,) = gouges([plate, pocket, hole], ["O", "P", "O"])
    assert "cuts 0.02 mm into" in told


# ----- refusals and words ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({}, "a point cannot cut 0.02 mm beyond the line"),
        ({"tool_diameter_mm": 0.04}, "its centre would not stay beside it"),
        ({"tool_diameter_mm": 1.0, "side": "on"}, "on both sides"),
        (
            {"tool_diameter_mm": 1.0, "finish_mm": 0.005, "finish_tool": Tool(0.03)},
            "0.03 mm cannot",
        ),
        ({"tool_diameter_mm": 0.02, "kind": "pocket"}, "0.02 mm cannot cut"),
    ],
)
def test_what_no_tool_can_do_is_refused(asked: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError, match=words) as caught:
        job_of(allowance_mm=-0.02, **asked)
    assert str(caught.value.where).endswith("key allowance")
    assert caught.value.mend


def test_a_large_one_is_doubted() -> None:
    for beyond, doubted in ((0.2, False), (0.3, True)):
        run = posted([_box(0, 0, 30, 20)], tool_diameter_mm=2.0, allowance_mm=-beyond, depth_mm=1)
        words = [str(each) for each in run.findings if each.code == PlanningCode.CUT_DOUBTFUL]
        assert any("mm are cut beyond the lines" in each for each in words) is doubted
