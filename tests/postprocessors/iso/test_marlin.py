"""The model of Marlin against its own loops, and closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.iso.controllers import MarlinController
from camtool_postprocessors.iso.marlin import (
    FIRST_MOVE_DELAY_S,
    MarlinModel,
    jerk_corners,
    kept_steps,
    slowed,
)

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles import marlin_run
from tests.oracles.grbl_run import ring_entries
from tests.oracles.motion_rows import rows_of

RNG = np.random.default_rng(4)
STEP_MM = 0.0125
LIMITS = (250.0, 250.0, 100.0)
JERK = (10.0, 8.0, 0.3)


def machine(**keys: Any) -> Machine[Any, Any]:
    loaded = load_target("linuxcnc", settings=["limits.rapid_mm_min=3000"]).machine
    axes = {
        name: replace(
            getattr(loaded.axes, name),
            coded_step_mm=STEP_MM,
            max_rate_mm_min=1500.0 if name == "z" else 3000.0,
            acceleration_mm_s2=limit,
        )
        for name, limit in zip("xyz", LIMITS, strict=True)
    }
    controller = MarlinController(**{"travel_acceleration_mm_s2": 300.0, **keys})
    return replace(loaded, axes=replace(loaded.axes, **axes), controller=controller)


def seconds(path: Toolpath, **keys: Any) -> Floats:
    return MarlinModel().seconds(path, machine(**keys))


def random_path(count: int) -> Toolpath:
    """Lines of many lengths and angles on whole steps, each of more than 6 of them."""
    builder, at = ToolpathBuilder(), np.zeros(3)
    for _ in range(count):
        size = 10.0 ** RNG.uniform(0.9, 3.0)
        way = RNG.normal(size=3) * [1.0, 1.0, RNG.choice([0.0, 0.5])]
        steps = np.rint(size * way / np.abs(way).max())
        at = at + (steps if RNG.random() < 0.9 else -np.abs(steps))
        builder.line(*(at * STEP_MM).tolist(), feed=float(RNG.choice([60.0, 600.0, 4000.0])))
    return builder.finish()


@pytest.mark.parametrize("small_segments", [True, False])
@pytest.mark.parametrize("jerk", [None, JERK])
def test_times_are_those_of_the_loop(
    small_segments: bool, jerk: tuple[float, float, float] | None
) -> None:
    """Limits, corners, ring and trapezoid, one block at a time."""
    keys = {"small_segments": small_segments, "classic_jerk_mm_s": jerk}
    path = random_path(300)
    ends = np.concatenate([np.zeros((1, 3)), path.end])
    ways = np.rint(np.diff(ends, axis=0) / STEP_MM).astype(int)
    lengths = [math.sqrt(sum((n * STEP_MM) ** 2 for n in way)) for way in ways.tolist()]
    units = [[n * STEP_MM / d for n in w] for w, d in zip(ways.tolist(), lengths, strict=True)]
    rates = (50.0, 50.0, 25.0)
    feeds, highest, accels = list[float](), list[float](), list[int]()
    for way, unit, length, feed in zip(
        ways.tolist(), units, lengths, path.feed.tolist(), strict=True
    ):
        most = min(r / abs(u) for r, u in zip(rates, unit, strict=True) if u)
        feeds.append(feed / 60.0)
        highest.append(most)
        of_axes = [int(limit / STEP_MM) for limit in LIMITS]
        accels.append(marlin_run.acceleration_steps(way, length, 300.0, of_axes))
    slowed = marlin_run.slowed(lengths, feeds, 16)
    speeds = [min(pair) for pair in zip(slowed, highest, strict=True)]
    per_mm = [max(map(abs, w)) / d for w, d in zip(ways.tolist(), lengths, strict=True)]
    accelerations = [n / s for n, s in zip(accels, per_mm, strict=True)]
    if jerk is None:
        corners = [0.0]
        for k in range(1, len(units)):
            square = marlin_run.junction_square(
                units[k - 1], units[k], lengths[k], accelerations[k], LIMITS, 0.013,
                small_segments,
            )  # fmt: skip
            corners.append(math.sqrt(square))
    else:
        corners = marlin_run.jerk_speeds(units, speeds, jerk)
    limits = [min(v**2, speeds[k] ** 2, speeds[max(k - 1, 0)] ** 2) for k, v in enumerate(corners)]
    gains = [2.0 * a * d for a, d in zip(accelerations, lengths, strict=True)]
    squares = [*ring_entries(gains, limits, 16), 0.0]
    wanted = [
        marlin_run.block_seconds(
            int(max(map(abs, ways[k].tolist()))),
            math.ceil(speeds[k] * per_mm[k] - 1e-9),
            math.sqrt(squares[k]) * per_mm[k],
            math.sqrt(squares[k + 1]) * per_mm[k],
            accels[k],
            120,
        )
        for k in range(len(ways))
    ]
    # A rate that is whole but for rounding may be one more in either, and a ramp a step longer.
    found = seconds(path, **keys)
    assert np.isclose(found, wanted, rtol=0.01, atol=5e-4).mean() > 0.95
    assert np.isclose(found, wanted, rtol=0.02, atol=4e-3).all()
    assert found.sum() == pytest.approx(sum(wanted), rel=1e-3)


def test_classic_jerk_is_that_of_the_loop() -> None:
    units = RNG.normal(size=(2000, 3)) * RNG.choice([0.0, 1.0], (2000, 3))
    units = units[np.abs(units).sum(axis=1) > 0.0]
    units /= np.sqrt((units**2).sum(axis=1))[:, None]
    speeds = RNG.choice([3.0, 12.0, 60.0], len(units))
    wanted = marlin_run.jerk_speeds(units.tolist(), speeds.tolist(), JERK)
    assert jerk_corners(units, speeds, JERK) == pytest.approx(wanted)


@pytest.mark.parametrize("ccw", [True, False])
@pytest.mark.parametrize("rise", [0.0, -0.7])
@pytest.mark.parametrize("correction", [1, 4, 25])
def test_chords_are_those_of_the_loop(ccw: bool, rise: float, correction: int) -> None:
    said = machine(mm_per_arc_segment=0.3, arc_correction=correction, min_steps=1)
    for radius in (0.1, 1.0, 7.7, 60.0):
        for sweep in (0.05, 1.0, 3.0, 6.2, 2.0 * math.pi):
            x, y = np.rint(RNG.uniform(-9.0, 9.0, 2) / STEP_MM) * STEP_MM
            angle = RNG.uniform(-9.0, 9.0)
            cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
            last = angle + (sweep if ccw else -sweep)
            ex, ey = cx + radius * math.cos(last), cy + radius * math.sin(last)
            if sweep == 2.0 * math.pi:
                ex, ey = x, y
            builder = ToolpathBuilder((x, y, 0.0))
            path = builder.arc(ex, ey, rise, centre=(cx, cy), ccw=ccw, feed=100.0).finish()
            found = MarlinModel().planned(path, said).path.end
            offset = cx - x, cy - y
            wanted = marlin_run.arc_ends(
                (x, y, 0.0), (ex, ey, rise), offset, not ccw, 0.3, 24, correction
            )
            assert len(found) == len(wanted)
            np.testing.assert_allclose(found, wanted, atol=0.5 * STEP_MM + 1e-9)


def test_short_moves_are_added_to_the_next() -> None:
    steps = np.cumsum(RNG.integers(-4, 9, (500, 3)), axis=0)
    kept = kept_steps(steps, 6)
    assert kept.tolist() == [list(p) for p in marlin_run.kept(steps.tolist(), 6)]
    assert (np.abs(np.diff(kept, axis=0)).max(axis=1) != 0).mean() < 0.9


def test_the_last_steps_of_a_program_of_short_moves_are_lost() -> None:
    builder = ToolpathBuilder()
    for k in range(1, 9):
        builder.line(k * 4 * STEP_MM, 0.0, 0.0, feed=600.0)
    path = builder.line(35 * STEP_MM, 0.0, 0.0, feed=600.0).finish()
    rows = rows_of(MarlinModel().run(path, machine(), Options(effects=IDEAL)))
    ends = [float(row.commanded[-1, 0]) / STEP_MM for row in rows if len(row.commanded)]
    assert ends == pytest.approx([8.0, 16.0, 24.0, 32.0])


def test_a_trapezoid_in_closed_form() -> None:
    """100 mm at 25 mm/s and 250 mm/s²: 4.1 s, 0.1 s in which a first move waits for others, and
    the first and second step at the lowest rate of 120 steps/s, which the ramp passes sooner."""
    path = ToolpathBuilder().line(100.0, 0.0, 0.0, feed=1500.0).finish()
    assert seconds(path) == pytest.approx([4.1 + FIRST_MOVE_DELAY_S], abs=2.0 / 120.0)


def test_short_moves_behind_a_stop_are_slowed() -> None:
    """20 moves of 0.1 mm at 25 mm/s, 4 ms each: the third to eighth get 2 · 16 ms / k more."""
    builder = ToolpathBuilder()
    for k in range(1, 21):
        builder.line(k * 0.1, 0.0, 0.0, feed=1500.0)
    length, speed = np.full(20, 0.1), np.full(20, 25.0)
    controller = machine().controller
    more_s = 0.1 / slowed(length, speed, controller) - 0.004
    assert more_s[2:8] == pytest.approx([0.032 / k for k in range(2, 8)])
    assert more_s[:2] == pytest.approx([0.0, 0.0])
    assert more_s[8:] == pytest.approx(np.zeros(12))
    path = builder.finish()
    assert seconds(path).sum() > seconds(path, min_segment_ms=0.0).sum()


def test_every_event_of_a_spindle_stops() -> None:
    def path(event: Kind) -> Toolpath:
        builder = ToolpathBuilder().line(10.0, 0.0, 0.0, feed=1200.0).event(event, 0.0)
        return builder.line(20.0, 0.0, 0.0, feed=1200.0).finish()

    stops = MarlinModel().planned(path(Kind.SPINDLE_OFF), machine())
    passes = MarlinModel().planned(path(Kind.MESSAGE), machine())
    assert stops.exit[0] == 0.0
    assert passes.exit[0] == pytest.approx(20.0)


def test_an_axis_may_move_next_to_nothing() -> None:
    path = ToolpathBuilder().line(10.0, 1e-310, -2.2e-309, feed=600.0).finish()
    assert 1.0 < seconds(path)[0] < 1.3
