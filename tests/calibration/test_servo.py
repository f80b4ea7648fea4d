"""Servo axes: motors from measured steps; gains against scipy.signal and the thesis' tables."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.calibration.servo import (
    MeasuredResponse,
    design,
    identify,
    loop_poles,
    read_response,
    respond,
    simulate_step,
)
from camtool.errors import InputError, OptionError
from camtool.machine.servo import MotorModel, SpeedLoop
from camtool.target.registry import load_target
from tests.strategies import examples

TICK_S = 0.005
THESIS = MotorModel(gain=680 / 70, time_constant_s=0.067)
"""The motor that the thesis identified (L2704-2757)."""


def loop(motor: MotorModel, *, unit: float = 0.001, is_whole: bool = False) -> SpeedLoop:
    return SpeedLoop(TICK_S, (motor,) * 3, (28.0,) * 3, (159.0,) * 3, unit, is_whole)


def by_small_steps(
    motor: MotorModel, time_s: Floats, drive: Floats, parts: int = 400
) -> tuple[Floats, Floats]:
    """Integrate the motor by Euler's rule in small steps: speeds and counts at the samples."""
    speed = place = 0.0
    speeds, places = [0.0], [0.0]
    for begin, end in pairwise(time_s.tolist()):
        step = (end - begin) / parts
        for part in range(parts):
            now = begin + part * step - motor.dead_time_s
            held = np.searchsorted(time_s, now + 1e-12, side="right") - 1
            u = float(drive[held]) if held >= 0 else 0.0
            if speed == 0.0 and abs(u) <= motor.friction_percent:
                continue
            sense = math.copysign(1.0, speed if speed else u)
            aim = motor.gain * (u - motor.friction_percent * sense)
            after = speed + step / motor.time_constant_s * (aim - speed)
            if speed and after * speed < 0.0:
                after = 0.0
            place += 0.5 * (speed + after) * step / TICK_S
            speed = after
        speeds.append(speed)
        places.append(place)
    return np.array(speeds), np.array(places)


@examples(25)
@given(
    st.floats(2.0, 12.0),
    st.floats(0.02, 0.2),
    st.floats(0.0, 25.0),
    st.floats(0.0, 0.02),
    st.lists(st.sampled_from([-70.0, -30.0, 0.0, 10.0, 40.0, 70.0]), min_size=1, max_size=4),
)
def test_the_response_is_that_of_small_steps(
    gain: float, tau: float, friction: float, dead: float, drives: list[float]
) -> None:
    motor = MotorModel(gain, tau, friction, dead)
    drive = np.repeat(drives, 30)
    time_s = np.arange(len(drive)) * TICK_S
    speed, place = respond(motor, time_s, drive, TICK_S)
    slow_speed, slow_place = by_small_steps(motor, time_s, drive)
    top = 1.0 + np.abs(speed).max()
    assert np.abs(speed - slow_speed).max() < 0.01 * top
    assert np.abs(place - slow_place).max() < 0.01 * top * (1.0 + len(drive) * 0.05)


def sample(motor: MotorModel, drives: list[float], seed: int, noise: float) -> MeasuredResponse:
    """Sample a motor in steps of a second, with noise on its speeds."""
    drive = np.repeat(drives, 200)
    time_s = np.arange(len(drive)) * TICK_S
    speed, _ = respond(motor, time_s, drive, TICK_S)
    random = np.random.default_rng(seed)
    return MeasuredResponse(
        "m.csv", time_s, drive, speed + random.normal(0, noise, len(speed)), False
    )


@examples(20)
@given(
    st.floats(3.0, 12.0),
    st.floats(0.03, 0.15),
    st.floats(0.0, 20.0),
    st.floats(0.0, 0.012),
    st.integers(0, 2**31),
)
def test_a_motor_is_identified_from_two_drives(
    gain: float, tau: float, friction: float, dead: float, seed: int
) -> None:
    motor = MotorModel(gain, tau, friction, dead)
    found = identify([sample(motor, [70.0, 40.0], seed, 1.0)], TICK_S)
    assert not found.notes
    for name, value in (
        ("gain", gain),
        ("time_constant_s", tau),
        ("dead_time_s", dead),
        ("friction_percent", friction),
    ):
        sigma = found.uncertainty[name]
        assert sigma is not None
        # Bounds at 0 push dead time and friction to one side; 6 σ leaves 20 × 4 draws alone.
        assert abs(getattr(found.motor, name) - value) <= 6.0 * sigma + 1e-9, name
    assert found.residual == pytest.approx(1.0, rel=0.2)


