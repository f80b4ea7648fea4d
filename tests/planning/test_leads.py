"""Leads: tangent to the contour, on the free side, and never where the tool does harm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.distance import points_to_segments
from camtool.geometry.polylines import Polyline, Polylines, Segments, begin_at, reverse
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Contour, Feeds, Setting
from camtool.planning.job import Lead, Operation, Tool
from camtool.planning.leads import (
    LEAD_HALVINGS,
    LEAD_SLACK_MM,
    KeepOut,
    leads_of,
    runs_back,
    segments_near,
    signed_distances,
)
from camtool.planning.paths import MeasuredPath
from tests.oracles.arcs import chain_distances, chain_points
from tests.oracles.runs import runs_of
from tests.paths import moved
from tests.strategies import contours, examples, open_contours, polylines

ARC, LINE = Lead("arc", 2.0), Lead("line", 2.0)
SQUARE = Polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0.0]]), True)
MIDDLE = Polyline(np.array([[5, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [0, 0, 0.0]]), True)
OPEN = Polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 5, 0.0]]))
NOTHING = KeepOut(Polylines.of([]), np.empty(0, dtype=np.bool_))
"""Nothing else to keep away from."""


def contour(path: Polyline, left: bool | None, radius: float = 0.5, **kind: Any) -> Contour:
    kind = {"lead_in": ARC, "lead_out": ARC, "tool": Tool(2.0 * radius), "name": "out", **kind}
    setting = Setting(Operation(**kind), Feeds(100.0, 30.0), (-1.0,), 2.0)
    return Contour(path, setting, "part/LINE 1", 0, material_left=left)


def leads(path: Polyline, left: bool | None, keep_out: Sequence[Polyline] = (), **kind: Any):
    along = MeasuredPath.of(path)
    lines = KeepOut(Polylines.of(keep_out), np.zeros(len(keep_out), dtype=np.bool_))
    return leads_of(contour(path, left, **kind), along, (0.0, along.total_mm), lines)


def test_arcs_come_from_the_free_side_along_the_tangent() -> None:
    """Quarter arcs, told by their far ends."""
    quarter = math.tan(math.pi / 8.0)
    outside, inside = leads(MIDDLE, True), leads(MIDDLE, False)
    assert outside.way_in == pytest.approx(np.array([[3, -2, -quarter], [5, 0, 0]]))
    assert outside.way_out == pytest.approx(np.array([[5, 0, -quarter], [7, -2, 0]]))
    assert inside.way_in == pytest.approx(np.array([[3, 2, quarter], [5, 0, 0]]))
    assert inside.way_out == pytest.approx(np.array([[5, 0, quarter], [7, 2, 0]]))
    assert outside.findings == inside.findings == ()


def test_lines_go_on_along_the_tangent() -> None:
    made = leads(SQUARE, True, lead_in=LINE, lead_out=LINE)
    assert made.way_in == pytest.approx(np.array([[-2, 0, 0], [0, 0, 0.0]]))
    assert made.way_out == pytest.approx(np.array([[0, 0, 0], [0, -2, 0.0]]))


def test_engraved_lines_have_no_free_side() -> None:
    made = leads(OPEN, None)
    assert made.way_in == pytest.approx(np.array([[-2, 0, 0], [0, 0, 0.0]]))
    assert made.way_out == pytest.approx(np.array([[10, 5, 0], [10, 7, 0.0]]))


@pytest.mark.parametrize("which", ["lead_in", "lead_out"])
def test_each_end_has_its_own(which: str) -> None:
    other = {"lead_in": "lead_out", "lead_out": "lead_in"}[which]
    made = leads(MIDDLE, True, **{which: Lead()})
    assert len(made.way_in) == (0 if which == "lead_in" else 2)
    assert len(made.way_out) == (0 if other == "lead_in" else 2)
    assert made.findings == ()


def test_inside_a_corner_a_line_would_cut_the_part_and_is_left_out() -> None:
    made = leads(SQUARE, False, lead_in=LINE, lead_out=Lead())
    assert len(made.way_in) == 0
    (finding,) = made.findings
    assert finding.code == PlanningCode.LEAD_LEFT_OUT
    assert finding.measured == 0.0
    assert finding.limit == 2.0
    assert "part/LINE 1 at X 0.0000 Y 0.0000" in finding.where


def test_a_large_arc_in_a_small_hole_is_halved() -> None:
    hole = Polyline(np.array([[-1, 0, 1.0], [1, 0, 1.0]]), True)
    made = leads(hole, False, lead_out=Lead())
    # The arc of 2 mm lies outside of the circle of 1 mm, that of 1 mm just within.
    assert math.dist(made.way_in[0, :2], made.way_in[1, :2]) == pytest.approx(math.sqrt(2.0))
    assert np.hypot(*made.way_in[0, :2]) <= 1.0
    assert [each.measured for each in made.findings] == [1.0]


def test_halving_ends_at_a_least_size() -> None:
    wall = Polyline(np.array([[-20, -0.51, 0], [20, -0.51, 0.0]]))
    made = leads(MIDDLE, True, [wall])
    assert len(made.way_in) == len(made.way_out) == 0
    near = Polyline(np.array([[-20, -0.5 - 2.0 / 2**LEAD_HALVINGS, 0], [20, -0.625, 0.0]]))
    made = leads(MIDDLE, True, [near])
    assert {each.measured for each in made.findings} == {2.0 / 2**LEAD_HALVINGS}


def test_a_lead_does_not_jump_through_a_thin_wall() -> None:
    """Both its ends are clear of it."""
    wall = Polyline(np.array([[4.0, -0.1, 0], [4.0, -0.4, 0.0]]))
    clear = leads(MIDDLE, True, lead_in=ARC, lead_out=Lead(), radius=0.0)
    crossed = leads(MIDDLE, True, [wall], lead_in=Lead("arc", 2.0), lead_out=Lead(), radius=0.05)
    assert clear.findings == ()
    assert len(crossed.findings) == 1
    assert crossed.findings[0].measured == 1.0


def test_a_lead_does_not_cross_a_finger_of_its_own_contour() -> None:
    """Its ends and its middle are free; between them it runs through the finger."""
    part = [[4, 0], [4, 2], [5, 2], [5, -2], [5.3, -2], [5.3, 3], [0, 3], [0, 0]]
    comb = Polyline(np.column_stack([np.array(part, dtype=np.float64), np.zeros(8)]), True)
    made = leads(comb, True, radius=0.0, lead_in=Lead(), lead_out=Lead("line", 3.0))
    assert [each.measured for each in made.findings] == [0.75]
    assert made.way_out[1, :2] == pytest.approx([4.75, 0.0])


def test_an_engraved_line_may_lie_in_what_is_kept() -> None:
    """Leads may cross the contour's own cut, but no other lines that must be kept."""
    assert leads(OPEN, None, [OPEN]).findings == ()
    other = Polyline(np.array([[-3, -1, 0], [-3, 1, 0.0]]))
    assert [each.measured for each in leads(OPEN, None, [OPEN, other]).findings] == []
    nearer = moved(other, 0.9, 0.0)
    assert [each.measured for each in leads(OPEN, None, [OPEN, nearer]).findings] == [1.0]


