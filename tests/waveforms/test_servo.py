"""Servo axes over time: against scipy's simulation of the loop, and the model's samples."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from camtool.pictures.options import PictureOptions
from camtool.simulation.motion import IDEAL, Options
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.moves import Toolpath
from camtool.waveforms.servo import AxisMove, ServoRun
from tests.postprocessors.matlab_router.parts import strokes

LONG = strokes([(4.0, 4.0), (24.0, 4.0), (24.0, 24.0), (4.0, 24.0)])
"""Three lines of 20 mm, each along one axis."""


def router(*settings: str) -> LoadedTarget:
    return load_target("matlab-router", settings=settings)


def run_of(
    path: Toolpath, *settings: str, span: tuple[float, float | None] = (0.0, None)
) -> ServoRun:
    target = router(*settings)
    loop = target.target.speed_loop(target.machine)
    assert loop is not None
    return ServoRun(target, path, loop, "a program", *span)


def line_along_x(run: ServoRun) -> AxisMove:
    """The first line along X, at 480 counts in a tick; X goes to its start at 500."""
    along_x = [move for move in run.moves() if move.axis == "X"]
    return next(move for move in along_x if move.reference_rpm == pytest.approx(5625))


@pytest.mark.parametrize("slaves", ["listing", "text"])
def test_ticks_are_the_samples_of_the_model(slaves: str) -> None:
    """Whole counts of the reached positions are the commanded samples, at the same times."""
    run = run_of(LONG, f"controller.slaves={slaves}")
    timed = list(run.target.timed(LONG, Options(effects=IDEAL)))
    ticks = list(run.target.target.servo_ticks(LONG, run.target.machine))
    at_s = np.concatenate([part.at_s for part in ticks])
    np.testing.assert_allclose(at_s, np.concatenate([part.at_s for part in timed]), atol=1e-9)
    machine = run.target.machine
    mm = np.concatenate([part.chunk.commanded for part in timed])
    coded = np.array([axis.coded_step_mm for axis in machine.axes]) * [1, 1, -1]
    counts = (mm - np.array(machine.controller.machine_zero_mm)) / coded
    reached = np.concatenate([part.reached for part in ticks])
    assert (np.abs(reached - counts) <= 1.0 + 1e-6).all()
    row = np.concatenate([part.row for part in ticks])
    assert (row == np.concatenate([part.chunk.row for part in timed])).all()


def test_a_long_line_answers_as_scipy_simulates_the_loop() -> None:
    """The text's loop is linear but for rounded counts: ω follows the closed loop of eq. 4.31,
    (z − a)(z − 1) + b (Kpd (z − 1) + Kid z), within two counts of the encoder."""
    run = run_of(LONG, "controller.slaves=text")
    loop, motor = run.loop, run.loop.motors[0]
    begun = line_along_x(run)
    ticks = [part for part, _ in run.ticks()]
    at_s = np.concatenate([part.at_s for part in ticks])
    speed = np.concatenate([part.speed for part in ticks])[:, 0]
    goal = begun.reference_rpm / run.rpm
    pole = float(np.exp(-loop.tick_s / motor.time_constant_s))
    b = motor.gain * (1.0 - pole)
    kid, kpd = loop.kid[0] * loop.gain_unit, loop.kpd[0] * loop.gain_unit
    # Measured is the mean speed of the tick before, drives change at its end.
    place = motor.gain * motor.time_constant_s / loop.tick_s * (1.0 - pole)
    mean = [motor.gain - place, place - motor.gain * pole]  # mean ω of a tick from u held in it
    plant = np.array(mean), np.array([1.0, -pole])
    open_den = np.convolve(plant[1], [1.0, -1.0, 0.0])
    feedback = np.convolve(plant[0], [kpd + kid, -kpd])
    closed_den = np.pad(open_den, (0, 0))
    closed_den = closed_den + np.pad(feedback, (len(closed_den) - len(feedback), 0))
    closed_num = np.convolve(plant[0], [kid, 0.0])
    assert b > 0.0
    count = 60
    from scipy import signal  # late: it takes a second or two of each worker

    system = signal.dlti(closed_num, closed_den, dt=loop.tick_s)
    _, (answer,) = signal.dstep(system, n=count)
    first = int(np.searchsorted(at_s, begun.at_s + 1e-6))
    shown = speed[first : first + count]
    wanted = goal * answer[:, 0]
    np.testing.assert_allclose(shown[: len(wanted)], wanted, atol=2.0)
    assert begun.overshoot == pytest.approx(float(answer.max()) - 1.0, abs=0.015)


def test_figures_of_a_long_line() -> None:
    """A line of 20 mm at 3.75 mm/s: its reference is 480 counts in a tick, 5625 rpm; at the end of
    the line the motor coasts, without a brake, τ ω further: listing, L5496-5584."""
    run = run_of(LONG)
    move = line_along_x(run)
    assert move.reference_rpm == pytest.approx(480 * 200 * 60 / 1024)
    assert 0.0 < move.overshoot < 0.1
    assert move.settling_s is not None
    assert 0.05 < move.settling_s < 0.5
    assert move.steady_error is not None
    assert abs(move.steady_error) < 0.01
    motor = run.loop.motors[0]
    ticks = [part for part, _ in run.ticks()]
    speed = np.concatenate([part.speed for part in ticks])[:, 0]
    drive = np.concatenate([part.drive for part in ticks])[:, 0]
    reached = np.concatenate([part.reached for part in ticks])[:, 0]
    off = np.flatnonzero((drive[:-1] > 0.0) & (drive[1:] == 0.0))[-1] + 1
    coasts = reached[off + 200] - reached[off]
    assert coasts == pytest.approx(
        speed[off + 1] / (1 - np.exp(-run.loop.tick_s / motor.time_constant_s)), rel=0.05
    )


def test_the_table_has_every_tick_and_the_errors() -> None:
    run = run_of(LONG, span=(6.0, 0.5))
    rows = list(csv.DictReader(io.StringIO(b"".join(run.table()).decode())))
    times = [float(row["time_s"]) for row in rows]
    assert len(rows) in (100, 101)
    np.testing.assert_allclose(np.diff(times), 0.005, atol=1e-6)
    assert 6.0 <= times[0] <= times[-1] <= 6.5
    assert {"x_reference", "y_speed", "z_drive", "x_wanted", "x_reached", "error_um"} <= {*rows[0]}


def test_pictures_show_the_axes_that_move() -> None:
    run = run_of(LONG)
    svg = run.svg(PictureOptions(size_px=500))
    for name in ("X", "Y", "Z"):
        assert f"speed of {name} (rpm of the motor)" in svg
        assert f"position of {name} (turns)" in svg
    assert "distance from the path (µm)" in svg
    alone = run.svg(PictureOptions(size_px=500), ["y"])
    assert "speed of Y" in alone
    assert "speed of X" not in alone