def test_one_drive_does_not_determine_the_friction() -> None:
    found = identify([sample(MotorModel(9.0, 0.06, 10.0), [70.0], 1, 0.5)], TICK_S)
    assert found.uncertainty["friction_percent"] is None
    assert found.motor.friction_percent == 0.0
    assert found.motor.gain == pytest.approx(9.0 * 60 / 70, rel=0.01)
    assert "friction is not determined" in found.notes[0]


def test_coasting_to_rest_determines_the_friction() -> None:
    found = identify([sample(MotorModel(9.0, 0.06, 10.0), [70.0, 0.0], 1, 0.5)], TICK_S)
    assert found.motor.friction_percent == pytest.approx(10.0, abs=0.2)


def test_the_thesis_step_gives_its_model() -> None:
    """u = 70, 680 counts, τ = 0.067 s; 0.6986 / (z − 0.9283) (L2704-2757)."""
    measured = sample(THESIS, [70.0], 3, 0.3)
    found = identify([measured], TICK_S).motor
    assert found.gain == pytest.approx(9.715, abs=0.005)
    assert found.time_constant_s == pytest.approx(0.067, abs=0.0002)
    a = math.exp(-TICK_S / found.time_constant_s)
    assert a == pytest.approx(0.9283, abs=0.0003)
    assert found.gain * (1 - a) == pytest.approx(0.6986, abs=0.003)


def test_counts_of_the_encoder_give_the_same_motor() -> None:
    motor = MotorModel(8.0, 0.05, 5.0, 0.004)
    drive = np.repeat([70.0, 0.0], 150)
    time_s = np.arange(len(drive)) * TICK_S
    _, place = respond(motor, time_s, drive, TICK_S)
    counts = np.floor(place) + 12345.0
    found = identify([MeasuredResponse("c.csv", time_s, drive, counts, True)], TICK_S).motor
    assert found.gain == pytest.approx(8.0, rel=1e-3)
    assert found.time_constant_s == pytest.approx(0.05, rel=5e-3)
    assert found.dead_time_s == pytest.approx(0.004, abs=3e-4)
    assert found.friction_percent == pytest.approx(5.0, abs=0.1)


# The design.


@pytest.mark.parametrize(
    ("axis", "ki", "kp", "kid", "kpd"),
    [
        (1, 5.6304, 0.1732, 0.028152, 0.159124),
        (0, 3.5099, 0.1069, 0.017549, 0.098125),
        (2, 3.2509, 0.10074, 0.0162, 0.09264),
    ],
)
def test_table_4_1(axis: int, ki: float, kp: float, kid: float, kpd: float) -> None:
    """The gains of the thesis (L2872-2880) for 250 ms and ωn = 22.63, within the rounding of the
    machine file's motors."""
    loaded = load_target("matlab-router", settings=("controller.slaves=text",))
    found = loaded.target.speed_loop(loaded.machine)
    assert found is not None
    gains = design(found.motors[axis], found, 0.25, 0.707)
    assert gains.wanted[0] == pytest.approx(22.63, abs=0.005)
    assert gains.ki == pytest.approx(ki, rel=1.2e-3)
    assert gains.kp == pytest.approx(kp, rel=2e-3)
    assert gains.kid == pytest.approx(kid, rel=4e-3)
    assert gains.kpd == pytest.approx(kpd, rel=2e-3)


MOTORS = st.builds(MotorModel, gain=st.floats(1.0, 20.0), time_constant_s=st.floats(0.02, 0.5))


@given(MOTORS, st.floats(0.3, 1.2), st.floats(0.5, 6.0))
def test_the_continuous_loop_has_the_wanted_poles(
    motor: MotorModel, damping: float, share: float
) -> None:
    from scipy import signal  # late: it takes a second or two of each worker

    settling_s = share * motor.time_constant_s
    found = loop(motor, unit=1e-9)
    try:
        gains = design(motor, found, settling_s, damping)
    except OptionError:
        return
    # ω/ω_ref = (Ki/s) G / (1 + (Kp + Ki/s) G), eq. 4.19
    tau, gain = motor.time_constant_s, motor.gain
    system = signal.TransferFunction(
        [gains.ki * gain], [tau, 1 + gains.kp * gain, gains.ki * gain]
    )
    poles = system.poles
    assert abs(poles[0] * poles[1]) == pytest.approx(gains.wanted[0] ** 2, rel=1e-6)
    assert -(poles[0] + poles[1]).real / 2 == pytest.approx(4.0 / settling_s, rel=1e-6)


