"""Judging with a controller that follows the path: what is left is the mechanics alone."""

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.findings import VerificationCode
from camtool.verification.report import Report
from camtool.verification.verify import VerifyOptions
from tests.oracles.dense_moves import circle, cut, pic_mmh, square
from tests.oracles.path_machine import STEP, both, path_machine
from tests.targets import verify

UM = 1000.0
NOISE_UM = 1e-7
"""What rounding may leave of an error of nothing."""

FREE = "controller.grid=none"


def report(toolpath: Toolpath, *settings: str, wanted: Toolpath | None = None) -> Report:
    return verify(toolpath, path_machine(*settings), wanted=wanted or toolpath).report


@st.composite
def contours(draw: st.DrawFn) -> Toolpath:
    """A few cuts on the grid: lines, arcs by thirds of pythagorean circles, full circles."""
    b = ToolpathBuilder()
    cell = st.integers(0, 80).map(lambda number: number * 0.05)
    for number in range(draw(st.integers(1, 3))):
        b.source = f"CUT/PATH {number}"
        cut(b, draw(cell), draw(cell))
        for _ in range(draw(st.integers(1, 4))):
            x, y, _ = b.position
            scale = draw(st.integers(1, 10)) * 0.05
            shape = draw(st.sampled_from(["line", "arc", "full"]))
            if shape == "line":
                b.line(draw(cell), draw(cell), feed=60.0)
                continue
            centre = (x + 3 * scale, y + 4 * scale)
            end = (centre[0] + 4 * scale, centre[1] - 3 * scale) if shape == "arc" else (x, y)
            b.arc(*end, centre=centre, ccw=draw(st.booleans()), feed=60.0)
        b.rapid(z=0.2)
    return b.event(Kind.END).finish()


@given(contours())
def test_without_play_there_is_no_error_at_all(toolpath: Toolpath) -> None:
    found = report(toolpath, FREE)
    error = found.error_um
    assert error.mechanics.max in (None, 0.0)
    for figure in (error.rounding, error.interpolation, error.total):
        assert figure.max is None or figure.max <= NOISE_UM
    for size in found.dimensions:
        assert size.predicted_mm == pytest.approx(size.nominal_mm, abs=1e-9)


@given(contours(), st.sampled_from([0.01, 0.05]))
def test_play_is_all_the_error_that_it_makes(toolpath: Toolpath, play: float) -> None:
    found = report(toolpath, FREE, f"axes.x.backlash_mm={play}")
    error = found.error_um
    assert error.interpolation.max is None or error.interpolation.max <= NOISE_UM
    if error.mechanics.max is not None and found.reversals.x:
        assert error.mechanics.max <= play * UM + NOISE_UM
        assert error.total.max <= error.mechanics.max + NOISE_UM


def test_the_play_of_each_axis_is_the_error() -> None:
    toolpath = square(ToolpathBuilder(), 1.0, 1.0, 2.0).finish()
    found = report(toolpath, "axes.x.backlash_mm=0.03").error_um
    assert found.mechanics.max == pytest.approx(30.0, abs=NOISE_UM)
    assert found.total.max == pytest.approx(30.0, abs=NOISE_UM)
    found = report(toolpath, "axes.x.backlash_mm=0.03", "axes.y.backlash_mm=0.04").error_um
    assert found.mechanics.max == pytest.approx(50.0, abs=NOISE_UM)
    centred = report(toolpath, "axes.x.backlash_mm=0.03", "controller.start_play=centred")
    assert centred.error_um.mechanics.max == pytest.approx(15.0, abs=NOISE_UM)


def test_compensation_equal_to_the_play_leaves_no_error() -> None:
    settings = (*both("backlash_mm", 0.04), *both("compensation_mm", 0.04))
    toolpath = square(ToolpathBuilder(), 1.0, 1.0, 2.0).finish()
    assert report(toolpath, *settings).error_um.mechanics.max == pytest.approx(0.0, abs=NOISE_UM)
    half = report(toolpath, *both("backlash_mm", 0.04), *both("compensation_mm", 0.03))
    assert half.error_um.mechanics.max == pytest.approx(10.0 * math.sqrt(2.0), abs=1e-6)


@pytest.mark.parametrize("play", [0.02, 0.2])
def test_known_play_gives_the_circle_of_the_formula(play: float) -> None:
    """As in test_verify_machine."""
    radius = 8.0
    found = report(
        circle(ToolpathBuilder(), 20.0, 20.0, radius).finish(), f"axes.x.backlash_mm={play}"
    )
    least = radius - play / 2
    largest = math.sqrt(least**2 + radius**2 - (radius - play) ** 2)
    (ring,) = found.circles
    assert ring.G_um == pytest.approx((largest - least) * UM, abs=2.0 * STEP * UM)


def test_extents_steps_reversals_and_time_of_a_square() -> None:
    toolpath = square(ToolpathBuilder(), 1.0, 1.0, 2.0).finish()
    found = report(toolpath, "limits.rapid_mm_min=600")
    assert found.extents_mm.x == pytest.approx((0.0, 3.0))
    assert (found.steps.x, found.steps.y, found.steps.iterations) == (1000, 1000, 0)
    # Both axes come back once; Z goes up, down and up again.
    assert (found.reversals.x, found.reversals.y, found.reversals.z) == (1, 1, 2)
    assert (found.reversals.cutting.x, found.reversals.cutting.y) == (1, 1)
    assert found.time_split_s.cutting == pytest.approx(4 * 2.0 / 0.8 * 60.0)
    rapids = 0.2 + math.sqrt(2.0) + 0.22
    assert found.time_split_s.air == pytest.approx(rapids / 10.0 + 0.22 / 0.8 * 60.0)
    assert found.interpolator == "path"


