"""Trapezoids of a controller that was measured: closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.iso.controllers import TrapezoidController
from camtool_postprocessors.iso.trapezoid import TrapezoidModel

from camtool.errors import MachineError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind
from tests.oracles.motion_rows import rows_of

ACCELERATION = 200.0


def machine(**keys: Any) -> Machine[Any, Any]:
    loaded = load_target("linuxcnc", settings=["limits.rapid_mm_min=3000"]).machine
    limits = {"max_rate_mm_min": 3000.0, "acceleration_mm_s2": ACCELERATION}
    axes = {name: replace(getattr(loaded.axes, name), **limits) for name in "xyz"}
    return replace(
        loaded, axes=replace(loaded.axes, **axes), controller=TrapezoidController(**keys)
    )


def test_a_line_and_a_triangle() -> None:
    """40 mm at 20 mm/s: 0.1 s to its speed and back. 0.5 mm: √(4 d / a) in all."""
    builder = ToolpathBuilder().line(40.0, 0.0, 0.0, feed=1200.0).event(Kind.DWELL, 0.5)
    path = builder.line(40.5, 0.0, 0.0, feed=6000.0).finish()
    found = TrapezoidModel().seconds(path, machine())
    assert found == pytest.approx([2.1, 0.5, math.sqrt(4 * 0.5 / ACCELERATION)])


@pytest.mark.parametrize("turn_deg", [0.0, 1.0, 45.0, 90.0, 135.0, 180.0])
def test_speeds_of_corners(turn_deg: float) -> None:
    """v² = v₉₀² (√2 − 1) s / (1 − s), s the cosine of half the turn."""
    turn = math.radians(turn_deg)
    x, y = 40.0 + 40.0 * math.cos(turn), 40.0 * math.sin(turn)
    builder = ToolpathBuilder().line(40.0, 0.0, 0.0, feed=1200.0).line(x, y, 0.0, feed=1200.0)
    moves = TrapezoidModel().planned(builder.finish(), machine(corner_mm_s=6.0))
    s = math.cos(turn / 2.0)
    wanted = 20.0
    if turn_deg > 0.0:
        wanted = min(20.0, math.sqrt(36.0 * (math.sqrt(2.0) - 1.0) * s / (1.0 - s)))
    assert moves.exit[0] == moves.entry[1] == pytest.approx(wanted, abs=1e-6)
    stops = TrapezoidModel().planned(builder.finish(), machine())
    assert stops.exit[0] == pytest.approx(20.0 if turn_deg == 0.0 else 0.0)


def test_a_tangent_arc_is_no_corner_and_keeps_to_its_radius() -> None:
    """√(200 · 0.5) = 10 mm/s."""
    builder = ToolpathBuilder().line(20.0, 0.0, 0.0, feed=1200.0)
    builder.arc(20.0, 1.0, 0.0, centre=(20.0, 0.5), ccw=True, feed=1200.0)
    path = builder.line(0.0, 1.0, 0.0, feed=1200.0).finish()
    moves = TrapezoidModel().planned(path, machine())
    assert moves.entry[1] == moves.exit[1] == moves.peak[1] == pytest.approx(10.0)
    assert moves.peak[0] == pytest.approx(20.0)


def test_the_path_is_that_of_the_program() -> None:
    builder = ToolpathBuilder().arc(0.0, 2.0, 1.0, centre=(0.0, 1.0), ccw=True, feed=600.0)
    rows = rows_of(TrapezoidModel().run(builder.finish(), machine(), Options(effects=IDEAL)))
    radii = np.hypot(rows[0].commanded[:, 0], rows[0].commanded[:, 1] - 1.0)
    assert np.abs(radii - 1.0).max() < 0.01
    assert rows[0].commanded[-1] == pytest.approx([0.0, 2.0, 1.0], abs=0.005)


def test_accelerations_are_needed() -> None:
    whole = machine()
    axes = replace(whole.axes, z=replace(whole.axes.z, acceleration_mm_s2=None))
    path = ToolpathBuilder().line(1.0, 0.0, 0.0, feed=600.0).finish()
    with pytest.raises(MachineError, match="acceleration_mm_s2"):
        TrapezoidModel().seconds(path, replace(whole, axes=axes))


def test_a_move_of_no_length_that_can_be_counted_is_none() -> None:
    builder = ToolpathBuilder().line(0.0, 0.0, -2.2e-309, feed=600.0)
    path = builder.line(1e-10, 0.0, 0.0, feed=600.0).finish()
    assert TrapezoidModel().seconds(path, machine()).tolist() == [0.0, 0.0]


def test_an_axis_may_move_next_to_nothing() -> None:
    path = ToolpathBuilder().line(10.0, 1e-310, -2.2e-309, feed=600.0).finish()
    assert 1.0 < TrapezoidModel().seconds(path, machine())[0] < 1.3
