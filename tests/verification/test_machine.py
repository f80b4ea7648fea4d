"""Judging with the real simulation of the first machine."""

import math

import numpy as np
import pytest

from camtool.findings import Severity
from camtool.simulation.motion import Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Toolpath
from camtool.verification.findings import VerificationCode
from camtool.verification.verify import VerifyOptions
from tests.oracles.dense_moves import circle, cut, dense_distance, pic_mmh, points_of, square
from tests.oracles.motion_rows import rows_of
from tests.targets import model_of, simulate, verify

STEP = 0.00014
UM = 1000.0
NO_PLAY = (
    "axes.x.backlash_mm=0.0",
    "axes.x.compensation_mm=0.0",
    "axes.y.backlash_mm=0.0",
    "axes.y.compensation_mm=0.0",
)


def small_circle() -> Toolpath:
    """Radius 30 steps, as the thesis compares its three methods on (Tabla 7)."""
    return circle(ToolpathBuilder(), 100 * STEP, 100 * STEP, 30 * STEP, ccw=False).finish()


@pytest.mark.parametrize(
    ("interpolator", "iterations", "most_steps"),
    [("stairs", 240, 1.0), ("dda", 188, 1.16), ("dsm", 168, 0.5)],
)
def test_the_three_methods_on_the_circle_of_the_thesis(
    interpolator, iterations: int, most_steps: float
) -> None:
    toolpath = small_circle()
    machine = pic_mmh(*NO_PLAY)
    row = 3
    passes = rows_of(simulate(toolpath, machine, Options(interpolator)))[row].iterations
    found = verify(toolpath, machine, options=VerifyOptions(interpolator=interpolator)).report
    assert passes == iterations
    assert 0.3 < found.error_um.interpolation.arcs_steps < most_steps
    assert found.error_um.interpolation.lines_steps is None
    assert found.interpolator == interpolator
    (ring,) = found.circles
    # Square roots of whole numbers about a whole centre: radius 30 at the four ends of the axes.
    assert ring.Fmax_um <= most_steps * STEP * UM
    assert ring.Fmin_um >= -most_steps * STEP * UM
    assert ring.direction == "cw"


def test_interpolation_and_total_are_those_of_dense_points() -> None:
    machine = pic_mmh()
    b = cut(ToolpathBuilder(), 0.05, 0.05).line(0.0763, 0.0618, feed=0.8)
    b.arc(0.0763, 0.0818, centre=(0.0763, 0.0718), ccw=True, feed=0.8)
    b.line(0.0763, 0.0718, feed=0.8).rapid(z=0.2)
    wanted = b.finish()
    decoded = model_of(machine).quantised(wanted, machine)
    clouds = {m.index: np.array(points_of(m, 3000)) for m in decoded if m.index in (3, 4, 5)}
    target = np.concatenate([np.array(points_of(m, 3000)) for m in wanted if m.index in clouds])
    inner, total = [], []
    for number, row in enumerate(rows_of(simulate(wanted, machine))):
        if number in clouds:
            cloud = clouds[number]
            inner += [dense_distance(point, cloud) for point in row.commanded[:, :2]]
            total += [dense_distance(point, target) for point in row.slide[:, :2]]
    error = verify(wanted, machine, wanted=wanted).report.error_um
    assert error.interpolation.max == pytest.approx(max(inner) * UM, abs=1e-3)
    rms = float(np.sqrt(np.mean(np.square(inner))))
    assert error.interpolation.rms == pytest.approx(rms * UM, abs=1e-3)
    assert error.total.max == pytest.approx(max(total) * UM, abs=2e-2)


def test_without_play_the_slides_are_where_the_controller_believes() -> None:
    decoded = square(ToolpathBuilder(), 0.1, 0.1, 0.3).finish()
    found = verify(decoded, pic_mmh(*NO_PLAY), wanted=decoded)
    assert found.report.error_um.mechanics.max == 0.0
    assert found.report.error_um.total.max < 1.5 * STEP * UM
    assert found.report.closure_um == 0.0


@pytest.mark.parametrize("play", [0.002, 0.02])
def test_known_play_gives_the_circle_of_the_formula(play: float) -> None:
    """As in test_verify_circles, with the play taken up to one side: the same path, half the
    play to the left, which the least-squares centre follows."""
    radius = 2000 * STEP
    machine = pic_mmh(*NO_PLAY, f"axes.x.backlash_mm={play}")
    decoded = circle(ToolpathBuilder(), 4000 * STEP, 3000 * STEP, radius).finish()
    found = verify(decoded, machine).report
    assert found.error_um.mechanics.max == pytest.approx(play * UM, abs=1e-6)
    least = radius - play / 2
    largest = math.sqrt(least**2 + radius**2 - (radius - play) ** 2)
    (ring,) = found.circles
    assert ring.G_um == pytest.approx((largest - least) * UM, abs=2.0 * STEP * UM)


