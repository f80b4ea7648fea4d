"""Pockets: all that the tool can reach is cleared, and nothing else, in any shape."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.measure import length, signed_area
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse, rotate
from camtool.operations.pocket.work import pocket
from camtool.planning.clearing import Cell, Steps, parts_of, ring_cells
from camtool.planning.findings import PlanningCode
from camtool.planning.items import CutRun, Fixed
from camtool.planning.job import Entry
from tests.oracles import swept
from tests.oracles.contours import CIRCLE, DUMBBELL, OBLONG, SLOT, SQUARE, closed, comb, star
from tests.oracles.contours import opened as open_path
from tests.oracles.swept import at_depth, complaints, gouges
from tests.paths import mirrored, moved, scaled
from tests.planning.pocket_cases import (
    SHAPES,
    chosen_of,
    cross,
    region_of,
    runs_of,
    setting_of,
    shapes,
    work_of,
)
from tests.strategies import examples

QUICK = ["square", "island off the middle", "star", "dumbbell", "keyhole"]


def wrong(paths: list[Polyline], diameter_mm: float, **options: object) -> list[str]:
    """Return the faults that the oracle finds in the pocket of the paths."""
    runs = runs_of(work_of(paths, diameter_mm, **options))
    return complaints(runs, region_of(paths), 0.5 * diameter_mm, -1.0)


@pytest.mark.parametrize("step_over", [0.4, 0.95])
@pytest.mark.parametrize("shape", QUICK)
def test_all_within_reach_is_cleared_and_nothing_else(shape: str, step_over: float) -> None:
    assert wrong(SHAPES[shape], 1.3, step_over=step_over) == []


@pytest.mark.slow
@pytest.mark.parametrize("step_over", [0.1, 0.5, 0.6, 0.8, 1.0])
@pytest.mark.parametrize("diameter_mm", [0.7, 1.7])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape(shape: str, diameter_mm: float, step_over: float) -> None:
    assert wrong(SHAPES[shape], diameter_mm, step_over=step_over) == []


@examples(3, 150)
@given(paths=shapes(), diameter_mm=st.floats(0.3, 2.5), step_over=st.floats(0.2, 1.0))
def test_random_shapes(paths: list[Polyline], diameter_mm: float, step_over: float) -> None:
    assume(not cross(paths))
    runs = runs_of(work_of(paths, diameter_mm, step_over=step_over))
    if runs:
        assert complaints(runs, region_of(paths), 0.5 * diameter_mm, -1.0) == []


def test_turned_mirrored_and_scaled() -> None:
    paths = SHAPES["letter"]
    for change in (lambda p: rotate(mirrored(p), 0.4), reverse):
        assert wrong([change(path) for path in paths], 0.9, step_over=0.7) == []
    large = [scaled(path, 30.0) for path in paths]
    one = runs_of(work_of(paths, 0.9, step_over=0.7))[0]
    thirty = runs_of(work_of(large, 27.0, step_over=0.7))[0]
    assert thirty.vertices[:, :2] == pytest.approx(30.0 * one.vertices[:, :2], abs=1e-5)


def without_a_ring(run: CutRun) -> CutRun:
    """The run with a shortcut over its middle half."""
    count = len(run.vertices)
    keep = np.r_[0 : count // 4, 3 * count // 4 : count]
    vertices = run.vertices[keep].copy()
    vertices[count // 4 - 1, 3] = 0.0
    return CutRun(vertices, run.feed_mm_min[keep[:-1]], run.plunge_mm_min, run.name)


def test_the_oracle_can_find_fault() -> None:
    (run,) = runs_of(work_of([SQUARE], 1.0))
    assert complaints([run], region_of([SQUARE]), 0.5, -1.0) == []
    (left_over,) = complaints([without_a_ring(run)], region_of([SQUARE]), 0.5, -1.0)
    assert "left over" in left_over
    beside = run.vertices + np.array([0.1, 0.0, 0.0, 0.0])
    aside = CutRun(beside, run.feed_mm_min, run.plunge_mm_min, run.name)
    assert any("into the wall" in each for each in gouges([aside], region_of([SQUARE]), 0.5))


def test_without_tips_a_long_step_would_leave_corners() -> None:
    region = offset_shape(region_of([star(5, 4.0, 12.0)]), 0.5)
    assert any(cell.tips for cell in every_cell(region, Steps(0.95, 0.5)))
    assert not any(cell.tips for cell in every_cell(region, Steps(0.5, 0.5)))


def every_cell(region: Polylines, steps: Steps) -> Iterator[Cell]:
    """All cells of the tree."""
    waiting = [ring_cells(region, steps)]
    while waiting:
        cell = waiting.pop()
        yield cell
        waiting += cell.inner


@pytest.mark.parametrize(
    ("shape", "diameter_mm", "items", "runs"),
    [
        ("square", 1.0, 1, 1),
        ("dumbbell", 1.0, 1, 1),
        ("dumbbell", 2.2, 1, 2),
        ("four stars", 1.0, 1, 1),
        ("core in an annulus", 1.0, 2, 2),
        ("letter", 1.0, 1, 1),
    ],
)
def test_the_tool_goes_down_once_where_it_can_stay(
    shape: str, diameter_mm: float, items: int, runs: int
) -> None:
    work = work_of(SHAPES[shape], diameter_mm, step_over=0.7)
    assert len(work.items) == items
    assert len(runs_of(work)) == runs


def rings_of(run: CutRun) -> list[Polyline]:
    """The closed loops of a run at one level: from a place until it comes there again."""
    (way,) = at_depth([run], -1.0)
    found, begin = [], 0
    rows = way.vertices
    while begin < len(rows):
        again = np.flatnonzero(np.hypot(*(rows[begin + 1 :, :2] - rows[begin, :2]).T) < 1e-7)
        if len(again) and again[0] > 0:
            found.append(Polyline(rows[begin : begin + 1 + again[0]], closed=True))
            begin += 1 + int(again[0])
        else:
            begin += 1
    return found


def test_rings_come_from_inside_out_by_the_step() -> None:
    (run,) = runs_of(work_of([SQUARE], 1.0, step_over=0.4))
    areas = [signed_area(ring) for ring in rings_of(run)]
    sides = [math.sqrt(area) for area in areas]
    assert sides[-1] == pytest.approx(9.0)
    assert np.diff(sides) == pytest.approx([0.8] * (len(sides) - 1))


@pytest.mark.parametrize(("direction", "wall"), [("climb", 1), ("drawn", 1), ("conventional", -1)])
def test_climb_runs_ccw_at_walls_and_cw_at_islands(direction: str, wall: int) -> None:
    paths = [CIRCLE, scaled(CIRCLE, 0.4)]
    (run,) = runs_of(work_of(paths, 1.0, step_over=0.45, direction=direction))
    turns = {
        round(math.sqrt(abs(signed_area(r)) / math.pi), 6): signed_area(r) for r in rings_of(run)
    }
    assert turns[9.5] * wall > 0.0
    assert turns[4.5] * wall < 0.0


def test_arcs_stay_arcs() -> None:
    (run,) = runs_of(work_of([CIRCLE], 2.0, step_over=0.45))
    segments = Segments.between(run.vertices[:-1, :2], run.vertices[1:, :2], run.vertices[:-1, 3])
    rings = 10
    assert segments.is_arc.sum() <= 3 * rings
    assert (~segments.is_arc).sum() == rings - 1
    assert np.abs(segments.centre[segments.is_arc]).max() < 1e-6


def test_an_allowance_stays_on_the_walls_and_islands() -> None:
    paths = SHAPES["island off the middle"]
    runs = runs_of(work_of(paths, 1.0, allowance_mm=0.3))
    assert gouges(runs, region_of(paths), 0.8) == []
    wanted = offset_shape(region_of(paths), 0.3)
    assert complaints(runs, wanted, 0.5, -1.0) == []


@pytest.mark.parametrize("kind", ["plunge", "ramp", "helix"])
def test_every_level_is_cleared_and_reached_no_steeper_than_asked(kind: str) -> None:
    entry = Entry(kind, angle_rad=0.1)
    work = work_of([OBLONG], 2.0, entry=entry, depth_mm=1.0, step_down_mm=0.4, last_pass_mm=0.1)
    (run,) = runs_of(work)
    z = run.vertices[:, 2]
    for level in work.items[0].setting.levels_mm:
        assert complaints([run], region_of([OBLONG]), 1.0, level) == []
    assert z.min() == -1.0
    assert np.all(np.diff(z) <= 0.0)
    assert z[0] == (work.items[0].setting.levels_mm[0] if kind == "plunge" else 0.0)
    flat = Segments.between(run.vertices[:-1, :2], run.vertices[1:, :2], run.vertices[:-1, 3])
    chord = np.hypot(*(flat.end - flat.start).T)
    way = np.where(
        flat.is_arc, np.where(flat.is_arc, flat.radius, 0.0) * np.abs(flat.sweep), chord
    )
    sinks = np.diff(z) < 0.0
    if kind == "plunge":
        assert way[sinks] == pytest.approx(0.0)
        assert np.all(run.feed_mm_min[sinks] == 100.0)
    else:
        assert -np.diff(z)[sinks] / way[sinks] == pytest.approx(math.tan(0.1))
        assert flat.is_arc[sinks].all() == (kind == "helix")
    assert np.all(run.feed_mm_min[~sinks] == 600.0)


def test_a_helix_is_as_large_as_it_may_be() -> None:
    (run,) = runs_of(work_of([SQUARE], 2.0, entry=Entry("helix")))
    helix = Segments.between(run.vertices[:1, :2], run.vertices[1:2, :2], run.vertices[:1, 3])
    assert helix.radius[0] == pytest.approx(0.5)
    assert helix.centre[0] == pytest.approx([5.0, 5.0], abs=0.1)
    (run,) = runs_of(work := work_of([SQUARE], 2.0, entry=Entry("helix", radius_mm=20.0)))
    helix = Segments.between(run.vertices[:1, :2], run.vertices[1:2, :2], run.vertices[:1, 3])
    assert 3.8 < helix.radius[0] <= 4.0
    (changed,) = [f for f in work.findings if f.code == PlanningCode.ENTRY_CHANGED]
    assert "instead of 20 mm" in changed.message


@pytest.mark.parametrize(
    ("width", "entry", "said"),
    [
        (2.05, Entry("helix"), "a ramp instead of a helix"),
        (2.05, Entry("ramp"), None),
        (2.05, Entry("ramp", angle_rad=1e-4), "a plunge instead of a ramp"),
        (2.05, Entry("helix", angle_rad=1e-4), "a plunge instead of a helix"),
        (8.0, Entry("helix", angle_rad=1e-6), "a plunge instead of a helix"),
    ],
)
def test_entries_that_do_not_fit_are_told(width: float, entry: Entry, said: str | None) -> None:
    work = work_of([closed((0, 0), (20, 0), (20, width), (0, width))], 2.0, entry=entry)
    changes = [f.message for f in work.findings if f.code == PlanningCode.ENTRY_CHANGED]
    assert [said in change for change in changes] == ([True] if said else [])
    assert (
        gouges(runs_of(work), region_of([closed((0, 0), (20, 0), (20, width), (0, width))]), 1)
        == []
    )


@pytest.mark.parametrize(
    ("paths", "middle_mm"),
    [
        ([closed((0, 0), (20, 0), (20, 2), (0, 2))], 18.0),
        ([closed((0, 0), (20, 0, 1), (20, 2), (0, 2, 1))], 20.0),
        ([scaled(CIRCLE, 0.8), scaled(CIRCLE, 0.6)], 14.0 * math.pi),
    ],
    ids=["square ends", "round ends", "ring"],
)
def test_a_slot_as_wide_as_the_tool_is_cut_along_its_middle(
    paths: list[Polyline], middle_mm: float
) -> None:
    work = work_of(paths, 2.0, step_down_mm=0.5)
    (slot,) = [f for f in work.findings if f.code == PlanningCode.SLOT_AS_WIDE]
    assert slot.severity == Severity.INFO
    (run,) = runs_of(work)
    (last,) = at_depth([run], -1.0)
    assert length(last) == pytest.approx(middle_mm, abs=1e-3)
    assert gouges([run], region_of(paths), 1.0 - 1e-4) == []
    assert not [f for f in work.findings if f.code == PlanningCode.CONTOUR_TOO_SMALL]


def test_a_neck_as_wide_as_the_tool_is_cut_too() -> None:
    work = work_of([DUMBBELL], 2.0)
    assert len(runs_of(work)) == 3
    assert [f.code for f in work.findings].count(PlanningCode.SLOT_AS_WIDE) == 1
    assert all(f.severity == Severity.INFO for f in work.findings)


def test_what_is_a_hair_too_narrow_is_a_slot_and_more_is_not() -> None:
    for width, count in ((1.9985, 1), (1.99, 0)):
        work = work_of([closed((0, 0), (20, 0), (20, width), (0, width))], 2.0)
        assert len(runs_of(work)) == count


def test_a_pocket_too_small_is_listed_with_its_area() -> None:
    work = work_of([SQUARE, moved(scaled(SQUARE, 0.1), 20.0, 0.0)], 2.0)
    assert len(work.items) == 1
    (finding,) = [f for f in work.findings if f.code == PlanningCode.CONTOUR_TOO_SMALL]
    assert finding.measured == pytest.approx(1.0)
    assert "PATH 1" in finding.where


def test_what_stays_uncut_is_told_in_few_lines() -> None:
    work = work_of([comb(30)], 1.2)
    uncut = [f for f in work.findings if f.code == PlanningCode.UNREACHED]
    assert 1 <= len(uncut) <= 15
    assert sum(f.measured or 0.0 for f in uncut) > 30 * 5.8


@pytest.mark.parametrize(
    ("paths", "diameter_mm", "said"),
    [
        (
            [SQUARE, open_path((20, 0), (30, 0), (30, 5))],
            1.0,
            ["PATH 1", "open", "clear", "close"],
        ),
        ([SQUARE], 0.0, ["width", "key tool", "diameter"]),
        (
            [SQUARE, moved(SQUARE, 5.0, 5.0)],
            1.0,
            ["cross", "PATH 0", "PATH 1", "join or separate"],
        ),
        ([closed((0, 0), (10, 10), (10, 0), (0, 10))], 1.0, ["cross", "PATH 0"]),
        ([SQUARE], 1.0, ["step", "key step_over", "larger"]),
    ],
    ids=["open", "no width", "crossing", "eight", "steps without end"],
)
def test_bad_input_names_path_operation_and_mend(
    paths: list[Polyline], diameter_mm: float, said: list[str]
) -> None:
    with pytest.raises(OptionError) as refused:
        work_of(paths, diameter_mm, name="clear it", step_over=1e-9 if "step" in said else 0.4)
    for word in said:
        assert word in str(refused.value)
    assert "operation 'clear it'" in str(refused.value)


def test_nothing_to_clear_is_no_work() -> None:
    work = pocket(chosen_of([]), setting_of(1.0))
    assert (work.items, work.findings) == ((), ())


def test_items_know_where_they_come_from() -> None:
    work = work_of(SHAPES["core in an annulus"], 1.0)
    assert [(item.source, item.name) for item in work.items] == [(0, "0/PATH 0"), (2, "0/PATH 2")]
    for item in work.items:
        assert isinstance(item, Fixed)
        assert item.outline is not None
        assert {run.name for run in item.runs} == {item.name}


def test_the_same_again() -> None:
    one, two = (work_of(SHAPES["four stars"], 1.0, step_over=0.8) for _ in range(2))
    for run, other in zip(runs_of(one), runs_of(two), strict=True):
        assert np.array_equal(run.vertices, other.vertices)


def test_parts_of_a_region_keep_their_holes() -> None:
    paths = [SQUARE, moved(scaled(CIRCLE, 0.1), 5, 5), moved(SQUARE, 20, 0)]
    paths.append(moved(scaled(CIRCLE, 0.1), 25, 5))
    parts = parts_of(region_of(paths))
    assert [len(part) for part in parts] == [2, 2]
    assert [float(part.vertices[0, 0]) for part in parts] == [0.0, 20.0]
    assert parts_of(region_of([])) == []


def test_swept_discs_cover_what_is_near() -> None:
    (way,) = at_depth(runs_of(work_of([SLOT], 1.0)), -1.0)
    area = swept.swept([way], 0.5, 0.05)
    assert area.area == pytest.approx(200.0 + 25.0 * math.pi, rel=2e-3)


def test_links_are_no_longer_than_the_step() -> None:
    (run,) = runs_of(work_of([SQUARE], 1.0, step_over=0.4))
    (way,) = at_depth([run], -1.0)
    rings = rings_of(run)
    assert length(way) - sum(map(length, rings)) == pytest.approx(0.4 * (len(rings) - 1))
    assert all(a.start != pytest.approx(b.start) for a, b in pairwise(rings))
