"""What looks forgotten or too bold is said once, and only where it is doubtful."""

from __future__ import annotations

import math

import numpy as np
import pytest

from camtool.findings import Severity
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.checks import ridge_mm
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Entry, Job, Operation, Stock, Tabs, Tool, job_of
from camtool.records import replace
from camtool.target.registry import load_target
from tests.drawings import drawing_of

BOX = Polyline(np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0.0]]), True)
LINE = Polyline(np.array([[1, 1, 0], [2, 1, 0.0]]))
SPINDLE, WIDTH, PASS, PLUNGE = "--spindle", "--tool-diameter", "--step-down", "--plunge-feed"
ALL_SAID = {"spindle_rpm": 9000.0, "tool_diameter_mm": 0.5, "plunge_feed_mm_min": 50.0}


def _said(target: str, job: Job, *paths: Polyline) -> str:
    """The one message, "" for none."""
    found = post_drawing(
        drawing_of(paths or [BOX]), job, load_target(target), check=False
    ).findings
    doubtful_settings = [each for each in found if each.code == PlanningCode.CUT_DOUBTFUL]
    assert len(doubtful_settings) <= 1
    assert all(each.severity == Severity.WARNING for each in doubtful_settings)
    return doubtful_settings[0].message if doubtful_settings else ""


def _flags(text: str) -> set[str]:
    return {flag for flag in (SPINDLE, WIDTH, PASS, PLUNGE) if flag in text}


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
@pytest.mark.parametrize(
    ("said", "flags"),
    [
        ({}, {SPINDLE, WIDTH, PLUNGE}),
        (ALL_SAID | {"depth_mm": 0.5}, set()),
        (ALL_SAID | {"depth_mm": 0.6}, {PASS}),
        (ALL_SAID | {"depth_mm": 6.0, "step_down_mm": 0.5}, set()),
        (ALL_SAID | {"depth_mm": 6.0, "step_down_mm": 1.0}, {PASS}),
        ({"side": "on"}, {SPINDLE, PLUNGE}),
        ({"kind": "engrave", "plunge_feed_mm_min": 50.0}, {SPINDLE}),
        ({"spindle_rpm": 9000.0, "feed_mm_min": 100.0, "side": "on"}, {PLUNGE}),
        ({"tool_kind": "v", "tool_diameter_mm": 0.5, "depth_mm": 0.6} | {
            "spindle_rpm": 1.0, "plunge_feed_mm_min": 5.0, "side": "on"}, set()),
    ],
)  # fmt: skip
def test_where_the_program_starts_the_spindle(
    target: str, said: dict[str, object], flags: set[str]
) -> None:
    assert _flags(_said(target, job_of(**said))) == flags


def test_a_point_on_open_paths_follows_them_as_it_should() -> None:
    assert _flags(_said("grbl", Job(), LINE)) == {SPINDLE, PLUNGE}


@pytest.mark.parametrize("target", ["pic-mmh", "valcnc"])
def test_other_machines_engrave_with_a_point(target: str) -> None:
    assert _said(target, Job(), BOX, LINE) == ""
    deep = job_of(tool_diameter_mm=0.1, depth_mm=0.3)
    assert _flags(_said(target, deep)) == {PASS}


def test_operations_are_named_where_not_all_are_meant() -> None:
    tool = Tool(0.5)
    one = Operation(name="a", tool=tool, depth_mm=0.4, spindle_rpm=9000.0, plunge_feed_mm_min=9.0)
    two = Operation(name="b", tool=tool, depth_mm=0.9, plunge_feed_mm_min=9.0)
    text = _said("grbl", Job(operations=(one, two)))
    assert text.count("operation 'b'") == 2
    assert "operation 'a'" not in text
    assert _flags(text) == {SPINDLE, PASS}


def test_the_summary_names_how_each_operation_cuts() -> None:
    job = job_of(**ALL_SAID, depth_mm=2.0, step_down_mm=0.8, last_pass_mm=0.3)
    made = post_drawing(drawing_of([BOX]), job, load_target("linuxcnc"))
    assert made.verification is not None
    report = made.verification.report
    assert report.planned is not None
    (each,) = report.planned.operations
    assert (each.tool_diameter_mm, each.spindle_rpm, each.passes) == (0.5, 9000.0, 4)
    assert each.deepest_pass_mm is not None
    assert each.deepest_pass_mm <= 0.8
    (line,) = (row for row in report.to_text().splitlines() if row.startswith("cut "))
    for words in ("tool 0.5 mm", "spindle 9000", "feed 500", "plunge 50", "2 mm deep in 4 passes"):
        assert words in line


