"""The model of Klipper against its own loops, and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.iso.controllers import KlipperController
from camtool_postprocessors.iso.klipper import KlipperModel

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.klipper_run import Settings, arc_ends, planned
from tests.oracles.motion_rows import rows_of

RNG = np.random.default_rng(3)
STEP_MM = 0.004
RAPID_MM_S = 50.0
SAID: dict[str, Any] = {
    "max_velocity_mm_s": 60.0,
    "max_accel_mm_s2": 300.0,
    "max_z_velocity_mm_s": 20.0,
    "max_z_accel_mm_s2": 90.0,
}


def machine(**keys: Any) -> Machine[Any, Any]:
    loaded = load_target("linuxcnc", settings=[f"limits.rapid_mm_min={60.0 * RAPID_MM_S}"]).machine
    axes = replace(
        loaded.axes,
        **{name: replace(getattr(loaded.axes, name), coded_step_mm=STEP_MM) for name in "xyz"},
    )
    return replace(loaded, axes=axes, controller=KlipperController(**{**SAID, **keys}))


def settings(**keys: Any) -> Settings:
    controller = machine(**keys).controller
    return Settings(
        controller.max_velocity_mm_s,
        controller.max_accel_mm_s2,
        controller.max_z_velocity_mm_s,
        controller.max_z_accel_mm_s2,
        controller.square_corner_velocity_mm_s,
        controller.minimum_cruise_ratio,
    )


def seconds(path: Toolpath, **keys: Any) -> Floats:
    return KlipperModel().seconds(path, machine(**keys))


def random_lines(count: int) -> tuple[Toolpath, list[tuple[float, float, float]], list[float]]:
    """Lines of many lengths and angles; some in Z, some straight on or back, some of no length."""
    points, speeds, builder = [(0.0, 0.0, 0.0)], list[float](), ToolpathBuilder()
    way = np.zeros(3)
    for _ in range(count):
        which = RNG.random()
        if which < 0.6:
            angle, way = RNG.uniform(0.0, 2.0 * math.pi), np.zeros(3)
            way[:2] = math.cos(angle), math.sin(angle)
            way[2] = RNG.choice([0.0, 0.0, RNG.normal()])
        elif which < 0.7:
            way = -way
        elif which < 0.75:
            way = np.zeros(3)
        length = 10.0 ** RNG.uniform(-2.5, 1.2)
        x, y, z = (np.array(points[-1]) + length * way).tolist()
        speeds.append(float(RNG.choice([1.0, 10.0, 40.0, 90.0])))
        points.append((x, y, z))
        builder.line(x, y, z, feed=60.0 * speeds[-1])
    return builder.finish(), points, speeds


@pytest.mark.parametrize("ratio", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("corner", [0.0, 5.0, 30.0])
def test_speeds_are_those_of_the_loop(ratio: float, corner: float) -> None:
    keys = {"minimum_cruise_ratio": ratio, "square_corner_velocity_mm_s": corner}
    for count in (1, 2, 3, 10, 200):
        path, points, speeds = random_lines(count)
        wanted = planned(points, speeds, settings(**keys))
        moves = KlipperModel().planned(path, machine(**keys))
        moving = moves.length > 0.0
        assert moving.sum() == len(wanted)
        for name, column in (("start_v2", moves.entry), ("cruise_v2", moves.peak)):
            found = column[moving] ** 2
            assert found == pytest.approx([getattr(one, name) for one in wanted], abs=1e-9)
        assert moves.seconds()[moving] == pytest.approx([one.seconds for one in wanted], abs=1e-9)


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("rise", [0.0, -0.7])
def test_chords_are_those_of_the_loop(ccw: bool, rise: float) -> None:
    for radius in (0.01, 0.3, 7.7, 60.0):
        for sweep in (0.001, 1.0, 3.0, 6.2, 2.0 * math.pi):
            x, y, angle = RNG.uniform(-9.0, 9.0, 3)
            cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
            last = angle + (sweep if ccw else -sweep)
            ex, ey = cx + radius * math.cos(last), cy + radius * math.sin(last)
            if sweep == 2.0 * math.pi:
                ex, ey = x, y
            builder = ToolpathBuilder((x, y, 0.0))
            path = builder.arc(ex, ey, rise, centre=(cx, cy), ccw=ccw, feed=100.0).finish()
            found = KlipperModel().planned(path, machine(arc_resolution_mm=0.2)).path.end
            wanted = arc_ends((x, y, 0.0), (ex, ey, rise), (cx - x, cy - y), not ccw, 0.2)
            assert len(found) == len(wanted)
            np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_a_trapezoid_in_closed_form() -> None:
    """60 mm at 30 mm/s and 300 mm/s²: 0.1 s to its speed, and as long back."""
    path = ToolpathBuilder().line(60.0, 0.0, 0.0, feed=1800.0).finish()
    assert seconds(path) == pytest.approx([2.0 + 0.1])


def test_a_corner_of_90_degrees() -> None:
    """It is met at the square corner velocity."""
    builder = ToolpathBuilder().line(50.0, 0.0, 0.0, feed=1800.0)
    path = builder.line(50.0, 50.0, 0.0, feed=1800.0).finish()
    moves = KlipperModel().planned(path, machine(square_corner_velocity_mm_s=7.0))
    assert moves.exit[0] == moves.entry[1] == pytest.approx(7.0)


def test_short_moves_cruise_a_part_of_their_time() -> None:
    """A move to and fro without a cruise ratio reaches √(a d); with 0.5 as if a were half."""
    builder = ToolpathBuilder().line(1.0, 0.0, 0.0, feed=3000.0)
    path = builder.line(0.0, 0.0, 0.0, feed=3000.0).finish()
    free = KlipperModel().planned(path, machine(minimum_cruise_ratio=0.0)).peak
    held = KlipperModel().planned(path, machine(minimum_cruise_ratio=0.5)).peak
    assert free == pytest.approx([math.sqrt(300.0)] * 2)
    assert held == pytest.approx([math.sqrt(150.0)] * 2)


def test_z_limits_a_slanted_move() -> None:
    """A move of 45° in Z runs at √2 times Z's speed and acceleration."""
    path = ToolpathBuilder().line(20.0, 0.0, 20.0, feed=6000.0).finish()
    moves = KlipperModel().planned(path, machine())
    assert moves.peak == pytest.approx([20.0 * math.sqrt(2.0)])
    assert moves.acceleration == pytest.approx([90.0 * math.sqrt(2.0)])


