"""Boring: which circles, the helices that clear them, and programs of every machine."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.polylines import Polyline
from camtool.operations.bore.work import CORE_SHARE, MAX_TURNS, bore, radii
from camtool.planning.findings import PlanningCode
from camtool.planning.holes import HOLE_SIZE_MM
from camtool.planning.items import CutRun, Feeds, Fixed, Setting, Work
from camtool.planning.job import Entry, Operation, Tool
from camtool.planning.ramps import MIN_HELIX_SHARE
from tests.oracles.run_sweep import swept
from tests.planning.test_drill import chosen_of, circle

FEEDS = Feeds(400.0, 100.0)


def setting_of(depth: float = 3.0, **settings: object) -> Setting:
    settings.setdefault("tool", Tool(3.0))
    operation = Operation(kind="bore", name="bores", **settings)  # type: ignore[arg-type]
    return Setting(operation, FEEDS, (-depth,), 5.0)


def runs_of(work: Work) -> list[CutRun]:
    return [run for item in work.items if isinstance(item, Fixed) for run in item.runs]


@given(
    diameter=st.floats(3.02, 30.0),
    depth=st.floats(0.2, 12.0),
    step_over=st.floats(0.2, 0.9),
    angle=st.floats(0.02, 0.6),
    step_down=st.none() | st.floats(0.2, 3.0),
    allowance=st.sampled_from([-0.1, -0.004, 0.0, 0.004, 0.1]),
    conventional=st.booleans(),
)
def test_the_tool_clears_the_hole_and_nothing_else(
    diameter: float,
    depth: float,
    step_over: float,
    angle: float,
    step_down: float | None,
    allowance: float,
    conventional: bool,
) -> None:
    if diameter < 3.0 + 2.0 * allowance + 2.0 * HOLE_SIZE_MM:
        return
    setting = setting_of(
        depth,
        step_over=step_over,
        step_down_mm=step_down,
        entry=Entry("helix", angle),
        allowance_mm=allowance,
        direction="conventional" if conventional else "climb",
    )
    runs = runs_of(bore(chosen_of([circle(5, 6, diameter)]), setting))
    floor = swept(runs, 1.5, below=depth * (1.0 - 1e-12))
    hole = shapely.Point(5, 6).buffer(0.5 * diameter - allowance, quad_segs=256)
    # Dense places and chords of the buffers leave some micrometres.
    assert floor.buffer(-0.02).within(hole)
    assert hole.buffer(-0.02).within(floor)
    if 0.5 * diameter - allowance - 1.5 < MIN_HELIX_SHARE * 1.5:
        return  # the tool plunges
    for run in runs:
        heights = run.vertices[:, 2]
        assert heights[0] == 0.0
        assert (np.diff(heights) <= 1e-12).all()
        radius = math.hypot(*(run.vertices[0, :2] - [5, 6]))
        turns = np.count_nonzero(np.diff(heights)) / 4.0
        pitch = depth / turns
        steepest = 2.0 * math.pi * radius * math.tan(angle)
        if turns < MAX_TURNS:
            assert pitch <= steepest * (1.0 + 1e-6)
            assert step_down is None or pitch <= step_down * (1.0 + 1e-6)
        # The last turn is whole and flat, and the tool leaves for the centre.
        assert heights[-6:].tolist() == [-depth] * 6
        assert run.vertices[-1, :2].tolist() == pytest.approx([5, 6])
        assert run.vertices[-6, :2].tolist() == pytest.approx(run.vertices[-2, :2].tolist())
        bulges = run.vertices[:-2, 3]
        assert (np.sign(bulges) == (-1.0 if conventional else 1.0)).all()
        # Down no faster than plunges are.
        down = -np.diff(heights)
        length = np.hypot(down, radius * 0.5 * math.pi)
        assert (run.feed_mm_min * down / length <= FEEDS.plunge_mm_min * (1 + 1e-9)).all()


@given(st.floats(0.001, 50.0), st.floats(0.1, 5.0), st.floats(0.02, 5.0))
def test_rings_leave_no_core_and_are_no_farther_apart_than_a_step(
    wide: float, tool: float, step: float
) -> None:
    rings = radii(wide, tool, step)
    assert rings[-1] == wide
    assert rings[0] <= CORE_SHARE * tool * (1.0 + 1e-9)
    assert (np.diff(rings) <= step * (1.0 + 1e-6)).all()
    assert (np.diff(rings) > 0.0).all()


def test_what_is_no_bore_is_named() -> None:
    paths = [
        circle(0, 0, 8.0),
        circle(20, 0, 3.0),
        circle(30, 0, 2.0),
        circle(0, 0, 4.0),
        circle(0, 0, 8.0),
        Polyline(np.array([[0, 0, 0], [9, 0, 0], [9, 5, 0.0]]), closed=True),
    ]
    work = bore(chosen_of(paths), setting_of())
    assert [item.name for item in work.items] == ["PATH 0"]
    others, small, within = work.findings
    assert {each.code for each in work.findings} == {PlanningCode.NOT_BORED}
    assert (others.where, others.severity) == ("PATH 5", Severity.WARNING)
    assert (small.where, small.severity) == ("PATH 1, PATH 2", Severity.WARNING)
    assert "circles wider than 3 mm: 2 circles of 2 mm" in small.message
    assert (within.where, within.severity) == ("PATH 3, PATH 4", Severity.INFO)


def test_nothing_to_bore_is_an_error() -> None:
    (small, nothing) = bore(chosen_of([circle(0, 0, 3.0)]), setting_of()).findings
    assert (small.code, nothing.code) == (PlanningCode.NOT_BORED, PlanningCode.NOTHING_DRAWN)
    assert nothing.severity == Severity.ERROR


def test_a_tool_of_no_width_is_refused() -> None:
    with pytest.raises(OptionError, match="a bore needs a tool that cuts a width"):
        bore(chosen_of([circle(0, 0, 8.0)]), setting_of(tool=Tool(0.0)))


def test_a_helix_gets_so_many_turns_and_no_more() -> None:
    work = bore(chosen_of([circle(0, 0, 4.0)]), setting_of(20.0, step_down_mm=0.01))
    (finding,) = work.findings
    assert finding.code == PlanningCode.ENTRY_CHANGED
    assert "at most 200 turns: its slope is 1.82°, not 3°" in finding.message
    (run,) = runs_of(work)
    assert np.count_nonzero(np.diff(run.vertices[:, 2])) == 4 * MAX_TURNS


@pytest.mark.parametrize("direction", ["climb", "conventional"])
def test_the_tool_plunges_where_a_helix_has_no_room(direction: str) -> None:
    """As a machinist does it: down in the middle in pecks no deeper than the tool is wide, and one
    lap at the bottom, which gives the hole its width."""
    setting = setting_of(7.0, direction=direction)
    work = bore(chosen_of([circle(5, 6, 3.2)]), setting)
    (finding,) = work.findings
    assert finding.code == PlanningCode.ENTRY_CHANGED
    assert "3.2 mm" in finding.message
    assert "3 pecks of 2.333 mm" in finding.message
    (run,) = runs_of(work)
    down = run.vertices[:-6]
    assert (down[:, :2] == [5.0, 6.0]).all()
    assert down[:, 2] == pytest.approx([-7 / 3, 0.5, 0.2 - 7 / 3, -14 / 3, 0.5, 0.2 - 14 / 3, -7])
    # Rapids only where it is cut already; cuts down at the feed of plunges.
    assert np.isnan(run.feed_mm_min[[0, 1, 3, 4]]).all()
    assert run.feed_mm_min[[2, 5]].tolist() == [FEEDS.plunge_mm_min] * 2
    lap = run.vertices[-6:]
    assert (lap[:, 2] == -7.0).all()
    assert np.hypot(*(lap[:-1, :2] - [5, 6]).T) == pytest.approx([0.1] * 5)
    assert (np.sign(lap[:4, 3]) == (1.0 if direction == "climb" else -1.0)).all()
    assert (run.feed_mm_min[6:] == FEEDS.cut_mm_min).all()


def test_pecks_of_a_narrow_bore_are_no_deeper_than_its_step_down() -> None:
    circles = [circle(5, 6, 3.2)]
    (run,) = runs_of(bore(chosen_of(circles), setting_of(2.0, step_down_mm=0.5)))
    cut = run.vertices[run.vertices[:, 2] < 0.0][::2, 2]
    assert cut[:4] == pytest.approx([-0.5, -1.0, -1.5, -2.0])
    with pytest.raises(OptionError, match="give a larger step_down"):
        bore(chosen_of(circles), setting_of(2.0, step_down_mm=2e-6))


@pytest.mark.parametrize("turn", [0.0, 1.0, 2.5])
def test_turned_and_reversed_circles_are_bored_alike(turn: float) -> None:
    def turned(path: Polyline) -> Polyline:
        vertices = path.vertices.copy()
        cos, sin = math.cos(turn), math.sin(turn)
        vertices[:, :2] = vertices[:, :2] @ np.array([[cos, sin], [-sin, cos]])
        return Polyline(vertices, closed=True)

    plain = runs_of(bore(chosen_of([circle(5, 6, 10.0)]), setting_of()))
    other = runs_of(bore(chosen_of([turned(circle(5, 6, 10.0, arcs=5, turn=-1.0))]), setting_of()))
    cos, sin = math.cos(turn), math.sin(turn)
    centre = np.array([5.0, 6.0]) @ np.array([[cos, sin], [-sin, cos]])
    assert len(plain) == len(other) == 3
    for one, two in zip(plain, other, strict=True):
        moved = one.vertices.copy()
        moved[:, :2] += centre - [5, 6]
        assert two.vertices == pytest.approx(moved, abs=1e-9)