@given(MOTORS, st.floats(0.0, 0.2), st.floats(0.0, 0.3))
def test_the_poles_are_those_of_scipy(motor: MotorModel, kid: float, kpd: float) -> None:
    from scipy import signal  # late: it takes a second or two of each worker

    b, a, _ = signal.cont2discrete(
        ([motor.gain], [motor.time_constant_s, 1.0]), TICK_S, method="zoh"
    )
    plant = np.poly1d(a), np.poly1d(np.ravel(b))
    rate = np.poly1d([1.0, -1.0])
    characteristic = plant[0] * rate + plant[1] * (kpd * rate + kid * np.poly1d([1.0, 0.0]))
    expected = sorted(np.roots(characteristic), key=lambda z: (z.real, z.imag))
    found = sorted(loop_poles(motor, TICK_S, kid, kpd), key=lambda z: (z.real, z.imag))
    assert np.abs(np.array(found) - expected).max() < 1e-6


@pytest.mark.parametrize(
    ("axis", "slaves"), [(0, "text"), (1, "text"), (1, "listing"), (2, "text")]
)
def test_the_simulated_step_is_that_of_the_slaves(axis: int, slaves: str) -> None:
    """The same step by the model of the machine, which has wraps of the counter as well."""
    from tests.postprocessors.matlab_router.test_controller import router, speeds_at_300

    machine = router(f"slaves={slaves}")
    target = load_target("matlab-router").target
    found = target.speed_loop(machine)
    assert found is not None
    step = simulate_step(found.motors[axis], found, (found.kid[axis], found.kpd[axis]), 300.0)
    speed = speeds_at_300(axis, machine)[: len(step.speed)]
    # The model keeps an old speed where the counter wrapped, in some 30 of 100 ticks at 300
    # counts; that moves the curve by a tick at most.
    assert np.abs(speed - step.speed[: len(speed)]).max() < (4.0 if slaves == "text" else 25.0)
    assert step.overshoot == pytest.approx(float(speed.max()) / 300 - 1, abs=0.01)


def test_gains_that_cannot_be() -> None:
    with pytest.raises(OptionError, match=r"too slow.*give less than 0\.536 s"):
        design(THESIS, loop(THESIS), 0.6, 0.707)
    with pytest.raises(OptionError, match=r"the loop runs every 5 ms.*give more time"):
        design(THESIS, loop(THESIS), 0.004, 0.707)
    with pytest.raises(OptionError, match="unstable with the stored gains"):
        design(THESIS, loop(THESIS), 0.0165, 1.2)
    coarse = loop(THESIS, unit=0.1, is_whole=True)
    with pytest.raises(OptionError, match=r"stored as 0 and 1.*give less time"):
        design(THESIS, coarse, 0.25, 0.707)


# The file.


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,rpm\n0,1\n", r"has the columns time_s, rpm"),
        ("0,0\n0.005,1\n", r"has 2 samples; a step needs at least 8"),
        ("0,0\n0.005,x\n" + "0.01,1\n" * 8, r"line 2, column 2.*'x' is no number"),
        ("0,0\n0.005,nan\n" + "0.01,1\n" * 8, r"'nan' is no number"),
        ("0,0\n0.005\n" + "0.01,1\n" * 8, r"line 2, column 2.*a number is missing"),
        ("".join(f"{0.01 * (k % 5)},{k}\n" for k in range(10)), r"line 6.*time does not go on"),
    ],
)
def test_bad_files_name_the_place(text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_response(text, "step.csv", 70.0)
    assert re.search(message, str(caught.value), re.DOTALL), str(caught.value)


def test_drives_are_needed_once() -> None:
    table = "time_ms;speed;drive\n" + "".join(f"{5 * k};{k};70\n" for k in range(10))
    assert read_response(table, "f", None).time_s[1] == 0.005
    with pytest.raises(OptionError, match="column of the drive"):
        read_response(table, "f", 70.0)
    with pytest.raises(InputError, match="--drive says a drive"):
        read_response("t,speed\n" + "0,1\n" * 9, "f", None)
    with pytest.raises(InputError, match=r"0 to 700 %"):
        read_response(table.replace("70\n", "700\n").replace("700", "0", 1), "f", None)


def test_a_motor_that_runs_backwards_is_an_error() -> None:
    measured = sample(THESIS, [70.0], 1, 0.0)
    backwards = MeasuredResponse("b.csv", measured.time_s, -measured.drive, measured.value, False)
    with pytest.raises(InputError, match="does not move in the sense of its drive"):
        identify([backwards], TICK_S)