TOOL_SAID = {"spindle_rpm": 5000.0, "feed_mm_min": 400.0, "plunge_feed_mm_min": 100.0}


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"tool_flutes": 2, "tool_chip_load_mm": (0.02, 0.06)}, ""),  # 0.04 mm
        ({"tool_flutes": 2, "tool_chip_load_mm": (0.04, 0.04)}, ""),
        ({"tool_flutes": 1, "tool_chip_load_mm": (0.02, 0.06)}, "chip load of 0.08 mm"),
        ({"tool_flutes": 4, "tool_chip_load_mm": (0.03, math.inf)}, "at least 0.03 mm"),
        ({"tool_chip_load_mm": (0.02, 0.03)}, ""),  # how many flutes is not known
        ({"tool_surface_speed_m_min": (0.0, 5.0)}, "7.854 m/min, where at most 5"),
        ({"tool_surface_speed_m_min": (5.0, 10.0)}, ""),
        ({"tool_cutting_length_mm": 0.4}, "edges of the tool are 0.4 mm long"),
        ({"tool_cutting_length_mm": 0.5}, ""),
        ({"tool_centre_cutting": False}, "--entry ramp"),
        ({"tool_centre_cutting": False, "entry": Entry("ramp")}, ""),
        ({"tool_centre_cutting": True}, ""),
        ({"tool_kind": "ball"}, "leaves 0.25 mm at the foot of walls"),
        ({"tool_kind": "ball", "side": "on"}, ""),
        ({"tool_kind": "bull", "tool_corner_radius_mm": 0.1}, "leaves 0.1 mm"),
        (
            {
                "tool_kind": "bull",
                "tool_corner_radius_mm": 0.1,
                "stock": Stock(0.4),
                "tabs": Tabs(4),
            },
            "",
        ),
        ({"tool_materials": ("brass", "wood")}, "presets for brass, wood"),
        ({"tool_materials": ("brass", "wood"), "material": "wood"}, ""),
    ],
)
def test_what_a_tool_is_not_made_for(said: dict[str, object], words: str) -> None:
    size = {"tool_diameter_mm": 0.5, "depth_mm": 0.5}
    found = _said("grbl", job_of(**TOOL_SAID, **size, **said))
    assert words in found
    assert bool(found) == bool(words)


@pytest.mark.parametrize("tool", [Tool(6.0, "ball"), Tool(6.0, "bull", corner_radius_mm=1.0)])
@pytest.mark.parametrize("step_over", [0.1, 0.4, 0.7, 1.0])
def test_ridges_are_as_high_as_the_nose_between_two_paths(tool: Tool, step_over: float) -> None:
    # By search: the least height at which one of the tools at both sides reaches the middle.
    half = 0.5 * step_over * tool.diameter_mm
    heights = np.linspace(0.0, 3.0, 300_001)
    reached = [height for height in heights[::100] if tool.radius_at(float(height)) >= half]
    assert ridge_mm(tool, step_over) == pytest.approx(reached[0], abs=1.1e-3)


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        # At square corners rings of 1.2 mm are 1.7 mm apart; the flat is 1 mm wide.
        (("bull", 1.0), "ridges of up to 0.063 mm on floors (--step-over 0.2 leaves 0 mm)"),
        (("bull", 0.1), ""),
        (("ball", 1.5), "(--step-over 0.1 leaves 0.015 mm)"),
    ],
)
def test_peaks_at_corners_count_and_a_finer_step_over_is_named(
    tool: tuple[str, float], words: str
) -> None:
    kind, corner_mm = tool
    said: dict[str, object] = {"tool_kind": kind, "tool_diameter_mm": 3.0}
    if kind == "bull":
        said["tool_corner_radius_mm"] = corner_mm
    found = _said("grbl", job_of(**TOOL_SAID, **said, kind="pocket", depth_mm=3.0))
    assert words in found
    assert ("ridges" in found) == bool(words)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"depth_mm": 3.0}, "parts are cut out of the stock, and nothing holds them"),
        ({"depth_mm": 3.2, "finish_mm": 0.1}, "before their finishing pass, and nothing holds"),
        ({"depth_mm": 3.0, "side": "outside"}, "nothing holds them"),
        ({"depth_mm": 2.9}, ""),
        ({"depth_mm": 3.0, "tabs": Tabs(4)}, ""),
        ({"depth_mm": 3.0, "side": "inside"}, ""),
        ({"depth_mm": 3.0, "kind": "pocket"}, ""),
    ],
)
def test_parts_that_nothing_holds(said: dict[str, object], words: str) -> None:
    settings = ALL_SAID | {"step_down_mm": 0.5, **said}
    job = replace(job_of(**settings), stock=Stock(3.0))
    message = _said("grbl", job)
    assert words in message
    assert bool(words) == bool(message)


def test_a_part_without_known_stock_may_be_held_by_it() -> None:
    assert _said("grbl", job_of(**ALL_SAID, depth_mm=3.0, step_down_mm=0.5)) == ""


def test_a_bore_that_plunges_is_a_plunge() -> None:
    """In a hole hardly wider than the tool there is no helix, so that its middle must cut."""
    said = {}
    for diameter in (3.2, 5.0):
        tool = Tool(3.0, centre_cutting=False)
        job = job_of(kind="bore", tool=tool, spindle_rpm=9000.0, depth_mm=2.0)
        hole = Polyline(np.array([[0, 0, 1], [diameter, 0, 1.0]]), closed=True)
        said[diameter] = _said("grbl", job, hole)
    assert "does not cut at its centre" in said[3.2]
    assert PLUNGE in said[3.2]
    assert said[5.0] == ""