def _dense(lead: np.ndarray) -> np.ndarray:
    return chain_points(lead, 200)


def _ring(path: Polyline) -> np.ndarray:
    return np.concatenate([path.vertices, path.vertices[:1]])


def _left(path: Polyline, points: np.ndarray) -> np.ndarray:
    """(J,) distance, positive on the left: even-odd over very fine chords of a closed path."""
    import shapely

    fine = chain_points(_ring(path), 400)
    polygon = shapely.Polygon(fine)
    within = shapely.contains_xy(polygon, points[:, 0], points[:, 1])
    x, y = fine.T
    ccw = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0.0
    distance = chain_distances(points, _ring(path))
    return np.where(within == ccw, distance, -distance)


@examples(30, 2000)
@given(
    contours(),
    st.integers(0, 11),
    st.booleans(),
    st.sampled_from(["line", "arc"]),
    st.floats(0.1, 5.0),
    st.tuples(st.floats(-12.0, 12.0), st.floats(-12.0, 12.0)),
)
def test_no_point_of_a_lead_does_harm(
    path: Polyline, start: int, left: bool, kind: str, size: float, off: tuple[float, float]
) -> None:
    path = begin_at(path, start % len(path))
    other = moved(path, *off)
    radius = 0.3
    clear = chain_distances(path.start[None], _ring(other))[0] > radius
    made = leads(
        path, left, [other], radius=radius, lead_in=Lead(kind, size), lead_out=Lead(kind, size)
    )
    for lead in (made.way_in, made.way_out):
        if not len(lead):
            continue
        points = _dense(lead)
        side = _left(path, points)
        assert (-side if left else side).min() >= -LEAD_SLACK_MM - 1e-3  # the chords of _left
        assert chain_distances(points, _ring(other)).min() >= radius - LEAD_SLACK_MM - 1e-9
        length = math.dist(lead[0, :2], lead[1, :2]) / (math.sqrt(2.0) if kind == "arc" else 1.0)
        halvings = math.log2(size / length)
        assert halvings == pytest.approx(round(halvings), abs=1e-6)
        assert 0 <= round(halvings) <= LEAD_HALVINGS
    short = sum(each.code == PlanningCode.LEAD_LEFT_OUT for each in made.findings)
    assert short == len(made.findings)
    if not clear:
        assert len(made.way_in) == len(made.way_out) == 0