def test_a_scale_error_shows_in_the_dimensions() -> None:
    toolpath = square(ToolpathBuilder(), 1.0, 1.0, 2.0).finish()
    found = report(toolpath, f"axes.x.real_step_mm={STEP * 1.01}")
    by_name = {item.name: item.error_percent for item in found.dimensions}
    assert by_name["part X"] == pytest.approx(1.0, abs=1e-6)
    assert by_name["part Y"] == pytest.approx(0.0, abs=1e-6)


def test_the_grid_is_an_error_of_rounding() -> None:
    off = 0.4 * STEP
    toolpath = square(ToolpathBuilder(), 1.0 + off, 1.0, 2.0).finish()
    assert report(toolpath).error_um.rounding.max == pytest.approx(off * UM, abs=1e-6)
    assert report(toolpath).error_um.interpolation.max <= NOISE_UM
    assert report(toolpath, FREE).error_um.rounding.max <= NOISE_UM


def _turned(toolpath: Toolpath, by: Callable[[np.ndarray], np.ndarray], *, mirror: bool) -> Any:
    swapped = {Kind.ARC_CW: Kind.ARC_CCW, Kind.ARC_CCW: Kind.ARC_CW}
    kinds = [swapped.get(Kind(k), Kind(k)) if mirror else Kind(k) for k in toolpath.kind]
    end = toolpath.end.copy()
    end[:, :2] = by(end[:, :2])
    return Toolpath(
        kind=np.array(kinds),
        end=end,
        centre=by(toolpath.centre),
        feed=toolpath.feed,
        value=toolpath.value,
        source=toolpath.source,
        block=toolpath.block,
        start=np.append(by(toolpath.start[None, :2])[0], toolpath.start[2]),
        texts=toolpath.texts,
    )


MOTIONS = [
    (lambda p: p * [-1.0, 1.0], True),
    (lambda p: p[:, ::-1], True),
    (lambda p: np.column_stack([-p[:, 1], p[:, 0]]), False),
    (lambda p: p - np.array([10.0, -5.0]), False),
    (lambda p: -p, False),
]


@given(contours(), st.sampled_from(MOTIONS))
def test_mirrors_turns_and_shifts_change_no_error(toolpath: Toolpath, motion: Any) -> None:
    """With play that is the same for both axes and either direction."""
    settings = (FREE, "controller.start_play=centred", *both("backlash_mm", 0.06))
    here = report(toolpath, *settings)
    there = report(_turned(toolpath, motion[0], mirror=motion[1]), *settings)
    for name in ("mechanics", "total", "interpolation"):
        one, other = getattr(here.error_um, name), getattr(there.error_um, name)
        assert (one.max or 0.0) == pytest.approx(other.max or 0.0, abs=1e-5)
        assert (one.rms or 0.0) == pytest.approx(other.rms or 0.0, abs=1e-5)
    assert here.time_s == pytest.approx(there.time_s)
    assert here.contours == there.contours


def keys(value: Any, at: str = "") -> set[str]:
    """All keys of nested JSON objects and of the first item of lists."""
    if isinstance(value, dict):
        return {at + key for key in value} | {
            found for key, item in value.items() for found in keys(item, f"{at}{key}.")
        }
    return keys(value[0], at + "[].") if isinstance(value, list) and value else set()


def test_the_report_has_the_keys_of_any_other() -> None:
    toolpath = circle(ToolpathBuilder(), 1.0, 1.0, 0.05).finish()
    one = verify(toolpath, pic_mmh(), wanted=toolpath).report.to_json()
    other = report(toolpath, FREE).to_json()
    assert keys(json.loads(one)) == keys(json.loads(other))
    assert "followed exactly" in report(toolpath).to_text(findings=False)


def test_it_has_no_interpolators_to_compare() -> None:
    toolpath = square(ToolpathBuilder(), 1.0, 1.0, 2.0).finish()
    with pytest.raises(OptionError, match="--interpolator"):
        verify(toolpath, path_machine(), options=VerifyOptions(interpolator="dsm"))


def test_travel_and_play_are_noticed_and_homing_told() -> None:
    b = square(ToolpathBuilder(), 1.0, 1.0, 2.0).event(Kind.HOME_XY)
    machine = path_machine("axes.x.travel_mm=2.5", "axes.y.backlash_mm=0.1")
    codes = {f.code: f for f in verify(b.finish(), machine).findings}
    assert codes[ProgramCode.OUT_OF_TRAVEL].where.startswith("axis X")
    assert VerificationCode.RETURN_TO_MACHINE_ZERO in codes
    unknown = [
        f.where
        for f in verify(b.finish(), machine).findings
        if f.code == ProgramCode.PLAY_NOT_KNOWN
    ]
    assert unknown == ["axis X", "axis Z"]


def test_the_trace_holds_as_many_points_as_were_asked_for() -> None:
    toolpath = circle(ToolpathBuilder(), 30.0, 30.0, 25.0).finish()
    options = VerifyOptions(trace_points=2000)
    trace = verify(toolpath, path_machine(), options=options).trace
    assert 700 <= len(trace.row) <= 2000
