"""The report's keys, bytes and words."""

import json
import math

import numpy as np
import pytest

from camtool import __version__
from camtool.findings import Finding, Severity
from camtool.importers.findings import DrawingCode
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.report import (
    Planned,
    PlannedOperation,
    PlannedTool,
    Report,
    clock,
    rounded,
    rounded_or_none,
    setup_sheets,
)
from camtool.verification.verify import Case, VerifyOptions, judge
from tests.oracles.dense_moves import circle, follow, pic_mmh, square
from tests.targets import on

MACHINE = pic_mmh()


def some_report(**options) -> Report:
    b = square(ToolpathBuilder(), 1.0, 1.0, 1.4)
    toolpath = circle(b, 4.0, 2.0, 0.7).finish()
    decoded = replace(toolpath, block=np.arange(len(toolpath)))
    given = VerifyOptions(source="logo.dxf", size_bytes=1234, **options)
    return judge(
        Case(decoded, on(MACHINE), toolpath, None, given), follow(decoded, 50, lambda p: p * 1.002)
    ).report


def empty_report() -> Report:
    nothing = ToolpathBuilder().finish()
    return judge(Case(nothing, on(MACHINE), None, None, VerifyOptions()), []).report


WANTED_KEYS = {
    "": "target source moves blocks bytes extents_mm time_s steps reversals error_um closure_um "
    "dimensions circles findings",
    "extents_mm": "x y z",
    "steps": "x y z iterations iterations_cutting",
    "reversals": "x y z",
    "error_um": "fit rounding interpolation mechanics total",
    "error_um.fit": "max rms",
    "error_um.rounding": "max rms",
    "error_um.interpolation": "max rms p95",
    "error_um.mechanics": "max rms",
    "error_um.total": "max rms p95",
    "dimensions.0": "name nominal_mm predicted_mm error_percent",
    "circles.0": "centre_mm radius_mm G_um Fmax_um Fmin_um",
    "findings.0": "code severity message where",
    "time_split_s": "cutting air dwell compensation link",
    "contour_errors.0": "name max_um rms_um mean_um at_mm block interpolation_um mechanics_um",
    "worst.0": "block move at_mm total_um interpolation_um mechanics_um source",
    "unreached": "moves max_um",
}
"""The keys that users rely on: they may never be renamed or dropped (design, section 4)."""

ADDED_KEYS = {
    "": "contours time_split_s interpolator camtool_version planned before contour_errors "
    "bidirectional unreached shape worst assumptions asked against found "
    "inspection engagement",
    "error_um": "depth_max",
    "error_um.total": "mean",
    "reversals": "cutting air",
    "error_um.interpolation": "lines_max arcs_max lines_steps arcs_steps",
    "circles.0": "D_um direction z_mm step_um spike_um B_um fit_um",
    "contour_errors.0": "fit_um",
    "worst.0": "fit_um",
    "dimensions.0": "of",
    "findings.0": "measured limit unit",
}


@pytest.mark.parametrize("place", WANTED_KEYS)
def test_the_keys_are_those_that_users_rely_on(place: str) -> None:
    found = json.loads(some_report().to_json())
    for key in place.split(".") if place else []:
        found = found[int(key)] if key.isdigit() else found[key]
    expected = WANTED_KEYS[place].split() + ADDED_KEYS.get(place, "").split()
    assert list(found) == expected


def test_extents_are_pairs_and_the_version_is_ours() -> None:
    found = json.loads(some_report().to_json())
    assert [len(found["extents_mm"][axis]) for axis in "xyz"] == [2, 2, 2]
    assert found["camtool_version"] == __version__
    assert found["source"] == "logo.dxf"
    assert found["bytes"] == 1234
    assert found["blocks"] == 13
    assert found["findings"][0]["severity"] in ("info", "warning", "error")


def test_the_same_case_gives_the_same_bytes() -> None:
    assert some_report().to_json() == some_report().to_json()
    assert some_report().to_json().endswith("}\n")