@given(contours(), st.integers(0, 11), st.booleans())
def test_leads_meet_the_contour_along_its_tangent(path: Polyline, start: int, left: bool) -> None:
    path = begin_at(path, start % len(path))
    along = MeasuredPath.of(path)
    made = leads(path, left, lead_in=Lead("arc", 0.2), lead_out=Lead("arc", 0.2))
    for lead, wanted, at in (
        (made.way_in, along.directions(np.zeros(1))[0], 1.0),
        (made.way_out, along.arrivals(np.array([along.total_mm]))[0], 0.0),
    ):
        if len(lead):
            meets = MeasuredPath.of(Polyline(lead))
            where = np.array([at * meets.total_mm])
            assert meets.at(where)[0] == pytest.approx(path.start, abs=1e-9)
            got = meets.directions(where) if at == 0.0 else meets.arrivals(where)
            assert got[0] == pytest.approx(wanted, abs=1e-9)
            assert meets.total_mm <= 0.2 * 0.5 * math.pi + 1e-9


@given(
    contours(),
    st.lists(st.tuples(st.floats(-12.0, 12.0), st.floats(-12.0, 12.0)), min_size=1, max_size=8),
)
def test_left_of_closed_paths(path: Polyline, places: list[tuple[float, float]]) -> None:
    points = np.array(places)
    wanted = _left(path, points)
    sure = np.abs(wanted) > 1e-3
    assert signed_distances(path, points)[sure] == pytest.approx(wanted[sure], abs=1e-6)


@given(open_contours(), st.floats(0.0, 1.0), st.sampled_from([-1e-3, 1e-3]))
def test_left_of_open_paths(path: Polyline, share: float, off: float) -> None:
    """A hair beside the path, and what is so for the way back is the other side."""
    along = MeasuredPath.of(path)
    where = np.array([share * along.total_mm])
    ahead = along.directions(where)[0]
    point = along.at(where) + off * np.array([[-ahead[1], ahead[0]]])
    found = signed_distances(path, point)[0]
    assert found == pytest.approx(-signed_distances(reverse(path), point)[0], abs=1e-9)
    vertex = np.abs(along.reach - where).min()
    if vertex > 0.05:
        # Within a sharp corner another piece may be as near, on the same side.
        assert math.copysign(1.0, found) == math.copysign(1.0, off)


