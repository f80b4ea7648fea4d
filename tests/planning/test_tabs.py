"""Tabs: the bridge that a tool of radius r really leaves, where it stands, how high it is."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.measure import length
from camtool.geometry.polylines import Polyline, begin_at, reverse
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Contour, Feeds, Setting
from camtool.planning.job import Entry, Lead, Operation, Tabs, Tool
from camtool.planning.paths import MeasuredPath
from camtool.planning.tabs import raise_profile, tabs_of
from tests.oracles.runs import run_points, runs_of, steepest
from tests.strategies import contours

STEP = 0.01
DIAMETER = 1.0
WIDTH = 1.2
BOTTOM = -2.0
SQUARE = Polyline(np.array([[0, 0, 0], [12, 0, 0], [12, 12, 0], [0, 12, 0.0]]), True)
OBLONG = Polyline(np.array([[0, 0, 0], [16, 0, 0], [16, 8, 0], [0, 8, 0.0]]), True)
ROUND = Polyline(np.array([[0, 0, 1.0], [8, 0, 1.0]]), True)
OPEN = Polyline(np.array([[0, 0, 0.5], [9, 0, -0.3], [9, 9, 0], [0, 9, 0.0]]))


def contour(path: Polyline, tabs: Tabs, **kind: Any) -> Contour:
    kind = {"name": "out", "tool": Tool(DIAMETER), **kind}
    levels = kind.pop("levels", (-1.0, BOTTOM))
    setting = Setting(Operation(tabs=tabs, **kind), Feeds(100.0, 30.0), levels, 2.0)
    return Contour(path, setting, "part/LINE 1", 0)


def tops(path: Polyline, made: Contour, bottom: float = BOTTOM) -> list[np.ndarray]:
    """The pieces (k, 3) of the last pass at which the tool is not at the bottom."""
    runs, _ = runs_of(made, path)
    points = run_points(runs[-1].vertices, STEP)
    # All round it, or from end to end.
    to_go = np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T)[::-1])[::-1]
    points = points[1:][to_go < length(path) - STEP]
    up = points[:, 2] > bottom + 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], up.astype(np.int64), [0]])))
    return [points[low:high] for low, high in zip(edges[::2], edges[1::2], strict=True)]


@pytest.mark.parametrize("path", [SQUARE, OBLONG, ROUND, OPEN])
@pytest.mark.parametrize("ramped", [False, True])
@pytest.mark.parametrize("entry", [Entry(), Entry("ramp", 0.5)])
def test_the_bridge_is_as_wide_as_asked_at_its_top(
    path: Polyline, ramped: bool, entry: Entry
) -> None:
    tabs = Tabs(count=3, width_mm=WIDTH, height_mm=0.6, ramped=ramped)
    pieces = tops(path, contour(path, tabs, entry=entry))
    assert len(pieces) == 3
    for piece in pieces:
        assert piece[:, 2].max() == pytest.approx(BOTTOM + 0.6)
        top = piece[piece[:, 2] >= BOTTOM + 0.6 - 1e-9]
        # Between the two discs of the tool where it goes up and down.
        across = math.dist(top[0, :2], top[-1, :2]) - DIAMETER
        assert across == pytest.approx(WIDTH, abs=3.0 * STEP)
        assert across == pytest.approx(WIDTH, abs=1e-6)


@pytest.mark.parametrize("path", [SQUARE, ROUND, OPEN])
def test_no_other_part_of_the_path_cuts_the_bridge(path: Polyline) -> None:
    tabs = Tabs(count=4, width_mm=WIDTH, height_mm=0.5)
    made = contour(path, tabs)
    runs, _ = runs_of(made, path)
    points = np.concatenate([run_points(run.vertices, STEP) for run in runs])
    low = points[points[:, 2] < BOTTOM + 0.5 - 1e-6]
    pieces = tops(path, made)
    assert len(pieces) == 4
    for piece in pieces:
        middle = 0.5 * (piece[0, :2] + piece[-1, :2])
        free = np.hypot(*(low[:, :2] - middle).T).min() - 0.5 * DIAMETER
        assert free >= 0.5 * WIDTH - 2.0 * STEP


def test_leads_of_open_contours_move_no_tab() -> None:
    tabs = Tabs(count=3, width_mm=WIDTH, height_mm=0.5)
    plain = tops(OPEN, contour(OPEN, tabs))
    lead = Lead("line", 3.0)
    led, _ = runs_of(contour(OPEN, tabs, lead_in=lead), OPEN)
    high = led[-1].vertices[led[-1].vertices[:, 2] == BOTTOM + 0.5]
    for piece in plain:
        for place in (piece[1], piece[-2]):
            assert np.hypot(*(high[:, :2] - place[:2]).T).min() <= 2.0 * STEP


def test_only_passes_below_the_top_are_raised() -> None:
    tabs = Tabs(count=2, width_mm=WIDTH, height_mm=0.5)
    runs, _ = runs_of(contour(SQUARE, tabs, levels=(-1.0, -1.4, -1.5, -1.8, -2.0)), SQUARE)
    heights = [float(z) for z in runs[0].vertices[:, 2]]
    up = [(a, b) for a, b in pairwise(heights) if b > a]
    assert up == [(-1.8, -1.5)] * 2 + [(-2.0, -1.5)] * 2


def test_sides_are_straight_or_slope_as_the_entry_does() -> None:
    for entry, ramped, slope in (
        (Entry(), True, 1.0),
        (Entry("ramp", math.radians(20.0)), True, math.tan(math.radians(20.0))),
        (Entry("ramp", math.radians(60.0)), True, 1.0),
    ):
        tabs = Tabs(count=2, width_mm=WIDTH, height_mm=0.5, ramped=ramped)
        runs, _ = runs_of(contour(SQUARE, tabs, entry=entry), SQUARE)
        # The tool goes up only at tabs; down nowhere more steeply than there, or than the entry.
        up = steepest(runs[0].vertices * [1.0, 1.0, -1.0, 1.0])
        assert up == pytest.approx(slope)
        assert steepest(runs[0].vertices) <= max(slope, math.tan(entry.angle_rad)) * (1 + 1e-6)
        straight = [
            (a, b)
            for a, b in pairwise(runs[0].vertices.tolist())
            if a[:2] == b[:2] and b[2] > a[2]
        ]
        assert straight == []
    tabs = Tabs(count=2, width_mm=WIDTH, height_mm=0.5)
    runs, _ = runs_of(contour(SQUARE, tabs), SQUARE)
    up = [(a, b) for a, b in pairwise(runs[0].vertices.tolist()) if b[2] > a[2]]
    assert len(up) == 2
    assert all(a[:2] == b[:2] for a, b in up)


@pytest.mark.parametrize(
    ("tabs", "wanted"),
    [
        (Tabs(count=1), 1),
        (Tabs(count=5), 5),
        (Tabs(spacing_mm=12.0), 4),
        (Tabs(spacing_mm=11.9), 5),
        (Tabs(spacing_mm=16.0), 3),
        (Tabs(spacing_mm=100.0), 1),
    ],
)
def test_count_and_spacing(tabs: Tabs, wanted: int) -> None:
    """Tabs by spacing are never farther apart than the spacing."""
    assert len(tops(SQUARE, contour(SQUARE, tabs))) == wanted


def _lengths(path: Polyline, tabs: Tabs) -> list[tuple[float, float]]:
    found, findings = tabs_of(contour(path, tabs), MeasuredPath.of(path))
    assert findings == []
    return [(tab.begin, tab.end) for tab in found]


def test_tabs_stand_in_the_middle_of_equal_shares() -> None:
    spans = _lengths(ROUND, Tabs(count=3, width_mm=1.0))
    third = 8.0 * math.pi / 3.0
    assert [0.5 * (low + high) for low, high in spans] == pytest.approx(
        [0.5 * third, 1.5 * third, 2.5 * third]
    )


def test_tabs_keep_off_corners_and_the_seam_where_they_can() -> None:
    for start in range(4):
        path = begin_at(OBLONG, start)
        corners = MeasuredPath.of(path).reach
        for count in (2, 3, 4, 5, 6, 7):
            spans = _lengths(path, Tabs(count=count, width_mm=WIDTH))
            assert len(spans) == count
            for low, high in spans:
                assert not ((corners > low + 1e-9) & (corners < high - 1e-9)).any()
    # Where there is nothing but corners, they stand on them.
    angles = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    many = Polyline(np.column_stack([4 * np.cos(angles), 4 * np.sin(angles), 0 * angles]), True)
    assert len(_lengths(many, Tabs(count=3, width_mm=WIDTH))) == 3


@given(contours(), st.integers(1, 4), st.booleans())
def test_tabs_on_any_contour(path: Polyline, count: int, ramped: bool) -> None:
    tabs = Tabs(count=count, width_mm=0.3, height_mm=0.2, ramped=ramped)
    made = contour(path, tabs, tool=Tool(0.2))
    found, findings = tabs_of(made, MeasuredPath.of(path))
    assert len(found) + len(findings) == count
    assert all(each.code == PlanningCode.TAB_LEFT_OUT for each in findings)
    total, along = length(path), MeasuredPath.of(path)
    for which, tab in enumerate(found):
        ends = along.at(np.array([tab.begin, tab.end]))
        assert math.dist(*ends) == pytest.approx(0.5, abs=1e-5)
        foot = 0.2 if ramped else 0.0
        assert tab.begin - foot >= -1e-5
        assert tab.end + foot <= total + 1e-5
        if which:
            assert tab.begin - foot >= found[which - 1].end + foot - 2e-5
    # The other way round the tabs stand at the same places, when the path begins there too.
    other = reverse(path)
    again, _ = tabs_of(contour(other, tabs, tool=Tool(0.2)), MeasuredPath.of(other))
    assert len(again) == len(found)


def test_a_tab_in_a_slot_hardly_wider_than_the_tool_holds_nothing() -> None:
    narrow = Polyline(np.array([[0, 0, 0], [20, 0, 0], [20, 0.3, 0], [0, 0.3, 0.0]]), True)
    found, findings = tabs_of(
        contour(narrow, Tabs(count=2, width_mm=WIDTH)), MeasuredPath.of(narrow)
    )
    assert found == []
    assert [each.code for each in findings] == [PlanningCode.TAB_LEFT_OUT] * 2
    assert "part/LINE 1" in findings[0].where


def test_a_circle_too_small_for_the_width_gets_no_tab() -> None:
    """Long enough along the path, not wide enough across."""
    small = Polyline(np.array([[0, 0, 1.0], [2.0, 0, 1.0]]), True)
    found, findings = tabs_of(
        contour(small, Tabs(count=1, width_mm=WIDTH)), MeasuredPath.of(small)
    )
    assert found == []
    assert [each.code for each in findings] == [PlanningCode.TAB_LEFT_OUT]


@pytest.mark.parametrize(
    ("tabs", "word"),
    [
        (Tabs(count=22, width_mm=1.2), "longer"),
        (Tabs(count=1, width_mm=47.5), "longer"),
        (Tabs(spacing_mm=1.0), "longer"),
        (Tabs(count=11, height_mm=1.2, ramped=True), "longer"),
        (Tabs(count=1, height_mm=2.1), "higher"),
    ],
)
def test_tabs_that_cannot_be(tabs: Tabs, word: str) -> None:
    with pytest.raises(OptionError) as caught:
        runs_of(contour(SQUARE, tabs), SQUARE)
    assert word in caught.value.message
    assert caught.value.where == "operation 'out', key tabs"
    assert caught.value.mend


def test_tabs_as_high_as_the_cut_are_deep_reach_the_stock_top() -> None:
    pieces = tops(SQUARE, contour(SQUARE, Tabs(count=2, width_mm=WIDTH, height_mm=2.0)))
    assert [piece[:, 2].max() for piece in pieces] == [0.0, 0.0]


LENGTHS = st.floats(0.0, 48.0)


@example([(0.0, -2.0), (5e-324, -0.5)], False)  # failed once: its slope is infinite
@given(st.lists(st.tuples(LENGTHS, st.floats(-2.0, 0.0)), min_size=2, max_size=6), st.booleans())
def test_a_raised_profile_is_the_higher_of_profile_and_tabs(
    knots: list[tuple[float, float]], ramped: bool
) -> None:
    asked = Tabs(count=3, width_mm=1.0, ramped=ramped)
    tabs = tabs_of(contour(SQUARE, asked), MeasuredPath.of(SQUARE))[0]
    made = raise_profile(knots, tabs, 48.0)
    assert made[0][0] == knots[0][0]
    assert made[0][1] >= knots[0][1]  # on a tab the tool does not go down beside it

    def at(profile: list[tuple[float, float]]) -> list[list[tuple[float, float]]]:
        return [
            [
                (s, a[1] + (b[1] - a[1]) * share)
                for share in np.linspace(0.01, 0.99, 57)
                for s in [a[0] + (b[0] - a[0]) * share]
            ]
            for a, b in pairwise(profile)
            if abs(b[0] - a[0]) > 1e-6
        ]

    for piece in at(made):
        for s, z in piece:
            # On some line of the plain profile, or on a tab, and below neither everywhere.
            over = max(tab.height(s) for tab in tabs)
            lines = [
                a[1] + (b[1] - a[1]) * (s - a[0]) / (b[0] - a[0])
                for a, b in pairwise(knots)
                if min(a[0], b[0]) - 1e-9 <= s <= max(a[0], b[0]) + 1e-9 and a[0] != b[0]
            ]
            assert any(abs(max(line, over) - z) <= 1e-6 for line in lines)
    assert sum(abs(b[0] - a[0]) for a, b in pairwise(made)) == pytest.approx(
        sum(abs(b[0] - a[0]) for a, b in pairwise(knots))
    )