def test_a_dwell_stops_and_an_output_does_not() -> None:
    def path(event: Kind) -> Toolpath:
        builder = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=1200.0).event(event, 0.25)
        return builder.line(20.0, 0.0, 0.0, feed=1200.0).finish()

    straight = ToolpathBuilder().line(20.0, 0.0, 0.0, feed=1200.0).finish()
    assert seconds(path(Kind.SPINDLE_CW)).sum() == pytest.approx(seconds(straight).sum())
    assert seconds(path(Kind.DWELL))[1] == 0.25
    assert seconds(path(Kind.DWELL)).sum() == pytest.approx(
        2 * seconds(straight).sum() - 1.0 + 0.25
    )


def test_motors_step_where_their_axes_pass_the_middle_of_a_step() -> None:
    path = ToolpathBuilder().arc(0.0, 2.0, 1.0, centre=(0.0, 1.0), ccw=True, feed=600.0)
    fine = machine(arc_resolution_mm=0.01)
    rows = rows_of(KlipperModel().run(path.finish(), fine, Options(effects=IDEAL)))
    steps = rows[0].commanded / STEP_MM
    assert steps == pytest.approx(np.rint(steps), abs=1e-9)
    assert rows[0].steps.tolist() == [500, 500, 250]


def test_a_move_of_no_length_that_can_be_counted_is_none() -> None:
    builder = ToolpathBuilder().line(0.0, 0.0, -2.2e-309, feed=600.0)
    path = builder.line(1e-10, 0.0, 0.0, feed=600.0).finish()
    assert seconds(path).tolist() == [0.0, 0.0]


def test_an_axis_may_move_next_to_nothing() -> None:
    path = ToolpathBuilder().line(10.0, 1e-310, -2.2e-309, feed=600.0).finish()
    assert 1.0 < seconds(path)[0] < 1.3