def test_left_of_beyond_the_ends_of_an_open_path_is_beside_its_tangent() -> None:
    points = np.array([[-3.0, 0.0], [-3.0, 0.5], [-3.0, -0.5], [10.0, 9.0], [9.0, 9.0]])
    assert signed_distances(OPEN, points) == pytest.approx([0.0, 0.5, -0.5, 0.0, 1.0])
    corner = np.array([[10.5, -0.5], [9.5, 0.5]])
    assert signed_distances(OPEN, corner) == pytest.approx([-math.sqrt(0.5), 0.5])


@given(
    st.lists(polylines(), min_size=1, max_size=4),
    st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    st.floats(0.1, 10.0),
)
def test_no_segment_that_is_near_is_passed_over(
    paths: list[Polyline], place: tuple[float, float], reach: float
) -> None:
    lines = Polylines.of(paths)
    every = Segments.of(lines)
    found = segments_near(lines, np.array(place), reach)
    distance = points_to_segments(np.array([place]), every)[0]
    near = distance <= reach
    have = {tuple(row) for row in np.column_stack([found.start, found.bulge, found.path]).tolist()}
    wanted = np.column_stack([every.start, every.bulge, every.path])[near]
    assert have >= {tuple(row) for row in wanted.tolist()}
    assert len(found) <= len(every)


@given(st.one_of(contours(), open_contours()), st.integers(0, 11))
def test_runs_back(path: Polyline, start: int) -> None:
    other = begin_at(path, start % len(path)) if path.closed else path
    assert not runs_back(path, other)
    assert runs_back(path, reverse(other))
    measured = MeasuredPath.of(path)
    part = measured.piece(0.2 * measured.total_mm, 0.6 * measured.total_mm)
    assert not runs_back(path, Polyline(part))
    assert runs_back(path, reverse(Polyline(part)))


def test_a_part_of_a_contour_keeps_to_the_whole_one() -> None:
    """A half of the square, from the middle of a side: the arc of the lead-out would cut it."""
    half = Polyline(MeasuredPath.of(MIDDLE).piece(0.0, 15.0))
    alone = contour(half, True, lead_in=Lead(), lead_out=LINE)
    whole = Contour(half, alone.setting, "part", 0, material_left=True, outline=SQUARE)
    drawn = Contour(half, alone.setting, "part", 0, material_left=True, outline=reverse(SQUARE))
    ends = (0.0, 15.0)
    free = leads_of(alone, MeasuredPath.of(half), ends, NOTHING)
    assert free.way_out == pytest.approx(np.array([[10, 10, 0], [10, 12, 0.0]]))
    inner = Contour(half, alone.setting, "part", 0, material_left=False, outline=SQUARE)
    for each in (whole, drawn):
        assert leads_of(each, MeasuredPath.of(half), ends, NOTHING).findings == ()
    assert len(leads_of(inner, MeasuredPath.of(half), ends, NOTHING).findings) == 1


def test_leads_are_flat_and_belong_to_the_run() -> None:
    runs, findings = runs_of(contour(MIDDLE, True, overlap_mm=1.0), MIDDLE)
    assert findings == []
    vertices = runs[0].vertices
    assert vertices[0].tolist() == pytest.approx([3, -2, -1.0, -math.tan(math.pi / 8)])
    assert vertices[-2].tolist() == pytest.approx([6, 0, -1.0, -math.tan(math.pi / 8)])
    assert vertices[-1].tolist() == pytest.approx([8, -2, -1.0, 0.0])
    assert (vertices[:, 2] == -1.0).all()
