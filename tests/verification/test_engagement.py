"""The gate of engagement: an angle that is known by geometry, at both sides of the limit."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool
from camtool.cli.options import engagement_limit
from camtool.errors import OptionError
from camtool.planning.job import Job, Operation, Stock, Tool
from camtool.planning.strokes import THICK_SHARE
from camtool.run import Run
from camtool.stock.cutters import CutterProfile
from camtool.stock.engagement import engagement_of
from camtool.stock.slides import ToolsOfRows, slide_moves
from tests.strategies import examples

RADIUS_MM = 2.5
NEAR_DEG = 1.0
"""Figures of operations are as near as this to an angle that there is."""


def side_cut(
    wide_mm: float,
    *,
    tool: Tool | None = None,
    depth_mm: float = 1.0,
    limit_deg: float | None = None,
) -> Run:
    """A straight cut along the lower edge of a block, so that the tool takes `wide_mm` of it; it
    goes down beside the block."""
    y = wide_mm - RADIUS_MM
    lines = ["G21 G90", "G0 Z5", "M3 S9000", f"G0 X-9 Y{y:.4f}", f"G1 Z{-depth_mm} F100"]
    program = "\n".join([*lines, "G1 X49 F600", "G0 Z5", "M5", "M2", ""])
    job = Job(
        operations=(Operation(kind="profile", tool=tool or Tool(2.0 * RADIUS_MM)),),
        stock=Stock(2.0, (0.0, 0.0), (40.0, 20.0)),
    )
    limit = None if limit_deg is None else math.radians(limit_deg)
    judging = camtool.Judging(gates=camtool.Gates(engagement_rad=limit))
    return camtool.verify(program.encode(), "grbl", job=job, judging=judging)


def angle_deg(wide_mm: float) -> float:
    """The engagement of a straight cut of this width, by the circle alone."""
    return math.degrees(math.acos(1.0 - min(wide_mm, 2.0 * RADIUS_MM) / RADIUS_MM))


def messages(run: Run) -> list[str]:
    return [each.message for each in run.findings if each.code.name == "ABOVE_GATE"]


@pytest.mark.parametrize(("wide_mm", "known_deg"), [(2.5, 90.0), (1.25, 60.0), (5.2, 180.0)])
def test_a_straight_cut_has_the_angle_of_its_width(wide_mm: float, known_deg: float) -> None:
    run = side_cut(wide_mm, limit_deg=known_deg + 0.2 if known_deg < 180.0 else 180.0)
    assert run.report is not None
    assert run.report.engagement is not None
    (row,) = run.report.engagement
    assert row.greatest_deg == pytest.approx(known_deg, abs=NEAR_DEG)
    assert (row.operation, row.limit_deg, row.left_mm, row.block) == ("", None, None, 6)
    assert messages(run) == []


@examples(30, 2_000)
@given(st.floats(0.3, 4.7), st.sampled_from([1.5, -1.5]))
def test_the_limit_is_kept_below_it_and_not_above(wide_mm: float, away_deg: float) -> None:
    """Chips thinner than a share of the radius do not count."""
    low = angle_deg(wide_mm - 2.0 * THICK_SHARE * RADIUS_MM)
    limit = low - 1.5 if away_deg < 0.0 else angle_deg(wide_mm) + 1.5
    run = side_cut(wide_mm, limit_deg=limit)
    assert run.report is not None
    assert run.report.engagement is not None
    found = run.report.engagement[0].greatest_deg
    assert found is not None
    assert low - 1e-6 <= found <= angle_deg(wide_mm) + NEAR_DEG
    if away_deg > 0.0:
        assert messages(run) == []
    else:
        (finding,) = (each for each in run.findings if each.code.name == "ABOVE_GATE")
        assert finding.where == "--max-engagement"
        assert finding.limit == pytest.approx(limit)
        assert finding.measured == pytest.approx(found, abs=1e-5)
        # An entry, which counts since the tool comes down in air, would end at X 6.708.
        place = re.search(r"at X (?:-9.000|6.708) Y (-?[0-9.]+);", finding.message)
        assert place is not None
        assert float(place[1]) == pytest.approx(wide_mm - RADIUS_MM, abs=0.005)


def test_chips_that_do_not_count_are_thinner_than_the_step_of_a_small_limit() -> None:
    """A cut that is engaged by 7° does not pass as one of 5°: its chip, 0.75 % of the radius, is
    less than twice as thick as what does not count at large limits."""
    target = camtool.load_target("linuxcnc")
    program = b"G21 G90 G61\nG0 Z5\nG0 X-40 Y-24.8137\nG1 Z-1 F100\nG1 X49 F600\nG0 Z5\nM2\n"
    decoded = target.target.read_in(program, target.machine, None)
    tools = ToolsOfRows((CutterProfile(25.0, 25.0),), np.zeros(len(decoded), dtype=np.int64))
    slides = slide_moves(decoded, target, tools)
    limit, number = np.array([math.radians(5.0)]), np.zeros(len(slides), dtype=np.int64)
    engagement = engagement_of(slides, decoded, (0.0, 0.0, 40.0, 20.0), (number, limit))
    greatest, _ = engagement.max_heights(number == 0)
    assert math.radians(6.0) < greatest <= math.radians(7.05)


@pytest.mark.parametrize(
    ("tool", "reason"),
    [
        (Tool(0.0), "the shape of a tool is not known"),
        (Tool(5.0, "ball"), "width changes with its height"),
        (Tool(5.0, "v", math.radians(60.0)), "width changes with its height"),
    ],
)
def test_what_cannot_be_judged_does_not_meet_the_limit(tool: Tool, reason: str) -> None:
    run = side_cut(1.0, tool=tool, limit_deg=180.0)
    assert [reason in each for each in messages(run)] == [True]
    assert run.failed


def test_nothing_is_judged_unless_somebody_asks() -> None:
    run = side_cut(2.5)
    assert run.report is not None
    assert run.report.engagement is None


def test_an_own_limit_and_the_gate_are_judged_by_one_run_of_the_slides(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from camtool.stock import engagement
    from camtool.verification import engagement as slides

    counts = {"slides": 0, "bounds": 0}
    moves_of, bounds_of = slides.slide_moves, engagement.engagement_of

    def counted_moves(*args: object, **options: object) -> object:
        counts["slides"] += 1
        return moves_of(*args, **options)  # type: ignore[arg-type]

    def counted_bounds(*args: object) -> object:
        counts["bounds"] += 1
        return bounds_of(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(slides, "slide_moves", counted_moves)
    monkeypatch.setattr(engagement, "engagement_of", counted_bounds)
    operation = Operation(
        kind="pocket",
        tool=Tool(3.0, number=1),
        depth_mm=1.0,
        spindle_rpm=9000.0,
        own=(("strategy", "adaptive"), ("engagement_rad", math.radians(60.0))),
    )
    drawing = tmp_path / "part.svg"
    drawing.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="8mm" viewBox="0 0 9 8">'
        '<rect x="0" y="0" width="9" height="8"/></svg>'
    )
    greatest = []
    for limit_deg in (61.3, 30.0):
        gates = camtool.Gates(engagement_rad=math.radians(limit_deg))
        run = camtool.post(str(drawing), "grbl", Job((operation,)), gates=gates)
        assert run.report is not None
        assert run.report.engagement is not None
        (row,) = run.report.engagement
        assert (row.operation, row.left_mm) == ("pocket", 0.0)
        assert row.limit_deg == pytest.approx(60.0)
        greatest.append(row.greatest_deg or 0.0)
        assert len(messages(run)) == (limit_deg == 30.0)
        assert "ENGAGEMENT_KEPT" in {each.code.name for each in run.findings}
        assert counts == {"slides": 1, "bounds": 1}
        counts.update(slides=0, bounds=0)
        text = run.report.to_text()
        assert "limit 60.00°; nothing is left but the scallop" in text
    assert greatest[0] == pytest.approx(greatest[1], abs=NEAR_DEG)


def test_a_lathe_has_no_engagement() -> None:
    samples = Path(__file__).parents[2] / "samples"
    job = camtool.read_job(samples / "screw.toml")
    gates = camtool.Gates(engagement_rad=1.0, gouge_mm=0.1)
    lathe = camtool.load_target("linuxcnc", machine=samples / "machines/linuxcnc-lathe.toml")
    run = camtool.post(str(samples / "screw.dxf"), lathe, job, gates=gates)
    told = messages(run)
    assert any("the work turns" in each for each in told)
    assert any("no gouge is known" in each for each in told)


@pytest.mark.parametrize("text", ["0%", "0deg", "181deg", "101%", "-1%", "nan", "nan deg", "x"])
def test_limits_that_say_nothing_are_refused(text: str) -> None:
    with pytest.raises(OptionError):
        engagement_limit(text)


def test_a_tool_that_comes_up_or_goes_down_where_it_was_is_not_engaged() -> None:
    """Half of the diameter along an edge, up and down again in the cut, and on."""
    lines = ["G21 G90", "G0 Z5", "M3 S9000", "G0 X-9 Y0", "G1 Z-1 F100", "G1 X20 F600", "G0 Z5"]
    lines += ["G1 Z-1 F100", "G1 X30 F600", "G0 Z5", "M5", "M2"]
    job = Job(
        operations=(Operation(kind="profile", tool=Tool(2.0 * RADIUS_MM)),),
        stock=Stock(2.0, (0.0, 0.0), (40.0, 20.0)),
    )
    judging = camtool.Judging(gates=camtool.Gates(engagement_rad=math.radians(91.0)))
    run = camtool.verify("\n".join(lines).encode() + b"\n", "grbl", job=job, judging=judging)
    assert messages(run) == []
    assert run.report is not None
    assert run.report.engagement is not None
    assert run.report.engagement[0].greatest_deg == pytest.approx(90.0, abs=NEAR_DEG)


def test_shallow_cuts_are_judged() -> None:
    run = side_cut(2.5, depth_mm=0.008, limit_deg=60.0)
    assert len(messages(run)) == 1


def test_holes_are_drilled_without_an_engagement() -> None:
    """A controller that rounds corners leaves the hole a little aslant."""
    lines = ["G21 G90 G64 P0.05", "G0 Z5", "M3 S9000", "G0 X9 Y9", "G1 Z-6 F100", "G0 Z5"]
    lines += ["G0 X9 Y30", "M5", "M2"]
    job = Job(operations=(Operation(kind="drill", tool=Tool(3.0, "drill", math.radians(118.0))),))
    judging = camtool.Judging(gates=camtool.Gates(engagement_rad=0.2))
    program = "\n".join(lines).encode() + b"\n"
    assert messages(camtool.verify(program, "linuxcnc", job=job, judging=judging)) == []


def test_small_arcs_head_as_commanded() -> None:
    """A circle of 0.04 mm round one of 0.02 mm: each chord of the slides stands for 40° of it,
    and the tool is engaged by the angle of two discs all the same."""
    radius, inner, outer = 2.0, 0.02, 0.04
    lines = ["G21 G90", "G0 Z5", "M3 S9000", f"G0 X{inner} Y0", "G1 Z-1 F100"]
    lines += [f"G3 X{inner} Y0 I{-inner} J0 F300", "G1 X-9", f"G1 X{inner}", "G3 X-0.04 I-0.03 J0"]
    lines += [f"G3 X{-outer} Y0 I{outer} J0", "G0 Z5", "M5", "M2", ""]
    operation = Operation(kind="profile", tool=Tool(2.0 * radius))
    judging = camtool.Judging(gates=camtool.Gates(engagement_rad=math.pi))
    program = "\n".join(lines).encode()
    run = camtool.verify(program, "grbl", job=Job((operation,)), judging=judging)
    assert run.report is not None
    assert run.report.engagement is not None
    reach = inner + radius
    cosine = (reach**2 - outer**2 - radius**2) / (2.0 * radius * outer)
    known = math.degrees(math.acos(cosine))
    greatest = run.report.engagement[0].greatest_deg
    assert greatest is not None
    assert 0.8 * known < greatest < known + 8.0


def test_a_lifted_link_is_no_entry() -> None:
    """A tool that comes down beside the stock, touches it by 0.05 mm, and then cuts too much."""
    lines = ["G21 G90", "G0 Z5", "M3 S9000", "G0 X-9 Y-1.25", "G1 Z-1 F100", "G1 X49 F600"]
    lines += ["G1 Y-5", "G1 X10 Z-0.8", "G1 X12 Y-1.2 Z-1", "G1 X14 Y1.25", "G1 X20", "G1 Y-5"]
    job = Job(
        operations=(Operation(kind="profile", tool=Tool(2.0 * RADIUS_MM)),),
        stock=Stock(2.0, (0.0, 0.0), (60.0, 20.0)),
    )
    judging = camtool.Judging(gates=camtool.Gates(engagement_rad=math.radians(75.0)))
    program = "\n".join([*lines, "G0 Z5", "M5", "M2", ""]).encode()
    run = camtool.verify(program, "grbl", job=job, judging=judging)
    assert len(messages(run)) == 1