@pytest.mark.parametrize("report", [some_report(), empty_report()], ids=["part", "nothing"])
def test_no_number_is_nan_or_infinite(report: Report) -> None:
    def refuse(constant: str) -> float:
        raise AssertionError(constant)

    json.loads(report.to_json(), parse_constant=refuse)
    assert "nan" not in report.to_text().lower()
    assert "nan" not in report.to_markdown().lower()


def test_what_is_not_known_is_null() -> None:
    found = json.loads(empty_report().to_json())
    assert found["error_um"]["total"] == dict.fromkeys(("max", "rms", "p95", "mean"))
    assert found["closure_um"] is None
    assert found["bytes"] is None
    assert found["blocks"] is None


@pytest.mark.parametrize(
    ("value", "expected"),
    [(1.23456789, 1.234568), (-1e-12, 0.0), (math.nan, None), (math.inf, None), (None, None)],
)
def test_numbers_are_rounded_and_never_minus_zero(value, expected) -> None:
    assert rounded_or_none(value) == expected
    if expected is not None:
        assert math.copysign(1.0, rounded_or_none(value)) == math.copysign(1.0, expected)
        assert rounded(value) == expected


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0, "0:00:00"), (59.6, "0:01:00"), (3725.4, "1:02:05"), (360_000, "100:00:00")],
)
def test_times_in_words(seconds: float, words: str) -> None:
    assert clock(seconds) == words


def test_the_text_says_what_matters() -> None:
    report = some_report()
    text = report.to_text()
    for word in ("3.700 × 1.700 mm", "2 contours", "1234 bytes", "reversals", "mechanics", "info"):
        assert word in text, word
    assert clock(report.time_s) in text
    assert "PLAY_NOT_KNOWN" not in report.to_text(findings=False)
    assert not text.endswith("\n")
    assert all(len(line) <= 120 for line in report.to_text(findings=False).splitlines())
    assert 1 <= len(report.notes()) <= 3


def test_tools_are_called_by_number_and_name_and_operations_by_theirs() -> None:
    tools = (
        PlannedTool(None, "", "end mill 2 mm", 3.0),
        PlannedTool(4, "bit", "V bit", 3.0),
        PlannedTool(7, "", "drill 3 mm", 3.0),
        PlannedTool(None, "saw", "end mill 1 mm", 3.0),
    )
    cut = PlannedOperation("", "pocket", 0, "", 2.0, "", None, None, None, 300.0, 100.0, 3.0)
    names = ["", "rim", "holes", ""]
    operations = tuple(replace(cut, name=name, tool=row) for row, name in enumerate(names))
    shown, done = setup_sheets(Planned(0.0, 0.0, operations, tools))
    assert [row[0] for row in shown.rows] == ["(1)", "T4 bit", "T7", "saw"]
    assert [row[:3] for row in done.rows] == [
        ("pocket", "pocket", "(1)"),
        ("rim", "pocket", "T4 bit"),
        ("holes", "pocket", "T7"),
        ("pocket", "pocket", "saw"),
    ]


def test_markdown_takes_names_from_drawings_as_words() -> None:
    sly = Finding(DrawingCode.UNITLESS, Severity.WARNING, "a|b <script> `c`\n# d", where="[x](y)")
    report = some_report().with_findings([sly, sly])
    assert len(report.findings) == 1
    lines = report.to_markdown().splitlines()
    (line,) = [line for line in lines if "UNITLESS" in line]
    assert line == "- warning `UNITLESS` (\\[x\\](y)): a\\|b \\<script\\> \\`c\\`\\\\n\\# d"
    assert "\n" not in replace(report, source="a\nb").to_text().splitlines()[0]


def test_long_tables_are_cut_short_in_markdown_only() -> None:
    report = some_report()
    many = replace(report, dimensions=report.dimensions * 5)
    assert "and 18 more dimensions" in many.to_markdown()
    assert len(json.loads(many.to_json())["dimensions"]) == 30
