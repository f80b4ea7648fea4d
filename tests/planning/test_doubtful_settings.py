"""What looks forgotten or too bold is said once, and only where it is doubtful."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.findings import Code, Severity
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation, Tool, job_of
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
    doubtful_settings = [each for each in found if each.code == Code.CUT_DOUBTFUL]
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