def test_compensation_equal_to_the_play_leaves_no_error_at_rest() -> None:
    play = 200 * STEP
    machine = pic_mmh(
        *NO_PLAY,
        f"axes.x.backlash_mm={play}",
        f"axes.x.compensation_mm={play}",
        f"axes.y.backlash_mm={play}",
        f"axes.y.compensation_mm={play}",
    )
    decoded = square(ToolpathBuilder(), 0.1, 0.1, 0.3).finish()
    assert verify(decoded, machine).report.error_um.mechanics.max == pytest.approx(0.0, abs=1e-6)


def test_scale_error_shows_in_the_dimensions() -> None:
    machine = pic_mmh(*NO_PLAY, f"axes.x.real_step_mm={STEP * 0.9965}")
    decoded = square(ToolpathBuilder(), 0.2, 0.2, 1.0).finish()
    by_name = {d.name: d for d in verify(decoded, machine).report.dimensions}
    assert by_name["contour 1 X"].error_percent == pytest.approx(-0.35, abs=0.01)
    assert by_name["contour 1 Y"].error_percent == pytest.approx(0.0, abs=0.01)


def test_arcs_that_miss_their_end_are_exactly_those_that_the_simulation_gave_up() -> None:
    rng = np.random.default_rng(11)
    machine = pic_mmh(*NO_PLAY, "controller.arc_end=equal")
    b = ToolpathBuilder()
    for number in range(25):
        turn, sweep, radius = rng.uniform(0, 6.28), rng.uniform(0.5, 3.0), rng.uniform(0.05, 0.2)
        x, y = rng.uniform(1, 2, 2)
        cut(b, x + radius * math.cos(turn), y + radius * math.sin(turn))
        b.block = 1000 + number
        end = (x + radius * math.cos(turn + sweep), y + radius * math.sin(turn + sweep))
        b.arc(*end, centre=(x, y), ccw=True, feed=0.8)
        b.block = -1
    decoded = b.finish()
    missed = {
        f"block {decoded.block[number] + 1}"
        for number, row in enumerate(rows_of(simulate(decoded, machine)))
        if not row.ended
    }
    found = [f for f in verify(decoded, machine).findings if f.code == ProgramCode.ARC_MISSES_END]
    assert 3 <= len(missed) <= 20
    assert {f.where.split(",")[0] for f in found} == missed
    for finding in found:
        assert finding.measured is not None
        assert 0.999 <= finding.measured <= 3.0
        assert "would run on" in finding.message


@pytest.mark.parametrize("form", ["example", "annex"])
def test_a_program_of_our_own_post_is_within_the_steps_of_its_machine(form: str) -> None:
    target = load_target("pic-mmh", settings=[f"dialect.form={form}"])
    rng = np.random.default_rng(5)
    b = ToolpathBuilder()
    for number in range(8):
        b.source = f"CUT arc {number}"
        x, y = rng.uniform(1.0, 4.0, 2)
        radius, turn, sweep = rng.uniform(0.1, 0.6), rng.uniform(0, 6.28), rng.uniform(0.3, 6.0)
        cut(b, x + radius * math.cos(turn), y + radius * math.sin(turn))
        end = (x + radius * math.cos(turn + sweep), y + radius * math.sin(turn + sweep))
        b.arc(*end, centre=(x, y), ccw=True, feed=0.8)
        b.line(*rng.uniform(1.0, 4.0, 2), feed=0.8)
        circle(b, x, y, radius, ccw=number % 2 == 0)
    wanted = b.finish()
    data = target.target.write(wanted, target.machine).data
    decoded = target.target.read(data, target.machine)
    found = verify(decoded, target.machine, wanted=wanted)
    assert [f for f in found.findings if f.severity == Severity.ERROR] == []
    error = found.report.error_um
    assert error.interpolation.arcs_steps <= 0.5
    assert error.interpolation.lines_steps < 1.0
    assert error.rounding.max < (0.4 if form == "example" else 2.0)
    assert len(found.report.circles) == 8
    assert found.report.blocks == data.count(b";")
    assert all(circle.G_um < 30.0 for circle in found.report.circles)


def test_the_string_of_the_thesis_alone_is_judged() -> None:
    """Its arc starts at part zero, so start and end radius differ: it cannot meet its end."""
    for reading, code in (
        ("equal", ProgramCode.ARC_MISSES_END),
        ("final-quadrant", VerificationCode.END_NOT_REACHED),
    ):
        target = load_target("pic-mmh", settings=[f"controller.arc_end={reading}"])
        data = b"G02X02969.00Y03400.00I03012.00J03040.00F08;"
        decoded = target.target.read(data, target.machine)
        found = verify(decoded, target.machine)
        assert {code, ProgramCode.ARC_END_UNSURE} <= {f.code for f in found.findings}
        assert found.report.contours == 1
